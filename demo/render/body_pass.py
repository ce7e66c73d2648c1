"""The pass of bodies: skins posed on the processor, shaded by themselves, drawn with smooth outlines.

Imported only once a window is open (see demo/render/gl.py)."""

from contextlib import contextmanager
from typing import Any, Iterator, Sequence

import numpy as np
from OpenGL import GL

from demo.figure.body import Figure
from demo.figure.forms import VISOR
from demo.figure.occlusion import Occlusion
from demo.figure.skin import Model, Skin
from demo.render import body_shaders, gl
from sim.math import rotations as rot
from sim.math.vectors import UP

LIGHT_MAP_PIXELS = 256  # of a side of the light's picture of the bodies
SOFTNESS = 0.014  # metres, half the width of a shadow's edge on them
LIGHT_MAP_MARGIN = 0.15  # metres of skin about the middles of its capsules
NEAR_PIXEL = 0.0022  # metres: where a pixel is smaller than that, triangles of the medium skin would show
ROW = (3, 3, 4, 2, 3, 1, 1)  # numbers of each attribute of body_shaders.BODY_VERTEX
ENDS = np.cumsum(ROW)
WHITE = np.full((1, 1, 4), 255, np.uint8)


class Bodies:
    """The figures of a picture: `pose` them, then draw them into the shadow's picture and into the scene."""

    def __init__(self) -> None:
        samplers = ("light_map", "picture")
        self._own = gl.program(body_shaders.BODY_VERTEX, body_shaders.FIGURE_FRAGMENT, samplers)
        self._painted = gl.program(body_shaders.BODY_VERTEX, body_shaders.PAINTED_FRAGMENT, samplers)
        self._ghost = gl.program(body_shaders.BODY_VERTEX, body_shaders.GHOST_FRAGMENT)
        self._flat = gl.program(body_shaders.SHADOW_VERTEX, body_shaders.SHADOW_FRAGMENT)
        self._deep = gl.program(body_shaders.DEPTH_VERTEX, body_shaders.DEPTH_FRAGMENT)
        self._light_map = gl.DepthMap(LIGHT_MAP_PIXELS)
        self._outline = _Outline()
        self._models: dict[Model, _Drawn] = {}
        self._posed: list[tuple[Figure, _Mesh, _Mesh]] = []  # with its mesh, and the coarse one

    def pose(self, figures: Sequence[Figure], pixels: Sequence[float], to_light: np.ndarray) -> None:
        """Places the figures; pixels: how many metres one pixel is, for each."""
        for drawn in self._models.values():
            drawn.begin()
        self._posed = []
        for figure, pixel in zip(figures, pixels, strict=True):
            drawn = self._drawn(figure.model)
            model = figure.model
            skin = model.fine if pixel < NEAR_PIXEL else model.medium
            near = drawn.mesh(skin, figure.bones)
            coarse = near if model.coarse is skin else drawn.mesh(model.coarse, figure.bones)
            if drawn.occlusion:
                near.shade(drawn.occlusion.at(coarse.corners, figure.capsules))
            self._posed.append((figure, near, coarse))
        shaded = [each for each in figures if not each.model.of_many]
        self._world_to_light = _world_to_light(shaded or figures, to_light)
        self._draw_light_map()

    def _drawn(self, model: Model) -> "_Drawn":
        if model not in self._models:
            self._models[model] = _Drawn(model)
        return self._models[model]

    def _draw_light_map(self) -> None:
        """The sides that are turned away from the light: what they hide is far behind the sides that it falls on."""
        self._light_map.bind()
        self._deep.use(world_to_light=self._world_to_light)
        with _solid():
            GL.glDisable(GL.GL_BLEND)
            GL.glCullFace(GL.GL_FRONT)
            for figure, _, coarse in self._posed:
                if not figure.model.of_many:
                    coarse.draw()
            GL.glCullFace(GL.GL_BACK)

    def draw_shadow(self, **uniforms: Any) -> None:
        """Flattens the figures along the light; the darkest place counts, so overlaps do not add up."""
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendEquation(GL.GL_MAX)
        for figure, _, coarse in self._posed:
            if figure.model.of_many:
                continue
            self._flat.use(plane=figure.plane, **uniforms)
            coarse.draw()
        GL.glBlendEquation(GL.GL_FUNC_ADD)

    def draw(self, smooth: bool, **uniforms: Any) -> None:
        """Draws the figures; smooth: with a strip along the outline that is covered the less the farther out, which
        costs a fraction of several samples a pixel. Takes eye, to_light, world_to_clip, half_size."""
        strips = []
        with _solid():
            GL.glDisable(GL.GL_BLEND)
            for figure, mesh, _ in self._posed:
                front = mesh.front(uniforms["world_to_clip"])
                self._use(figure, uniforms)
                mesh.draw(front)
                if not figure.model.of_many:
                    strips.append((figure, mesh, front))
            if smooth:
                GL.glEnable(GL.GL_BLEND)
                GL.glDepthMask(False)
                GL.glDisable(GL.GL_CULL_FACE)
                for figure, mesh, front in strips:
                    self._use(figure, uniforms)
                    self._outline.draw(*mesh.outline(front))

    def _use(self, figure: Figure, uniforms: dict[str, Any]) -> None:
        own = figure.model.picture is None
        program = self._own if own else self._painted
        gl.bind_textures(self._light_map.texture, self._models[figure.model].picture)
        softness = SOFTNESS * np.linalg.norm(self._world_to_light[:2, :3], axis=1)
        program.use(plane=figure.plane, world_to_light=self._world_to_light, softness=softness, **uniforms)
        if own:
            program.use(tints=figure.tints, visor=VISOR)

    def draw_ghosts(self, ghosts: list[tuple[Figure, float]], **uniforms: Any) -> None:
        """Figures that can be seen through, each with its opacity; what is solid hides them."""
        self._ghost.use(**uniforms)
        with _solid():
            GL.glEnable(GL.GL_BLEND)
            GL.glDepthMask(False)
            for figure, opacity in ghosts:
                mesh = self._drawn(figure.model).mesh(figure.model.medium, figure.bones)
                self._ghost.use(tints=figure.tints, opacity=opacity)
                mesh.draw(mesh.front(uniforms["world_to_clip"]))


