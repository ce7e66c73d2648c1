"""The forms of Motion Puzzle as settings of one network: the paper's (Table 3, App. A.1), ours, and what ablations take
away.

The names of `CONFIGS` are what training, evaluation and bench know."""

from dataclasses import dataclass, replace
from typing import Any

from torch import nn

from sim.body.skeleton import JOINT_COUNT
from stylizer.networks.graph import LEVELS
from stylizer.networks.layers import BPAdaIN, JointLinear, STConv

RESIDUAL = 4  # the number of the decoder's residual block above G3, beside those of its levels, 3 to 1


@dataclass(frozen=True)
class Config:
    stem: int = 64  # channels of the 1x1 convolutions at both ends
    channels: tuple[int, ...] = (128, 256, 512)  # at G1, G2, G3
    distances: tuple[int, ...] = (3, 2, 2)  # K, the farthest hop that a spatial convolution sees, at G1, G2, G3
    taps: tuple[int, ...] = (7, 5, 5)  # samples that a temporal convolution sees, at G1, G2, G3
    residual_taps: int = 3  # the same in the residual blocks at G3; 0: no residual blocks
    style_levels: tuple[int, ...] = (3, 2, 1)  # levels of the decoder that have a BP-StyleNet, coarse to fine
    style_statistics: int = 1  # what BP-AdaIN's scale and bias are made of: 1 the style's mean, 2 its deviation too
    by_part: bool = True  # BP-AdaIN; False: AdaIN over the whole body (Sec. 7.2)
    attention: bool = True  # BP-ATN (Sec. 7.2)
    own_ends: bool = False  # each joint has weights of its own in the 1x1 convolutions at both ends
    root_units: int = 0  # hidden units by which the content's root velocity conditions BP-AdaIN; 0: none
    residual_output: bool = (
        False  # the content is decoded in its own style as well, and how the two outputs differ is put on
    )

    def conv(self, level: int, channels_in: int, channels_out: int, taps: int = 0) -> STConv:
        """A spatial-temporal convolution on graph G_level with this table's kernel."""
        return STConv(LEVELS[level], channels_in, channels_out, self.distances[level - 1], taps or self.taps[level - 1])

    def adain(self, level: int) -> BPAdaIN:
        """BP-AdaIN on graph G_level."""
        return BPAdaIN(LEVELS[level], self.width(level), self.by_part, self.style_statistics)

    def end(self, channels_in: int, channels_out: int) -> JointLinear | nn.Linear:
        """The 1x1 convolution at either end."""
        return (
            JointLinear(JOINT_COUNT, channels_in, channels_out)
            if self.own_ends
            else nn.Linear(channels_in, channels_out)
        )

    def width(self, level: int) -> int:
        """Channels at G_level; G_0 is the stem."""
        return self.channels[level - 1] if level else self.stem

    @property
    def styled(self) -> tuple[int, ...]:
        """The numbers of the decoder's blocks that take in a style."""
        return (*self.style_levels, *([RESIDUAL] if self.residual_taps else []))


FULL = Config()  # Table 3
PAPER_SLIM = replace(FULL, residual_taps=0, style_levels=(3, 2))  # Sec. 7.3, App. A.1: the paper's real-time system
NARROW: dict[str, Any] = {"stem": 20, "channels": (40, 80, 160)}  # as wide as a core trains in an hour
# What measurement added to the paper's networks.
ADDED: dict[str, Any] = {"style_statistics": 2, "own_ends": True, "root_units": 32, "residual_output": True}
SLIM = replace(PAPER_SLIM, **NARROW, **ADDED)
CONFIGS = {
    "full": FULL,
    "paper_slim": PAPER_SLIM,
    "paper_narrow": replace(PAPER_SLIM, **NARROW),
    "large": replace(FULL, **NARROW, **ADDED),
    "slim": SLIM,
    "slim_no_attention": replace(SLIM, attention=False),
    "slim_whole_body_adain": replace(SLIM, by_part=False),
}
