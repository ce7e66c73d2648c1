"""The passes a picture is made of, each a small class: shadow, sky and ground, marks, panels; that of bodies is in
demo.render.body_pass.

Imported only once a window is open (see demo/render/gl.py)."""

from contextlib import contextmanager
from typing import Any, Iterator

import numpy as np
from OpenGL import GL

from demo.render import gl, shaders
from demo.render.body_pass import Bodies
from demo.render.ground_decals import boxes
from demo.render.ground_mesh import GroundMesh
from demo.ui.hud import Placed
from sim.ground.ground import Ground

SHADOW_PIXELS = 128
SHADOW_BLUR = 0.02  # metres between the taps of the blur
GROUND_COLOUR = (0.69, 0.72, 0.745)  # display colour, about that which the shader gives level ground


class Shadow:
    """A small blurred picture of the ground around the figures: how much light they take from it."""

    def __init__(self) -> None:
        self._targets = [gl.Target(SHADOW_PIXELS, SHADOW_PIXELS, depth=False, single=True) for _ in range(2)]
        self._blur = gl.program(shaders.FULL_VERTEX, shaders.BLUR_FRAGMENT)
        self._array = GL.glGenVertexArrays(1)

    def draw(self, bodies: Bodies, to_light: np.ndarray, area: tuple[float, float, float]) -> int:
        """The texture with the finished picture of a square of ground, under the bodies as they are posed: area, its
        centre x, z and half its side."""
        sharp, blurred = self._targets
        sharp.bind()
        GL.glClearColor(0, 0, 0, 0)
        GL.glClear(GL.GL_COLOR_BUFFER_BIT)
        bodies.draw_shadow(to_light=to_light, area=area)
        GL.glDisable(GL.GL_BLEND)
        GL.glBindVertexArray(self._array)
        step = SHADOW_BLUR / (2 * area[2])
        for source, target, texel in ((sharp, blurred, (step, 0)), (blurred, sharp, (0, step))):
            target.bind()
            GL.glBindTexture(GL.GL_TEXTURE_2D, source.texture)
            self._blur.use(texel=texel)
            GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
        assert sharp.texture is not None  # a picture without samples has one
        return sharp.texture


class Sky:
    """The sky, down to the horizon or to the lower border."""

    def __init__(self) -> None:
        self._array = GL.glGenVertexArrays(1)
        self._program = gl.program(shaders.SKY_VERTEX, shaders.SKY_FRAGMENT)

    def draw(self, horizon: float, slope: tuple[float, float]) -> None:
        """horizon: its height in clip units; slope: sine of the elevation in the middle, and its growth upwards."""
        if horizon < 1:
            GL.glDisable(GL.GL_BLEND)
            GL.glBindVertexArray(self._array)
            self._program.use(horizon=horizon, slope=slope)
            GL.glDrawArrays(GL.GL_TRIANGLE_STRIP, 0, 4)


class FlatGround:
    """Level floor and the sky over it: they fill the picture, so nothing needs to be cleared but the depth."""

    def __init__(self) -> None:
        self._array, self._sky = GL.glGenVertexArrays(1), Sky()
        self._ground = gl.program(shaders.FLAT_GROUND_VERTEX, shaders.GROUND_FRAGMENT)
        self._shade = gl.program(shaders.FLAT_SHADE_VERTEX, shaders.SHADE_FRAGMENT)
        self._marks = Strips(shaders.FLAT_MARK_VERTEX, shaders.MARK_FRAGMENT, (4, 4, 2))

    def draw(self, horizon: float, slope: tuple[float, float], focus: np.ndarray, world_to_clip: np.ndarray) -> None:
        """Draws both; horizon and slope as Sky.draw has them, focus (3,) the middle of what is seen."""
        self._sky.draw(horizon, slope)
        GL.glDisable(GL.GL_BLEND)
        GL.glBindVertexArray(self._array)
        self._ground.use(focus=focus, world_to_clip=world_to_clip)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)

    def shade(self, shadow: int, area: tuple[float, float, float], world_to_clip: np.ndarray) -> None:
        """Lays the shadow's picture over its part of the ground: to read it for all the ground costs twice as much."""
        GL.glBindVertexArray(self._array)
        _begin_shade(shadow)
        self._shade.use(area=area, world_to_clip=world_to_clip)
        GL.glDrawArrays(GL.GL_TRIANGLE_STRIP, 0, 4)

    def mark(self, rows: np.ndarray, world_to_clip: np.ndarray) -> None:
        """Draws discs, rings and arrows, rows (n, 10) as demo.render.ground_decals makes them."""
        self._marks.draw(rows, world_to_clip=world_to_clip)


