"""A height map: how high the ground is anywhere, and how high a body on it is carried."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sim.body.skeleton import BONE_OFFSETS, TOES

BLUR = 0.2  # metres (Gaussian sigma): a body goes over an edge or a step as over a ramp of about twice this length
FOOT_LENGTH = float(np.linalg.norm(BONE_OFFSETS[TOES[0], [0, 2]]))  # metres over the floor
STEEPEST_SOLE = np.tan(np.radians(30))  # where ankle and toe stand less level than this, there is an edge between
SLOPE_STEP = 0.1  # metres to either side over which a slope is measured


@dataclass(frozen=True)
class Ground:
    """Heights (rows along z, columns along x) in metres, a `cell` in metres apart, about the world's origin.

    tiled: the map repeats for ever; otherwise its edges go on as they are. Raises ValueError for what is no such
    table."""

    heights: np.ndarray
    cell: float
    tiled: bool = True
    name: str = ""

    def __post_init__(self) -> None:
        heights = np.ascontiguousarray(self.heights, np.float32)
        if heights.ndim != 2 or min(heights.shape) < 2 or not np.isfinite(heights).all() or not self.cell > 0:
            raise ValueError("a ground is a table of two finite heights each way at least, a positive cell apart")
        object.__setattr__(self, "heights", heights)

    def __deepcopy__(self, memo: dict[int, object]) -> "Ground":
        return self  # nothing in it ever changes

    def height_at(self, places: np.ndarray) -> np.ndarray:
        """The ground (...) in metres at places (..., 2), world x and z."""
        return self._sample(self.heights, places)

    def smooth_height_at(self, places: np.ndarray) -> np.ndarray:
        """The same of the ground blurred by BLUR, which a body that walks over it follows."""
        return self._sample(self.blurred, places)

    def slope_at(self, places: np.ndarray) -> np.ndarray:
        """How many metres the blurred ground rises in a metre of x and of z: (..., 2) at places (..., 2)."""
        step = SLOPE_STEP * np.eye(2)
        around = np.stack([places[..., None, :] + step, places[..., None, :] - step])
        up, down = self.smooth_height_at(around)
        return (up - down) / (2 * SLOPE_STEP)

    def raised(self, height: float) -> "Ground":
        """The same ground, higher by so many metres."""
        return replace(self, heights=self.heights + np.float32(height))

    @cached_property
    def blurred(self) -> np.ndarray:
        """The heights blurred by BLUR."""
        from scipy.ndimage import gaussian_filter  # a flat ground, the usual one, has no use for it

        mode = "wrap" if self.tiled else "nearest"
        return gaussian_filter(self.heights, BLUR / self.cell, mode=mode).astype(np.float32)

    def _sample(self, heights: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Bilinear, (...) of heights at places (..., 2)."""
        rows, columns = heights.shape
        size = np.array([columns, rows])
        cells = np.asarray(places) / self.cell + size // 2
        floor = np.floor(cells)
        low = floor.astype(np.intp)
        corners = np.array([low, low + 1])
        corners = corners % size if self.tiled else np.minimum(np.maximum(corners, 0), size - 1)
        x, z = corners[..., 0], corners[..., 1] * columns
        share = cells - floor
        near, far = heights.ravel()[z[:, None] + x]  # along z, each (2, ...) along x
        at_low, at_high = near + (far - near) * share[..., 1]
        return at_low + (at_high - at_low) * share[..., 0]


def sole_heights(ground: np.ndarray) -> np.ndarray:
    """How high (..., 2) the sole lies under ankle and toe on ground so high (..., 2) there, in metres: along a slope,
    or flat on the higher of the two where an edge is between them."""
    steep = np.abs(ground[..., :1] - ground[..., 1:]) > STEEPEST_SOLE * FOOT_LENGTH
    return np.where(steep, ground.max(axis=-1, keepdims=True), ground)


def rest_on_origin(ground: Ground) -> Ground:
    """The ground moved up or down so that a body starts at height 0."""
    return ground.raised(-float(ground.smooth_height_at(np.zeros(2))))
