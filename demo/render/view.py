"""What the picture shows besides the frame itself: camera, twin, what is seen inside, panels."""

from dataclasses import dataclass, field

import numpy as np

from demo.figure.character_model import DrawnCharacter
from demo.render.camera import NEAR, Camera
from demo.ui import layout
from demo.ui.canvas import Box
from demo.ui.hud import Panel, Pixels, Placed
from sim.body.pose import Pose
from sim.body.skeleton import INDEX, PARENTS
from sim.ground.ground import Ground
from sim.math.vectors import UP
from sim.session import Frame

BREADTH = {"": 0.8, "beside": 1.1, "ghost": 0.8}  # of what is to be seen whole, as a share of the field of view
FLESH = 0.11  # metres of body about the joints, at most
TWIN_DISTANCE = 1.15  # metres between the character and its neutral twin
FIGURE_HEIGHT = 1.8  # metres, of the figure: whoever is taller is looked at from farther away
TWINS = ("", "beside", "ghost")
# Joints that the body goes on beyond, and how far, as a share of the bone that leads there.
ENDS = np.array([INDEX[name] for name in ("Head", "LeftHand", "RightHand", "LeftToe", "RightToe")])
TIPS = np.array([[1.0], [0.6], [0.6], [0.5], [0.5]])


@dataclass(frozen=True)
class Paths:
    """The root's way on the floor, each (n, 2) world x, z: what was gone, what is asked, what the network expects."""

    past: np.ndarray
    desired: np.ndarray
    predicted: np.ndarray


@dataclass
class View:
    """One picture's settings. Only the camera remembers anything: call `follow` once a picture."""

    camera: Camera = field(default_factory=Camera)
    ground: Ground | None = None  # what it stands on; None: level floor
    character: DrawnCharacter | None = None  # who is drawn in place of the figure
    twin: str = ""  # one of TWINS: the neutral motion beside the character, or about it as a ghost
    arrow: bool = True
    contacts: bool = True
    skeleton: bool = False
    paths: Paths | None = None
    crowd: tuple[Pose, np.ndarray] | None = (
        None  # others, poses with a leading axis, and their parts' colours (n, 5, 3)
    )
    past: tuple[Pose, ...] = ()  # earlier poses drawn as ghosts, the oldest first
    glow: dict[str, float] = field(default_factory=dict)  # body part -> 0..1, brightened
    panels: tuple[Panel, ...] = ()
    over: tuple[Placed, ...] = ()  # what lies over the panels at a place of its own

    def twin_shift(self, frame: Frame) -> np.ndarray:
        """(3,) from the character to its twin: always beside it in the picture, as high over the ground; or where the
        character is."""
        shift = -self.camera.right * (TWIN_DISTANCE if self.twin == "beside" else 0.0)
        place = frame.styled.root_position
        return shift + UP * (self._height(place + shift) - self._height(place))

    def dress(self, character: DrawnCharacter | None, frame: Frame | None = None) -> None:
        """Draws a character in place of the figure from now on, or, for None, the figure; frame: the newest."""
        self.character = character
        self.camera.tall = max(1.0, character.character.height / FIGURE_HEIGHT) if character else 1.0
        if character and frame:
            character.follow(frame.styled, self.ground)

    def follow(self, frame: Frame, seconds: float) -> None:
        """Moves the camera with the character (with what lies between it and its twin) for `seconds`, to a frame of 60
        a second."""
        if self.character:
            self.character.follow(frame.styled, self.ground)
        place = self._aim(frame)
        self.camera.follow(place, seconds, self.ground, self._aim(frame, self.twin_shift(frame) / 2) - place)

    def jump_to(self, frame: Frame) -> None:
        """Aims the camera at the character, and its twin, at once."""
        if self.character:
            self.character.follow(frame.styled, self.ground)
        self.camera.jump(self._aim(frame, self.twin_shift(frame) / 2), self.ground)

    def free_area(self, size: tuple[int, int]) -> Pixels:
        """The part of a picture of that size, in pixels, that panels leave free and in which the character, and its
        twin, are largest."""
        boxes = tuple(layout.with_gap(placed) for placed in layout.place(self.panels, size))
        return layout.free_area(boxes, size, BREADTH[self.twin])

    def make_room(self, size: tuple[int, int]) -> None:
        """The camera puts the character, and its twin, there."""
        left, top, width, height = layout.within(self.free_area(size), size, BREADTH[self.twin])
        shares = left / size[0], top / size[1], width / size[0], height / size[1]
        self.camera.make_room(*shares, BREADTH[self.twin])

    def pixels(self, points: np.ndarray, size: tuple[int, int]) -> np.ndarray:
        """Where points (n, 3) are in a picture of that size: (n, 3) left and top in pixels, distance in metres."""
        clip = np.column_stack([points, np.ones(len(points))]) @ self.camera.world_to_clip(size[0] / size[1]).T
        distance = np.maximum(clip[:, 3:], NEAR)
        return np.concatenate([(clip[:, :2] / distance * [1, -1] + 1) / 2 * size, distance], axis=1)

    def figure_box(self, pose: Pose, size: tuple[int, int], shift: np.ndarray | float = 0.0) -> Box:
        """Left, top, width and height in pixels of what holds the figure moved by `shift` metres, in a picture of that
        size."""
        joints = pose.positions + shift
        tips = joints[ENDS] + TIPS * (joints[ENDS] - joints[PARENTS[ENDS]])
        return self._box(np.concatenate([joints, tips]), size)

    def own_box(self, frame: Frame, size: tuple[int, int]) -> Box:
        """The same of who is steered: the character that is drawn in place of the figure, or the figure."""
        return self._box(self.character.points, size) if self.character else self.figure_box(frame.styled, size)

    def _box(self, points: np.ndarray, size: tuple[int, int]) -> Box:
        """What holds points (n, 3) and the flesh about them."""
        places = self.pixels(points, size)
        flesh = FLESH / (self.camera.metres_a_pixel(size) * places[:, 2:])
        low, high = (places[:, :2] - flesh).min(0), (places[:, :2] + flesh).max(0)
        return float(low[0]), float(low[1]), float(high[0] - low[0]), float(high[1] - low[1])

    def _aim(self, frame: Frame, shift: np.ndarray | float = 0.0) -> np.ndarray:
        """(3,) the place on the ground at so much from the character: it stays there while the character jumps."""
        place = frame.styled.root_position + shift
        return place + UP * (self._height(place) - place[1])

    def _height(self, place: np.ndarray) -> float:
        """Of the ground, blurred, at a place (3,)."""
        return 0.0 if self.ground is None else float(self.ground.smooth_height_at(place[[0, 2]]))
