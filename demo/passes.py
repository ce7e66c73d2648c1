"""The passes a picture is made of, each a small class: shadow, sky and ground, marks, bodies, panels.

Imported only once a window is open (see demo/gl.py)."""

import numpy as np
from OpenGL import GL

from demo import gl, shaders
from demo.body import VISOR, Figure
from demo.skin import Skin, make_skin

SKIN_CELL, SHADOW_CELL = 0.020, 0.045  # metres: the shadow is blurred, coarser triangles do
SHADOW_PIXELS = 144
MARK_FLOATS = 10


class Bodies:
    """The figures: one skin, drawn for each figure's bones into the shadow picture and into the scene."""

    def __init__(self) -> None:
        self._lit = gl.program(shaders.BODY_VERTEX, shaders.BODY_FRAGMENT)
        self._flat = gl.program(shaders.SHADOW_VERTEX, shaders.SHADOW_FRAGMENT)
        self._fine, self._coarse = (_upload(make_skin(cell)) for cell in (SKIN_CELL, SHADOW_CELL))

    def draw_shadow(self, figures: list[Figure], **uniforms) -> None:
        """Flattens the figures along the light; the darkest place counts, so overlaps do not add up."""
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendEquation(GL.GL_MAX)
        self._flat.use(**uniforms)
        for figure in figures:
            self._flat.use(bones=figure.bones)
            _draw(self._coarse)
        GL.glBlendEquation(GL.GL_FUNC_ADD)

    def draw(self, figures: list[Figure], **uniforms) -> None:
        """Draws the insides first and then the rims round them, each rim pixel by how much of it the figure covers:
        smooth edges for little more than the price of one sample."""
        GL.glEnable(GL.GL_DEPTH_TEST)
        GL.glEnable(GL.GL_CULL_FACE)
        GL.glBlendFunc(GL.GL_SRC_ALPHA, GL.GL_ONE_MINUS_SRC_ALPHA)
        self._lit.use(visor=VISOR, **uniforms)
        for edges in (False, True):
            (GL.glEnable if edges else GL.glDisable)(GL.GL_BLEND)
            GL.glDepthMask(not edges)
            for figure in figures:
                self._lit.use(edges=float(edges), bones=figure.bones, tints=figure.tints)
                _draw(self._fine)
        GL.glDepthMask(True)
        GL.glDisable(GL.GL_CULL_FACE)
        GL.glDisable(GL.GL_DEPTH_TEST)


def _upload(skin: Skin) -> tuple[int, int]:
    """A vertex array with the skin, and its number of indices."""
    array = GL.glGenVertexArrays(1)
    GL.glBindVertexArray(array)
    attributes = (skin.positions, skin.normals, skin.joints, skin.weights, skin.openness[:, None])
    for location, values in enumerate(attributes):
        gl.buffer(np.ascontiguousarray(values, np.float32))
        gl.attribute(location, values.shape[1])
    gl.buffer(skin.triangles.astype(np.uint32), GL.GL_ELEMENT_ARRAY_BUFFER)
    return array, skin.triangles.size


def _draw(mesh: tuple[int, int]) -> None:
    GL.glBindVertexArray(mesh[0])
    GL.glDrawElements(GL.GL_TRIANGLES, mesh[1], GL.GL_UNSIGNED_INT, None)


class Shadow:
    """A small blurred picture of the ground around the figures: how much light they take from it."""

    def __init__(self) -> None:
        self._targets = [gl.Target(SHADOW_PIXELS, SHADOW_PIXELS, depth=False, single=True) for _ in range(2)]
        self._blur = gl.program(shaders.FULL_VERTEX, shaders.BLUR_FRAGMENT)
        self._array = GL.glGenVertexArrays(1)

    def draw(self, bodies: Bodies, figures: list[Figure], **uniforms) -> int:
        """The texture with the finished picture."""
        sharp, blurred = self._targets
        sharp.bind()
        GL.glClearColor(0, 0, 0, 0)
        GL.glClear(GL.GL_COLOR_BUFFER_BIT)
        bodies.draw_shadow(figures, **uniforms)
        GL.glDisable(GL.GL_BLEND)
        GL.glBindVertexArray(self._array)
        step = 1 / SHADOW_PIXELS
        for source, target, texel in ((sharp, blurred, (step, 0)), (blurred, sharp, (0, step))):
            target.bind()
            GL.glBindTexture(GL.GL_TEXTURE_2D, source.texture)
            self._blur.use(texel=texel)
            GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
        return sharp.texture


