"""A clip played small in a panel of the window: what a style was learned from."""

from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from demo.render.camera import Camera
from demo.render.renderer import Renderer
from demo.render.view import View
from demo.ui.hud import Pixels
from sim.body.pose import Pose
from sim.body.skeleton import PART_NAMES
from sim.command import Command
from sim.motion.clip import FPS, Clip, root_frame
from sim.session import Frame

if TYPE_CHECKING:
    from demo.render.gl import Target

SECONDS = 10.0  # that a clip plays at most, over and over if it is shorter
SIDES = (0.24, 0.30)  # width and height, as shares of the window's height where the panels leave that
EVERY = 2  # the window's pictures to one of the clip: half as smooth, half the price


class Inset:
    """Plays one clip at a time. Needs the window's context, as the renderer does."""

    def __init__(self) -> None:
        self.style = ""  # that was learned from the clip
        self._frames: list[Frame] = []  # of the clip
        self._left = 0  # simulated frames that it still plays
        self._renderer: Renderer | None = None  # made with the first picture
        self._picture: "Target | None" = None
        self._age = 0  # of the picture, in pictures of the window

    @property
    def playing(self) -> bool:
        """Whether a clip is shown."""
        return self._left > 0

    def play(self, clip: Clip, style: str) -> None:
        """Shows a clip from its start, in the colour of a style."""
        self.style = style
        clip = clip[: round(SECONDS * FPS)]
        root = root_frame(clip.positions(), clip.fps)
        command = Command(style=dict.fromkeys(PART_NAMES, (style, 1.0)))
        poses = [
            Pose(*pose, np.zeros(4), 0.0)
            for pose in zip(root.positions, root.facing, clip.hips, clip.global_rotations())
        ]
        self._frames = [Frame(command, pose, pose) for pose in poses]
        self._left = round(SECONDS * FPS)
        self._view = View(Camera(yaw=float(root.facing[0]) + np.pi + 0.6, distance=3.1), arrow=False, contacts=False)
        self._view.jump_to(self._frames[0])

    def step(self) -> None:
        """Lets a simulated frame pass."""
        if self.playing:
            self._left -= 1
            frame = self._frame()
            if frame is self._frames[0]:
                self._view.jump_to(frame)
            self._view.follow(frame, 1 / FPS)

    def draw(self, window_size: tuple[int, int], box: Pixels) -> None:
        """Draws it into a box of the picture in the bound framebuffer of (width, height) pixels."""
        if not self.playing:
            return
        from demo.render import gl  # only now: a window must be open

        window, (left, top, width, height) = gl.bound_framebuffer(), box
        renderer, picture = self._fit(gl, (max(1, width), max(1, height)))
        if self._age % EVERY == 0:
            picture.bind()
            renderer.draw(self._frame(), self._view)
        self._age += 1
        gl.inlay(picture, window, left, window_size[1] - top - picture.height)

    def _frame(self) -> Frame:
        return self._frames[(round(SECONDS * FPS) - self._left) % len(self._frames)]

    def _fit(self, gl: ModuleType, size: tuple[int, int]) -> "tuple[Renderer, Target]":
        """Follows the window's size."""
        if self._picture is None or self._renderer is None:
            self._renderer, self._picture = Renderer(size), gl.Target(*size, depth=False)
        elif (self._picture.width, self._picture.height) != size:
            self._picture.delete()
            self._renderer.resize(size)
            self._picture, self._age = gl.Target(*size, depth=False), 0
        return self._renderer, self._picture
