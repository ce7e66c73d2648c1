"""Generative Human Motion Stylization in Latent Space (Guo et al., ICLR 2024): a motion autoencoder, and between its
two halves a content code, a probabilistic style code and a generator with AdaIN. Sizes are ours: the paper's are not at
hand."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from sim.body.skeleton import JOINT_COUNT
from sim.motion.features import LAYOUT
from stylizer.data.domains import DomainBatch
from stylizer.networks.blocks import (
    BODY,
    AdaIN,
    InstanceNorm,
    ResBlock,
    by_joint,
    conv,
    doubling,
    for_each,
    halving,
    newest,
    pool,
    stack,
    whole,
)
from stylizer.networks.layers import leaky
from stylizer.systems.motion_puzzle.objective import Recipe
from stylizer.systems.whole_body import HIPS, Restyled, WholeBody

LOCAL = slice(LAYOUT["position"].start, LAYOUT["velocity"].stop)  # P: all of a joint's features but the root's
PLACE, AXES = LAYOUT["position"], LAYOUT["rotation"]
SPREAD = (-8.0, 4.0)  # bounds of a log variance
FIRST_STAGE = 0.35  # share of the time in which the autoencoder and the regressor learn


@dataclass(frozen=True)
class Config:
    labels: tuple[str, ...] = ()  # style labels sl; none in the unsupervised scheme
    window: int = 32  # samples at 30 Hz: T
    pose: tuple[int, int] = (192, 192)  # channels of the autoencoder at T / 2, T / 4
    latent: int = 128  # D_z of a motion code
    width: int = 128  # channels of content encoder, style encoder and generator
    content: int = 8  # D_z^c of a content code; 64 let all of the style through
    code: int = 16  # D_z^s of a style code
    blocks: int = 2  # residual blocks of the content encoder, and of the generator
    taps: int = 5  # samples that the autoencoder's convolutions see; all others see 3
    variational: bool = False  # VAE (V) instead of AE (A), Sec. 3.1
    labelled: bool = True  # the supervised scheme; False: sl is dropped


CONFIGS = {
    "latent": Config(),
    "latent_unlabelled": Config(labelled=False),
    "latent_vae": Config(variational=True),
}
RECIPE = Recipe(
    {
        "pose": 1.0,
        "speed": 1.0,
        "size": 1e-3,
        "smooth": 1e-2,
        "spread": 1e-3,
        "root_velocity": 1.0,  # Sec. 3.1, 3.2.3
        "reconstruction": 1.0,
        "alignment": 0.1,
        "cycle": 1.0,
        "prior": 0.2,
    },  # lambda of Sec. 3.2.2
    batch=24,
    learning_rate=1e-3,
    momentum=0.9,
    average=0.998,
)


def kl(mean: Tensor, spread: Tensor, other: Tensor | None = None, other_spread: Tensor | None = None) -> Tensor:
    """Mean over (...) of the divergence of Gaussians with these means and log variances from others, or from N(0,
    I)."""
    other = torch.zeros_like(mean) if other is None else other
    other_spread = torch.zeros_like(spread) if other_spread is None else other_spread
    ratio = (spread.exp() + (mean - other).square()) / other_spread.exp()
    return 0.5 * (other_spread - spread + ratio - 1).mean()


class Encoder(nn.Module):
    """The autoencoder's E: convolutions that halve the time twice. variational: twice the channels, mean and log
    variance."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        widths = [JOINT_COUNT * LOCAL.stop, *config.pose]
        self.convs, self.halve = stack(widths, config.taps), halving()
        self.head = conv(BODY, config.pose[-1], config.latent * (2 if config.variational else 1), 3)

    def forward(self, pose: Tensor) -> Tensor:
        """P (1, B, T, 252) -> z (1, B, T / 4, D_z)"""
        for layer in self.convs:
            pose = self.halve(leaky(layer(pose)))
        return self.head(pose)


class Decoder(nn.Module):
    """The autoencoder's D: the way back."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        widths = [config.pose[-1], *config.pose[::-1]]
        self.stem, self.twice = conv(BODY, config.latent, config.pose[-1], 3), doubling()
        self.convs = stack(widths, config.taps)
        self.head = nn.Linear(config.pose[0], JOINT_COUNT * LOCAL.stop)

    def forward(self, z: Tensor) -> Tensor:
        """z (1, B, T / 4, D_z) -> P (1, B, T, 252)"""
        x = leaky(self.stem(z))
        for layer in self.convs:
            x = leaky(layer(self.twice(x)))
        return self.head(x)


class ContentEncoder(nn.Module):
    """E_c: a deterministic code that keeps time; IN erases what is global."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.stem = conv(BODY, config.latent, config.width, 3)
        self.blocks = nn.ModuleList(
            ResBlock(BODY, config.width, config.width, 3, lambda channels: InstanceNorm()) for _ in range(config.blocks)
        )
        self.head, self.norm = nn.Linear(config.width, config.content), InstanceNorm()

    def forward(self, z: Tensor) -> Tensor:
        """z (1, B, T_z, D_z) -> z_c (1, B, T_z, D_z^c)"""
        x = self.stem(z)
        for block in self.blocks:
            x = block(x)
        return self.norm(self.head(leaky(x)))


