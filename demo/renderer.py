"""The renderer: one picture from one frame, drawn into the bound framebuffer; window, tests and video share it."""

import numpy as np

from demo import body, colours, hud, marks
from demo.camera import Camera
from demo.view import View
from sim.session import Frame

TO_LIGHT = np.array([0.36, 0.84, 0.41]) / np.linalg.norm([0.36, 0.84, 0.41])
SHADOW_HALF_WIDTH = 1.55  # metres of ground round the character that its shadow can reach
HARDWARE_SAMPLES = 4
GROUND_SEEN = 60.0  # metres: the sky is drawn down to the ground that far off, where haze has given it the sky's colour
COLOUR_EASE = 0.15  # share of a colour's change that one picture makes

__all__ = ["Renderer", "View"]


class Renderer:
    """Draws frames. Needs a current OpenGL 3.3 context: make one with demo.window.open_window first."""

    def __init__(self, size: tuple[int, int], samples: int | None = None) -> None:
        """size: (width, height) pixels. samples a pixel: by default 4 on graphics hardware, else 1."""
        # Only now: PyOpenGL picks its platform when it is imported, which must follow the window.
        from demo import gl, passes

        self._gl, self._bodies, self._shadow = gl, passes.Bodies(), passes.Shadow()
        self._scenery, self._marks, self._panels = passes.Scenery(), passes.ground_marks(), passes.Panels()
        self._lines = passes.lines()
        self._samples = (0 if gl.is_software() else HARDWARE_SAMPLES) if samples is None else samples
        self._colours: np.ndarray | None = None
        self._scene = None
        self.resize(size)

    def resize(self, size: tuple[int, int]) -> None:
        """Follows the window: size (width, height) pixels."""
        if self._scene is not None:
            self._scene.delete()
        output = self._gl.bound_framebuffer()
        self.size = tuple(size)
        self._scene = self._gl.Target(*size, samples=self._samples)
        self._gl.bind_framebuffer(output, self.size)

    def draw(self, frame: Frame, view: View) -> None:
        """One picture: shadow, sky and ground, marks, bodies, panels."""
        output = self._gl.bound_framebuffer()
        camera = view.camera
        world_to_clip = camera.world_to_clip(self.size[0] / self.size[1])

        figures = self._figures(frame, view)
        centre = frame.styled.root_position - TO_LIGHT * (0.9 / TO_LIGHT[1])  # the shadow falls away from the light
        centre = centre + view.twin_shift / 2 if view.twin else centre
        area = (centre[0], centre[2], SHADOW_HALF_WIDTH + (0.6 if view.twin else 0.0))
        shadow = self._shadow.draw(self._bodies, figures, to_light=TO_LIGHT, area=area)

        self._scene.bind()
        self._gl.clear_depth()
        self._scenery.draw(*_sky(camera, self.size), camera.target, world_to_clip)
        self._scenery.shade(shadow, area, world_to_clip)
        self._marks.draw(self._ground_marks(frame, view), world_to_clip=world_to_clip)
        pixel = 2 * np.tan(camera.field_of_view / 2) / min(self.size)
        self._bodies.draw(figures, world_to_clip=world_to_clip, eye=camera.eye, to_light=TO_LIGHT, pixel=pixel)

        self._scene.resolve_to(output)
        self._panels.draw(hud.place(view.panels, self.size), *self.size)
        self._gl.finish()  # whoever times this call means the picture, not the order for it

    def _figures(self, frame: Frame, view: View) -> list[body.Figure]:
        wanted = colours.part_colours(frame.command.style)
        if self._colours is None:
            self._colours = wanted
        self._colours = self._colours + COLOUR_EASE * (wanted - self._colours)
        figures = [body.figure(frame.styled, colours.brightened(self._colours, view.glow))]
        if view.twin:
            figures.append(body.figure(frame.neutral, np.tile(colours.TWIN, (len(wanted), 1)), view.twin_shift))
        return figures

    def _ground_marks(self, frame: Frame, view: View) -> np.ndarray:
        rows = marks.shades(frame.styled)
        if view.twin:
            rows += marks.shades(frame.neutral, view.twin_shift)
        if view.contacts:
            rows += marks.contacts(frame.styled)
        if view.arrow:
            rows += marks.arrow(frame)
        return np.array(rows, np.float32)


def _sky(camera: Camera, size: tuple[int, int]) -> tuple[float, tuple[float, float]]:
    """Where the ground ends, in clip units, and the sine of the elevation in the middle with its growth upwards."""
    half = np.arctan(np.tan(camera.field_of_view / 2) / min(1.0, size[0] / size[1]))
    below = camera.pitch - np.arctan2(camera.eye[1], GROUND_SEEN)
    middle = np.sin(-camera.pitch)
    return float(np.tan(below) / np.tan(half)), (middle, np.sin(half - camera.pitch) - middle)
