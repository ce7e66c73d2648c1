"""Forward kinematics of the 21 joints for training, on tensors whose first axis is the joint."""

import torch
from torch import Tensor
from torch.nn import functional as F

from sim.body.skeleton import ANCESTORS, BONE_OFFSETS, PARENTS


def forward_kinematics(axes: Tensor, hips: Tensor) -> Tensor:
    """Joint positions (21, ..., 3) in metres from forward and up axes (21, ..., 6) and the hips' place (1, ..., 3).

    Axes are taken as they are: a network's are about orthonormal, see `orthonormal_axes`."""
    forward, up = axes[..., :3], axes[..., 3:]
    left = torch.linalg.cross(up, forward)
    offsets = torch.as_tensor(BONE_OFFSETS[1:], dtype=axes.dtype, device=axes.device)
    offsets = offsets.view(-1, *[1] * (axes.dim() - 2), 3)
    parents = torch.as_tensor(PARENTS[1:], device=axes.device)
    bones = sum(axis[parents] * offsets[..., i : i + 1] for i, axis in enumerate((left, up, forward)))
    ancestors = torch.as_tensor(ANCESTORS, dtype=axes.dtype, device=axes.device)
    return torch.tensordot(ancestors, torch.cat([hips, bones]), dims=1)


def orthonormal_axes(axes: Tensor) -> Tensor:
    """Axes (..., 6) made orthonormal: forward keeps its direction, up gives way (Zhou et al. 2019)."""
    forward = F.normalize(axes[..., :3], dim=-1)
    left = F.normalize(torch.linalg.cross(axes[..., 3:], forward), dim=-1)
    return torch.cat([forward, torch.linalg.cross(forward, left)], dim=-1)
