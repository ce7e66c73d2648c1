"""Unpaired Motion Style Transfer from Video to Animation (Aberman et al., ACM TOG 39(4), 2020): content by temporal
convolutions, style as one code from 3-D positions or from their 2-D projection.

Where the paper has unit quaternions, joints turn by forward and up axes (6 numbers), which have no double cover."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from sim.body.skeleton import INDEX, JOINT_COUNT
from sim.body.torch_kinematics import forward_kinematics
from sim.motion.features import LAYOUT
from stylizer.data.domains import DomainBatch
from stylizer.networks.blocks import (
    BODY,
    AdaIN,
    DomainHead,
    InstanceNorm,
    ResBlock,
    by_joint,
    doubling,
    for_each,
    halving,
    newest,
    pool,
    stack,
    whole,
)
from stylizer.networks.layers import leaky
from stylizer.systems.adversarial import Adversarial, slope_penalty
from stylizer.systems.motion_puzzle.objective import Recipe
from stylizer.systems.whole_body import Restyled, WholeBody

POSITION, ROTATION = LAYOUT["position"], LAYOUT["rotation"]
TURNS = JOINT_COUNT * 6
# What both our skeleton and a pose detector know. Hips and neck are where detectors have them: between the joints of
# the legs, and of the arms.
POINTS = (
    "Hips",
    "LeftUpLeg",
    "LeftLeg",
    "LeftFoot",
    "RightUpLeg",
    "RightLeg",
    "RightFoot",
    "Neck",
    "Head",
    "LeftArm",
    "LeftForeArm",
    "LeftHand",
    "RightArm",
    "RightForeArm",
    "RightHand",
)
POINT_SCALE = 0.5  # metres that count as 1
YAWS, SCALES = (-torch.pi / 2, torch.pi / 2), (0.8, 1.2)  # of the views that training looks from (Sec. 3.3)
MARGIN = 5.0  # delta of Eq. 7
END = 8  # samples at the end of a window that D sees once more by themselves


@dataclass(frozen=True)
class Config:
    labels: tuple[str, ...] = ()  # S, the style classes of the discriminator
    window: int = 32  # samples at 30 Hz
    content: tuple[int, int] = (96, 144)  # channels of E_C at T / 2, T / 4; the decoder mirrors them
    style: tuple[int, int] = (96, 144)  # channels of E_S
    discriminator: tuple[int, int] = (64, 96)  # channels of D
    code: int = 144  # C of z_s
    taps: int = 7  # samples that a convolution sees
    views: int = 5  # projections of a motion that E_S^2D is shown in a step


CONFIGS = {"unpaired": Config()}
# alpha of Eq. 8; Eq. 3 is here a mean over all numbers, which makes it small beside the paper's.
RECIPE = Recipe(
    {
        "content": 5.0,
        "adversarial": 1.0,
        "feature": 0.5,
        "joint": 0.3,
        "triplet": 0.3,
        "real": 1.0,
        "fake": 1.0,
        "slope": 1.0,
    },
    batch=16,
    learning_rate=1e-3,
    momentum=0.5,
    average=0.998,
)
DISCRIMINATOR_RATE = 0.3  # of D's learning rate in the others': it has the easier task


class ContentEncoder(nn.Module):
    """E_C: convolutions that halve the time, and a residual block; IN throughout strips the code of style."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.convs, self.halve = stack([TURNS, *config.content], config.taps), halving()
        self.norm = InstanceNorm()
        self.residual = ResBlock(
            BODY, config.content[-1], config.content[-1], config.taps, lambda channels: InstanceNorm()
        )

    def forward(self, x: Tensor) -> Tensor:
        """(1, B, T, 126) -> z_c (1, B, T / 4, C)"""
        for layer in self.convs:
            x = self.halve(leaky(self.norm(layer(x))))
        return self.residual(x)


class StyleEncoder(nn.Module):
    """E_S^3D or E_S^2D: a code of fixed size, however long the motion."""

    def __init__(self, config: Config, channels: int) -> None:
        super().__init__()
        self.convs, self.halve = stack([channels, *config.style], config.taps), halving()
        self.head = nn.Sequential(
            nn.Linear(config.style[-1], config.code), nn.LeakyReLU(0.2), nn.Linear(config.code, config.code)
        )

    def forward(self, x: Tensor) -> Tensor:
        """(1, B, T, channels) -> z_s (B, code)"""
        for layer in self.convs:
            x = self.halve(leaky(layer(x)))
        return self.head(pool(x))


