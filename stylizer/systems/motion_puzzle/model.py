"""Motion Puzzle (Jang et al., ACM TOG 41(3), 2022): style transfer by body part. Table 3 and the real-time system's
form.

Feature maps are (vertex, batch, time, channel). What can be set, and the forms that have names:
stylizer/systems/motion_puzzle/config.py."""

import torch
from torch import Tensor, nn

from sim.body.skeleton import PARTS
from sim.motion.features import FEATURES, LAYOUT
from stylizer.networks.graph import LEVELS
from stylizer.networks.layers import BPATN, BlockFeatures, BPAdaIN, Pool, STConv, Unpool, leaky, normalize, of_kind
from stylizer.networks.normalization import Scaled
from stylizer.systems.motion_puzzle.config import RESIDUAL, Config
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures, cat_batch

ROOT = LAYOUT["root"]
ROOT_SIZE = ROOT.stop - ROOT.start


def block_features(style: StyleFeatures, number: int) -> BlockFeatures:
    """What a style says to one block of the decoder."""
    return BlockFeatures(*(style[f"{number}.{field}"] for field in BlockFeatures._fields))


def named(number: int, features: BlockFeatures) -> StyleFeatures:
    """The inverse of `block_features`."""
    return {f"{number}.{field}": values for field, values in features._asdict().items()}


class ResBlock(nn.Module):
    """Two STConv around which the feature passes on (Table 3 a, b; the form of Liu et al. 2019)."""

    def __init__(self, config: Config, normalize: bool) -> None:
        super().__init__()
        self.prepare = _instance_norm if normalize else nn.Identity()
        width = config.width(3)
        self.conv1, self.conv2 = (config.conv(3, width, width, config.residual_taps) for _ in range(2))

    def forward(self, x: Tensor) -> Tensor:
        """(5, B, T, C) -> the same shape"""
        return x + self.conv2(self.prepare(leaky(self.conv1(self.prepare(x)))))


class Encoder(nn.Module):
    """A 1x1 convolution, one STConv for each graph, G1 to G3, and a residual block (Table 3 a, b)."""

    def __init__(self, config: Config, normalize: bool) -> None:
        super().__init__()
        self.prepare = _instance_norm if normalize else nn.Identity()
        self.stem = config.end(FEATURES, config.stem)
        self.convs = nn.ModuleList(config.conv(level, config.width(level - 1), config.width(level)) for level in LEVELS)
        self.pools = nn.ModuleList([nn.Identity(), Pool(LEVELS[1], LEVELS[2]), Pool(LEVELS[2], LEVELS[3])])
        self.residual = ResBlock(config, normalize) if config.residual_taps else nn.Identity()

    def levels(self, motion: Tensor) -> list[Tensor]:
        """(21, B, T, 15) -> features of G1, G2, G3, (V, B, T / 1 2 4, C); T is a multiple of 4."""
        x, levels = self.stem(motion), []
        for pool, conv in zip(self.pools, self.convs):
            x = leaky(conv(self.prepare(pool(x))))
            levels.append(x)
        return [*levels[:-1], self.residual(x)]


class StyleEncoder(Encoder):
    """E_s (Sec. 4.2): one style feature for each graph (Eq. 3)."""

    def __init__(self, config: Config) -> None:
        super().__init__(config, normalize=False)

    def forward(self, motion: Tensor) -> list[Tensor]:
        """What `levels` says."""
        return self.levels(motion)


class ContentEncoder(Encoder):
    """E_c (Sec. 4.3): instance normalization before every convolution takes the style out; G3's is kept (Eq. 6)."""

    def __init__(self, config: Config) -> None:
        super().__init__(config, normalize=True)

    def forward(self, motion: Tensor) -> Tensor:
        """(21, B, T, 15) -> (5, B, T / 4, C3)"""
        return self.levels(motion)[-1]


