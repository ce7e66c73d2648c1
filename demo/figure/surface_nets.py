"""A surface given by distances on a grid as corners and quads: naive surface nets (Gibson 1998)."""

from itertools import product

import numpy as np


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