class StyleEncoder(nn.Module):
    """E_s: the Gaussian N_s(mu, sigma) of a motion's style, given its label."""

    def __init__(self, config: Config, labels: int) -> None:
        super().__init__()
        self.stem = conv(BODY, config.latent + labels, config.width, 3)
        self.block = ResBlock(BODY, config.width, config.width, 3)
        self.head = nn.Linear(config.width, 2 * config.code)

    def forward(self, z: Tensor, label: Tensor) -> tuple[Tensor, Tensor]:
        """z (1, B, T_z, D_z), one-hot (B, labels) -> mu, log sigma^2 (B, D_z^s)"""
        label = label[None, :, None].expand(-1, -1, z.shape[2], -1)
        x = self.block(self.stem(torch.cat([z, label], dim=3)))
        mean, spread = self.head(pool(leaky(x))).chunk(2, dim=1)
        return mean, spread.clamp(*SPREAD)


class Generator(nn.Module):
    """G: a motion code from a content code, with the style code and label injected by AdaIN."""

    def __init__(self, config: Config, labels: int) -> None:
        super().__init__()
        style = config.code + labels
        self.stem = conv(BODY, config.content, config.width, 3)
        self.blocks = nn.ModuleList(
            ResBlock(BODY, config.width, config.width, 3, lambda channels: AdaIN(style, channels))
            for _ in range(config.blocks)
        )
        self.norm = AdaIN(style, config.width)
        self.head = conv(BODY, config.width, config.latent, 3)

    def forward(self, content: Tensor, style: Tensor) -> Tensor:
        """z_c (1, B, T_z, D_z^c), z_s and label (B, D_z^s + labels) -> z (1, B, T_z, D_z)"""
        x = self.stem(content)
        for block in self.blocks:
            x = block(x, style)
        return self.head(leaky(self.norm(x, style)))


class Regressor(nn.Module):
    """Sec. 3.2.3: the root's velocity x, z and turn rate from the local motion alone."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.convs = stack([JOINT_COUNT * LOCAL.stop, width, width], 5)
        self.head = nn.Linear(width, 3)

    def forward(self, pose: Tensor) -> Tensor:
        """P (1, B, T, 252) -> (1, B, T, 3), normalized"""
        for layer in self.convs:
            pose = leaky(layer(pose))
        return self.head(pose)


class Latent(WholeBody):
    """Autoencoder, style and content encoders, generator and regressor. A code here is z_s with its one-hot label."""

    KIND, CONFIG = "latent", Config

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self.NOISE = config.code
        labels = len(config.labels) if config.labelled else 0
        self.encoder, self.pose_decoder = Encoder(config), Decoder(config)
        self.content_encoder, self.style_encoder = ContentEncoder(config), StyleEncoder(config, labels)
        self.generator, self.regressor = Generator(config, labels), Regressor(config.width)

    def one_hot(self, domain: Tensor) -> Tensor:
        """sl: (B,) -> (B, labels); without labels (B, 0)."""
        labels = len(self.config.labels)
        return (
            F.one_hot(domain, labels).float()
            if self.config.labelled
            else torch.zeros(len(domain), 0, device=domain.device)
        )

    def motion_code(self, motion: Tensor) -> Tensor:
        """z, the mean of a VAE's: normalized windows (21, B, T, 15) -> (1, B, T / 4, D_z)."""
        return self.encoder(whole(motion[..., LOCAL]))[..., : self.config.latent]

    def encode(self, motion: Tensor, domain: Tensor) -> Tensor:
        label = self.one_hot(domain)
        return torch.cat([self.style_encoder(self.motion_code(motion), label)[0], label], dim=1)

    def code_from_noise(self, noise: Tensor, domain: Tensor) -> Tensor:
        """A label's style, or, in the unsupervised scheme, any: z_s from the prior N(0, I) (Sec. 3.3 b, d)."""
        return torch.cat([noise[:, : self.config.code], self.one_hot(domain)], dim=1)

    def local(self, motion: Tensor, codes: Tensor) -> Tensor:
        """P (1, n B, T, 252) of normalized windows (21, B, T, 15), each in n of the styles of codes (n B, C)."""
        content = self.content_encoder(self.motion_code(motion))
        return self.pose_decoder(self.generator(for_each(content, codes), codes))

    def restyled(self, motion: Tensor, codes: Tensor) -> Restyled:
        result = by_joint(self.local(motion, codes)) * self.deviation[..., LOCAL] + self.mean[..., LOCAL]
        return Restyled(result[..., AXES], result[HIPS : HIPS + 1, ..., PLACE])

    def predict_root_velocity(self, motion: Tensor) -> Tensor:
        """(B, T, 3) the root's velocity x, z in metres and turn rate in radians a second that fit normalized local
        motion."""
        root_velocity = self.regressor(whole(motion[..., LOCAL]))[0]
        return root_velocity * self.deviation[HIPS, ..., LAYOUT["root"]] + self.mean[HIPS, ..., LAYOUT["root"]]


