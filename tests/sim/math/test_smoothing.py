"""The smoothest curve: follows, stands still, fades, and is the minimum that it says it is."""

import numpy as np
import pytest

from sim.math.smoothing import smooth_penalised


@pytest.mark.parametrize("frames", [4, 5, 30])
def test_it_follows_what_it_must(frames):
    target = np.linspace(0, 1, frames)[:, None]
    followed = smooth_penalised(target, np.full(frames, 1e6), 0.0, 10.0)
    assert np.allclose(followed, target, atol=1e-3)
    still = smooth_penalised(target, 0.0, np.full(frames - 1, 1e6), 10.0)
    assert np.allclose(np.diff(still, axis=0), np.diff(target, axis=0), atol=1e-3)
    assert np.allclose(smooth_penalised(target, 0.0, 0.0, 10.0), 0, atol=1e-9)


def test_no_curve_costs_less():
    random = np.random.default_rng(1)
    target, weight, stillness, free = random.random((20, 2)), random.random(20), random.random(19), random.random(20)
    fade = 1.5

    def cost(curve):
        """Of each of the two columns, as the docstring has it."""
        return (
            (np.diff(curve, 2, axis=0) ** 2).sum(axis=0)
            + free @ (curve / fade**2) ** 2
            + weight @ (curve - target) ** 2
            + stillness @ np.diff(curve - target, axis=0) ** 2
        )

    best = smooth_penalised(target, weight, stillness, fade, free)
    for _ in range(20):
        assert (cost(best + 1e-3 * random.standard_normal((20, 2))) > cost(best)).all()
    np.testing.assert_allclose(smooth_penalised(target[:, 0], weight, stillness, fade, free), best[:, 0], atol=1e-12)
