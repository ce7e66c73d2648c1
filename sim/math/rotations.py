"""Rotations: unit quaternions (w, x, y, z), 6-D (forward and up axes) and yaw; the only place where orders are
converted.

Every function works on any leading axes and is plain numpy, so one frame and a whole clip use the same code. A frame's
arrays are tiny and each numpy call costs a microsecond, so products of quaternions are one outer product and one table.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:  # imported where it is used: it takes a third of a second, and the live loop has no use for it
    from scipy.spatial.transform import Rotation

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
TINY = 1e-30  # divided by in place of a length of 0

# Hamilton's table: the product of the i-th and j-th of the units 1, i, j, k is plus or minus the |n|-th, counted from
# 1.
_HAMILTON = np.array([[1, 2, 3, 4], [2, -1, 4, -3], [3, -4, -1, 2], [4, 3, -2, -1]])
_PRODUCT = np.sign(_HAMILTON)[..., None] * np.eye(4)[np.abs(_HAMILTON) - 1]  # (4, 4, 4): a_i b_j counts in (a b)_k
# q v q* is bilinear in q: column c of the rotation matrix is what becomes of the c-th axis.
_MATRIX = np.einsum("ick,kjr,j->ijrc", _PRODUCT[:, 1:], _PRODUCT[:, :, 1:], CONJUGATE)  # (4, 4, 3, 3)
_AXES = np.concatenate([_MATRIX[..., 2], _MATRIX[..., 1]], axis=-1).reshape(16, 6)  # forward and up axis
# And back: 4 q q^T, which is symmetric with trace 4, from the matrix and a 1.
_SQUARE = np.round(4 * np.linalg.pinv(np.column_stack([_MATRIX.reshape(16, 9), np.eye(4).ravel()])))  # (10, 16)
_PRODUCT, _MATRIX = _PRODUCT.reshape(16, 4), _MATRIX.reshape(16, 9)
_YZX = np.array([1, 2, 0])


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotation b followed by a: (..., 4), (..., 4) -> (..., 4)."""
    return _outer(a, b) @ _PRODUCT


def inverse(q: np.ndarray) -> np.ndarray:
    """The inverse of unit quaternions (..., 4)."""
    return q * CONJUGATE


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of (..., 3) vectors; many times quicker than np.cross on small arrays."""
    return (a * b.take(_YZX, -1) - a.take(_YZX, -1) * b).take(_YZX, -1)


def rotate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) turned by unit quaternions (..., 4)."""
    return (to_matrix(q) @ v[..., None])[..., 0]


def length(v: np.ndarray) -> np.ndarray:
    """Lengths (..., 1) of vectors (..., n)."""
    return np.sqrt(np.vecdot(v, v))[..., None]


def normalize(v: np.ndarray) -> np.ndarray:
    """Vectors (..., n) at unit length; a zero vector stays zero."""
    return v / np.maximum(length(v), 1e-12)


def slerp(a: np.ndarray, b: np.ndarray, t: np.ndarray | float) -> np.ndarray:
    """From a to b along the shorter arc: (..., 4), (..., 4), t broadcastable to (..., 1); t beyond 0..1
    extrapolates."""
    dot = np.vecdot(a, b)[..., None]
    b = np.where(dot < 0, -b, b)
    angle = np.arccos(np.minimum(np.abs(dot), 1.0))
    sine = np.sin(angle)
    small = sine < 1e-6
    safe = np.where(small, 1.0, sine)
    wa = np.where(small, 1.0 - t, np.sin((1.0 - t) * angle) / safe)
    wb = np.where(small, t, np.sin(t * angle) / safe)
    return normalize(wa * a + wb * b)