class UnevenGround:
    """The same on the triangles of a ground, which hide what lies behind them."""

    def __init__(self) -> None:
        self._sky = Sky()
        self._ground = gl.program(shaders.UNEVEN_GROUND_VERTEX, shaders.GROUND_FRAGMENT)
        self._shade = gl.program(shaders.UNEVEN_SHADE_VERTEX, shaders.SHADE_FRAGMENT)
        self._mark = gl.program(shaders.UNEVEN_MARK_VERTEX, shaders.MARK_FRAGMENT)
        self._array = GL.glGenVertexArrays(1)
        GL.glBindVertexArray(self._array)
        self._corners, self._triangles = gl.Buffer(), gl.Buffer(GL.GL_ELEMENT_ARRAY_BUFFER)
        gl.attribute(0, 4)
        self._of: Ground | None = None

    def stand_on(self, ground: Ground) -> None:
        """Draws this ground from now on."""
        if ground is not self._of:
            self._of, self._mesh = ground, GroundMesh(ground)

    def draw(self, horizon: float, slope: tuple[float, float], focus: np.ndarray, world_to_clip: np.ndarray) -> None:
        """As FlatGround.draw; the sky fills whatever the ground leaves, for it ends in hills and not at a horizon."""
        if self._mesh.move(focus[[0, 2]]):
            self._corners.write(self._mesh.quads)
        gl.clear(GROUND_COLOUR)  # seen in a pixel here and there, where a fine grid's edge lies on a coarse one's
        GL.glDisable(GL.GL_BLEND)
        with _uneven():
            self._ground.use(focus=focus, world_to_clip=world_to_clip)
            self._draw_quads(self._mesh.seen(world_to_clip))
            self._sky.draw(self._mesh.horizon(world_to_clip), slope)

    def shade(self, shadow: int, area: tuple[float, float, float], world_to_clip: np.ndarray) -> None:
        """As FlatGround.shade."""
        _begin_shade(shadow)
        middle, half = np.array([area[:2]]), area[2]
        with _uneven():
            self._shade.use(area=area, world_to_clip=world_to_clip)
            self._draw_quads(*self._mesh.within(middle - half, middle + half))

    def mark(self, rows: np.ndarray, world_to_clip: np.ndarray) -> None:
        """As FlatGround.mark."""
        if not len(rows):
            return
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendFunc(GL.GL_SRC_ALPHA, GL.GL_ONE_MINUS_SRC_ALPHA)
        with _uneven():
            self._mark.use(world_to_clip=world_to_clip)
            for row, quads in zip(rows, self._mesh.within(*boxes(rows)), strict=True):
                self._mark.use(place=row[:4], colour=row[4:8], kind=row[8:])
                self._draw_quads(quads)

    def _draw_quads(self, quads: np.ndarray) -> None:
        """Two triangles for each of some quads, their numbers (n,), with the program in use."""
        GL.glBindVertexArray(self._array)
        self._triangles.write((4 * quads[:, None] + [0, 1, 2, 0, 2, 3]).astype(np.uint32))
        GL.glDrawElements(GL.GL_TRIANGLES, 6 * len(quads), GL.GL_UNSIGNED_INT, None)


@contextmanager
def _uneven() -> Iterator[None]:
    """What is drawn while the block runs lies on the ground or behind it."""
    GL.glEnable(GL.GL_DEPTH_TEST)
    GL.glDepthFunc(GL.GL_LEQUAL)
    GL.glEnable(GL.GL_CULL_FACE)
    yield
    GL.glDisable(GL.GL_CULL_FACE)
    GL.glDepthFunc(GL.GL_LESS)
    GL.glDisable(GL.GL_DEPTH_TEST)


def _begin_shade(shadow: int) -> None:
    """What is drawn from now on takes light away, as much as the shadow's picture says."""
    GL.glEnable(GL.GL_BLEND)
    GL.glBlendFunc(GL.GL_ZERO, GL.GL_ONE_MINUS_SRC_COLOR)
    GL.glBindTexture(GL.GL_TEXTURE_2D, shadow)


class Strips:
    """Shapes of four corners, one for each row of numbers: marks lying on level floor, or lines in the air."""

    def __init__(self, vertex: str, fragment: str, widths: tuple[int, ...]) -> None:
        self._array = GL.glGenVertexArrays(1)
        GL.glBindVertexArray(self._array)
        self._instances = gl.InstanceBuffer(0, widths)
        self._program = gl.program(vertex, fragment)

    def draw(self, rows: np.ndarray, **uniforms: Any) -> None:
        """rows: (n, sum of the widths) float32, as demo.render.ground_decals makes them."""
        if not len(rows):
            return
        GL.glBindVertexArray(self._array)
        self._instances.write(rows)
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendFunc(GL.GL_SRC_ALPHA, GL.GL_ONE_MINUS_SRC_ALPHA)
        self._program.use(**uniforms)
        GL.glDrawArraysInstanced(GL.GL_TRIANGLE_STRIP, 0, 4, len(rows))


def lines() -> Strips:
    """Lines and dots as wide on the screen wherever they are."""
    return Strips(shaders.LINE_VERTEX, shaders.LINE_FRAGMENT, (4, 4, 4))


class Panels:
    """Text panels over the scene. A panel's texture is kept as long as the panel is shown unchanged."""

    def __init__(self) -> None:
        self._array = GL.glGenVertexArrays(1)
        self._program = gl.program(shaders.PANEL_VERTEX, shaders.PANEL_FRAGMENT)
        self._textures: dict = {}

    def draw(self, placed: list[Placed], width: int, height: int) -> None:
        """Draws panels where demo.ui.hud has put them in a window of width x height pixels."""
        GL.glBindVertexArray(self._array)
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendFunc(GL.GL_ONE, GL.GL_ONE_MINUS_SRC_ALPHA)
        kept = {}
        for panel in placed:
            left, top, w, h = panel.box
            kept[panel.key] = handle = self._textures.pop(panel.key, None) or gl.texture(w, h, panel.pixels())
            GL.glBindTexture(GL.GL_TEXTURE_2D, handle)
            self._program.use(box=(2 * left / width - 1, 1 - 2 * (top + h) / height, 2 * w / width, 2 * h / height))
            GL.glDrawArrays(GL.GL_TRIANGLE_STRIP, 0, 4)
        if self._textures:
            GL.glDeleteTextures(len(self._textures), list(self._textures.values()))
        self._textures = kept
