"""Diverse Motion Stylization (Park et al., PACMCGIT 4(3), 2021): a graph-convolutional encoder-decoder, and style codes
by domain, from a clip or from noise. Table 3 of its appendix.

Joints turn by forward and up axes (6 numbers) where the paper has quaternions: 9 numbers a joint with its position, not
7."""

from dataclasses import dataclass
from typing import Callable

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from sim.motion.features import POSE_CHANNELS
from stylizer.data.domains import DomainBatch
from stylizer.networks.blocks import ROOTED, AdaIN, DomainHead, InstanceNorm, Plain, ResBlock, for_each, newest, pool
from stylizer.networks.graph import LEVELS
from stylizer.networks.layers import Unpool, leaky, normalize
from stylizer.systems.adversarial import Adversarial, slope_penalty
from stylizer.systems.motion_puzzle.objective import Recipe
from stylizer.systems.whole_body import HIPS, Restyled, WholeBody

CHANNELS = POSE_CHANNELS.stop  # position 3 and axes 6
PLACE, AXES = slice(0, 3), slice(3, CHANNELS)
SLOPE_EVERY = 8  # steps


@dataclass(frozen=True)
class Config:
    labels: tuple[str, ...] = ()  # the style domains
    window: int = 32  # samples at 30 Hz
    channels: tuple[int, int, int] = (64, 128, 256)  # at G1, G2, G3
    taps: int = 3  # samples that a convolution sees
    code: int = 64  # of a style code
    noise: int = 16  # of z
    hidden: tuple[int, int, int] = (256, 512, 1024)  # FC1, FC2, FC3 of the mapping network


CONFIGS = {
    "diverse": Config(channels=(24, 48, 96), hidden=(64, 128, 256)),  # what a processor can train in half an hour
    "diverse_full": Config(),  # Table 3
}
# lambda of Eq. 12. The paper's are all one; our cycle and identity are means over all numbers, and would be small
# beside it.
RECIPE = Recipe(
    {
        "adversarial": 1.0,
        "cycle": 3.0,
        "identity": 3.0,
        "style": 1.0,
        "diversity": -1.0,
        "real": 1.0,
        "fake": 1.0,
        "slope": 1.0,
    },
    batch=8,
    learning_rate=1e-3,
    momentum=0.0,
    average=0.998,
)
MAPPING_RATE = 0.2  # of F's learning rate in the others'; the paper's is far less, over 100,000 steps


def he(module: nn.Module) -> None:
    """He et al. 2015, with which App. A.2 starts: features, and so codes, begin of a size that matters."""
    if isinstance(module, nn.Linear):
        nn.init.kaiming_normal_(module.weight)
        if module.bias is not None:
            nn.init.zeros_(module.bias)


class Trunk(nn.Module):
    """1x1 convolution and two residual blocks down to G3 (Table 3 a, b, d): what G, E and D begin with."""

    def __init__(self, config: Config, norm: Callable[[int], nn.Module] = lambda channels: Plain()) -> None:
        super().__init__()
        self.stem = nn.Linear(CHANNELS, config.channels[0])
        pairs = zip(config.channels, config.channels[1:])
        self.blocks = nn.ModuleList(
            ResBlock(ROOTED[level], a, b, config.taps, norm, ROOTED[level + 1]) for level, (a, b) in enumerate(pairs, 1)
        )

    def forward(self, x: Tensor) -> list[Tensor]:
        """(21, B, T, 9) -> features of G1, G2, G3: (V, B, T / 1 2 4, C); T a multiple of 4."""
        levels = [self.stem(x)]
        for block in self.blocks:
            levels.append(block(levels[-1]))
        return levels


class Decoder(nn.Module):
    """G_dec (Eq. 3): residual blocks with AdaIN (Eq. 4) from G3 back to G1; skip connections bring the early layers'
    detail, normalized, so that they bring no style."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        pairs = list(zip(config.channels, config.channels[1:]))
        self.unpools = nn.ModuleList(Unpool(LEVELS[level + 1], LEVELS[level]) for level in (2, 1))
        self.blocks = nn.ModuleList(
            ResBlock(
                ROOTED[level],
                pairs[level - 1][1],
                pairs[level - 1][0],
                config.taps,
                lambda channels: AdaIN(config.code, channels),
            )
            for level in (2, 1)
        )
        self.head = nn.Linear(config.channels[0], CHANNELS)

    def forward(self, levels: list[Tensor], code: Tensor) -> Tensor:
        """Features of G1, G2, G3 and codes (B, code) -> (21, B, T, 9)"""
        x = normalize(levels[-1], (0, 2))
        for unpool, block, skip in zip(self.unpools, self.blocks, levels[-2::-1]):
            x = block(unpool(x), code) + normalize(skip, (0, 2))
        return self.head(leaky(x))


class DomainEncoder(nn.Module):
    """A trunk, the whole graph in one feature, and a linear branch a domain: the style encoder E (Eq. 5) with size =
    code, the discriminator D with size = 1. The feature is a mean over time, so any length will do."""

    def __init__(self, config: Config, size: int) -> None:
        super().__init__()
        width = config.channels[-1]
        self.trunk, self.global_conv = Trunk(config), nn.Linear(LEVELS[3].size * width, width)
        self.head = DomainHead(width, len(config.labels), size)
        self.apply(he)

    def forward(self, x: Tensor, domain: Tensor) -> Tensor:
        """(21, B, T, 9), (B,) -> (B, size)"""
        return self.head(leaky(self.global_conv(pool(leaky(self.trunk(x)[-1])))), domain)


class Mapping(nn.Module):
    """F (Eq. 6): a style code out of noise and a domain (Table 3 c)."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        first, second, third = config.hidden
        self.domains = len(config.labels)
        self.of_noise, self.of_domain = nn.Linear(config.noise, first), nn.Linear(self.domains, first)
        self.rest = nn.Sequential(
            nn.Linear(2 * first, second),
            nn.ReLU(),
            nn.Linear(second, third),
            nn.ReLU(),
            nn.Linear(third, config.code),
            nn.Tanh(),
        )
        self.apply(he)

    def forward(self, noise: Tensor, domain: Tensor) -> Tensor:
        """(B, noise), (B,) -> (B, code)"""
        one_hot = F.one_hot(domain, self.domains).float()
        return self.rest(torch.cat([self.of_noise(noise), self.of_domain(one_hot)], dim=1).relu())