class BPResBlock(nn.Module):
    """The decoder's residual block at G3, with BP-AdaIN for normalization (Table 3 c)."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        width = config.width(3)
        self.adains = nn.ModuleList(config.adain(3) for _ in range(2))
        self.convs = nn.ModuleList(config.conv(3, width, width, config.residual_taps) for _ in range(2))

    def style_side(self, style: Tensor) -> BlockFeatures:
        """Both BP-AdaIN's scales and biases side by side; there are no tokens to attend to."""
        scales, biases = (
            torch.cat(both, dim=2)
            for both in zip(*(of_kind(BPAdaIN, adain).style_side(style) for adain in self.adains))
        )
        none = style.new_zeros(*scales.shape[:2], 0, style.shape[-1])
        return BlockFeatures(scales, biases, none, none)

    def forward(self, x: Tensor, style: BlockFeatures) -> Tensor:
        """(5, B, T, C) -> the same shape"""
        y = x
        for adain, conv, scale, bias in zip(self.adains, self.convs, style.scale.chunk(2, 2), style.bias.chunk(2, 2)):
            y = conv(leaky(adain(y, scale, bias)))
        return x + y


class BPStyleNet(nn.Module):
    """BP-AdaIN, STConv, BP-ATN, STConv on one graph (Eq. 10, 14; Table 3 d)."""

    def __init__(self, config: Config, level: int) -> None:
        super().__init__()
        channels, graph = config.width(level), LEVELS[level]
        self.adain = config.adain(level)
        self.conv1 = config.conv(level, channels, channels)
        self.attention = BPATN(graph, channels) if config.attention else None
        self.conv2 = config.conv(level, channels, config.width(level - 1))
        self.reach = config.taps[level - 1] // 2

    def style_side(self, style: Tensor) -> BlockFeatures:
        """All that depends on the style alone, from its feature (V, B, S, C)."""
        scale, bias = self.adain.style_side(style)
        none = style.new_zeros(*scale.shape[:2], 0, style.shape[-1])
        return BlockFeatures(scale, bias, *(self.attention.style_side(style) if self.attention else (none, none)))

    def forward(self, x: Tensor, style: BlockFeatures, last: int | None = None) -> Tensor:
        """(V, B, T, C) -> (V, B, T, C of the finer graph); only the `last` samples where a number is given."""
        x = self.conv1(leaky(self.adain(x, style.scale, style.bias)))
        if self.attention:
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


class RootCondition(nn.Module):
    """What the content's root velocity adds to BP-AdaIN's scales and biases.

    Instance normalization takes speed and direction out of the content, but a run is no quick walk, and the same style
    looks another when it backs or turns."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.hidden = nn.Linear(2 * ROOT_SIZE, config.root_units)
        self.sides = nn.ModuleDict(
            {
                str(number): nn.Linear(
                    config.root_units,
                    len(PARTS) * 2 * config.width(min(number, 3)) * (2 if number == RESIDUAL else 1),
                )
                for number in config.styled
            }
        )

    def forward(self, motion: Tensor, style: StyleFeatures) -> StyleFeatures:
        """The style (batch of B or 1) at the root velocity of normalized motion (21, B, T, 15)."""
        root = motion[0, ..., ROOT]
        hidden = leaky(self.hidden(torch.cat([root.mean(dim=1), root[:, -1]], dim=1)))
        result: StyleFeatures = {}
        for number, side in self.sides.items():
            scale, bias = side(hidden).view(len(hidden), len(PARTS), -1).transpose(0, 1).chunk(2, dim=2)
            result |= {
                f"{number}.scale": style[f"{number}.scale"] + scale,
                f"{number}.bias": style[f"{number}.bias"] + bias,
            }
        return style | result


class Decoder(nn.Module):
    """D (Sec. 4.4, Eq. 7): from G3 back to G1, taking in the style on the way (Table 3 c)."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.config = config
        self.residual = BPResBlock(config) if config.residual_taps else None
        self.blocks = nn.ModuleDict()
        for level in reversed(LEVELS):
            self.blocks[str(level)] = (BPStyleNet if level in config.style_levels else PlainBlock)(config, level)
        self.unpools = nn.ModuleDict({str(level): Unpool(LEVELS[level], LEVELS[level - 1]) for level in (3, 2)})
        self.head = config.end(config.stem, FEATURES)

    def style_side(self, style: list[Tensor]) -> StyleFeatures:
        """A style clip's features of G1, G2, G3 -> what the decoder needs of them, computed once a style."""
        result = named(RESIDUAL, self.residual.style_side(style[-1])) if self.residual else {}
        for level in self.config.style_levels:
            result |= named(level, of_kind(BPStyleNet, self.blocks[str(level)]).style_side(style[level - 1]))
        return result

    def forward(self, content: Tensor, style: StyleFeatures, last: int | None = None) -> Tensor:
        """(5, B, T / 4, C3) -> motion (21, B, T, 15), or its `last` samples alone, without computing the others."""
        x = self.residual(content, block_features(style, RESIDUAL)) if self.residual else content
        for level in reversed(LEVELS):
            of_level = block_features(style, level) if level in self.config.style_levels else None
            x = self.blocks[str(level)](x, of_level, self._needed(level, last))
            x = self.unpools[str(level)](x) if level > 1 else x
        with torch.autocast(x.device.type, enabled=False):  # a few channels that everything hangs on
            return self.head(leaky(x.float()))

    def _needed(self, level: int, last: int | None) -> int | None:
        """How many of a block's last samples are wanted. A block that normalizes or attends over time needs all of
        them."""
        if last is None or level == 3 or (level == 2 and 1 in self.config.style_levels):
            return None
        return last if level == 1 else (last + of_kind(PlainBlock, self.blocks["1"]).reach + 1) // 2


