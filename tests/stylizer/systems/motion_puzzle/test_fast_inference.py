"""The live forms of the network answer as the network does, and the quick one as the plain one."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from stylizer.systems.motion_puzzle.config import CONFIGS
from stylizer.systems.motion_puzzle.fast_inference import FastInference, TorchInference, to_inference
from stylizer.systems.motion_puzzle.model import ROOT, MotionPuzzle
from stylizer.systems.motion_puzzle.style_tensors import cat_batch, stack_parts, to_numpy
from tests.stylizer.conftest import expand_batch

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
    begun_at_zero = [p for p in model.parameters() if p.dim() > 1 and not p.any()]
    for parameter in begun_at_zero:  # what training begins without must count here
        torch.nn.init.normal_(parameter, std=0.1)
    rng = np.random.default_rng(1)
    model.set_statistics(rng.normal(size=(21, 15)), rng.uniform(0.5, 1.5, size=(21, 15)))
    with torch.inference_mode():
        styles = [model.encode_style(torch.randn(21, 1, 32, 15)) for _ in range(3)]
    return model, styles, rng


def change_of(form, windows, *styles) -> np.ndarray:
    return form.change(windows, *(form.prepare(to_numpy(style)) for style in styles))


@pytest.mark.parametrize(
    "name, change",
    [
        ("slim", {}),
        ("slim", {"root_units": 0}),
        ("paper_slim", {}),
        ("full", {}),
        ("slim_whole_body_adain", {}),
        ("slim_no_attention", {}),
    ],
)
def test_live_it_is_the_network_up_to_rounding(name, change):
    model, styles, rng = network(name, change)
    for shown in ([styles[1]], [styles[1], stack_parts([styles[2]] * 5)]):
        windows = rng.normal(size=(len(shown), 16, 21, 15))
        style, own = cat_batch(shown), expand_batch(styles[0], len(shown))
        ours = change_of(to_inference(model), windows, style, own)
        assert np.abs(ours - changed(model, windows, style, own)).max() < 1e-4
        assert np.abs(ours).max() > 0.01
    assert FastInference.fits(model.config) == (name == "slim")


@pytest.mark.parametrize("change", [{}, {"root_units": 0}])
def test_the_quick_form_is_the_plain_one_up_to_rounding_whatever_way_the_body_goes(change):
    """Backwards, sideways, turning, standing."""
    model, styles, rng = network("slim", change)
    quick, plain = to_inference(model), TorchInference(model)
    assert type(quick) is FastInference
    windows = rng.normal(size=(6, 16, 21, 15))
    windows[:, :, 0, ROOT] = np.array(
        [(0, 1.3, 0), (0, -0.8, 0), (0.9, 0.1, 0), (0, 0, 1.5), (0.02, 0.05, 0), (-0.7, 0.7, -0.5)], dtype=float
    )[:, None]
    style, own = cat_batch([styles[1], styles[2]] * 3), expand_batch(styles[0], 6)
    ours, theirs = (change_of(form, windows, style, own) for form in (quick, plain))
    assert np.abs(ours - theirs).max() < 1e-4
