"""Uneven ground as triangles: square grids nested about a place, each twice as coarse as the one inside it (geometry
clipmaps, Losasso and Hoppe 2004). Plain numbers: the pass that draws them is in demo.render.render_passes."""

import numpy as np

from sim.ground.ground import BLUR, Ground

TO_LIGHT = np.array([0.36, 0.84, 0.41]) / np.linalg.norm([0.36, 0.84, 0.41])
SKY_LIGHT, SUN_LIGHT = 0.4, 0.75  # on the ground: from all of the sky, and from TO_LIGHT
DARKEST = 0.5  # light on the ground, 1 on level floor
CREASE = 0.1  # of light, between a face and the ground about its corner: past that there is an edge between
LEVEL = np.zeros(3)  # the plane of level floor, as tangent_plane gives it
FINE_REACH = 1.6  # metres from the middle to the border of the finest grid, if it has no more than MOST_CELLS
REACH = 19.0  # metres to the border of the coarsest: haze closes over what lies beyond
FEWEST_CELLS, MOST_CELLS = 32, 128  # of a side of each grid, multiples of 4
TOLERANCE = 0.015  # metres that triangles of the finest grid may be off the ground
STRIDE = 8  # cells that a grid is moved at once, an even number
STRAIGHT = 1e-4  # metres off a straight line under which neighbouring cells are drawn as one
LONGEST = 8  # cells in a row that are: a mark is drawn on all of those that it reaches into
STEEPEST = 1.0  # metres in a metre, of a plane that shadows fall on


def tangent_plane(ground: Ground | None, place: np.ndarray) -> np.ndarray:
    """The plane that touches the blurred ground at a place (2,): (3,) its height at the origin, and the metres that it
    rises in a metre of x and of z."""
    if ground is None:
        return LEVEL
    slope = np.clip(ground.slope_at(place), -STEEPEST, STEEPEST)
    return np.array([ground.smooth_height_at(place) - slope @ place, *slope])


class GroundMesh:
    """The grids about the place that they were last moved to, as `quads` (n, 4, 4) float32, far ones first: x, y, z and
    light (1 on level ground) of four corners, from the one at the least x and z round by the one at the greatest z."""

    def __init__(self, ground: Ground) -> None:
        self._ground = ground
        cell = _finest_cell(ground)
        self._side = int(np.clip(4 * round(FINE_REACH / (2 * cell)), FEWEST_CELLS, MOST_CELLS))
        count = 1 + int(np.ceil(np.log2(max(REACH / (self._side / 2 * cell), 1.0))))
        self._cells = cell * 2.0 ** np.arange(count)
        self._centres = np.full((count, 2), np.nan)
        self._corners = np.zeros((count, self._side + 1, self._side + 1, 4), np.float32)
        self._unstitched = self._corners[..., 1].copy()  # heights of the ground itself, at borders as well
        self._merged = [np.zeros((0, 4, 4), np.float32)] * count  # the quads of each grid

    def move(self, place: np.ndarray) -> bool:
        """Moves the grids to a place (2,); whether anything changed. Corners are ever at the same points of the ground,
        so that nothing swims."""
        steps = STRIDE * self._cells[:, None]
        centres = np.round(place / steps) * steps
        moved = (centres != self._centres).any(axis=-1)
        self._centres = centres
        for grid in np.flatnonzero(moved).tolist():
            self._place_corners(grid)
        for grid in np.flatnonzero(moved | np.roll(moved, 1)).tolist():  # its hole moves with the grid inside it
            self._merged[grid] = self._merged_cells(grid)
        if moved.any():
            self.quads = np.concatenate(self._merged[::-1])
            self._places = np.ascontiguousarray(self.quads[..., :3].swapaxes(0, 1)).reshape(-1, 3)
            self._low, self._high = self.quads[:, 0, :3:2], self.quads[:, 2, :3:2]
        return bool(moved.any())

    def seen(self, world_to_clip: np.ndarray) -> np.ndarray:
        """The numbers (n,) of the quads that are not wholly beyond one border of the picture (Cohen and Sutherland)."""
        x, y, w = (row[:3].astype(np.float32) @ self._places.T + np.float32(row[3]) for row in world_to_clip[[0, 1, 3]])
        beyond = [outside.reshape(4, -1).all(axis=0) for outside in (x < -w, x > w, y < -w, y > w, w < 0)]
        return np.flatnonzero(~np.any(beyond, axis=0))

    def horizon(self, world_to_clip: np.ndarray) -> float:
        """How high in the picture, in clip units, the border of the ground is lowest: only above that is sky."""
        coarsest = self._corners[-1, ..., :3]
        border = np.concatenate([coarsest[0], coarsest[-1], coarsest[:, 0], coarsest[:, -1]])
        x, y, w = (border @ row[:3] + row[3] for row in world_to_clip[[0, 1, 3]])
        seen = (w > 0) & (np.abs(x) < 2 * w)  # and the next ones, for what lies between two corners
        return float((y[seen] / w[seen]).min(initial=1.0))

    def within(self, low: np.ndarray, high: np.ndarray) -> list[np.ndarray]:
        """For each of some rectangles, world x and z (m, 2) of opposite corners, the numbers (n,) of the quads that
        reach into it."""
        near = np.flatnonzero(np.all((self._low < high.max(axis=0)) & (self._high > low.min(axis=0)), axis=-1))
        reaches = np.all((self._low[near, None] < high) & (self._high[near, None] > low), axis=-1)
        return [near[inside] for inside in reaches.T]

    def _place_corners(self, grid: int) -> None:
        """Fills in the corners of a grid about its centre; its border lies on the lines of the coarser one."""
        steps = (np.arange(self._side + 1) - self._side // 2) * self._cells[grid]
        places = np.stack(np.meshgrid(*(steps + middle for middle in self._centres[grid])), axis=-1)
        heights = self._heights(grid, places)
        self._unstitched[grid] = heights
        rise_z, rise_x = np.gradient(heights, self._cells[grid])
        if grid + 1 < len(self._cells):
            along = np.arange(self._side + 1)
            for border in (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1]):
                heights[border] = np.interp(along, along[::2], self._heights(grid + 1, places[border][::2]))
        self._corners[grid] = np.stack([places[..., 0], heights, places[..., 1], _light(rise_x, rise_z)], axis=-1)

    def _heights(self, grid: int, places: np.ndarray) -> np.ndarray:
        """Of the ground (...) at places (..., 2); blurred in grids that are too coarse for its steps."""
        is_fine = grid == 0 or self._cells[grid] < BLUR
        return (self._ground.height_at if is_fine else self._ground.smooth_height_at)(places)

    def _merged_cells(self, grid: int) -> np.ndarray:
        """(n, 4, 4) the quads of a grid outside the finer one inside it, neighbours that lie straight as one: those of
        a row, and then of rows those that are as long."""
        side, heights, inner = self._side, self._corners[grid, ..., 1], self._inner_cells(grid)
        straight = _is_straight(heights)
        starts = ~(straight[:-1, :-1] & straight[1:, :-1]) | inner
        starts[:, 1:] |= inner[:, :-1]
        first = np.flatnonzero(starts)
        length = np.zeros((side, side), int)  # of the run that starts in a cell; 0: none does
        length.flat[first] = np.diff(first, append=side * side)
        length[inner] = 0
        # a run goes on from the row above where both ends do
        row, column = np.nonzero(length)
        end = column + length[row, column]
        straight = _is_straight(heights.T).T
        above = (row > 0) & straight[row, column] & straight[row, end]
        above &= length[row - 1, column] == length[row, column]
        goes_on = np.zeros((side, side), bool)
        goes_on[row[above], column[above]] = True
        column, row = np.nonzero((length * ~goes_on).T)
        stops = np.flatnonzero(~goes_on.T)  # column by column
        first = column * side + row
        height = np.append(stops, side * side)[np.searchsorted(stops, first) + 1] - first
        rows = row[:, None] + height[:, None] * np.array([0, 1, 1, 0])
        columns = column[:, None] + length[row, column][:, None] * np.array([0, 0, 1, 1])
        return _with_creases(self._corners[grid][rows, columns], self._unstitched[grid][rows, columns])

    def _inner_cells(self, grid: int) -> np.ndarray:
        """(side, side) which cells of a grid the finer one covers."""
        inner = np.zeros((self._side, self._side), bool)
        if grid:
            quarter, cell = self._side // 4, self._cells[grid]
            column, row = (quarter + np.round((self._centres[grid - 1] - self._centres[grid]) / cell)).astype(int)
            inner[row : row + 2 * quarter, column : column + 2 * quarter] = True
        return inner


