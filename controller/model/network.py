"""The phase-functioned neural network (Holden et al. 2017): three layers whose weights are a cyclic spline of the
phase."""

import math

import torch
from torch import nn
from torch.nn import functional as F

from controller.model.idle_layer import SHAPE as IDLE_SHAPE
from controller.model.io_layout import INPUT_SIZE, OUTPUT_SIZE, POSE_SIZE

CONTROL_POINTS = 4


def spline_coefficients(phase: torch.Tensor) -> torch.Tensor:
    """How much each of the four control points counts at a phase in radians: (...) -> (..., 4).

    The cyclic cubic Catmull-Rom spline of the paper, written as a weighting of control points: weights and layer
    outputs are both linear in them, so blending outputs equals blending weights and costs a third."""
    w = phase * (CONTROL_POINTS / (2 * math.pi))
    k1 = torch.floor(w)
    t = w - k1
    basis = torch.stack(
        [
            -0.5 * t + t**2 - 0.5 * t**3,
            1 - 2.5 * t**2 + 1.5 * t**3,
            0.5 * t + 2 * t**2 - 1.5 * t**3,
            -0.5 * t**2 + 0.5 * t**3,
        ],
        dim=-1,
    )
    points = (k1.long()[..., None] + torch.arange(-1, 3)) % CONTROL_POINTS
    return torch.zeros_like(basis).scatter(-1, points, basis)


class PhaseLinear(nn.Module):
    """A linear layer with four sets of weights, blended by phase."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        bound = math.sqrt(6 / (inputs + outputs))
        self.weight = nn.Parameter(torch.empty(CONTROL_POINTS * outputs, inputs).uniform_(-bound, bound))
        self.bias = nn.Parameter(torch.zeros(CONTROL_POINTS * outputs))

    def forward(self, x: torch.Tensor, coefficients: torch.Tensor) -> torch.Tensor:
        """x (batch, inputs), coefficients (batch, 4) -> (batch, outputs)."""
        four = F.linear(x, self.weight, self.bias).view(len(x), CONTROL_POINTS, -1)
        return torch.bmm(coefficients.to(four.dtype)[:, None], four)[:, 0]


class PhaseFunctionedNetwork(nn.Module):
    """Normalised input and phase to normalised output. The statistics travel with the weights."""

    input_mean: torch.Tensor
    input_std: torch.Tensor
    output_mean: torch.Tensor
    output_std: torch.Tensor
    standing: torch.Tensor
    idle: torch.Tensor

    def __init__(self, hidden: int = 512, dropout: float = 0.0) -> None:
        super().__init__()
        self.layers = nn.ModuleList(
            [PhaseLinear(INPUT_SIZE, hidden), PhaseLinear(hidden, hidden), PhaseLinear(hidden, OUTPUT_SIZE)]
        )
        self.hidden = hidden
        self.dropout = dropout
        for name, size in (("input", INPUT_SIZE), ("output", OUTPUT_SIZE)):
            self.register_buffer(f"{name}_mean", torch.zeros(size))
            self.register_buffer(f"{name}_std", torch.ones(size))
        self.register_buffer("standing", torch.zeros(POSE_SIZE))  # a pose to start from
        self.register_buffer("idle", torch.zeros(IDLE_SHAPE))  # what is laid on it while the character stands

    def forward(self, x: torch.Tensor, phase: torch.Tensor) -> torch.Tensor:
        """x (batch, INPUT_SIZE), phase (batch,) radians -> (batch, OUTPUT_SIZE), all in natural units."""
        return self.blended(x, spline_coefficients(phase))

    def blended(self, x: torch.Tensor, coefficients: torch.Tensor) -> torch.Tensor:
        """The same for control points that count as coefficients (batch, 4) say."""
        h = (x - self.input_mean) / self.input_std
        for i, layer in enumerate(self.layers):
            if i:
                h = F.elu(h)
            h = layer(F.dropout(h, self.dropout, self.training), coefficients)
        return h.float() * self.output_std + self.output_mean
