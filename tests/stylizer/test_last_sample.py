"""The live form of the network answers as the network does."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from stylizer.blend import for_batch, joined, side_by_side
from stylizer.configs import CONFIGS
from stylizer.last_sample import LastSample, live_form
from stylizer.motion_puzzle import MotionPuzzle

SMALL = {"stem": 8, "channels": (8, 12, 16)}


def said(model, windows, style, own):
    """What the network itself says of the last sample."""
    with torch.inference_mode():
        motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
        answers = model(motion, style, own, last=1)
        return [None if answer is None else model.restore(answer)[:, 0].numpy() for answer in answers]


@pytest.mark.parametrize("name, change", [("slim", {}), ("slim", {"way": 0}), ("slim", {"relative": False}),
                                          ("paper_slim", {}), ("full", {}), ("whole_body_adain", {}), ("no_attention", {})])
def test_it_is_the_network_up_to_rounding(name, change):
    torch.manual_seed(1)
    model = MotionPuzzle(replace(CONFIGS[name], **SMALL, **change)).eval()
    begun_at_zero = [p for p in model.parameters() if p.dim() > 1 and not p.any()]
    for parameter in begun_at_zero:  # what training begins without must count here
        torch.nn.init.normal_(parameter, std=0.1)
    rng = np.random.default_rng(1)
    model.set_statistics(rng.normal(size=(21, 15)), rng.uniform(0.5, 1.5, size=(21, 15)))
    with torch.inference_mode():
        styles = [model.encode_style(torch.randn(21, 1, 32, 15)) for _ in range(3)]
    own = styles[0]
    for looks in ([styles[1]], [styles[1], side_by_side([styles[2]] * 5)]):
        windows, style = rng.normal(size=(len(looks), 16, 21, 15)), joined(looks)
        with torch.inference_mode():
            ours = live_form(model)(windows, style, for_batch(own, len(looks)))
        for answer, exact in zip(ours, said(model, windows, style, for_batch(own, len(looks))), strict=True):
            assert (answer is None) == (exact is None)
            assert answer is None or np.abs(answer - exact).max() < 1e-4
    assert LastSample.fits(model.config) == name.endswith("slim")
