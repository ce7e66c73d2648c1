"""What the bench makes of its times, on times that are known."""

import gc

import numpy as np
import torch

from demo.bench.bench import FPS, MINUTE, Pauses, by_period, compare_halves, make_rival, timeline
from demo.bench.machine import LARGE, Probe, products_of
from stylizer.systems.motion_puzzle.config import CONFIGS


def test_frames_share_what_their_decoder_cost():
    np.testing.assert_allclose(by_period([0.007, 0.001, 0.001, 0.003, 0.006, 0.002, 0.0, 0.0, 0.009]), [0.003, 0.002])


def test_ten_minutes_compare_their_last_with_their_first_and_name_what_memory_grew_by():
    frames = np.full(3 * MINUTE, 0.004)
    frames[-MINUTE:] = 0.006
    memory = [(0, 300.0), (MINUTE, 310.0), (2 * MINUTE, 310.5), (3 * MINUTE, 312.0)]
    assert compare_halves(frames, memory) == {
        "first_minute_p99_ms": 4.0,
        "last_minute_p99_ms": 6.0,
        "ratio": 1.5,
        "growth_mb": 2.0,
    }
    assert compare_halves(frames[:MINUTE], memory) is None
    assert timeline(frames[: 3 * FPS]) == [[4.0, 4.0]] * 3


def test_matrix_products_are_counted_however_they_are_written():
    layer = torch.nn.Linear(5, 7)

    @torch.inference_mode()
    def action():
        layer(torch.zeros(2, 3, 5))
        torch.zeros(4, 2, 3) @ torch.zeros(4, 3, 6)
        torch.einsum("ij,jk->ik", torch.zeros(2, 9), torch.zeros(9, 2))

    assert sorted(2 * np.prod(product) for product in products_of(action)) == [
        2 * 2 * 9 * 2,
        2 * 4 * 2 * 3 * 6,
        2 * 6 * 5 * 7,
    ]


def test_the_probe_times_the_dearest_shapes_and_the_typical_speed_lies_among_them():
    probe = Probe([(64, 64, 64)] * 2 + [(1, 2, 3)])
    probe.take()
    speeds = [speed for shape, (speed,) in probe.speeds.items() if shape != LARGE]
    assert min(speeds) <= probe.typical_gflops() <= max(speeds)
    assert set(probe.report()["sgemm_gflops"]) == {"64x64x64", "1x2x3", "512x512x512"}


def test_the_rivals_are_the_papers_networks():
    full, slim = (
        sum(int(np.prod(product)) for product in products_of(make_rival(CONFIGS[name])))
        for name in ("full", "paper_slim")
    )
    assert full > 1.5 * slim > 1e8, "multiplications of numbers, for a window"


def test_a_collection_within_the_block_is_heard():
    pauses = Pauses()
    with pauses:
        gc.collect()
    gc.collect()
    assert pauses.report()["pauses"] == 1 and pauses.report()["longest_ms"] > 0
