"""The renderer: one picture from one frame, drawn into the bound framebuffer; window, tests and video share it."""

import numpy as np

from demo.figure import body, colours
from demo.render import ground_decals
from demo.render.camera import Camera
from demo.render.ground_mesh import TO_LIGHT, tangent_plane
from demo.render.quality import QUALITIES
from demo.render.view import View
from demo.ui import hud, layout
from sim.body.pose import Pose
from sim.body.skeleton import PART_NAMES
from sim.session import Frame

SHADOW_MARGIN = 0.3  # metres of ground round the joints' shadows that the body's blurred one can reach
HARDWARE_SAMPLES = 4
GROUND_SEEN = 60.0  # metres: the sky is drawn down to the ground that far off, where haze has given it the sky's colour
COLOUR_EASE = 0.15  # share of a colour's change that one picture makes

__all__ = ["Renderer", "View"]


class Renderer:
    """Draws frames. Needs a current OpenGL 3.3 context: make one with demo.render.window.open_window first."""

    def __init__(self, size: tuple[int, int], samples: int | None = None, supersample: int = 1) -> None:
        """size: (width, height) pixels. samples a pixel: by default 4 on graphics hardware, else 1. supersample: the
        scene is drawn so many times as wide and as high, 2 at most, and made small: for pictures that are not looked at
        while they are drawn."""
        # Only now: PyOpenGL picks its platform when it is imported, which must follow the window.
        from demo.render import body_pass, gl, render_passes

        self._gl, self._bodies, self._shadow = gl, body_pass.Bodies(), render_passes.Shadow()
        self._flat, self._uneven = render_passes.FlatGround(), render_passes.UnevenGround()
        self._lines, self._panels = render_passes.lines(), render_passes.Panels()
        plain = gl.is_software() or supersample > 1
        self._supersample = supersample
        self._samples = (0 if plain else HARDWARE_SAMPLES) if samples is None else samples
        self._quality = QUALITIES[0]
        self._colours: np.ndarray | None = None
        self._make_scene(size)

    def resize(self, size: tuple[int, int]) -> None:
        """Follows the window: size (width, height) pixels."""
        self._scene.delete()
        self._make_scene(size)

    def simplify(self, level: int) -> None:
        """Draws in the quality of demo.render.quality.QUALITIES that is so many steps below the best one."""
        self._quality = QUALITIES[level]
        self.resize(self.size)

    def _make_scene(self, size: tuple[int, int]) -> None:
        output = self._gl.bound_framebuffer()
        self.size = size[0], size[1]
        scale = self._supersample / self._quality.shrink
        width, height = (max(1, round(side * scale)) for side in size)
        # a picture of several samples cannot be magnified: its outlines are smoothed as where a processor draws
        several = self._quality.smooth and self._quality.shrink == 1
        self._scene = self._gl.Target(width, height, samples=self._samples if several else 0)
        self._gl.bind_framebuffer(output, self.size)

    def draw(self, frame: Frame, view: View) -> None:
        """One picture: shadow, sky and ground, marks, bodies, lines, panels."""
        output = self._gl.bound_framebuffer()
        camera, size = view.camera, (self._scene.width, self._scene.height)
        world_to_clip, half_size = camera.world_to_clip(size[0] / size[1]), (size[0] / 2, size[1] / 2)

        figures = self._figures(frame, view)
        area = _shadow_area(frame, view)
        away = [float(np.linalg.norm(figure.capsules[0, 0] - camera.eye)) for figure in figures]
        self._bodies.pose(figures, [camera.metres_a_pixel(size) * distance for distance in away], TO_LIGHT)
        if self._quality.shadows:
            shadow = self._shadow.draw(self._bodies, to_light=TO_LIGHT, area=area)

        self._scene.bind()
        self._gl.clear_depth()
        if view.ground is not None:
            self._uneven.stand_on(view.ground)
        ground = self._flat if view.ground is None else self._uneven
        ground.draw(*_sky(camera, size), camera.target, world_to_clip)
        if self._quality.shadows:
            ground.shade(shadow, area, world_to_clip)
        ground.mark(_marks(frame, view), world_to_clip)
        seen = {"world_to_clip": world_to_clip, "eye": camera.eye, "half_size": half_size}
        self._bodies.draw(smooth=self._quality.smooth and not self._scene.samples, to_light=TO_LIGHT, **seen)
        self._bodies.draw_ghosts(_ghosts(frame, view), **seen)
        self._lines.draw(_lines(frame, view, size), world_to_clip=world_to_clip, half_size=half_size)

        self._scene.resolve_to(output, self.size)
        self._panels.draw([*layout.place(view.panels, self.size), *view.over], *self.size)
        self._gl.finish()  # whoever times this call means the picture, not the order for it

    def _figures(self, frame: Frame, view: View) -> list[body.Figure]:
        wanted = colours.part_colours(colours.worn(frame))
        if self._colours is None:
            self._colours = wanted
        self._colours = self._colours + COLOUR_EASE * (wanted - self._colours)
        brightened = colours.brighten(self._colours, view.glow)
        plane = _plane(frame.styled, view)
        own = view.character
        figures = [own.figure(plane) if own else body.figure(frame.styled, brightened, plane=plane)]
        if view.twin == "beside":
            shift, tints = view.twin_shift(frame), np.tile(colours.TWIN, (len(wanted), 1))
            figures.append(body.figure(frame.neutral, tints, shift, _plane(frame.neutral, view, shift)))
        if view.crowd:
            poses, tints = view.crowd
            planes = np.array([tangent_plane(view.ground, place) for place in poses.root_position[:, [0, 2]]])
            figures += body.crowd_figures(poses, tints, planes)
        return figures


