"""The whole network: Table 3, styles per part, the last sample alone, what `residual_output` promises, and that it
learns."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.body.kinematics import forward_kinematics as numpy_kinematics
from sim.body.torch_kinematics import forward_kinematics
from sim.math import rotations as rot
from sim.motion.features import STRIDE, WINDOW, clip_features, rotations_of
from stylizer.data.dataset import CLIP_WINDOW, LATER, STYLE_WINDOW
from stylizer.systems.motion_puzzle.config import CONFIGS, FULL, PAPER_SLIM, SLIM
from stylizer.systems.motion_puzzle.model import MotionPuzzle
from stylizer.systems.motion_puzzle.objective import (
    OURS,
    PAPER,
    Inputs,
    _seen_later,
    compute_losses,
    imitate,
)
from stylizer.systems.motion_puzzle.style_tensors import mix_parts
from tests.stylizer.conftest import TINY
from tests.support.walker import walking_clip

SMALL_FULL = replace(FULL, stem=8, channels=(8, 12, 16))


@pytest.fixture
def model():
    torch.manual_seed(0)
    return MotionPuzzle(TINY)


def motion(seed, batch=2, samples=WINDOW):
    return torch.randn(batch, samples, 21, 15, generator=torch.Generator().manual_seed(seed))


def stconv(hops, taps, channels_in, channels_out):
    return hops * taps * channels_in * channels_out + channels_out


def test_the_full_network_is_table_3():
    """Rows of Table 3: kernel sizes k_s (hops 0..K, K = 3 2 2), k_t, and channels; G1 G2 G3 are 21, 10, 5 vertices."""
    convolutions = ((4, 7, 64, 128), (3, 5, 128, 256), (3, 5, 256, 512), (3, 3, 512, 512), (3, 3, 512, 512))
    encoder = (15 * 64 + 64) + sum(stconv(*row) for row in convolutions)
    style_nets = 0
    for hops, taps, channels, finer in ((3, 5, 512, 256), (3, 5, 256, 128), (4, 7, 128, 64)):
        # each part its own affine map, from the style's mean to scale and bias
        adain = 5 * (channels + 1) * 2 * channels
        attention = 3 * (channels + 1) * channels  # m, n and l of Eq. 12, 13
        style_nets += adain + stconv(hops, taps, channels, channels) + attention + stconv(hops, taps, channels, finer)
    residual = 2 * (stconv(3, 3, 512, 512) + 5 * 513 * 1024)
    model = MotionPuzzle(FULL)
    for part in (model.style_encoder, model.content_encoder):
        assert sum(p.numel() for p in part.parameters()) == encoder
    assert model.parameter_count() == 2 * encoder + residual + style_nets + (64 * 15 + 15)
    assert 36e6 < model.parameter_count() < 40e6
    with torch.inference_mode():
        style = model.normalize(motion(1, 1, 32))
        features = model.style_encoder(style)
        assert [tuple(f.shape) for f in features] == [(21, 1, 32, 128), (10, 1, 16, 256), (5, 1, 8, 512)]
        content = model.content_encoder(model.normalize(motion(0, 1)))
        assert content.shape == (5, 1, 4, 512)
        assert model.decoder(content, model.decoder.style_side(features)).shape == (21, 1, 16, 15)


def test_the_papers_slim_network_has_no_residual_blocks_and_two_style_nets():
    model = MotionPuzzle(PAPER_SLIM)
    style = model.encode_style(model.normalize(motion(1, 1, 32)))
    assert {name.partition(".")[0] for name in style} == {"3", "2"}
    assert 5 * 17_250_000 > 2 * model.parameter_count() and not [
        n for n, _ in model.named_parameters() if "residual" in n
    ]


@pytest.mark.parametrize("config", [SMALL_FULL, *(replace(c, stem=8, channels=(8, 8, 8)) for c in CONFIGS.values())])
def test_every_form_restyles_and_its_last_sample_alone_is_the_last_sample(config):
    torch.manual_seed(0)
    model = MotionPuzzle(config)
    style, own = (model.encode_style(model.normalize(motion(seed, samples=32))) for seed in (1, 2))
    content = model.normalize(motion(0))
    whole, last = model(content, style, own), model(content, style, own, last=1)
    if not config.residual_output:
        assert whole[1] is last[1] is None
        whole, last = whole[:1], last[:1]
    for every, newest in zip(whole, last, strict=True):
        assert every.shape == (21, 2, 16, 15) and newest.shape == (21, 2, 1, 15)
        assert torch.allclose(newest, every[:, :, -1:], atol=1e-5)


def test_relative_tells_what_is_lost_in_its_own_style(model):
    own, style = (model.encode_style(model.normalize(motion(seed, samples=32))) for seed in (1, 2))
    content = model.normalize(motion(0))
    styled, rebuilt = model(content, style, own)
    for output, wanted in ((styled, style), (rebuilt, own)):
        assert torch.allclose(
            output, model.decode_styles(content, model.content_encoder(content), [wanted])[0], atol=1e-5
        )


def test_the_way_over_the_floor_has_a_say_though_normalization_takes_it_out():
    torch.manual_seed(0)
    model = MotionPuzzle(replace(SLIM, stem=8, channels=(8, 8, 8)))
    style, still = model.encode_style(model.normalize(motion(1, samples=32))), model.normalize(motion(0))
    moving = still.clone()
    moving[..., 12:] += 1.0
    styled = [model.condition_on_root(content, style) for content in (still, moving)]
    scales = [each["3.scale"] for each in styled]
    assert scales[0].shape == (5, 2, 8) and not torch.allclose(*scales)
    assert torch.equal(styled[0]["3.keys"], style["3.keys"])


def test_attention_and_parts_can_be_taken_away():
    names = ("slim_no_attention", "slim_whole_body_adain")
    models = {name: MotionPuzzle(replace(CONFIGS[name], stem=8, channels=(8, 8, 8))) for name in names}
    style = {name: model.encode_style(model.normalize(motion(1, samples=32))) for name, model in models.items()}
    without, whole = (style[name] for name in names)
    assert all(values.shape[2] == 0 for name, values in without.items() if name.endswith("keys"))
    scale = whole["3.scale"]
    assert torch.equal(scale, scale[:1].expand(5, -1, -1)) and whole["2.keys"].shape[2] > 0


def test_parts_are_mixed_by_part(model):
    own, other = (model.encode_style(model.normalize(motion(seed, samples=32))) for seed in (1, 2))
    use_other = torch.zeros(5, 2, dtype=torch.bool)
    use_other[3, 0] = True
    for name, c in mix_parts(own, other, use_other).items():
        a, b = own[name], other[name]
        assert torch.equal(c[3, 0], b[3, 0]) and torch.equal(c[3, 1], a[3, 1]) and torch.equal(c[:3], a[:3])


def test_normalization_is_undone(model):
    random = np.random.default_rng(0)
    model.set_statistics(random.normal(size=(21, 15)), random.uniform(0.5, 2, (21, 15)))
    assert torch.allclose(model.restore(model.normalize(motion(0))), motion(0), atol=1e-5)


def test_what_a_later_window_tells_of_our_last_samples():
    def samples(end):
        return torch.sin(0.2 * (end - STRIDE * torch.arange(15, -1, -1.0)))[None, None, :, None]

    assert torch.allclose(_seen_later(samples(60 + LATER))[:, :, -2:], samples(60)[:, :, -2:], atol=2e-3)


def test_kinematics_in_torch_are_those_of_sim():
    features = clip_features(walking_clip())[:8]
    motion = torch.from_numpy(features).permute(1, 0, 2)[:, :, None]
    positions = forward_kinematics(motion[..., 3:9], motion[:1, ..., :3])[:, :, 0].permute(1, 0, 2).numpy()
    assert np.allclose(
        positions, numpy_kinematics(features[:, 0, :3], rot.from_matrix(rotations_of(features))), atol=1e-9
    )


def test_the_imitated_motion_takes_turns_from_the_match_and_the_way_from_the_content(model):
    walk = torch.from_numpy(clip_features(walking_clip()).astype(np.float32))
    content, match = (model.normalize(walk[start : start + 32 : 2][None]) for start in (0, 20))
    use_target = torch.zeros(5, 1, dtype=torch.bool)
    assert torch.allclose(imitate(model, content, match, use_target), content, atol=1e-3)
    use_target[0] = True
    mixed = imitate(model, content, match, use_target)
    assert torch.equal(mixed[1:5, ..., 3:9], match[1:5, ..., 3:9])
    assert torch.equal(mixed[5:, ..., 3:9], content[5:, ..., 3:9])
    assert torch.equal(mixed[..., 12:], content[..., 12:])
    assert (mixed[3, ..., :3] - content[3, ..., :3]).abs().max() > 0.01


@pytest.mark.parametrize("recipe, learned", [(OURS, ("mean_pose", "imitation")), (PAPER, ("reconstruction", "cycle"))])
def test_one_batch_is_learned(recipe, learned):
    torch.manual_seed(0)
    ours = recipe is OURS
    model = MotionPuzzle(replace(SLIM, stem=16, channels=(16, 16, 32), residual_output=ours, root_units=8 * ours))
    shift = torch.randn(21, 2, 1, 15)

    def wave(end, samples, of=torch.sin):
        return of(0.2 * (end - STRIDE * torch.arange(samples - 1, -1, -1.0))[:, None]) + shift

    target = wave(10, CLIP_WINDOW, torch.cos) + 0.5
    inputs = Inputs(
        wave(60, STYLE_WINDOW),
        wave(60, CLIP_WINDOW),
        wave(60 + LATER, WINDOW),
        target,
        target,
        target[:, :, -WINDOW:],
        target[:, :, -WINDOW:],
        torch.ones(2),
        torch.ones(5, 2, dtype=torch.bool),
    )
    optimizer = torch.optim.Adam(model.parameters(), 5e-3)
    history = []
    for _ in range(60):
        terms = compute_losses(model, inputs, recipe)
        assert terms.keys() == recipe.weights.keys()
        history.append({name: value.item() for name, value in terms.items()})
        optimizer.zero_grad()
        sum(recipe.weights[name] * value for name, value in terms.items()).backward()
        optimizer.step()
    for name in learned:
        assert history[-1][name] < 0.95 * history[0][name]