class Diverse(WholeBody):
    """The motion stylizer G, the style encoder E and the mapping network F."""

    KIND, CONFIG = "diverse", Config

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self.NOISE = config.noise
        self.trunk = Trunk(config, lambda channels: InstanceNorm())  # G_enc (Eq. 2)
        self.decoder = Decoder(config)
        self.style_encoder = DomainEncoder(config, config.code)
        self.mapping = Mapping(config)

    def encode(self, motion: Tensor, domain: Tensor) -> Tensor:
        return self.style_encoder(motion[..., POSE_CHANNELS], domain)

    def code_from_noise(self, noise: Tensor, domain: Tensor) -> Tensor:
        return self.mapping(noise[:, : self.config.noise], domain)

    def stylize(self, motion: Tensor, codes: Tensor) -> Tensor:
        """G: normalized position and axes (21, n B, T, 9) of motion (21, B, T, 9 or more), each in n of the styles of
        codes (n B, code)."""
        return self.decoder([for_each(level, codes) for level in self.trunk(motion[..., POSE_CHANNELS])], codes)

    def restyled(self, motion: Tensor, codes: Tensor) -> Restyled:
        result = self.stylize(motion, codes) * self.deviation[..., POSE_CHANNELS] + self.mean[..., POSE_CHANNELS]
        return Restyled(result[..., AXES], result[HIPS : HIPS + 1, ..., PLACE])


class Objective(Adversarial):
    """Eq. 7 to 12, in two turns. Codes come from F and from E in alternate steps (App. A.2). As in StarGAN v2, whose
    scheme this is, Eq. 7's generator side is the non-saturating one, and the discriminator's slope at real motion is
    held low."""

    system: Diverse
    discriminator: DomainEncoder

    def __init__(self, config: Config) -> None:
        super().__init__(Diverse(config), DomainEncoder(config, 1))

    def learned(self) -> dict[str, list[tuple[list[nn.Parameter], float]]]:
        """What each phase changes, and how quickly."""
        mapping = list(self.system.mapping.parameters())
        rest = [p for name, p in self.system.named_parameters() if not name.startswith("mapping.")]
        return {
            "discriminator": [(list(self.discriminator.parameters()), 1.0)],
            "generator": [(rest, 1.0), (mapping, MAPPING_RATE)],
        }

    def two_codes(self, x: DomainBatch[Tensor], step: int) -> tuple[Tensor, Tensor]:
        """s_1, s_2 of the target's domain: of two noises, or of two reference motions."""
        model, n = self.system, self.system.config.noise
        if step % 2:
            return model.encode(x.target, x.target_domain), model.encode(x.target_kin, x.target_domain)
        first, second = (model.code_from_noise(z, x.target_domain) for z in (x.noise[:, :n], x.noise[:, n : 2 * n]))
        return first, second

    def discriminator_losses(self, x: DomainBatch[Tensor], step: int) -> dict[str, Tensor]:
        """D's side of Eq. 7."""
        with torch.no_grad():
            fake = self.system.stylize(x.source, self.two_codes(x, step)[0])
        slope = step // 2 % SLOPE_EVERY == 0
        real = x.target[..., POSE_CHANNELS].clone().requires_grad_(slope)
        score = self.discriminator(real, x.target_domain)
        terms = {
            "real": F.softplus(-score).mean(),
            "fake": F.softplus(self.discriminator(fake, x.target_domain)).mean(),
        }
        if slope:
            terms["slope"] = slope_penalty(score, real)
        return terms

    def generator_losses(self, x: DomainBatch[Tensor], step: int) -> dict[str, Tensor]:
        """G's, E's and F's side of Eq. 7, and Eq. 8 to 11."""
        model, motion = self.system, x.source[..., POSE_CHANNELS]
        first, second = self.two_codes(x, step)
        own = model.encode(x.source, x.source_domain)
        fake, other, same = model.stylize(motion, torch.cat([first, second, own])).chunk(3, dim=1)
        cycled = model.stylize(fake, own)
        return {
            "adversarial": F.softplus(-self.discriminator(fake, x.target_domain)).mean(),  # Eq. 7
            "cycle": ((motion - cycled).abs() * newest(motion)).mean(),  # Eq. 8, by L1
            "identity": ((motion - same).abs() * newest(motion)).mean(),  # Eq. 9, by L1
            "style": (first - model.encode(fake, x.target_domain)).abs().mean(),  # Eq. 10
            "diversity": (fake - other.detach()).abs().mean(),  # Eq. 11, which Eq. 12 subtracts
        }