def _is_straight(heights: np.ndarray) -> np.ndarray:
    """(n, n) of heights (n, n): whether a row goes straight on at a place, which it never does for more than LONGEST
    cells."""
    result = np.zeros(heights.shape, bool)
    result[:, 1:-1] = np.abs(heights[:, 2:] + heights[:, :-2] - 2 * heights[:, 1:-1]) < STRAIGHT
    result[:, ::LONGEST] = False
    return result


def _with_creases(quads: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Quads (n, 4, 4), a corner lit as the face between heights (n, 4) where the ground about it is lit otherwise by
    CREASE."""
    y, (width, depth) = heights.T, (quads[:, 2, ::2] - quads[:, 0, ::2]).T
    face = _light((y[2] + y[3] - y[0] - y[1]) / (2 * width), (y[1] + y[2] - y[0] - y[3]) / (2 * depth))[:, None]
    quads[..., 3] = np.where(np.abs(quads[..., 3] - face) > CREASE, face, quads[..., 3])
    return quads


def _finest_cell(ground: Ground) -> float:
    """The coarsest of the ground's own cell and its multiples by two that shows it within TOLERANCE."""
    heights, cell = ground.heights, ground.cell
    while cell < BLUR and min(heights.shape) > 4:
        middle = (heights[:-2:2, :-2:2] + heights[2::2, :-2:2] + heights[:-2:2, 2::2] + heights[2::2, 2::2]) / 4
        if np.abs(middle - heights[1:-1:2, 1:-1:2]).max() > TOLERANCE:
            break
        heights, cell = heights[::2, ::2], 2 * cell
    return cell


def _light(rise_x: np.ndarray, rise_z: np.ndarray) -> np.ndarray:
    """The light (...) on ground that rises so much (...) in a metre of x and of z, 1 where it is level."""
    upright = 1 / np.sqrt(1 + rise_x**2 + rise_z**2)
    sun = upright * np.maximum(TO_LIGHT[1] - rise_x * TO_LIGHT[0] - rise_z * TO_LIGHT[2], 0)
    light = (SKY_LIGHT * (0.5 + 0.5 * upright) + SUN_LIGHT * sun) / (SKY_LIGHT + SUN_LIGHT * TO_LIGHT[1])
    return np.maximum(light, DARKEST)