def from_axis_angle(axis: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Rotation about unit axes (..., 3) by angles in radians (...)."""
    half = np.asarray(angle)[..., None] / 2
    return np.concatenate([np.cos(half), np.sin(half) * axis], axis=-1)


def from_rotation_vector(vector: np.ndarray) -> np.ndarray:
    """Rotations (..., 4) from axis times angle in radians (..., 3); the zero vector is the identity exactly."""
    angle = length(vector)
    half = angle / 2
    return np.concatenate([np.cos(half), np.sin(half) / np.maximum(angle, TINY) * vector], axis=-1)


def to_rotation_vector(q: np.ndarray) -> np.ndarray:
    """Axis times angle (..., 3), the angle at most half a turn, of unit quaternions (..., 4)."""
    cosine, vector = q[..., :1], q[..., 1:]
    sine = length(vector)
    angle = 2 * np.arctan2(sine, np.abs(cosine))
    return vector * np.copysign(angle / np.maximum(sine, TINY), cosine)


def nearest_turn(vector: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3), taken the other way round the circle where that is nearer to the ones before them: a
    rotation of about half a circle must not change its direction from one frame to the next."""
    apart = length(vector - before)
    if apart.max() < np.pi:  # the two ways end a whole turn apart: this one is the nearer
        return vector
    other = vector * (1 - 2 * np.pi / np.maximum(length(vector), 1e-9))
    return np.where(length(other - before) < apart, other, vector)


def unwrap(vectors: np.ndarray) -> np.ndarray:
    """Rotation vectors (frames, ..., 3), each taken the way round the circle that is nearest to the frame before it."""
    result = vectors.copy()
    for frame in range(1, len(result)):
        result[frame] = nearest_turn(vectors[frame], result[frame - 1])
    return result


def mean(q: np.ndarray) -> np.ndarray:
    """The rotation (4,) that rotations (n, 4) are nearest to, whatever their signs (Markley et al. 2007)."""
    return np.linalg.eigh(q.T @ q)[1][:, -1]


def between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The shortest rotation that turns direction a (..., 3) onto direction b (..., 3).

    For opposite directions any half turn would do; one about an axis perpendicular to a is taken."""
    a, b = normalize(a), normalize(b)
    axis = cross(a, b)
    result = np.empty((*axis.shape[:-1], 4))
    result[..., 0] = 1.0 + np.vecdot(a, b)
    result[..., 1:] = axis
    opposite = result[..., :1] < 1e-8
    if opposite.any():
        square = cross(a, np.where(np.abs(a[..., :1]) < 0.9, np.array([1.0, 0, 0]), np.array([0, 1.0, 0])))
        result = np.where(opposite, np.concatenate([np.zeros_like(square[..., :1]), square], axis=-1), result)
    return normalize(result)


def from_yaw(yaw: np.ndarray | float) -> np.ndarray:
    """Rotation about the vertical by a yaw in radians (...); yaw 0 faces +Z, a quarter turn faces +X."""
    half = np.asarray(yaw) / 2
    result = np.zeros((*half.shape, 4))
    result[..., 0], result[..., 2] = np.cos(half), np.sin(half)
    return result


def yaw_of(direction: np.ndarray) -> np.ndarray:
    """Yaw (...) of directions whose last axis is (x, z) or (x, y, z)."""
    return np.arctan2(direction[..., 0], direction[..., -1])


def wrap_angle(angle: np.ndarray | float) -> np.ndarray | float:
    """The same angle in -pi .. pi."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def to_6d(q: np.ndarray) -> np.ndarray:
    """The rotated forward (+Z) and up (+Y) axes, (..., 4) -> (..., 6), as in Jang et al. 2022, Sec. 3."""
    return _outer(q, q) @ _AXES


def from_6d(axes: np.ndarray) -> np.ndarray:
    """The nearest rotation to a forward and an up axis, (..., 6) -> (..., 4)."""
    return from_matrix(matrix_of_6d(axes))


def matrix_of_6d(axes: np.ndarray) -> np.ndarray:
    """The same as a matrix (..., 3, 3): Gram-Schmidt, forward kept."""
    forward, up = axes[..., :3], axes[..., 3:]
    forward, right = normalize(np.array([forward, cross(up, forward)]))  # right is +X: the character's left
    matrix = np.empty((*axes.shape[:-1], 3, 3))
    matrix[..., 0], matrix[..., 1], matrix[..., 2] = right, cross(forward, right), forward
    return matrix


def to_matrix(q: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    return (_outer(q, q) @ _MATRIX).reshape(*q.shape[:-1], 3, 3)


def from_matrix(m: np.ndarray) -> np.ndarray:
    """Quaternions of rotation matrices, (..., 3, 3) -> (..., 4)."""
    square = (m.reshape(-1, 9) @ _SQUARE[:9] + _SQUARE[9]).reshape(-1, 4, 4)  # every row is a multiple of q
    largest = square.diagonal(axis1=1, axis2=2).argmax(axis=1)
    return normalize(square[np.arange(len(square)), largest]).reshape(*m.shape[:-2], 4)


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Every component of a (..., 4) times every one of b (..., 4): (..., 16)."""
    products = a[..., :, None] * b[..., None, :]
    return products.reshape(*products.shape[:-2], 16)


def from_scipy(rotation: Rotation) -> np.ndarray:
    """scipy's (x, y, z, w) becomes our (w, x, y, z)."""
    return np.roll(rotation.as_quat(), 1, axis=-1)


def to_scipy(q: np.ndarray) -> Rotation:
    """Our (w, x, y, z), any leading axes flattened, as a scipy Rotation."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(np.roll(q, -1, axis=-1).reshape(-1, 4))


def from_euler(order: str, degrees: np.ndarray) -> np.ndarray:
    """Intrinsic Euler angles in degrees (..., 3), applied in BVH channel order such as 'ZXY' -> (..., 4)."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_euler(order.upper(), degrees.reshape(-1, len(order)), degrees=True)
    return from_scipy(turns).reshape(*degrees.shape[:-1], 4)


def to_euler(order: str, q: np.ndarray) -> np.ndarray:
    """Intrinsic Euler angles in degrees (..., 3) in BVH channel order."""
    return to_scipy(q).as_euler(order.upper(), degrees=True).reshape(*q.shape[:-1], 3)


def make_continuous(q: np.ndarray) -> np.ndarray:
    """The same rotations (frames, ..., 4) with signs chosen so that neighbouring frames lie close."""
    flips = np.sum(q[1:] * q[:-1], axis=-1, keepdims=True) < 0
    signs = np.where(np.cumsum(flips, axis=0) % 2 == 1, -1.0, 1.0)
    return np.concatenate([q[:1], q[1:] * signs], axis=0)
