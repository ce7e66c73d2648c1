"""The live form of the network answers as the network does."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from stylizer.blend import for_batch, joined, side_by_side
from stylizer.configs import CONFIGS
from stylizer.last_sample import LastSample, live_form
from stylizer.motion_puzzle import MotionPuzzle
from stylizer.translation import ROOT

SMALL = {"stem": 8, "channels": (8, 12, 16)}


def changed(model, windows, style, own):
    """What the network itself changes in the last sample."""
    with torch.inference_mode():
        motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
        styled, rebuilt = (answer if answer is None else model.restore(answer)[:, 0].numpy()
                           for answer in model(motion, style, own, last=1))
        return styled - (windows[:, -1] if rebuilt is None else rebuilt)


@pytest.mark.parametrize("name, change", [("slim", {}), ("slim", {"way": 0}), ("no_key_poses", {}), ("paper_slim", {}),
                                          ("full", {}), ("whole_body_adain", {}), ("no_attention", {})])
def test_its_two_halves_are_the_network_up_to_rounding(name, change):
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
    for looks in ([styles[1]], [styles[1], side_by_side([styles[2]] * 5)]):
        windows, style, own = rng.normal(size=(len(looks), 16, 21, 15)), joined(looks), for_batch(styles[0], len(looks))
        live = live_form(model)
        ours = live.decoded(windows, style, own) + live.key_poses(windows[:, -1], windows[:, :, 0, ROOT].mean(axis=1), style, own)
        assert np.abs(ours - changed(model, windows, style, own)).max() < 1e-4
        assert np.abs(ours).max() > 0.01
        nowhere = live.key_poses(windows[:, -1], windows[:, :, 0, ROOT].mean(axis=1), own, own)
        assert nowhere.shape == windows[:, -1].shape and np.abs(nowhere).max() < 1e-6  # in their own style, or without key poses
    assert LastSample.fits(model.config) == (name in ("slim", "no_key_poses"))
