"""Light that a posed body keeps from itself: how much of its surroundings a place on the skin does not see because the
body's own capsules are before it.

Asked at the corners of a coarse skin, the probes, and carried from there to a finer one."""

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from demo.figure.skin import Skin

PROBES = 1500  # at most
NEAREST = 8  # probes that a corner goes by
SPREAD = 0.03  # metres over which a probe counts (Gaussian sigma): less shows the probes, more blurs what they see
FACING = 0.05  # metres that a probe whose normal points elsewhere seems farther off
RANGE = 1.6  # times the radius of what is in the way over which it still counts as much as a sphere should
STRENGTH = 0.85  # share of the light that a full obstacle takes


class Occlusion:
    """Probes on a coarse skin, and how the corners of a finer one go by them."""

    def __init__(self, coarse: Skin, limbs: np.ndarray) -> None:
        """limbs: (capsules, 2, 3) the ends of what may be before the skin, in its bind pose."""
        self.probes = slice(None, None, -(-len(coarse.positions) // PROBES))
        self._skin = coarse
        positions, normals = coarse.positions[self.probes], coarse.normals[self.probes]
        self._radii = _thickness(positions, limbs)
        self._bind = obstruction(positions, normals, limbs, self._radii)  # is in the skin's own openness already

    def carry_to(self, skin: Skin) -> sparse.csr_matrix:
        """(n, probes): its product with what `at` gives is that of the corners of a skin."""
        own = _features(self._skin.positions[self.probes], self._skin.normals[self.probes])
        away, which = cKDTree(own).query(_features(skin.positions, skin.normals), NEAREST)
        weights = np.exp((away[:, :1] ** 2 - away**2) / (2 * SPREAD**2))
        weights /= weights.sum(axis=1, keepdims=True)
        rows = np.repeat(np.arange(len(which)), NEAREST)
        shape = (len(which), len(own))
        return sparse.csr_matrix((weights.ravel().astype(np.float32), (rows, which.ravel())), shape)

    def at(self, corners: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """(probes,) share of the light that is gone, 0 .. 1: corners (2, n, 3) of the posed coarse skin, places and
        normals, and the ends (capsules, 2, 3) of what is before them."""
        positions, normals = corners[0, self.probes], corners[1, self.probes]
        return np.maximum(obstruction(positions, normals, ends, self._radii) - self._bind, 0.0).astype(np.float32)


def _features(positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    return np.concatenate([positions, FACING * normals], axis=1)


def _thickness(positions: np.ndarray, limbs: np.ndarray) -> np.ndarray:
    """(capsules,) the radii of limbs (capsules, 2, 3): half of the places (n, 3) on the skin that are nearest to one
    are farther away from it."""
    apart, _ = _nearest(positions, limbs)
    nearest = apart.argmin(axis=1)
    return np.array(
        [
            np.sqrt(np.median(apart[nearest == limb, limb])) if (nearest == limb).any() else 0.0
            for limb in range(len(limbs))
        ],
        np.float32,
    )


def _nearest(positions: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of places (n, 3) and the nearest points of segments (segments, 2, 3): the squares of their distances
    (n, segments), and the shares (n, segments) of a segment's length at which those points are.

    Products of matrices of numbers, for there are many places and few segments."""
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    squared = np.maximum(np.vecdot(along, along), 1e-6)
    way = positions @ along.T - np.vecdot(start, along)  # of places along each
    share = np.clip(way / squared, 0.0, 1.0)
    apart = np.vecdot(positions, positions)[:, None] - 2 * positions @ start.T + np.vecdot(start, start)
    return np.maximum(apart - 2 * share * way + share**2 * squared, 1e-6), share


def obstruction(positions: np.ndarray, normals: np.ndarray, ends: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """(n,) 0..1 of places (n, 3) with normals (n, 3) before capsules (capsules, 2, 3) with radii (capsules,): each
    takes as much as a sphere about its nearest point would (Inigo Quilez, Sphere ambient occlusion), and what is left
    the next ones."""
    ends = ends.astype(np.float32)
    apart, share = _nearest(positions, ends)
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    before = normals @ start.T - np.vecdot(positions, normals)[:, None] + share * (normals @ along.T)
    cosine = np.maximum(before / np.sqrt(apart), 0.0)
    reach = (RANGE * radii) ** 2
    return 1 - np.prod(1 - STRENGTH * cosine * np.minimum(reach / (apart + 0.3 * reach + 1e-9), 1.0), axis=1)
