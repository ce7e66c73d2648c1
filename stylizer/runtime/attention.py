"""What a body part's attention looks at: the map A of BP-ATN (Jang et al. 2022, Eq. 12), read out of the running
network."""

import numpy as np
import torch
from torch import Tensor

from stylizer.networks.layers import of_kind
from stylizer.styles.encoding import TOKEN_WINDOWS
from stylizer.styles.style_clips import WINDOW
from stylizer.systems.motion_puzzle.model import BPStyleNet, MotionPuzzle
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures

LEVEL = 2  # the finest graph with attention: two vertices a part, 15 samples a second


@torch.inference_mode()
def attention_map(model: MotionPuzzle, motion: Tensor, style: StyleFeatures, part: int) -> np.ndarray:
    """How much the content at each sample (rows) looks at each sample of the style clips (columns); rows add up to 1.

    motion: normalized, (21, 1, T, 15); style: of every part, as the decoder wants it; part: its place in PART_NAMES.
    Gives (T / 2, samples of the style's windows, one after the other). Raises ValueError for a model without
    attention."""
    layer = of_kind(BPStyleNet, model.decoder.blocks[str(LEVEL)]).attention
    if layer is None:
        raise ValueError("these stylizer weights were trained without attention")
    seen = []
    hook = layer.register_forward_pre_hook(lambda _, inputs: seen.append(inputs))
    try:
        model.decoder(model.content_encoder(motion), style)
    finally:
        hook.remove()
    x, keys, _ = seen[0]
    weights = layer.attention(x, keys)[part, 0]  # (content tokens, style tokens); a token is a vertex at a sample
    samples = WINDOW // 2 ** (LEVEL - 1)
    by_time = weights.view(-1, x.shape[2], TOKEN_WINDOWS, weights.shape[1] // (TOKEN_WINDOWS * samples), samples)
    return by_time.sum(3).mean(0).flatten(1).numpy()
