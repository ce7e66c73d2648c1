"""Motion Puzzle (Jang et al., ACM TOG 41(3), 2022): style transfer by body part, in the form of its real-time system.

Sec. 7.3, App. A.1: no residual blocks, BP-StyleNet at G3 and G2 only. Feature maps are (vertex, batch, time, channel).
"""

from dataclasses import asdict, dataclass

import numpy as np
import torch
from torch import Tensor, nn

from sim.features import FEATURES
from stylizer.graph import LEVELS
from stylizer.layers import BPATN, BPAdaIN, PartStyle, Pool, STConv, Unpool, leaky, normalized


@dataclass(frozen=True)
class Config:
    stem: int = 24  # channels of the 1x1 convolutions at both ends (64 in Table 3)
    channels: tuple[int, ...] = (48, 96, 192)  # at G1, G2, G3 (128, 256, 512 in Table 3)
    distances: tuple[int, ...] = (3, 2, 2)  # K, the farthest hop that a spatial convolution sees, at G1, G2, G3
    taps: tuple[int, ...] = (7, 5, 5)  # samples that a temporal convolution sees, at G1, G2, G3
    style_levels: tuple[int, ...] = (3, 2)  # levels of the decoder that have a BP-StyleNet, coarse to fine

    def conv(self, level: int, channels_in: int, channels_out: int) -> STConv:
        """A spatial-temporal convolution on graph G_level with this table's kernel."""
        return STConv(LEVELS[level], channels_in, channels_out, self.distances[level - 1], self.taps[level - 1])

    def width(self, level: int) -> int:
        """Channels at G_level; G_0 is the stem."""
        return self.channels[level - 1] if level else self.stem


class Encoder(nn.Module):
    """A 1x1 convolution and one STConv for each graph, G1 to G3 (Table 3 a, b without residual blocks)."""

    def __init__(self, config: Config, normalize: bool) -> None:
        super().__init__()
        self.normalize = normalize
        self.stem = nn.Linear(FEATURES, config.stem)
        self.convs = nn.ModuleList(config.conv(level, config.width(level - 1), config.width(level)) for level in LEVELS)
        self.pools = nn.ModuleList([nn.Identity(), Pool(LEVELS[1], LEVELS[2]), Pool(LEVELS[2], LEVELS[3])])

    def forward(self, motion: Tensor) -> list[Tensor]:
        """(21, B, T, 15) -> features of G1, G2, G3, (V, B, T / 1 2 4, C); T is a multiple of 4."""
        x, levels = self.stem(motion), []
        for pool, conv in zip(self.pools, self.convs):
            x = pool(x)
            if self.normalize:
                x = normalized(x, (0, 2))  # over vertices and time together: keeps the posture's shape, learns quicker
            x = leaky(conv(x))
            levels.append(x)
        return levels


class StyleEncoder(Encoder):
    """E_s (Sec. 4.2): one style feature for each graph (Eq. 3)."""

    def __init__(self, config: Config) -> None:
        super().__init__(config, normalize=False)


class ContentEncoder(Encoder):
    """E_c (Sec. 4.3): instance normalization before every convolution takes the style out; G3's is kept (Eq. 6)."""

    def __init__(self, config: Config) -> None:
        super().__init__(config, normalize=True)

    def forward(self, motion: Tensor) -> Tensor:
        """(21, B, T, 15) -> (5, B, T / 4, C3)"""
        return super().forward(motion)[-1]


class BPStyleNet(nn.Module):
    """BP-AdaIN, STConv, BP-ATN, STConv on one graph (Eq. 10, 14; Table 3 d)."""

    def __init__(self, config: Config, level: int) -> None:
        super().__init__()
        channels, graph = config.width(level), LEVELS[level]
        self.adain = BPAdaIN(graph, channels)
        self.conv1 = config.conv(level, channels, channels)
        self.attention = BPATN(graph, channels)
        self.conv2 = config.conv(level, channels, config.width(level - 1))
        self.reach = config.taps[level - 1] // 2

    def style_side(self, style: Tensor) -> PartStyle:
        """All that depends on the style alone, from its feature (V, B, S, C)."""
        return PartStyle(*self.adain.style_side(style), *self.attention.style_side(style))

    def forward(self, x: Tensor, style: PartStyle, last: int | None = None) -> Tensor:
        """(V, B, T, C) -> (V, B, T, C of the finer graph); only the `last` samples where a number is given."""
        x = self.conv1(leaky(self.adain(x, style.scale, style.bias)))
        x = self.attention(x, style.keys, style.values)
        return _tail(self.conv2, x, last, self.reach)