class MotionPuzzle(Scaled):
    """The whole network."""

    KIND, CONFIG = "motion-puzzle", Config

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self.style_encoder = StyleEncoder(config)
        self.content_encoder = ContentEncoder(config)
        self.decoder = Decoder(config)
        self.root_condition = RootCondition(config) if config.root_units else None

    def encode_style(self, motion: Tensor) -> StyleFeatures:
        """Normalized style clip (21, B, T, 15), T a multiple of 4 -> its style."""
        return self.decoder.style_side(self.style_encoder(motion))

    def forward(
        self, motion: Tensor, style: StyleFeatures, own: StyleFeatures, last: int | None = None
    ) -> tuple[Tensor, Tensor | None]:
        """Eq. 7: normalized motion (21, B, T, 15) in another style, and where the configuration says `residual_output`
        in its own too; all samples or the `last` ones.

        The second shows what of the content's own movement the decoder loses: what is put on is how the two differ."""
        content = self.content_encoder(motion)
        if not self.config.residual_output:
            (styled,) = self.decode_styles(motion, content, [style], last)
            return styled, None
        styled, rebuilt = self.decode_styles(motion, content, [style, own], last)
        return styled, rebuilt

    def decode_styles(
        self, motion: Tensor, content: Tensor, styles: list[StyleFeatures], last: int | None = None
    ) -> list[Tensor]:
        """Motion (21, B, T, 15), or its `last` samples, in each of some styles, from normalized motion and its content
        feature (batches of B)."""
        styled = cat_batch([self.condition_on_root(motion, style) for style in styles])
        return list(self.decoder(content.repeat(1, len(styles), 1, 1), styled, last).chunk(len(styles), dim=1))

    def condition_on_root(self, motion: Tensor, style: StyleFeatures) -> StyleFeatures:
        """The style as the decoder wants it for this motion."""
        return self.root_condition(motion, style) if self.root_condition else style


def _tail(conv: STConv, x: Tensor, last: int | None, reach: int) -> Tensor:
    """conv(x), or only its `last` samples, computed from the samples that they can see."""
    return conv(x) if last is None else conv(x[:, :, -(last + reach) :])[:, :, -last:]


def _instance_norm(x: Tensor) -> Tensor:
    """Over vertices and time together: takes the level and the liveliness out, keeps the posture's shape."""
    return normalize(x, (0, 2))
