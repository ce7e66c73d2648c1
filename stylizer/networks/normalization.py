"""What all style-transfer networks share: their configuration, and the statistics that scale motion features for
them."""

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from sim.body.skeleton import JOINT_COUNT
from sim.motion.features import FEATURES


class Scaled(nn.Module):
    """A network with its configuration (a dataclass) and the mean and deviation of the features of
    `sim.motion.features`."""

    KIND: str  # what the header of its weight files calls it
    NOISE = 0  # standard normal numbers that a style by chance is made of; 0: styles come from clips only
    mean: Tensor
    deviation: Tensor

    def __init__(self, config: Any) -> None:
        super().__init__()
        self.config = config
        self.register_buffer("mean", torch.zeros(JOINT_COUNT, 1, 1, FEATURES))
        self.register_buffer("deviation", torch.ones(JOINT_COUNT, 1, 1, FEATURES))

    def set_statistics(self, mean: np.ndarray, deviation: np.ndarray) -> None:
        """Mean and deviation of the training features, (21, 15) each."""
        self.mean.copy_(torch.as_tensor(mean, dtype=torch.float32)[:, None, None])
        self.deviation.copy_(torch.as_tensor(deviation, dtype=torch.float32)[:, None, None])

    def normalize(self, features: Tensor) -> Tensor:
        """(B, T, 21, 15) as `sim.motion.features` has them -> (21, B, T, 15) as the networks want them."""
        return (features.permute(2, 0, 1, 3) - self.mean) / self.deviation

    def restore(self, motion: Tensor) -> Tensor:
        """The inverse of `normalize`."""
        return (motion * self.deviation + self.mean).permute(1, 2, 0, 3)

    def parameter_count(self) -> int:
        return sum(p.numel() for p in self.parameters())
