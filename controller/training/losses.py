"""What the controller's training minimises: how far an output is from the frame that followed, number by number and as
a body."""

import torch
from torch.nn import functional as F

from controller.model.io_layout import OUTPUT_SLICES
from sim.body.skeleton import CONTACT_JOINTS, JOINT_COUNT
from sim.body.torch_kinematics import forward_kinematics, orthonormal_axes
from sim.motion.clip import FPS

# What each loss counts. Of a part of the output: mean absolute error in standard deviations, of the contacts
# cross-entropy.
WEIGHTS = {
    "positions": 1.0,
    "velocities": 0.5,
    "rotations": 1.0,
    "root": 2.0,
    "phase": 1.0,
    "future_positions": 0.5,
    "future_directions": 0.5,
    "contacts": 0.2,
    "skeleton": 10.0,  # per metre, on joints placed by the rotations alone: what is drawn
    "slide": 1.0,  # per metre a second, on the way of ankles and toes over the floor
    "motion": 0.5,  # per metre a second, on that of all joints from frame to frame: what jitters has the wrong one
}
PLANTED_WEIGHT = 8.0  # how much more a slide counts while the joint is planted


def compute_losses(
    y: torch.Tensor, target: torch.Tensor, deviation: torch.Tensor, misplaced: torch.Tensor, astray: torch.Tensor
) -> dict[str, torch.Tensor]:
    """Their weighted sum, as `loss`, and every loss of WEIGHTS, for outputs and targets (batch, OUTPUT_SIZE).

    deviation (OUTPUT_SIZE,): the outputs' standard deviations. misplaced (batch, 21, 3) metres: how far the joints are
    from where they should be; astray (batch, 21, 3) metres: how far their root motion in this frame is from what
    it should be."""
    error = (y - target).abs() / deviation
    contacts = OUTPUT_SLICES["contacts"]
    losses = {name: error[:, where].mean() for name, where in OUTPUT_SLICES.items() if name != "contacts"}
    losses["contacts"] = F.binary_cross_entropy_with_logits(y[:, contacts], target[:, contacts])
    losses["skeleton"] = misplaced.abs().mean()
    speed = FPS * astray.abs()
    planted = 1 + (PLANTED_WEIGHT - 1) * target[:, contacts, None]
    losses["slide"] = (speed[:, CONTACT_JOINTS][..., [0, 2]] * planted).mean()
    losses["motion"] = speed.mean()
    loss = sum((WEIGHTS[name] * value for name, value in losses.items()), torch.zeros((), device=y.device))
    return {"loss": loss, **losses}


def joint_positions(y: torch.Tensor) -> torch.Tensor:
    """Joint positions (batch, 21, 3) in the root frame, in metres, from the hips' place and the rotations of outputs
    (batch, OUTPUT_SIZE)."""
    axes = y[:, OUTPUT_SLICES["rotations"]].view(-1, JOINT_COUNT, 6).transpose(0, 1)
    hips = y[None, :, OUTPUT_SLICES["positions"]][..., :3]
    return forward_kinematics(orthonormal_axes(axes), hips).transpose(0, 1)


def root_displacement(y: torch.Tensor, before: torch.Tensor, now: torch.Tensor) -> torch.Tensor:
    """How far each joint went in a frame, the root's step included: (batch, 21, 3) metres, in the earlier root frame.

    before, now: joint positions (batch, 21, 3), each in its own root frame; y holds the root's step between them."""
    step = y[:, OUTPUT_SLICES["root"]]
    x, height, z = now.unbind(-1)
    sine, cosine = torch.sin(step[:, 2:]), torch.cos(step[:, 2:])
    x, z = cosine * x + sine * z + step[:, :1], cosine * z - sine * x + step[:, 1:2]
    return torch.stack([x, height, z], dim=-1) - before
