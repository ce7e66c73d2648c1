"""What a style that was seen going one way over the floor looks like going another: who runs tired is not held as who
walks so.

Learned from styles that were captured going several ways. What all of them have in common when they run, back or turn
is no style; what a style does besides is told by how its clip is held, how lively it is and which way it goes."""

import numpy as np
import torch
from torch import Tensor, nn

from sim.body.skeleton import PARTS
from sim.math.easing import smooth_step
from sim.motion.features import LAYOUT
from stylizer.networks.layers import leaky

ROOT = LAYOUT["root"]
ROOT_SIZE = ROOT.stop - ROOT.start
HIDDEN, CODE = 64, 16  # units of both networks, and of the code by which a style is told
LEAST = 0.05  # of the normalized deviation, added before logarithms are taken: how still a still joint is says nothing
STANDING = (0.1, 0.4)  # metres a second between which standing becomes going
MOST = 1.2  # logarithm of the most that a way makes a style livelier, or quieter


def known_direction(root_velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The part of ways over the floor (B, 3), in metres and radians a second, that styled captures show, forwards or
    backwards (B, 3), and how far (B, 1) a way is of that kind: nobody was captured side-stepping or standing in a
    style, so what was learned says nothing of it, and spine and arms are held there as the style's clip has them."""
    forward = np.zeros_like(root_velocity)
    forward[..., 1] = root_velocity[..., 1]
    over_floor = np.square(root_velocity[..., :2]).sum(axis=-1, keepdims=True)
    share = np.square(root_velocity[..., 1:2]) / np.maximum(over_floor, 1e-9)
    return forward, share * smooth_step(np.sqrt(over_floor), *STANDING)


class DirectionTransfer(nn.Module):
    """From one way to another: what is added to every number of a part's mean, and by what its movement is
    multiplied."""

    def __init__(self, body: int, part: int) -> None:
        """body: numbers that hold a whole body, part: those of one part."""
        super().__init__()
        self.seen, self.code = nn.Linear(2 * body + ROOT_SIZE, HIDDEN), nn.Linear(HIDDEN, CODE)
        self.going = nn.Linear(CODE + ROOT_SIZE, HIDDEN)
        self.weight = nn.Parameter(torch.zeros(len(PARTS), HIDDEN, 2 * part))  # every part has its own

    def style_side(self, mean: Tensor, deviation: Tensor, root_velocity: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and deviation (B, body) of a normalized clip and its mean way (B, 3) -> its code (B, CODE), and what it
        is going its own way, (5, B, 2 part), from which others differ."""
        code = self.code(leaky(self.seen(torch.cat([mean, (deviation + LEAST).log(), root_velocity], dim=1))))
        by_part = code.expand(len(PARTS), -1, -1)
        return code, self.styled(by_part, root_velocity)

    def styled(self, code: Tensor, root_velocity: Tensor) -> Tensor:
        """Codes (5, B, CODE), each part's of its own style, and a way (B, 3) -> (5, B, 2 part)."""
        return leaky(self.going(torch.cat([code, root_velocity.expand(len(PARTS), -1, -1)], dim=2))) @ self.weight

    def forward(self, code: Tensor, source_prediction: Tensor, root_velocity: Tensor) -> tuple[Tensor, Tensor]:
        """From where a style was seen, `source_prediction` (see `style_side`), to a way (B, 3): what is added to the
        mean, and the logarithm of what the movement is multiplied by, two of (5, B, part)."""
        shift, gain = (self.styled(code, root_velocity) - source_prediction).chunk(2, dim=2)
        return shift, gain.clamp(-MOST, MOST)