def _plane(pose: Pose, view: View, shift: np.ndarray | float = 0.0) -> np.ndarray:
    """That of the ground under a character, moved by `shift` metres (demo.render.ground_mesh.tangent_plane)."""
    return tangent_plane(view.ground, (pose.root_position + shift)[[0, 2]])


def _marks(frame: Frame, view: View) -> np.ndarray:
    rows = ground_decals.shades(frame.styled, view.ground)
    if view.twin == "beside":
        rows += ground_decals.shades(frame.neutral, view.ground, view.twin_shift(frame))
    if view.crowd:
        poses, _ = view.crowd
        for one in range(len(poses.hips)):
            rows += ground_decals.shades(poses[one], view.ground)
        rows += ground_decals.steered(frame.styled)
    if view.contacts:
        rows += ground_decals.contacts(frame.styled)
    if view.arrow and view.paths is None:
        rows += ground_decals.arrow(frame)
    return np.array(rows, np.float32)


def _shadow_area(frame: Frame, view: View) -> tuple[float, float, float]:
    """The square of ground that holds the shadows: centre x, z and half its side. A small one is quick to draw."""
    points = view.character.points if view.character else frame.styled.positions
    shadows = _shadow(points, _plane(frame.styled, view))
    if view.twin == "beside":
        shift = view.twin_shift(frame)
        shadows = np.concatenate(
            [shadows, _shadow(frame.neutral.positions + shift, _plane(frame.neutral, view, shift))]
        )
    low, high = shadows.min(0) - SHADOW_MARGIN, shadows.max(0) + SHADOW_MARGIN
    return *((low + high) / 2), float((high - low).max() / 2)


def _shadow(joints: np.ndarray, plane: np.ndarray) -> np.ndarray:
    """(n, 2) world x and z where the shadows of joints (n, 3) fall on a plane, away from the light."""
    places = joints[:, [0, 2]]
    heights = joints[:, 1] - plane[0] - places @ plane[1:]
    return places - TO_LIGHT[[0, 2]] * (heights / (TO_LIGHT[1] - plane[1:] @ TO_LIGHT[[0, 2]]))[:, None]


def _ghosts(frame: Frame, view: View) -> list[tuple[body.Figure, float]]:
    """Figures that can be seen through, with their opacities: the neutral twin, and the past, which fades."""
    ghosts = [(pose, colours.PAST, 0.10 + 0.35 * (age + 1) / len(view.past)) for age, pose in enumerate(view.past)]
    if view.twin == "ghost":
        ghosts.append((frame.neutral, colours.GHOST, 0.85))
    return [(body.figure(pose, np.tile(colour, (len(PART_NAMES), 1))), opacity) for pose, colour, opacity in ghosts]


def _lines(frame: Frame, view: View, size: tuple[int, int]) -> np.ndarray:
    rows = []
    if view.paths is not None:
        rows += ground_decals.paths(view.paths, hud.scale_for(size), view.ground)
    if view.skeleton:
        rows += ground_decals.skeleton(frame.styled, colours.BONES, hud.scale_for(size))
        if view.twin == "beside":
            rows += ground_decals.skeleton(frame.neutral, colours.BONES, hud.scale_for(size), view.twin_shift(frame))
    return np.array(rows, np.float32)


def _sky(camera: Camera, size: tuple[int, int]) -> tuple[float, tuple[float, float]]:
    """Where the ground ends, in clip units, and the sine of the elevation in the middle with its growth upwards."""
    focal, _, aim = camera.lens(size[0] / size[1])
    below = camera.pitch - np.arctan2(camera.eye[1], GROUND_SEEN)
    middle, top = (np.sin(np.arctan((clip - aim) / focal) - camera.pitch) for clip in (0.0, 1.0))
    return float(aim + focal * np.tan(below)), (float(middle), float(top - middle))
