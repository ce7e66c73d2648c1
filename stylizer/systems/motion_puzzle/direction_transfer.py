"""A style at another root velocity than its clip shows: a tired run is not the pose of a tired walk.

Learned from styles that were captured at several root velocities. What all of them have in common when they run, back
or turn is no style; what a style does besides is predicted from its clip's mean pose, motion amplitude and root
velocity."""

import numpy as np
import torch
from torch import Tensor, nn

from sim.body.skeleton import PARTS
from sim.math.easing import smooth_step
from sim.motion.features import LAYOUT
from sim.motion.thresholds import STANDING_STYLE
from stylizer.networks.layers import leaky

ROOT = LAYOUT["root"]
ROOT_SIZE = ROOT.stop - ROOT.start
HIDDEN, CODE = 64, 16  # units of both networks, and of the code of a style
LEAST = 0.05  # of the normalized deviation, added before logarithms are taken: how still a still joint is says nothing
MOST = 1.2  # logarithm of the most by which a root velocity changes a style's motion amplitude


def known_direction(root_velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The part of root velocities (B, 3), metres and radians a second, that styled captures show, forwards or backwards
    (B, 3), and how far (B, 1) a velocity is of that kind: nobody was captured side-stepping or standing in a style, so
    nothing was learned of it, and spine and arms keep the clip's mean pose there."""
    forward = np.zeros_like(root_velocity)
    forward[..., 1] = root_velocity[..., 1]
    over_floor = np.square(root_velocity[..., :2]).sum(axis=-1, keepdims=True)
    share = np.square(root_velocity[..., 1:2]) / np.maximum(over_floor, 1e-9)
    return forward, share * smooth_step(np.sqrt(over_floor), *STANDING_STYLE)


class DirectionTransfer(nn.Module):
    """From one root velocity to another: what is added to every number of a part's mean, and the factor of its
    movement."""

    def __init__(self, body: int, part: int) -> None:
        """body: numbers that hold a whole body, part: those of one part."""
        super().__init__()
        self.seen, self.code = nn.Linear(2 * body + ROOT_SIZE, HIDDEN), nn.Linear(HIDDEN, CODE)
        self.going = nn.Linear(CODE + ROOT_SIZE, HIDDEN)
        self.weight = nn.Parameter(torch.zeros(len(PARTS), HIDDEN, 2 * part))  # every part has its own

    def style_side(self, mean: Tensor, deviation: Tensor, root_velocity: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and deviation (B, body) of a normalized clip and its root velocity (B, 3) -> its code (B, CODE), and the
        prediction at that very velocity, (5, B, 2 part), from which others differ."""
        code = self.code(leaky(self.seen(torch.cat([mean, (deviation + LEAST).log(), root_velocity], dim=1))))
        by_part = code.expand(len(PARTS), -1, -1)
        return code, self.predict(by_part, root_velocity)

    def predict(self, code: Tensor, root_velocity: Tensor) -> Tensor:
        """Codes (5, B, CODE), each part's of its own style, and a root velocity (B, 3) -> (5, B, 2 part)."""
        return leaky(self.going(torch.cat([code, root_velocity.expand(len(PARTS), -1, -1)], dim=2))) @ self.weight

    def forward(self, code: Tensor, source_prediction: Tensor, root_velocity: Tensor) -> tuple[Tensor, Tensor]:
        """From where a style was seen, `source_prediction` (see `style_side`), to a root velocity (B, 3): what is added
        to the mean, and the logarithm of what the movement is multiplied by, two of (5, B, part)."""
        shift, gain = (self.predict(code, root_velocity) - source_prediction).chunk(2, dim=2)
        return shift, gain.clamp(-MOST, MOST)
