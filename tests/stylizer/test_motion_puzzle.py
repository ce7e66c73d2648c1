"""The whole network: shapes, styles per part, the last sample alone, and that it learns."""

import numpy as np
import pytest
import torch

from sim.features import STRIDE
from stylizer.dataset import LATER
from stylizer.losses import WEIGHTS, _seen_later, losses
from stylizer.motion_puzzle import Config, MotionPuzzle, mix_parts

TINY = Config(stem=8, channels=(8, 8, 8))


@pytest.fixture
def model():
    torch.manual_seed(0)
    return MotionPuzzle(TINY)


def motion(seed, batch=2, samples=16):
    return torch.randn(batch, samples, 21, 15, generator=torch.Generator().manual_seed(seed))


@pytest.mark.parametrize("levels", [(3, 2), (3, 2, 1)])
def test_shapes(levels):
    model = MotionPuzzle(Config(8, (8, 12, 16), style_levels=levels))
    content = model.content_encoder(model.normalize(motion(0)))
    assert content.shape == (5, 2, 4, 16)
    features = model.style_encoder(model.normalize(motion(1, samples=32)))
    assert [tuple(f.shape) for f in features] == [(21, 2, 32, 8), (10, 2, 16, 12), (5, 2, 8, 16)]
    assert model.decoder(content, model.decoder.style_side(features)).shape == (21, 2, 16, 15)


def test_the_last_sample_alone_is_the_last_sample(model):
    style = model.encode_style(model.normalize(motion(1, samples=32)))
    content = model.content_encoder(model.normalize(motion(0)))
    assert torch.allclose(model.decoder(content, style, last=1), model.decoder(content, style)[:, :, -1:], atol=1e-5)


def test_parts_are_mixed_by_part(model):
    own, other = (model.encode_style(model.normalize(motion(seed, samples=32))) for seed in (1, 2))
    use_other = torch.zeros(5, 2, dtype=torch.bool)
    use_other[3, 0] = True
    for level, mixed in mix_parts(own, other, use_other).items():
        for a, b, c in zip(own[level], other[level], mixed):
            assert torch.equal(c[3, 0], b[3, 0]) and torch.equal(c[3, 1], a[3, 1]) and torch.equal(c[:3], a[:3])


def test_normalization_is_undone(model):
    random = np.random.default_rng(0)
    model.set_statistics(random.normal(size=(21, 15)), random.uniform(0.5, 2, (21, 15)))
    assert torch.allclose(model.restore(model.normalize(motion(0))), motion(0), atol=1e-5)


def test_what_a_later_window_tells_of_our_last_samples():
    def samples(end):
        return torch.sin(0.2 * (end - STRIDE * torch.arange(15, -1, -1.0)))[None, None, :, None]

    assert torch.allclose(_seen_later(samples(60 + LATER))[:, :, -2:], samples(60)[:, :, -2:], atol=2e-3)


def test_one_batch_is_learned():
    torch.manual_seed(0)
    model = MotionPuzzle(Config(16, (16, 16, 32)))
    shift = torch.randn(2, 1, 21, 15)
    source, later = (torch.sin(0.2 * (end - STRIDE * torch.arange(samples - 1, -1, -1.0))[:, None, None] + shift)
                     for end, samples in ((60, 32), (60 + LATER, 16)))
    target = torch.cos(torch.arange(32) * 0.4 + torch.randn(2, 21, 15, 1)).permute(0, 3, 1, 2) + 0.5
    chosen = torch.ones(5, 2, dtype=torch.bool)
    optimizer = torch.optim.Adam(model.parameters(), 5e-3)
    history = []
    for _ in range(50):
        terms = losses(model, source, later, target, chosen)
        assert terms.keys() == WEIGHTS.keys()
        history.append({name: value.item() for name, value in terms.items()})
        optimizer.zero_grad()
        sum(WEIGHTS[name] * value for name, value in terms.items()).backward()
        optimizer.step()
    assert history[-1]["reconstruction"] < 0.85 * history[0]["reconstruction"]
    assert history[-1]["posture"] < 0.5 * history[0]["posture"]