@contextmanager
def _solid() -> Iterator[None]:
    """Depth counts and backs are not drawn while the block runs."""
    GL.glEnable(GL.GL_DEPTH_TEST)
    GL.glEnable(GL.GL_CULL_FACE)
    GL.glBlendFunc(GL.GL_SRC_ALPHA, GL.GL_ONE_MINUS_SRC_ALPHA)
    yield
    GL.glDepthMask(True)
    GL.glDisable(GL.GL_CULL_FACE)
    GL.glDisable(GL.GL_DEPTH_TEST)


def _world_to_light(figures: Sequence[Figure], to_light: np.ndarray) -> np.ndarray:
    """(4, 4) for column vectors: into the light's picture of the figures, 0 .. 1 across, up and away from the light."""
    right = rot.normalize(np.cross(UP, to_light))
    axes = np.array([right, np.cross(to_light, right), -to_light])
    places = np.concatenate([figure.capsules.reshape(-1, 3) for figure in figures]) @ axes.T
    low, high = places.min(0) - LIGHT_MAP_MARGIN, places.max(0) + LIGHT_MAP_MARGIN
    side = high - low
    result = np.eye(4)
    result[:3, :3] = axes / side[:, None]
    result[:3, 3] = 0.5 - (low + high) / 2 / side
    return result


class _Drawn:
    """A model on the graphics card: a mesh for each time that a skin of it is in a picture, its picture, and how it
    keeps light from itself."""

    def __init__(self, model: Model) -> None:
        self.occlusion = None if model.limbs is None else Occlusion(model.coarse, model.limbs)
        skins = {id(skin): skin for skin in (model.fine, model.medium)} if self.occlusion else {}
        self._carry = {key: self.occlusion.carry_to(skin) for key, skin in skins.items() if self.occlusion}
        picture = WHITE if model.picture is None else model.picture
        self.picture = gl.texture(picture.shape[1], picture.shape[0], picture.tobytes())
        self._meshes: dict[int, list[_Mesh]] = {}
        self._used: dict[int, int] = {}

    def begin(self) -> None:
        """A new picture: its meshes are free again."""
        self._used.clear()

    def mesh(self, skin: Skin, bones: np.ndarray) -> "_Mesh":
        """The next free mesh of a skin, posed."""
        made, used = self._meshes.setdefault(id(skin), []), self._used.get(id(skin), 0)
        if used == len(made):
            made.append(_Mesh(skin, self._carry.get(id(skin))))
        self._used[id(skin)] = used + 1
        made[used].pose(bones)
        return made[used]