class Decoder(nn.Module):
    """F: residual blocks with AdaIN, whose parameters a perceptron makes of z_s, then convolutions that double the
    time."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        width = config.content[-1]
        self.perceptron = nn.Sequential(nn.Linear(config.code, config.code), nn.LeakyReLU(0.2))
        self.residuals = nn.ModuleList(
            ResBlock(BODY, width, width, config.taps, lambda channels: AdaIN(config.code, channels)) for _ in range(2)
        )
        self.convs, self.twice = stack([*config.content[::-1], config.content[0]], config.taps), doubling()
        self.head = nn.Linear(config.content[0], TURNS)

    def forward(self, content: Tensor, code: Tensor) -> Tensor:
        """z_c (1, B, T / 4, C), z_s (B, code) -> (1, B, T, 126)"""
        x, code = content, self.perceptron(code)
        for residual in self.residuals:
            x = residual(x, code)
        for layer in self.convs:
            x = leaky(layer(self.twice(x)))
        return self.head(x)


class Unpaired(WholeBody):
    """G of Eq. 1, its content encoder, both style encoders and the decoder."""

    KIND, CONFIG = "unpaired", Config

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self.content_encoder, self.decoder = ContentEncoder(config), Decoder(config)
        self.style_3d = StyleEncoder(config, JOINT_COUNT * 3)
        self.style_2d = StyleEncoder(config, len(POINTS) * 2)

    def encode(self, motion: Tensor, domain: Tensor | None = None) -> Tensor:
        """E_S^3D: normalized windows (21, B, T, 15) -> codes (B, code)."""
        return self.style_3d(whole(motion[..., POSITION]))

    def encode_points(self, points: Tensor) -> Tensor:
        """E_S^2D: points (B, T, 15, 2) in metres about the hips, x to the right of the picture, y up -> codes (B,
        code)."""
        return self.style_2d(points.flatten(2)[None] / POINT_SCALE)

    def transfer(self, motion: Tensor, codes: Tensor) -> Tensor:
        """Eq. 1: normalized axes (21, n B, T, 6) of windows (21, B, T, 15), each in n of the styles of codes (n B,
        code)."""
        content = self.content_encoder(whole(motion[..., ROTATION]))
        return by_joint(self.decoder(for_each(content, codes), codes))

    def restyled(self, motion: Tensor, codes: Tensor) -> Restyled:
        return Restyled(self.axes(self.transfer(motion, codes)), None)

    def axes(self, turns: Tensor) -> Tensor:
        """Normalized axes as they are."""
        return turns * self.deviation[..., ROTATION] + self.mean[..., ROTATION]

    def posed(self, turns: Tensor) -> Tensor:
        """Normalized axes (21, B, T, 6) with where they put the joints: (21, B, T, 9), places about the hips first."""
        axes = self.axes(turns)
        places = forward_kinematics(axes, torch.zeros_like(axes[:1, ..., :3]))
        return torch.cat([places / self.deviation[..., POSITION], turns], dim=-1)

    def projected(self, motion: Tensor, yaw: Tensor, scale: Tensor) -> Tensor:
        """P of Eq. 6, weak perspective: normalized windows (21, B, T, 15) seen from yaw (B,), times scale (B,): (B, T,
        15, 2)."""
        places = motion[..., POSITION] * self.deviation[..., POSITION] + self.mean[..., POSITION]
        places = points_of(places.permute(1, 2, 0, 3))
        right = torch.stack([torch.cos(yaw), torch.zeros_like(yaw), -torch.sin(yaw)], dim=-1)
        picture = torch.stack([(places * right[:, None, None]).sum(-1), places[..., 1]], dim=-1)
        return picture * scale[:, None, None, None]


def points_of(places: Tensor) -> Tensor:
    """POINTS (B, T, 15, 3) about the hips, of joints (B, T, 21, 3)."""
    between = {
        name: (places[..., INDEX[f"Left{side}"], :] + places[..., INDEX[f"Right{side}"], :]) / 2
        for name, side in (("Hips", "UpLeg"), ("Neck", "Arm"))
    }
    found = [between[name] if name in between else places[..., INDEX[name], :] for name in POINTS]
    return torch.stack(found, dim=-2) - between["Hips"][..., None, :]


class Discriminator(nn.Module):
    """D, the multi-style discriminator: temporal convolutions over turns and places, one output for each style."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.convs, self.halve = stack([JOINT_COUNT * 9, *config.discriminator], config.taps), halving()
        self.head = DomainHead(config.discriminator[-1], len(config.labels), 1)

    def feature(self, posed: Tensor) -> Tensor:
        """D_f: (1, B, T, 189) -> (2 B, C), of the windows and then of their ends alone, which a live stream is made
        of."""
        return torch.cat([self._pooled(posed), self._pooled(posed[:, :, -END:])])

    def _pooled(self, posed: Tensor) -> Tensor:
        for layer in self.convs:
            posed = self.halve(leaky(layer(posed)))
        return pool(posed)

    def score(self, feature: Tensor, domain: Tensor) -> Tensor:
        """(2 B, C), (B,) -> (2 B, 1)"""
        return self.head(feature, domain.repeat(2))


