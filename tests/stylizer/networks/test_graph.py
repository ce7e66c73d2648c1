"""The three graphs are the paper's: 21, 10 and 5 vertices, pooled along the chains and never across parts."""

import numpy as np
import pytest

from sim.body.skeleton import INDEX, PART_OF_JOINT
from stylizer.networks.graph import G1, G2, G3, LEVELS, pooling, unpooling


def test_sizes_are_the_papers():
    assert [graph.size for graph in LEVELS.values()] == [21, 10, 5]
    assert [[len(part) for part in graph.parts] for graph in LEVELS.values()] == [[4, 4, 5, 4, 4], [2] * 5, [1] * 5]


@pytest.mark.parametrize("graph", LEVELS.values())
def test_a_vertex_never_spans_two_parts(graph):
    for part, vertices in enumerate(graph.parts):
        for vertex in vertices:
            assert {PART_OF_JOINT[joint] for joint in graph.groups[vertex]} == {part}


def test_hop_distances():
    hops = G1.hops()
    assert hops[INDEX["Hips"], INDEX["LeftToe"]] == 4
    assert hops[INDEX["LeftHand"], INDEX["RightHand"]] == 8
    assert (hops == hops.T).all() and (np.diag(hops) == 0).all()
    assert G3.hops().tolist() == [[0, 2, 1, 2, 2], [2, 0, 1, 2, 2], [1, 1, 0, 1, 1], [2, 2, 1, 0, 2], [2, 2, 1, 2, 0]]


def test_mixing_averages_each_distance():
    for graph in LEVELS.values():
        for matrix in graph.mixing(2):
            rows = matrix.sum(axis=1)
            assert np.all(np.isclose(rows, 1) | (rows == 0)) and rows.any()


def test_pooling_and_unpooling_keep_a_constant_and_the_parts():
    for fine, coarse in ((G1, G2), (G2, G3)):
        pool, unpool = pooling(fine, coarse), unpooling(coarse, fine)
        assert np.allclose(pool.sum(axis=1), 1) and np.allclose(unpool.sum(axis=1), 1)
        assert np.allclose(pool @ unpool, np.eye(coarse.size))