class Objective(nn.Module):
    """Two stages: the autoencoder with the regressor learns from all motion, then the stylization between its halves,
    which stay as they are (Eq. 1 to 4)."""

    PHASES = ("autoencoder", "stylization")

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.system = Latent(config)

    def learned(self) -> dict[str, list[tuple[list[nn.Parameter], float]]]:
        """What each stage changes, and how quickly."""
        first: list[nn.Parameter] = []
        second: list[nn.Parameter] = []
        for name, parameter in self.system.named_parameters():
            (first if name.startswith(("encoder.", "pose_decoder.", "regressor.")) else second).append(parameter)
        return {"autoencoder": [(first, 1.0)], "stylization": [(second, 1.0)]}

    def schedule(self, progress: float) -> tuple[tuple[str, ...], float]:
        """The stage that is on and how far it is."""
        if progress < FIRST_STAGE:
            return self.PHASES[:1], progress / FIRST_STAGE
        return self.PHASES[1:], (progress - FIRST_STAGE) / (1 - FIRST_STAGE)

    def forward(self, phase: str, x: DomainBatch[Tensor], step: int) -> dict[str, Tensor]:
        """The stage's terms of one batch."""
        return self.autoencoder_losses(x) if phase == "autoencoder" else self.stylization_losses(x)

    def autoencoder_losses(self, x: DomainBatch[Tensor]) -> dict[str, Tensor]:
        """Sec. 3.1 and 3.2.3."""
        model = self.system
        motion = torch.cat([x.any, x.source], dim=1)
        pose = whole(motion[..., LOCAL])
        z, *spread = model.encoder(pose).split(model.config.latent, dim=3)
        if spread:
            spread = spread[0].clamp(*SPREAD)
            regularized = {"spread": kl(z, spread)}
            z = z + self.noise_like(z, x.noise) * (spread / 2).exp()
        else:
            regularized = {"size": z.abs().mean(), "smooth": z.diff(dim=2).abs().mean()}
        rebuilt = model.pose_decoder(z)
        root_velocity = motion[:1, ..., LAYOUT["root"]]
        miss = rebuilt - pose
        return {
            "pose": (miss.abs() * newest(pose)).mean(),
            "speed": miss.diff(dim=2).abs().mean(),
            **regularized,
            "root_velocity": (model.regressor(pose) - root_velocity).abs().mean(),
        }

    def noise_like(self, z: Tensor, noise: Tensor) -> Tensor:
        """Standard normal numbers in the shape of z, from a generator that the batch's own numbers seed."""
        generator = torch.Generator().manual_seed(int(noise[0, :2].double().abs().sum() * 1e9))
        return torch.randn(z.shape, generator=generator).to(z.device)

    def stylization_losses(self, x: DomainBatch[Tensor]) -> dict[str, Tensor]:
        """Eq. 1 to 4 for z^1, z^2 of one sequence and z^3 of any other."""
        model, size = self.system, x.source.shape[1]
        motion = torch.cat([x.source, x.sibling, x.target], dim=1)
        pose = whole(motion[..., LOCAL])
        with torch.no_grad():
            z = model.motion_code(motion)
        label, other = model.one_hot(x.source_domain), model.one_hot(x.target_domain)
        labels = torch.cat([label, label, other])
        content = model.content_encoder(z)
        mean, spread = model.style_encoder(z, labels)
        noise = x.noise[:, : model.config.code]
        style = torch.cat([mean + (spread / 2).exp() * noise.repeat(3, 1), labels], dim=1)
        second, third = slice(size, 2 * size), slice(2 * size, None)

        made = model.generator(
            torch.cat([content[:, : 2 * size], content[:, second]], dim=1), torch.cat([style[: 2 * size], style[third]])
        )
        rebuilt, transferred = made[:, : 2 * size], made[:, 2 * size :]  # z^1 and z^2 again, and z^t
        mean_t, spread_t = model.style_encoder(transferred, other)
        style_t = torch.cat([mean_t + (spread_t / 2).exp() * noise, other], dim=1)
        cycled = model.generator(
            torch.cat([model.content_encoder(transferred), content[:, third]], dim=1),
            torch.cat([style[second], style_t]),
        )
        return {
            "reconstruction": self.apart(rebuilt, z[:, : 2 * size], pose[:, : 2 * size]),  # Eq. 1
            "alignment": kl(mean[:size], spread[:size], mean[second], spread[second]),  # Eq. 2
            "cycle": self.apart(cycled, z[:, size:], pose[:, size:]),  # Eq. 3
            "prior": kl(torch.cat([mean, mean_t]), torch.cat([spread, spread_t])),  # Eq. 4
        }

    def apart(self, made: Tensor, z: Tensor, pose: Tensor) -> Tensor:
        """L1 in latent and in motion space."""
        return (made - z).abs().mean() + ((self.system.pose_decoder(made) - pose).abs() * newest(pose)).mean()