class _Mesh:
    """A skin whose corners are written anew each picture."""

    def __init__(self, skin: Skin, carry: Any) -> None:
        self._skin, self._carry = skin, carry
        count = len(skin.positions)
        self.corners = np.empty((2, count, 3), np.float32)
        self._rows = np.zeros((count, sum(ROW)), np.float32)  # of the shader's attributes, those that do not change
        self._rows[:, ENDS[1] : ENDS[4]] = np.column_stack([skin.materials, skin.positions])
        self._gone = np.zeros(count, np.float32)
        self._array = GL.glGenVertexArrays(1)
        GL.glBindVertexArray(self._array)
        self._places = gl.Buffer()
        gl.attribute(0, 3)
        gl.attribute(1, 3, offset=12 * count)
        for location in (2, 3, 4):
            values = self._rows[:, ENDS[location - 1] : ENDS[location]]
            gl.buffer(np.ascontiguousarray(values))
            gl.attribute(location, ROW[location])
        self._shades = gl.Buffer()
        gl.attribute(5, 1)
        self._shades.write(self._gone)
        self._triangles = gl.Buffer(GL.GL_ELEMENT_ARRAY_BUFFER)

    def pose(self, bones: np.ndarray) -> None:
        """Places the corners by demo.figure.body.bones (4 joints, 3)."""
        self.corners = self._skin.posed(bones)
        self._places.write(self.corners)

    def shade(self, gone: np.ndarray) -> None:
        """Takes light away: the share (probes,) that is gone at each probe."""
        self._gone = self._carry @ gone
        self._shades.write(self._gone)

    def front(self, world_to_clip: np.ndarray) -> np.ndarray:
        """(m,) which triangles are turned to the eye."""
        clip = world_to_clip.astype(np.float32)
        at = self.corners[0] @ clip[[0, 1, 3], :3].T + clip[[0, 1, 3], 3]
        x, y = (at[:, :2] / at[:, 2:]).T
        a, b, c = self._skin.triangles.T
        x0, y0 = x[a], y[a]
        return (x[b] - x0) * (y[c] - y0) > (x[c] - x0) * (y[b] - y0)

    def outline(self, front: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of attributes (r, 17) and triangles (t, 3) of the strips along all edges between a triangle that is
        turned to the eye and one that is not."""
        corners, sides = self._skin.edges
        shown = np.append(front, False)[sides]
        edge = corners[shown[:, 0] != shown[:, 1]]
        used, ends = np.unique(edge, return_inverse=True)
        rows = self._rows[used]
        rows[:, : ENDS[0]], rows[:, ENDS[0] : ENDS[1]] = self.corners[0][used], self.corners[1][used]
        rows[:, ENDS[4]] = self._gone[used]
        outer = rows.copy()
        outer[:, ENDS[5]] = 1.0
        p, q = ends.reshape(-1, 2).T
        r, s = p + len(used), q + len(used)
        triangles = np.stack([p, q, r, r, q, s], axis=1).reshape(-1, 3)
        return np.concatenate([rows, outer]), triangles.astype(np.uint32)

    def draw(self, shown: np.ndarray | None = None) -> None:
        """Draws, with the program in use, the triangles that are shown, or all: a software driver is slow with each."""
        triangles = self._skin.triangles if shown is None else self._skin.triangles[shown]
        GL.glBindVertexArray(self._array)
        GL.glVertexAttrib1f(len(ROW) - 1, 0.0)
        self._triangles.write(triangles)
        GL.glDrawElements(GL.GL_TRIANGLES, triangles.size, GL.GL_UNSIGNED_INT, None)


class _Outline:
    """A mesh that is written anew whole, each time it is drawn."""

    def __init__(self) -> None:
        self._array = GL.glGenVertexArrays(1)
        GL.glBindVertexArray(self._array)
        self._rows, self._triangles = gl.Buffer(), gl.Buffer(GL.GL_ELEMENT_ARRAY_BUFFER)
        gl.interleave(0, ROW)

    def draw(self, rows: np.ndarray, triangles: np.ndarray) -> None:
        """Draws triangles (t, 3) of rows (r, 17) with the program in use."""
        GL.glBindVertexArray(self._array)
        self._rows.write(rows)
        self._triangles.write(triangles)
        GL.glDrawElements(GL.GL_TRIANGLES, triangles.size, GL.GL_UNSIGNED_INT, None)
