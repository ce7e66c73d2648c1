"""Systems that restyle the whole body at once: what they share, and how one frame or a clip is made of their outputs.

A style is one vector, its code. A part takes its joints from the output in its own style, so parts may have different
styles: the system is then evaluated once for each."""

from typing import Any, Mapping, NamedTuple, Sequence

import numpy as np
import torch
from torch import Tensor

from sim.body.kinematics import forward_kinematics
from sim.body.skeleton import CONTACT_JOINTS, INDEX, PART_OF_JOINT
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT, POSE_CHANNELS, STRIDE
from stylizer.networks.normalization import Scaled

HIPS = INDEX["Hips"]


class Restyled(NamedTuple):
    """What a system gives, in the character's own frame, not normalized.

    axes: (21, B, T, 6) forward and up axis of each joint; hips: (1, B, T, 3) metres, None: as low as lets the feet
    stand."""

    axes: Tensor
    hips: Tensor | None


class WholeBody(Scaled):
    """A system by its style codes. `config.window` is the samples of a window, `config.labels` the domains it was
    taught."""

    # samples: a live window ends with its newest one held so long, as these systems give the end of a window weakly
    LOOK_AHEAD = 8
    mean_poses: Tensor

    def __init__(self, config: Any) -> None:
        super().__init__(config)
        self.register_buffer("mean_poses", torch.zeros(max(len(config.labels), 1), 21, POSE_CHANNELS.stop))

    def encode(self, motion: Tensor, domain: Tensor) -> Tensor:
        """Codes (B, C) of normalized windows (21, B, T, 15), their domains (B,) given; the same for the same motion."""
        raise NotImplementedError

    def restyled(self, motion: Tensor, codes: Tensor) -> Restyled:
        """Normalized windows (21, B, T, 15), T a multiple of 4, each in n of the styles of codes (n B, C)."""
        raise NotImplementedError

    def code_from_noise(self, noise: Tensor, domain: Tensor) -> Tensor:
        """Codes (B, C) without a clip, from standard normal numbers (B, NOISE) and domains (B,). Raises ValueError
        where a system takes styles from clips only."""
        raise ValueError(f"the {self.KIND} stylizer takes styles from clips only: name a clip or a style")

    @property
    def newest(self) -> int:
        """The sample of a live window that is drawn; those after it repeat it."""
        return self.config.window - 1 - self.LOOK_AHEAD

    def live_samples(self) -> np.ndarray:
        """(T,) which samples of the motion a live window holds."""
        return np.minimum(np.arange(self.config.window), self.newest)

    @torch.inference_mode()
    def encode_style(self, windows: np.ndarray, label: str | None = None) -> Tensor:
        """The code (C,) of a clip from its windows (n, T, 21, 15), their mean; label: its domain, if it is known."""
        motion = self.normalize(torch.from_numpy(windows.astype(np.float32)))
        domain = self.config.labels.index(label) if label in self.config.labels else self.nearest_domain(motion)
        return self.encode(motion, torch.full((len(windows),), domain)).mean(dim=0)

    @torch.inference_mode()
    def sample_code(self, label: str | None, random: np.random.Generator) -> Tensor:
        """A code (C,) by chance, in a domain where the system knows domains."""
        domain = self.config.labels.index(label) if label in self.config.labels else 0
        noise = torch.from_numpy(random.standard_normal((1, self.NOISE)).astype(np.float32))
        return self.code_from_noise(noise, torch.tensor([domain]))[0]

    def nearest_domain(self, motion: Tensor) -> int:
        """The domain whose mean pose is nearest to that of normalized windows (21, B, T, 15)."""
        mean_pose = motion[..., POSE_CHANNELS].mean(dim=(1, 2))
        return int((self.mean_poses - mean_pose).abs().mean(dim=(1, 2)).argmin())


@torch.inference_mode()
def stylize_windows(model: WholeBody, windows: np.ndarray, codes: Tensor, last: int | None = None) -> np.ndarray:
    """Features (n B, T, 21, 15) of windows (B, T, 21, 15), each in n of the styles of codes (n B, C); or the `last`
    samples."""
    result = model.restyled(model.normalize(torch.from_numpy(windows.astype(np.float32))), codes)

    def asked_for(x: Tensor) -> np.ndarray:
        return x.permute(1, 2, 0, 3)[:, -(last or 0) :].double().numpy()

    content = np.tile(windows[:, -(last or 0) :], (len(codes) // len(windows), 1, 1, 1))
    hips = None if result.hips is None else asked_for(result.hips)[..., 0, :]
    return complete_features(content, asked_for(result.axes), hips)


def complete_features(content: np.ndarray, axes: np.ndarray, hips: np.ndarray | None) -> np.ndarray:
    """Features (..., T, 21, 15) of a body that turns as axes (..., T, 21, 6), its hips at (..., T, 3), with bones of
    our length, the root going the content's way. Without hips it stands as high over its feet as the content."""
    rotations = rot.from_6d(axes)
    positions = forward_kinematics(content[..., HIPS, LAYOUT["position"]] if hips is None else hips, rotations)
    if hips is None:
        lowest = (p[..., CONTACT_JOINTS, 1].min(axis=-1) for p in (content[..., LAYOUT["position"]], positions))
        positions[..., 1] += np.subtract(*lowest)[..., None]
    result = content.copy()
    result[..., LAYOUT["position"]], result[..., LAYOUT["rotation"]] = positions, rot.to_6d(rotations)
    velocity = velocities(content, positions)
    result[..., 1:, :, LAYOUT["velocity"]] = velocity
    if velocity.shape[-3]:
        result[..., 0, :, LAYOUT["velocity"]] = velocity[..., 0, :, :]
    return result


def velocities(content: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """(..., T - 1, 21, 3) of joint positions (..., T, 21, 3) at 30 Hz, the root turning as the content's features
    (..., T, 21, 15) say."""
    turn = content[..., 1:, 0, LAYOUT["root"]][..., 2] * STRIDE / FPS
    before = rot.rotate(rot.from_yaw(-turn)[..., None, :], positions[..., :-1, :, :])  # in the frame of one sample on
    return (positions[..., 1:, :, :] - before) * FPS / STRIDE


def joints_by_code(wanted: Sequence[tuple | None]) -> dict[tuple, np.ndarray]:
    """The five parts' codes -> the joints (n,) that take it; parts that are given None are not restyled."""
    return {
        code: np.flatnonzero([wanted[part] == code for part in PART_OF_JOINT]) for code in dict.fromkeys(wanted) if code
    }


def combine_joints(
    content: np.ndarray, styled: Mapping[tuple, np.ndarray], joints: Mapping[tuple, np.ndarray]
) -> np.ndarray:
    """The content's features (..., 21, 15), each joint as the output in its own style says."""
    result = content.copy()
    for code, which in joints.items():
        result[..., which, :] = styled[code][..., which, :]
    return result


def velocity_factor(features: np.ndarray) -> float:
    """V of Aberman et al. 2020, Eq. 2, in metres a second: the temporal mean of the greatest local joint velocity of
    features (..., 21, 15)."""
    return float(np.linalg.norm(features[..., LAYOUT["velocity"]], axis=-1).max(axis=-1).mean())