class Objective(Adversarial):
    """Eq. 3 to 8, in two turns: the discriminator's and the generator's.

    The adversarial terms are least squares with 1 for real and 0 for fake; the discriminator's slope at real motion is
    held low, without which so small a one runs away."""

    system: Unpaired
    discriminator: Discriminator

    def __init__(self, config: Config) -> None:
        super().__init__(Unpaired(config), Discriminator(config))

    def learned(self) -> dict[str, list[tuple[list[nn.Parameter], float]]]:
        """What each phase changes, and how quickly."""
        return {
            "discriminator": [(list(self.discriminator.parameters()), DISCRIMINATOR_RATE)],
            "generator": [(list(self.system.parameters()), 1.0)],
        }

    def discriminator_losses(self, x: DomainBatch[Tensor], step: int) -> dict[str, Tensor]:
        """The discriminator's side of Eq. 4."""
        model, discriminator = self.system, self.discriminator
        with torch.no_grad():
            fake = whole(model.posed(model.transfer(x.source, model.encode(x.target))))
        real = whole(model.posed(x.target[..., ROTATION])).requires_grad_(step % 8 == 0)
        score = discriminator.score(discriminator.feature(real), x.target_domain)
        terms = {
            "real": (score - 1).square().mean(),
            "fake": discriminator.score(discriminator.feature(fake), x.target_domain).square().mean(),
        }
        if real.requires_grad:
            terms["slope"] = slope_penalty(score, real)
        return terms

    def generator_losses(self, x: DomainBatch[Tensor], step: int) -> dict[str, Tensor]:
        """Eq. 3 and the generator's sides of Eq. 4 to 7."""
        model, discriminator = self.system, self.discriminator
        clips = torch.cat([x.kin, x.target, x.target_kin], dim=1)
        from_3d = model.encode(clips)
        views = self.views(x)
        from_2d = torch.stack([model.encode_points(model.projected(clips, *view)) for view in views])
        codes = (from_3d + from_2d.mean(0)) / 2  # z_s
        kin, target, target_kin = codes.chunk(3)

        both = model.transfer(x.source, torch.cat([kin, target]))
        rebuilt, restyled = model.posed(both).chunk(2, dim=1)
        fake = discriminator.feature(whole(restyled))
        with torch.no_grad():
            real = torch.stack(
                [discriminator.feature(whole(model.posed(one[..., ROTATION]))) for one in (x.target, x.target_kin)]
            )
        apart = (target - target_kin).norm(dim=1) - (target - kin).norm(dim=1)
        others = x.source_domain != x.target_domain
        return {
            "content": ((rebuilt - model.posed(x.source[..., ROTATION])).abs() * newest(both)).mean(),  # Eq. 3
            "adversarial": (discriminator.score(fake, x.target_domain) - 1).square().mean(),  # Eq. 4
            "feature": (fake - real.mean(0)).abs().mean(),  # Eq. 5
            "joint": (from_3d - from_2d).square().sum(-1).mean(),  # Eq. 6
            "triplet": ((apart + MARGIN).clamp(min=0) * others).mean(),  # Eq. 7
        }

    def views(self, x: DomainBatch[Tensor]) -> list[tuple[Tensor, Tensor]]:
        """(yaw, scale), (3 B,) each, of every view, out of the batch's random numbers."""
        sampled = torch.special.ndtr(x.noise[:, : 2 * self.system.config.views]).repeat(3, 1)  # uniform in 0 .. 1
        spans = ((YAWS, sampled[:, 0::2]), (SCALES, sampled[:, 1::2]))
        yaws, scales = (low + (high - low) * share for (low, high), share in spans)
        return list(zip(yaws.unbind(1), scales.unbind(1)))
