"""Rotations: unit quaternions (w, x, y, z), 6-D (forward and up axes) and yaw; the only place where orders are converted.

Every function works on any leading axes and is plain numpy, so one frame and a whole clip use the same code.
"""

import numpy as np
from scipy.spatial.transform import Rotation

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotation b followed by a: (..., 4), (..., 4) -> (..., 4)."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack([aw * bw - ax * bx - ay * by - az * bz,
                     aw * bx + ax * bw + ay * bz - az * by,
                     aw * by - ax * bz + ay * bw + az * bx,
                     aw * bz + ax * by - ay * bx + az * bw], axis=-1)


def inverse(q: np.ndarray) -> np.ndarray:
    """The inverse of unit quaternions (..., 4)."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of (..., 3) vectors; many times quicker than np.cross on small arrays."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def rotate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) turned by unit quaternions (..., 4)."""
    t = 2.0 * cross(q[..., 1:], v)
    return v + q[..., :1] * t + cross(q[..., 1:], t)


def normalize(v: np.ndarray) -> np.ndarray:
    """Vectors (..., n) at unit length; a zero vector stays zero."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def slerp(a: np.ndarray, b: np.ndarray, t) -> np.ndarray:
    """From a to b along the shorter arc: (..., 4), (..., 4), t broadcastable to (..., 1); t beyond 0..1 extrapolates."""
    dot = np.sum(a * b, axis=-1, keepdims=True)
    b = np.where(dot < 0, -b, b)
    angle = np.arccos(np.minimum(np.abs(dot), 1.0))
    sine = np.sin(angle)
    small = sine < 1e-6
    safe = np.where(small, 1.0, sine)
    wa = np.where(small, 1.0 - t, np.sin((1.0 - t) * angle) / safe)
    wb = np.where(small, t, np.sin(t * angle) / safe)
    return normalize(wa * a + wb * b)


def from_axis_angle(axis: np.ndarray, angle) -> np.ndarray:
    """Rotation about unit axes (..., 3) by angles in radians (...)."""
    half = np.asarray(angle)[..., None] / 2
    return np.concatenate([np.cos(half), np.sin(half) * axis], axis=-1)


def from_rotation_vector(vector: np.ndarray) -> np.ndarray:
    """Rotations (..., 4) from axis times angle in radians (..., 3); the zero vector is the identity exactly."""
    half = np.linalg.norm(vector, axis=-1, keepdims=True) / 2
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * vector], axis=-1)


def to_rotation_vector(q: np.ndarray) -> np.ndarray:
    """Axis times angle (..., 3), the angle at most half a turn, of unit quaternions (..., 4)."""
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    return q[..., 1:] * np.where(sine < 1e-8, 2.0, angle / np.maximum(sine, 1e-8))


def between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The shortest rotation that turns direction a (..., 3) onto direction b (..., 3).

    For opposite directions any half turn would do; one about an axis perpendicular to a is taken."""
    a, b = normalize(a), normalize(b)
    w = 1.0 + np.sum(a * b, axis=-1, keepdims=True)
    perpendicular = cross(a, np.where(np.abs(a[..., :1]) < 0.9, np.array([1.0, 0, 0]), np.array([0, 1.0, 0])))
    return normalize(np.where(w < 1e-8, np.concatenate([np.zeros_like(w), perpendicular], -1),
                              np.concatenate([w, cross(a, b)], -1)))


def from_yaw(yaw) -> np.ndarray:
    """Rotation about the vertical by a yaw in radians (...); yaw 0 faces +Z, a quarter turn faces +X."""
    half = np.asarray(yaw) / 2
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, np.sin(half), zero], axis=-1)


def yaw_of(direction: np.ndarray) -> np.ndarray:
    """Yaw (...) of directions whose last axis is (x, z) or (x, y, z)."""
    return np.arctan2(direction[..., 0], direction[..., -1])


def wrap_angle(angle):
    """The same angle in -pi .. pi."""
    return (np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi


def to_6d(q: np.ndarray) -> np.ndarray:
    """The rotated forward (+Z) and up (+Y) axes, (..., 4) -> (..., 6), as in Jang et al. 2022, Sec. 3."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y),
                     2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=-1)


def from_6d(axes: np.ndarray) -> np.ndarray:
    """The nearest rotation to a forward and an up axis (Gram-Schmidt, forward kept), (..., 6) -> (..., 4)."""
    forward = normalize(axes[..., :3])
    right = normalize(cross(axes[..., 3:], forward))  # +X: the character's left
    return from_matrix(np.stack([right, cross(forward, right), forward], axis=-1))


def from_matrix(m: np.ndarray) -> np.ndarray:
    """Quaternions of rotation matrices, (..., 3, 3) -> (..., 4)."""
    return from_scipy(Rotation.from_matrix(m.reshape(-1, 3, 3))).reshape(*m.shape[:-2], 4)


def from_scipy(rotation: Rotation) -> np.ndarray:
    """scipy's (x, y, z, w) becomes our (w, x, y, z)."""
    return np.roll(rotation.as_quat(), 1, axis=-1)


def to_scipy(q: np.ndarray) -> Rotation:
    """Our (w, x, y, z), any leading axes flattened, as a scipy Rotation."""
    return Rotation.from_quat(np.roll(q, -1, axis=-1).reshape(-1, 4))


def from_euler(order: str, degrees: np.ndarray) -> np.ndarray:
    """Intrinsic Euler angles in degrees (..., 3), applied in BVH channel order such as 'ZXY' -> (..., 4)."""
    turns = Rotation.from_euler(order.upper(), degrees.reshape(-1, len(order)), degrees=True)
    return from_scipy(turns).reshape(*degrees.shape[:-1], 4)


def to_euler(order: str, q: np.ndarray) -> np.ndarray:
    """Intrinsic Euler angles in degrees (..., 3) in BVH channel order."""
    return to_scipy(q).as_euler(order.upper(), degrees=True).reshape(*q.shape[:-1], 3)


def continuous(q: np.ndarray) -> np.ndarray:
    """The same rotations (frames, ..., 4) with signs chosen so that neighbouring frames lie close."""
    flips = np.sum(q[1:] * q[:-1], axis=-1, keepdims=True) < 0
    signs = np.where(np.cumsum(flips, axis=0) % 2 == 1, -1.0, 1.0)
    return np.concatenate([q[:1], q[1:] * signs], axis=0)
