"""The live forms of the network answer as the network does, and the quick one as the plain one."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from stylizer.systems.motion_puzzle.config import CONFIGS
from stylizer.systems.motion_puzzle.direction_transfer import ROOT
from stylizer.systems.motion_puzzle.fast_inference import FastInference, TorchInference, to_inference
from stylizer.systems.motion_puzzle.model import MotionPuzzle
from stylizer.systems.motion_puzzle.style_tensors import cat_batch, expand_batch, stack_parts

SMALL = {"stem": 8, "channels": (8, 12, 16)}


def changed(model, windows, style, own):
    """What the network itself changes in the last sample."""
    with torch.inference_mode():
        motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
        styled, rebuilt = (
            answer if answer is None else model.restore(answer)[:, 0].numpy()
            for answer in model(motion, style, own, last=1)
        )
        return styled - (windows[:, -1] if rebuilt is None else rebuilt)


def network(name, change):
    """A small network of that kind, with statistics of its own, and three styles."""
    torch.manual_seed(1)
    model = MotionPuzzle(replace(CONFIGS[name], **SMALL, **change)).eval()
    if model.key_poses:
        model.key_poses.begin(torch.randn(21, 8, 64, 15))
    begun_at_zero = [p for p in model.parameters() if p.dim() > 1 and not p.any()]
    for parameter in begun_at_zero:  # what training begins without must count here
        torch.nn.init.normal_(parameter, std=0.1)
    rng = np.random.default_rng(1)
    model.set_statistics(rng.normal(size=(21, 15)), rng.uniform(0.5, 1.5, size=(21, 15)))
    with torch.inference_mode():
        styles = [model.encode_style(torch.randn(21, 1, 32, 15)) for _ in range(3)]
    return model, styles, rng


@pytest.mark.parametrize(
    "name, change",
    [
        ("slim", {}),
        ("slim", {"root_units": 0}),
        ("no_key_poses", {}),
        ("paper_slim", {}),
        ("full", {}),
        ("whole_body_adain", {}),
        ("no_attention", {}),
    ],
)
def test_its_two_halves_are_the_network_up_to_rounding(name, change):
    """Of motion that goes straight on, as fast as its feet say: what the network itself was trained on."""
    model, styles, rng = network(name, change)
    for looks in ([styles[1]], [styles[1], stack_parts([styles[2]] * 5)]):
        windows, style, own = (
            rng.normal(size=(len(looks), 16, 21, 15)),
            cat_batch(looks),
            expand_batch(styles[0], len(looks)),
        )
        windows[..., ROOT] = np.array([0.0, 1.0, 0.0]) * rng.uniform(0.6, 2.0, size=(len(looks), 16, 1, 1))
        live, root_velocities = to_inference(model), windows[:, :, 0, ROOT].mean(axis=1)
        styled, rebuilt = live.key_poses(windows[:, -1], root_velocities, root_velocities, style, own)
        ours = live.decoded(windows, style, own) + styled - rebuilt
        assert np.abs(ours - changed(model, windows, style, own)).max() < 1e-4
        assert np.abs(ours).max() > 0.01
        styled, rebuilt = live.key_poses(windows[:, -1], root_velocities, root_velocities, own, own)
        assert styled.shape == rebuilt.shape == windows[:, -1].shape
        assert np.abs(styled - rebuilt).max() < 1e-6, "in their own style, or without key poses"
    assert FastInference.fits(model.config) == (name in ("slim", "no_key_poses"))


@pytest.mark.parametrize("name, change", [("slim", {}), ("slim", {"root_units": 0}), ("no_key_poses", {})])
def test_the_quick_form_is_the_plain_one_up_to_rounding_whatever_way_the_body_goes(name, change):
    """Backwards, sideways, turning, standing, and at another speed than the neutral motion's."""
    model, styles, rng = network(name, change)
    quick, plain = to_inference(model), TorchInference(model)
    assert type(quick) is FastInference
    windows = rng.normal(size=(6, 16, 21, 15))
    style, own = cat_batch([styles[1], styles[2]] * 3), expand_batch(styles[0], 6)
    own_root_velocities = np.array(
        [(0, 1.3, 0), (0, -0.8, 0), (0.9, 0.1, 0), (0, 0, 1.5), (0.02, 0.05, 0), (-0.7, 0.7, -0.5)], dtype=float
    )
    root_velocities = own_root_velocities * np.array([[0.6], [1.0], [1.2], [1.0], [1.0], [0.8]])
    decode_styles = [
        (
            form.decoded(windows, style, own),
            *form.key_poses(windows[:, -1], root_velocities, own_root_velocities, style, own),
            *form.key_poses(windows[:, -1], own_root_velocities, own_root_velocities, style, own),
        )
        for form in (quick, plain)
    ]
    for ours, theirs in zip(*decode_styles):
        assert np.abs(ours - theirs).max() < 1e-4
    elsewhere, same = (np.abs(decode_styles[0][1] - decode_styles[0][3])[place].max() for place in (0, 1))
    assert same == 0 and (elsewhere > 1e-3) == bool(model.key_poses), "it matters how fast the body goes"
