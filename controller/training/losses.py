"""What the controller's training minimises: how far an answer is from the frame that followed, number by number and as
a body."""

import torch
from torch.nn import functional as F

from controller.model.io_layout import OUTPUT_SLICES
from sim.body.skeleton import ANCESTORS, BONE_OFFSETS, CONTACT_JOINTS, JOINT_COUNT, PARENTS
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
    "way": 0.5,  # per metre a second, on that of all joints from frame to frame: what jitters has the wrong one
}
PLANTED_WEIGHT = 8.0  # how much more a slide counts while the joint is planted


def losses_of(
    y: torch.Tensor, target: torch.Tensor, deviation: torch.Tensor, misplaced: torch.Tensor, astray: torch.Tensor
) -> dict[str, torch.Tensor]:
    """Their weighted sum, as `loss`, and every loss of WEIGHTS, for outputs and targets (batch, OUTPUT_SIZE).

    deviation (OUTPUT_SIZE,): the outputs' standard deviations. misplaced (batch, 21, 3) metres: how far the joints are
    from where they should be; astray (batch, 21, 3) metres: how far their way over the floor in this frame is from what
    it should be."""
    error = (y - target).abs() / deviation
    contacts = OUTPUT_SLICES["contacts"]
    losses = {name: error[:, where].mean() for name, where in OUTPUT_SLICES.items() if name != "contacts"}
    losses["contacts"] = F.binary_cross_entropy_with_logits(y[:, contacts], target[:, contacts])
    losses["skeleton"] = misplaced.abs().mean()
    speed = FPS * astray.abs()
    planted = 1 + (PLANTED_WEIGHT - 1) * target[:, contacts, None]
    losses["slide"] = (speed[:, CONTACT_JOINTS][..., [0, 2]] * planted).mean()
    losses["way"] = speed.mean()
    return {"loss": sum(WEIGHTS[name] * value for name, value in losses.items()), **losses}


class Skeleton(torch.nn.Module):
    """Joint positions in the root frame, from the hips' position and the rotations of an output."""

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("ancestors", torch.tensor(ANCESTORS, dtype=torch.float32))
        self.register_buffer("offsets", torch.tensor(BONE_OFFSETS, dtype=torch.float32))

    def forward(self, y: torch.Tensor) -> torch.Tensor:
        """y (batch, OUTPUT_SIZE) -> (batch, 21, 3) metres."""
        axes = y[:, OUTPUT_SLICES["rotations"]].view(-1, JOINT_COUNT, 6)[:, PARENTS[1:]]
        forward = F.normalize(axes[..., :3], dim=-1)
        left = F.normalize(torch.linalg.cross(axes[..., 3:], forward), dim=-1)
        matrix = torch.stack([left, torch.linalg.cross(forward, left), forward], dim=-1)
        bones = (matrix @ self.offsets[1:, :, None])[..., 0]
        hips = y[:, OUTPUT_SLICES["positions"]][:, None, :3]
        return self.ancestors @ torch.cat([hips, bones], dim=1)


def root_displacement(y: torch.Tensor, before: torch.Tensor, now: torch.Tensor) -> torch.Tensor:
    """How far each joint went in a frame, the root's step included: (batch, 21, 3) metres, in the earlier root frame.

    before, now: joint positions (batch, 21, 3), each in its own root frame; y tells the root's step between them."""
    step = y[:, OUTPUT_SLICES["root"]]
    x, height, z = now.unbind(-1)
    sine, cosine = torch.sin(step[:, 2:]), torch.cos(step[:, 2:])
    x, z = cosine * x + sine * z + step[:, :1], cosine * z - sine * x + step[:, 1:2]
    return torch.stack([x, height, z], dim=-1) - before
