"""What the systems that learn against a discriminator share."""

import torch
from torch import Tensor, nn

from stylizer.data.domains import DomainBatch


class Adversarial(nn.Module):
    """What a system and its discriminator learn in every step, in two turns. Subclasses say what (`learned`) and by
    which losses (`discriminator_losses`, `generator_losses`)."""

    PHASES = ("discriminator", "generator")

    def __init__(self, system: nn.Module, discriminator: nn.Module) -> None:
        super().__init__()
        self.system, self.discriminator = system, discriminator

    def schedule(self, progress: float) -> tuple[tuple[str, ...], float]:
        """The phases of a step and how far training is in them."""
        return self.PHASES, progress

    def forward(self, phase: str, x: DomainBatch[Tensor], step: int) -> dict[str, Tensor]:
        """The phase's terms of one batch."""
        return getattr(self, f"{phase}_losses")(x, step)


def slope_penalty(score: Tensor, motion: Tensor) -> Tensor:
    """R1 of Mescheder et al. 2018: mean squared gradient of a discriminator's score (B, 1) at real motion (V, B, T,
    C)."""
    (gradient,) = torch.autograd.grad(score.sum(), motion, create_graph=True)
    return gradient.square().sum(dim=(0, 2, 3)).mean()
