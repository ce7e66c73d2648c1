"""Euler angles that run on: of the two sets that tell a rotation, in every frame the one nearer to the frame before."""

import warnings

import numpy as np

from sim.math import rotations as rot

LOCKED = 1e-6  # of the sine or cosine of the middle angle under which the outer two turn about one axis


def complete(order: str) -> str:
    """Three axes that begin with those of `order`: a joint with fewer channels turns by 0 about the others."""
    for axis in "ZXY":
        if len(order) < 3 and axis not in order:
            order += axis
    return order


def continuous(order: str, rotations: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """Intrinsic Euler angles in degrees (F, 3) of rotations (F, 4), in channel order such as `ZXY`.

    start: angles (3,) that those of the first frame are to be near to. In gimbal lock the first angle stays."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # scipy warns of gimbal lock; what it gives is right
        one = rot.to_euler(order, rotations)
    other = one * (1, -1, 1) + (180.0, 0.0 if order[0] == order[2] else 180.0, 180.0)
    both = np.stack([one, other], axis=1)  # (F, 2, 3)
    middle = np.radians(one[:, 1])
    locked = np.abs(np.sin(middle) if order[0] == order[2] else np.cos(middle)) < LOCKED
    free = np.flatnonzero(~locked)
    result = one.copy()
    result[free] = both[free, _nearer(both[free], start)]
    if len(free) and len(free) < len(one):
        before = free[np.maximum(np.searchsorted(free, np.flatnonzero(locked)) - 1, 0)]
        result[locked, 0] = result[before, 0]
        result[locked, 2] = _last_angle(order, rotations[locked], result[locked])
    if start is not None:
        result = np.concatenate([start[None], result])
    result = np.unwrap(result, axis=0, period=360.0)
    return result if start is None else result[1:]


def _nearer(both: np.ndarray, start: np.ndarray | None) -> np.ndarray:
    """(F,) 0 or 1: which of two sets of angles (F, 2, 3) is taken in each frame, from the one nearer to `start` on."""
    if not len(both):
        return np.zeros(0, int)
    first = 0 if start is None else int(_apart(start, both[0]).argmin())
    onward = _apart(both[:-1, :, None], both[1:, None]).argmin(axis=-1).tolist()  # (F - 1, 2): from which to which
    chosen = [first]
    for nearest in onward:
        chosen.append(nearest[chosen[-1]])
    return np.array(chosen)


def _apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The sum of the differences of angles (..., 3) in degrees, round the circle."""
    return np.abs((other - one + 180.0) % 360.0 - 180.0).sum(axis=-1)


def _last_angle(order: str, rotations: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """(n,) the third angle in degrees that, after the first two of angles (n, 3), makes the rotations (n, 4)."""
    rest = rotations
    for axis, turn in zip(order[:2], np.radians(angles[:, :2]).T):
        about = np.broadcast_to(np.eye(3)["XYZ".index(axis)], (len(turn), 3))
        rest = rot.multiply(rot.from_axis_angle(about, -turn), rest)
    return np.degrees(2 * np.arctan2(rest[:, 1 + "XYZ".index(order[2])], rest[:, 0]))