class PlainBlock(nn.Module):
    """A level without style: one STConv."""

    def __init__(self, config: Config, level: int) -> None:
        super().__init__()
        self.conv = config.conv(level, config.width(level), config.width(level - 1))
        self.reach = config.taps[level - 1] // 2

    def forward(self, x: Tensor, style: None = None, last: int | None = None) -> Tensor:
        return _tail(self.conv, leaky(x), last, self.reach)


class Decoder(nn.Module):
    """D (Sec. 4.4, Eq. 7): from G3 back to G1, taking in the style on the way."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.blocks = nn.ModuleDict()
        for level in reversed(LEVELS):
            self.blocks[str(level)] = (BPStyleNet if level in config.style_levels else PlainBlock)(config, level)
        self.unpools = nn.ModuleDict({str(level): Unpool(LEVELS[level], LEVELS[level - 1]) for level in (3, 2)})
        self.head = nn.Linear(config.stem, FEATURES)
        self.style_levels = config.style_levels

    def style_side(self, style: list[Tensor]) -> dict[int, PartStyle]:
        """Style features of G1, G2, G3 -> what each level with a BP-StyleNet needs of them, computed once a style."""
        return {level: self.blocks[str(level)].style_side(style[level - 1]) for level in self.style_levels}

    def forward(self, content: Tensor, style: dict[int, PartStyle], last: int | None = None) -> Tensor:
        """(5, B, T / 4, C3) -> motion (21, B, T, 15), or its `last` samples alone, without computing the others."""
        # The samples wanted of each level's block. G2 normalizes and attends over all of G3's output: it is never cut.
        needed = {1: last, 2: None if last is None else (last + self.blocks["1"].reach + 1) // 2, 3: None}
        x = content
        for level in reversed(LEVELS):
            x = self.blocks[str(level)](x, style.get(level), needed[level])
            x = self.unpools[str(level)](x) if level > 1 else x
        return self.head(leaky(x))


class MotionPuzzle(nn.Module):
    """The whole network, and the statistics that scale the features of `sim.features` for it."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.config = config
        self.style_encoder = StyleEncoder(config)
        self.content_encoder = ContentEncoder(config)
        self.decoder = Decoder(config)
        self.register_buffer("mean", torch.zeros(21, 1, 1, FEATURES))
        self.register_buffer("deviation", torch.ones(21, 1, 1, FEATURES))

    def set_statistics(self, mean: np.ndarray, deviation: np.ndarray) -> None:
        """Mean and deviation of the training features, (21, 15) each."""
        self.mean.copy_(torch.as_tensor(mean, dtype=torch.float32)[:, None, None])
        self.deviation.copy_(torch.as_tensor(deviation, dtype=torch.float32)[:, None, None])

    def normalize(self, features: Tensor) -> Tensor:
        """(B, T, 21, 15) as `sim.features` has them -> (21, B, T, 15) as the networks want them."""
        return (features.permute(2, 0, 1, 3) - self.mean) / self.deviation

    def restore(self, motion: Tensor) -> Tensor:
        """The inverse of `normalize`."""
        return (motion * self.deviation + self.mean).permute(1, 2, 0, 3)

    def encode_style(self, motion: Tensor) -> dict[int, PartStyle]:
        """Normalized style clip (21, B, T, 15), T a multiple of 4 -> the style by level."""
        return self.decoder.style_side(self.style_encoder(motion))

    def parameter_count(self) -> int:
        return sum(p.numel() for p in self.parameters())

    def settings(self) -> dict:
        """The configuration as plain values, for a weight file's header."""
        return asdict(self.config)


def mix_parts(own: dict[int, PartStyle], other: dict[int, PartStyle], use_other: Tensor) -> dict[int, PartStyle]:
    """Each part from one style or the other (Alg. 1). use_other: (5, B) of bool."""
    pick = use_other[:, :, None]
    return {level: PartStyle(*(torch.where(pick if a.dim() == 3 else pick[..., None], b, a)
                               for a, b in zip(own[level], other[level])))
            for level in own}


def _tail(conv: STConv, x: Tensor, last: int | None, reach: int) -> Tensor:
    """conv(x), or only its `last` samples, computed from the samples that they can see."""
    return conv(x) if last is None else conv(x[:, :, -(last + reach):])[:, :, -last:]
