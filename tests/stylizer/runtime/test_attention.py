"""What a part's attention looks at, read out of a network that it leaves as it was."""

import numpy as np
import pytest
import torch

from sim.body.skeleton import PART_NAMES
from stylizer.runtime.attention import attention_map
from stylizer.styles.encoding import TOKEN_WINDOWS, encode
from stylizer.styles.style_clips import WINDOW
from stylizer.systems.motion_puzzle.config import Config
from stylizer.systems.motion_puzzle.model import MotionPuzzle


@pytest.fixture(scope="module")
def model() -> MotionPuzzle:
    torch.manual_seed(0)
    return MotionPuzzle(Config(stem=8, channels=(8, 12, 16))).eval()


@pytest.fixture(scope="module", params=[1, 3, 12])
def style(model, request):
    """Of as many windows as a clip may have: attention looks at TOKEN_WINDOWS of them."""
    return encode(model, np.random.default_rng(1).normal(size=(request.param, WINDOW, 21, 15)))


@pytest.mark.parametrize("part", range(len(PART_NAMES)))
def test_rows_are_shares_of_the_style_clips(model, style, part):
    motion = model.normalize(torch.randn(1, 16, 21, 15, generator=torch.Generator().manual_seed(2)))
    seen = attention_map(model, motion, style, part)
    assert seen.shape == (8, TOKEN_WINDOWS * WINDOW // 2) and seen.min() >= 0
    np.testing.assert_allclose(seen.sum(1), 1, atol=1e-5)
    np.testing.assert_array_equal(seen, attention_map(model, motion, style, part))
    assert not model.decoder.blocks["2"].attention._forward_pre_hooks
