"""The figure's skin: its capsules melted into one smooth surface, cut into triangles and tied to the joints.

The surface is where a smooth union of distances (log-sum-exp) is zero; corners and quads come from naive surface nets
(Gibson 1998), each corner is then moved onto the surface and each quad folded as the surface goes. A corner follows the
joints whose capsules are near it."""

from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product

import numpy as np
from scipy import sparse

from demo.figure import body
from sim.body.skeleton import JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from sim.math import rotations as rot

MELT = 0.017  # metres: how softly capsules run into each other
REACH = 0.09  # metres round a capsule beyond which it does not count
TIE = 0.020  # metres: how softly the skin passes from one joint to the next
TIES = 4  # joints a corner may follow
SLACK = 0.01  # a tie weaker than this is dropped
LIMBS = [place for place, name in enumerate(PART_NAMES) if name != "spine"]


@dataclass(frozen=True)
class Skin:
    """A mesh in the bind pose: positions and normals (n, 3), how much light reaches a corner (n,) 0..1, the joints it
    follows and their weights (n, 4), triangles (m, 3)."""

    positions: np.ndarray
    normals: np.ndarray
    openness: np.ndarray
    joints: np.ndarray
    weights: np.ndarray
    triangles: np.ndarray

    @cached_property
    def follow(self) -> sparse.csr_matrix:
        """(2 n, 84): its product with demo.figure.body.bones (84, 3) is the skin in that pose, positions and then
        normals.

        A corner is the weighted sum of its joints' transforms of it, so all of them are one sparse product: a quarter
        of a millisecond, where a software driver's vertex shader takes several for each time the skin is drawn."""
        weights = np.where(self.weights < SLACK, 0, self.weights)
        weights /= weights.sum(-1, keepdims=True)
        homogeneous = [
            np.column_stack([vectors, np.full(len(vectors), last)])
            for vectors, last in ((self.positions, 1.0), (self.normals, 0.0))
        ]
        columns = (self.joints[:, :, None] * 4 + np.arange(4)).ravel()
        rows = np.repeat(np.arange(len(weights)), TIES * 4)
        halves = [
            sparse.csr_matrix(
                ((weights[:, :, None] * vectors[:, None]).ravel().astype(np.float32), (rows, columns)),
                (len(weights), JOINT_COUNT * 4),
            )
            for vectors in homogeneous
        ]
        result = sparse.vstack(halves, format="csr")
        result.eliminate_zeros()
        return result

    @property
    def materials(self) -> np.ndarray:
        """(n, 6) float32: shares of the four limbs, of gloves and shoes, and the openness."""
        part = np.eye(len(PART_NAMES))[PART_OF_JOINT][:, LIMBS]
        columns = np.column_stack([part, body.IS_GLOVE])[self.joints]  # (n, TIES, 5)
        shares = np.sum(self.weights[..., None] * columns, axis=1)
        return np.column_stack([shares, self.openness]).astype(np.float32)


@cache
def make_skin(cell: float) -> Skin:
    """The skin in triangles of about `cell` metres."""
    low, high = body.BIND.positions.min(0) - 0.3, body.BIND.positions.max(0) + 0.3
    axes = [np.arange(a, b, cell) for a, b in zip(low, high, strict=True)]
    corners, quads = surface_nets(_grid_distance(axes))
    positions = low + corners * cell
    for _ in range(3):
        distance, normals = _distance_and_normal(positions)
        positions = positions - normals * distance[:, None]
    _, normals = _distance_and_normal(positions)
    open_at = [np.clip(_distance(positions + normals * step)[0] / step, 0, 1) for step in (0.03, 0.07)]
    joints, weights = _ties(positions)
    return Skin(positions, normals, np.mean(open_at, axis=0), joints, weights, _triangles(positions, quads))


# The forms in the bind pose: where each starts, and its axes.
_TURN = body.BIND.rotations[body.FORM_JOINT]
_ORIGIN = body.BIND.positions[body.FORM_JOINT] + rot.rotate(_TURN, body.FORM_START)
_AXES = rot.rotate(_TURN[:, None], body.form_frames())


def _form_distance(form: int, points: np.ndarray) -> np.ndarray:
    """Signed distance (...) from points (..., 3) to one capsule; exact where it is neither tapered nor stretched."""
    local = (points - _ORIGIN[form]) @ (_AXES[form] / body.FORM_STRETCH[form][:, None]).T
    length = body.FORM_LENGTH[form]
    along = np.clip(local[..., 1], 0, length)
    gap = np.sqrt(local[..., 0] ** 2 + (local[..., 1] - along) ** 2 + local[..., 2] ** 2)
    return (gap - np.interp(along / length, body.PROFILE, body.FORM_RADII[form])) * body.FORM_STRETCH[form].min()


