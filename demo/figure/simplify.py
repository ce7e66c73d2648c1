"""Triangles made fewer: short edges of a closed mesh are collapsed until every edge is as long as wanted where it lies,
and what is left is evened out. Only the tool that makes the figure's mesh does this: it takes a minute."""

import heapq

import numpy as np

from sim.math import rotations as rot

ROUND_OFF = 1e-12
UPRIGHT = 0.25  # cosine between a triangle's fronts before and after a collapse, at least
MOST_EDGES = 9  # of a corner
LONGEST = 1.35  # times the wanted length that an edge may become


class Mesh:
    """A mesh being simplified: positions and normals (n, 3), wanted edge lengths (n,), triangles as a list of corners.
    Corners `on_plane` lie on the mirror plane x = 0, the mesh's only border, and stay there."""

    def __init__(self, positions: np.ndarray, normals: np.ndarray, lengths: np.ndarray, triangles: np.ndarray) -> None:
        self.positions, self.normals, self.lengths = positions.copy(), normals.copy(), lengths.copy()
        self.triangles: list[list[int] | None] = triangles.tolist()
        self.around: list[set[int]] = [set() for _ in positions]  # the triangles of each corner
        for number, triangle in enumerate(triangles.tolist()):
            for corner in triangle:
                self.around[corner].add(number)
        self.on_plane = np.zeros(len(positions), bool)
        for corner, other in _edges(triangles):
            if len(self.around[corner] & self.around[other]) == 1:
                self.on_plane[[corner, other]] = True

    def neighbours(self, corner: int) -> set[int]:
        """The corners that share an edge with one."""
        found: set[int] = set()
        for number in self.around[corner]:
            found.update(self.triangles[number] or ())
        found.discard(corner)
        return found

    def collapse(self) -> None:
        """Collapses edges, those first that are shortest for where they lie, until none is shorter than wanted."""
        version = np.zeros(len(self.positions), int)
        queue = [(self._share(a, b), int(a), int(b), 0, 0) for a, b in _edges(self.kept())]
        queue = [entry for entry in queue if entry[0] < 1]
        heapq.heapify(queue)
        while queue:
            _, a, b, version_a, version_b = heapq.heappop(queue)
            if version[a] != version_a or version[b] != version_b or not self._join(a, b):
                continue
            version[a] += 1
            version[b] = -1
            for other in self.neighbours(a):
                share = self._share(a, other)
                if share < 1:
                    heapq.heappush(queue, (share, a, other, int(version[a]), int(version[other])))

    def _share(self, a: int, b: int) -> float:
        """How long an edge is beside what is wanted."""
        edge = self.positions[a] - self.positions[b]
        return float(np.sqrt(edge @ edge) * 2 / (self.lengths[a] + self.lengths[b]))

    def _join(self, a: int, b: int) -> bool:
        """Makes two neighbours one corner, a; False, and nothing is changed, where that would spoil the mesh."""
        shared = self.around[a] & self.around[b]
        border = len(shared) == 1
        near = self.neighbours(a) | self.neighbours(b)
        if not shared or len(self.neighbours(a) & self.neighbours(b)) != len(shared):
            return False
        if self.on_plane[a] and self.on_plane[b] and not border:
            return False
        if len(near) - 2 > MOST_EDGES:
            return False
        place, normal = self._between(a, b)
        kept = [number for number in (self.around[a] | self.around[b]) - shared]
        corners = np.array([self.triangles[number] for number in kept])
        before = self.positions[corners]
        after = np.where(((corners == a) | (corners == b))[..., None], place, before)
        fronts = [np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]) for t in (before, after)]
        if (np.vecdot(*map(rot.normalize, fronts)) < UPRIGHT).any():
            return False
        others = [other for other in near if other not in (a, b)]
        reach = np.linalg.norm(self.positions[others] - place, axis=-1)
        if (reach > LONGEST * (self.lengths[others] + min(self.lengths[a], self.lengths[b])) / 2).any():
            return False
        self.positions[a], self.normals[a] = place, normal
        self.lengths[a] = min(self.lengths[a], self.lengths[b])
        self.on_plane[a] |= self.on_plane[b]
        for number in shared:
            for corner in self.triangles[number] or ():
                self.around[corner].discard(number)
            self.triangles[number] = None
        for number in self.around[b]:
            self.triangles[number] = [a if corner == b else corner for corner in self.triangles[number] or ()]
            self.around[a].add(number)
        self.around[b] = set()
        return True

    def _between(self, a: int, b: int) -> tuple[np.ndarray, np.ndarray]:
        """Where the surface is between two corners, as far as their normals tell, and its normal there; of an edge with
        one end on the mirror plane, that end."""
        if self.on_plane[a] != self.on_plane[b]:
            end = a if self.on_plane[a] else b
            return self.positions[end], self.normals[end]
        edge = self.positions[b] - self.positions[a]
        normal = self.normals[a] + self.normals[b]
        normal = normal / max(np.sqrt(normal @ normal), ROUND_OFF)
        bulge = edge @ (self.normals[b] - self.normals[a]) / 8  # of a circle through both
        return (self.positions[a] + self.positions[b]) / 2 + bulge * normal, normal

    def flip_edges(self) -> int:
        """Turns the edge between two triangles where the other diagonal makes better ones; how many."""
        count = 0
        for a, b in _edges(self.kept()):
            shared = self.around[a] & self.around[b]
            if len(shared) != 2:
                continue
            first, second = shared
            c, d = (next(x for x in self.triangles[n] or () if x not in (a, b)) for n in (first, second))
            if d in self.neighbours(c):
                continue
            p, q, r, s = self.positions[[a, b, c, d]]
            if _angle(p - r, q - r) + _angle(p - s, q - s) < np.pi + 0.05:
                continue
            old = [np.array(self.triangles[number]) for number in (first, second)]
            # the triangle that runs from a to b keeps its turn
            at = {corner: place for place, corner in enumerate(old[0].tolist())}
            forward = (at[int(a)] + 1) % 3 == at[int(b)]
            new = [[c, a, d], [c, d, b]] if forward else [[c, d, a], [c, b, d]]
            fronts_old = [rot.normalize(_front(self.positions[t])) for t in old]
            fronts_new = [rot.normalize(_front(self.positions[t])) for t in new]
            if min(float(x @ y) for x in fronts_old for y in fronts_new) < 0.7:
                continue
            for number, triangle in zip((first, second), new, strict=True):
                for corner in self.triangles[number] or ():
                    self.around[corner].discard(number)
                self.triangles[number] = [int(corner) for corner in triangle]
            for number, triangle in zip((first, second), new, strict=True):
                for corner in triangle:
                    self.around[corner].add(number)
            count += 1
        return count

    def even_out(self) -> None:
        """Moves each corner, along the surface, to the middle of its neighbours."""
        target = self.positions.copy()
        for corner, near in ((c, list(self.neighbours(c))) for c in range(len(self.around)) if self.around[c]):
            if self.on_plane[corner]:
                near = [other for other in near if self.on_plane[other]]
            target[corner] = self.positions[near].mean(axis=0)
        move = 0.5 * (target - self.positions)
        self.positions += move - np.vecdot(move, self.normals)[:, None] * self.normals

    def kept(self) -> np.ndarray:
        """(m, 3) the triangles that are left."""
        return np.array([triangle for triangle in self.triangles if triangle])

    def compact(self) -> tuple[np.ndarray, np.ndarray]:
        """The numbers of the corners that are left, and the triangles (m, 3) counted among those."""
        triangles = self.kept()
        used = np.unique(triangles)
        return used, np.searchsorted(used, triangles)


def _edges(triangles: np.ndarray) -> np.ndarray:
    """(e, 2) every edge of triangles (m, 3) once."""
    return np.unique(
        np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1), axis=0
    )


def _front(corners: np.ndarray) -> np.ndarray:
    return np.cross(corners[1] - corners[0], corners[2] - corners[0])


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    cosine = a @ b / max(np.sqrt((a @ a) * (b @ b)), ROUND_OFF)
    return float(np.arccos(np.clip(cosine, -1, 1)))