class Scenery:
    """Sky and ground: they fill the picture, so nothing needs to be cleared but the depth."""

    def __init__(self) -> None:
        self._array = GL.glGenVertexArrays(1)
        self._sky = gl.program(shaders.SKY_VERTEX, shaders.SKY_FRAGMENT)
        self._ground = gl.program(shaders.GROUND_VERTEX, shaders.GROUND_FRAGMENT)
        self._shade = gl.program(shaders.SHADE_VERTEX, shaders.SHADE_FRAGMENT)

    def draw(self, horizon: float, slope: tuple[float, float], focus: np.ndarray, world_to_clip: np.ndarray) -> None:
        """horizon: its height in clip units; slope: sine of the elevation in the middle, and its growth upwards."""
        GL.glDisable(GL.GL_BLEND)
        GL.glBindVertexArray(self._array)
        if horizon < 1:
            self._sky.use(horizon=horizon, slope=slope)
            GL.glDrawArrays(GL.GL_TRIANGLE_STRIP, 0, 4)
        self._ground.use(focus=focus, world_to_clip=world_to_clip)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)

    def shade(self, shadow: int, area: tuple[float, float, float], world_to_clip: np.ndarray) -> None:
        """Lays the shadow's picture over its part of the ground: to read it for all the ground costs twice as much."""
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendFunc(GL.GL_ZERO, GL.GL_ONE_MINUS_SRC_COLOR)
        GL.glBindTexture(GL.GL_TEXTURE_2D, shadow)
        self._shade.use(area=area, world_to_clip=world_to_clip)
        GL.glDrawArrays(GL.GL_TRIANGLE_STRIP, 0, 4)


class Marks:
    """Discs, rings and arrows lying on the ground."""

    def __init__(self) -> None:
        self._array = GL.glGenVertexArrays(1)
        GL.glBindVertexArray(self._array)
        self._instances = gl.InstanceBuffer(0, (4, 4, 2))
        self._program = gl.program(shaders.MARK_VERTEX, shaders.MARK_FRAGMENT)

    def draw(self, marks: np.ndarray, **uniforms) -> None:
        """marks: (n, 10) float32, rows of demo.marks."""
        assert marks.shape[1] == MARK_FLOATS
        GL.glBindVertexArray(self._array)
        self._instances.write(marks)
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendFunc(GL.GL_SRC_ALPHA, GL.GL_ONE_MINUS_SRC_ALPHA)
        self._program.use(**uniforms)
        GL.glDrawArraysInstanced(GL.GL_TRIANGLE_STRIP, 0, 4, len(marks))


class Panels:
    """Text panels over the scene. A panel's texture is kept as long as the panel is shown unchanged."""

    def __init__(self) -> None:
        self._array = GL.glGenVertexArrays(1)
        self._program = gl.program(shaders.PANEL_VERTEX, shaders.PANEL_FRAGMENT)
        self._textures: dict = {}

    def draw(self, pictures: list[tuple], width: int, height: int) -> None:
        """pictures: those of demo.hud.place, in a window of width x height pixels."""
        GL.glBindVertexArray(self._array)
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendFunc(GL.GL_ONE, GL.GL_ONE_MINUS_SRC_ALPHA)
        kept = {}
        for key, left, top, (w, h), pixels in pictures:
            kept[key] = handle = self._textures.pop(key, None) or gl.texture(w, h, pixels())
            GL.glBindTexture(GL.GL_TEXTURE_2D, handle)
            self._program.use(box=(2 * left / width - 1, 1 - 2 * (top + h) / height, 2 * w / width, 2 * h / height))
            GL.glDrawArrays(GL.GL_TRIANGLE_STRIP, 0, 4)
        if self._textures:
            GL.glDeleteTextures(len(self._textures), list(self._textures.values()))
        self._textures = kept
