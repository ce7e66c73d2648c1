"""The skeleton as three graphs G1 (joints), G2 and G3 (body parts), all derived from the table in
`sim.body.skeleton`."""

from dataclasses import dataclass

import numpy as np

from sim.body.skeleton import JOINT_COUNT, PARENTS, PARTS


@dataclass(frozen=True)
class Graph:
    """One level of the skeleton. groups: the joints each vertex stands for; parts: the vertices of each body part."""

    groups: tuple[tuple[int, ...], ...]
    parts: tuple[tuple[int, ...], ...]

    @property
    def size(self) -> int:
        return len(self.groups)

    def hops(self) -> np.ndarray:
        """(V, V) edge distance d of every pair; two vertices are joined where a bone joins any of their joints."""
        owner = {joint: vertex for vertex, group in enumerate(self.groups) for joint in group}
        joined = np.eye(self.size, dtype=bool)
        for joint in range(1, JOINT_COUNT):
            a, b = owner[joint], owner[int(PARENTS[joint])]
            joined[a, b] = joined[b, a] = True
        hops = np.full((self.size, self.size), self.size)
        reach = np.eye(self.size, dtype=bool)
        for distance in range(self.size):
            hops[reach & (hops > distance)] = distance
            reach = (reach.astype(int) @ joined.astype(int)) > 0
        return hops

    def mixing(self, distance: int) -> np.ndarray:
        """(distance + 1, V, V): row j of matrix d averages the vertices d edges from j (1 / Z of Eq. 1, B of Eq. 2)."""
        matrices = np.stack([self.hops() == d for d in range(distance + 1)]).astype(np.float32)
        return matrices / np.maximum(matrices.sum(axis=2, keepdims=True), 1.0)

    def part_table(self) -> np.ndarray:
        """(5, n) vertices of each part, shorter parts filled up with -1."""
        longest = max(map(len, self.parts))
        return np.array([[*part, *[-1] * (longest - len(part))] for part in self.parts])


def _joints() -> Graph:
    return Graph(tuple((joint,) for joint in range(JOINT_COUNT)), tuple(PARTS.values()))


def _pooled(graph: Graph) -> Graph:
    """Consecutive vertices along a part's chain become one: 4 -> 2 -> 1, the spine 5 -> 2 -> 1 (Fig. 4)."""
    groups: list[tuple[int, ...]] = []
    parts: list[tuple[int, ...]] = []
    for part in graph.parts:
        runs = np.array_split(np.array(part), len(part) // 2)
        parts.append(tuple(range(len(groups), len(groups) + len(runs))))
        groups += [tuple(joint for vertex in run for joint in graph.groups[vertex]) for run in runs]
    return Graph(tuple(groups), tuple(parts))


G1 = _joints()
G2 = _pooled(G1)
G3 = _pooled(G2)
LEVELS = {1: G1, 2: G2, 3: G3}


def pooling(fine: Graph, coarse: Graph) -> np.ndarray:
    """(V coarse, V fine): averages the fine vertices of each coarse one."""
    member = np.array([[set(f) <= set(c) for f in fine.groups] for c in coarse.groups], dtype=np.float32)
    return member / member.sum(axis=1, keepdims=True)


def unpooling(coarse: Graph, fine: Graph) -> np.ndarray:
    """(V fine, V coarse): each fine vertex takes the value of the coarse one it belongs to."""
    return (pooling(fine, coarse).T > 0).astype(np.float32)