def _distance(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Melted distance (n,) at points (n, 3), each joint's nearness (n, 21): exp(-distance / MELT) of its capsules."""
    nearness = np.zeros((len(points), JOINT_COUNT))
    for form, joint in enumerate(body.FORM_JOINT):
        near = np.flatnonzero(np.all(np.abs(points - _ORIGIN[form]) < _box(form), axis=-1))
        nearness[near, joint] += np.exp(-_form_distance(form, points[near]) / MELT)
    return -MELT * np.log(np.maximum(nearness.sum(-1), 1e-12)), nearness


def _box(form: int) -> np.ndarray:
    """(3,) half extents about a form's start outside of which it does not count."""
    thickness = body.FORM_STRETCH[form].max() * body.FORM_RADII[form].max()
    return np.abs(_AXES[form][1]) * body.FORM_LENGTH[form] + thickness + REACH


def _distance_and_normal(points: np.ndarray, step: float = 1e-3) -> tuple[np.ndarray, np.ndarray]:
    """Melted distance (n,) and its direction of steepest growth (n, 3)."""
    gradient = [_distance(points + offset)[0] - _distance(points - offset)[0] for offset in step * np.eye(3)]
    return _distance(points)[0], rot.normalize(np.stack(gradient, axis=-1))


def _grid_distance(axes: list[np.ndarray]) -> np.ndarray:
    """Melted distance on a grid: each capsule is only asked about the block round it."""
    nearness = np.zeros([len(axis) for axis in axes])
    for form in range(len(body.FORMS)):
        ends = np.stack([_ORIGIN[form] - _box(form), _ORIGIN[form] + _box(form)], axis=-1)
        block = tuple(slice(*np.searchsorted(axis, pair)) for axis, pair in zip(axes, ends, strict=True))
        sides = [axis[part] for axis, part in zip(axes, block, strict=True)]
        points = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)
        nearness[block] += np.exp(-_form_distance(form, points) / MELT)
    return -MELT * np.log(np.maximum(nearness, 1e-12))


def _ties(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The joints (n, 4) that corners follow and how much (n, 4), adding up to 1."""
    nearness = _distance(points)[1] ** (MELT / TIE)
    joints = np.argsort(-nearness, axis=-1)[:, :TIES]
    weights = np.take_along_axis(nearness, joints, axis=-1)
    return joints, weights / weights.sum(-1, keepdims=True)


def surface_nets(distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The zero surface of a grid (x, y, z): corners (n, 3) in cells, and quads (m, 4) that front the positive side.

    Every cell that the surface crosses gets one corner, the mean of the crossings on its edges; every grid edge that it
    crosses joins the corners of the four cells around that edge."""
    cells = np.array(distance.shape) - 1
    total, count = np.zeros((*cells, 3)), np.zeros(cells)
    for axis in range(3):
        others = [a for a in range(3) if a != axis]
        start, end = np.delete(distance, -1, axis), np.delete(distance, 0, axis)  # of each edge along the axis
        crossed = (start < 0) != (end < 0)
        where = np.where(crossed, start / np.where(crossed, start - end, 1), 0)
        for corner in product((0, 1), repeat=2):  # the four edges of a cell along this axis
            part = [slice(None)] * 3
            offset = np.zeros(3)
            for other, side in zip(others, corner, strict=True):
                part[other] = slice(side, side + cells[other])
                offset[other] = side
            hit = crossed[tuple(part)]
            total[hit] += offset
            total[..., axis] += np.where(hit, where[tuple(part)], 0)
            count += hit
    used = count > 0
    index = np.full(cells, -1)
    index[used] = np.arange(used.sum())
    corners = np.argwhere(used) + total[used] / count[used][:, None]
    return corners, np.concatenate([_quads(distance, index, axis) for axis in range(3)])


def _quads(distance: np.ndarray, index: np.ndarray, axis: int) -> np.ndarray:
    """Corners (m, 4), one after the other round each grid edge along one axis that the surface crosses."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    inner = [slice(1, -1)] * 3
    inner[axis] = slice(None, -1)
    start = distance[tuple(inner)]
    inner[axis] = slice(1, None)
    end = distance[tuple(inner)]
    edges = np.argwhere((start < 0) != (end < 0))
    leaves = start[tuple(edges.T)] < 0  # the surface's front looks along the axis
    around = []
    for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
        cell = edges.copy()
        cell[:, first] += a
        cell[:, second] += b
        around.append(index[tuple(cell.T)])
    p, q, r, s = around
    return np.stack([p, np.where(leaves, q, s), r, np.where(leaves, s, q)], axis=-1)


def _triangles(positions: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """(2 m, 3) uint32: quads (m, 4) of corners at positions (n, 3), each folded along the diagonal that lies nearer to
    the surface. Folded all alike, every other quad along the edge of a hand is folded across it: a sawtooth for an
    outline."""
    middles = (positions[quads[:, :2]] + positions[quads[:, 2:]]) / 2  # (m, 2, 3), of either diagonal
    first, second = np.abs(_distance(middles.reshape(-1, 3))[0]).reshape(-1, 2).T
    quads = np.where((second < first)[:, None], np.roll(quads, 1, axis=1), quads)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.uint32)
