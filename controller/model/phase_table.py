"""The network as it runs: its weights by phase, computed in advance (the precomputation of Holden et al. 2017, Sec. 6).

One character's step takes as long as its weights take to come out of memory. Blending the outputs of the four control
points reads all four sets; here sets lie ready all round the cycle, and the two beside the phase are read. From one to
the next weights go in a straight line: the paper's nearest entry reads half as much, but leaves a step in the motion
wherever it changes."""

import math

import numpy as np
import torch

from controller.model.network import CONTROL_POINTS, PhaseFunctionedNetwork, spline_coefficients

ENTRIES = 64  # round the cycle: 130 MB, and joints within 0.05 mm (RMS) of the spline's
FINE = 16  # places between two entries at which the straight lines are fitted to the spline


class PhaseTable:
    """Natural input and phase to natural output: one character by the table, a crowd by the four control points.

    A crowd's phases lie all round the cycle. It reads all four sets of weights once for everyone, and blends what they
    give with the table's own coefficients, so that each moves as it would alone."""

    def __init__(self, network: PhaseFunctionedNetwork, entries: int = ENTRIES) -> None:
        self.entries = entries
        self.network = network
        self.coefficients = fit_coefficients(entries)
        self.mean, self.deviation, self.output_mean, self.output_deviation = (
            getattr(network, name).numpy() for name in ("input_mean", "input_std", "output_mean", "output_std")
        )
        self.layers = [_tabulated(layer, self.coefficients) for layer in network.layers]
        # What goes into each layer: once for either entry, each with a 1 at its end that the bias is multiplied by.
        self._inputs = [np.ones((2, table.shape[1]), np.float32) for table in self.layers]

    def __deepcopy__(self, memo: dict[int, object]) -> "PhaseTable":
        return self  # nothing in it changes from step to step: copies of a character share it

    def __call__(self, x: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """x (..., INPUT_SIZE) float32, phase (...) in radians -> (..., OUTPUT_SIZE), for no leading axes or one. Raises
        FloatingPointError where that is not finite."""
        place = phase * (self.entries / (2 * math.pi))
        y = self._one(x, float(place)) if x.ndim == 1 else self._many(x, place)
        if not np.isfinite(y).all():
            raise FloatingPointError("the network's output is not finite")
        return y

    def _one(self, x: np.ndarray, place: float) -> np.ndarray:
        entry, place = divmod(place, 1)
        entry, share = int(entry) % self.entries, np.array([[1 - place], [place]], np.float32)
        h = (x - self.mean) / self.deviation
        for i, (table, inputs) in enumerate(zip(self.layers, self._inputs)):
            inputs[:, :-1] = _elu(h) if i else h
            h = (inputs * share).ravel() @ table[entry : entry + 2].reshape(-1, table.shape[2])
        return h * self.output_deviation + self.output_mean

    @torch.inference_mode()
    def _many(self, x: np.ndarray, place: np.ndarray) -> np.ndarray:
        entry, place = np.divmod(place, 1)
        entry, place = entry.astype(int) % self.entries, place.astype(np.float32)[:, None]
        coefficients = (1 - place) * self.coefficients[entry] + place * self.coefficients[entry + 1]
        return self.network.blended(torch.from_numpy(x), torch.from_numpy(coefficients)).numpy()


def fit_coefficients(entries: int) -> np.ndarray:
    """How much each control point counts in each entry, (entries + 1, 4), the first once more at the end as the last's
    neighbour.

    The polygon round the cycle that is nearest to the spline: one with its corners on the spline would lie all to one
    side."""
    place = np.arange(entries * FINE) / FINE
    hats = np.maximum(0, 1 - np.abs((place[:, None] - np.arange(entries) + entries / 2) % entries - entries / 2))
    spline = spline_coefficients(torch.from_numpy(place * (2 * math.pi / entries))).numpy()
    corners = np.linalg.solve(hats.T @ hats, hats.T @ spline)
    return np.concatenate([corners, corners[:1]]).astype(np.float32)


def _tabulated(layer: torch.nn.Module, coefficients: np.ndarray) -> np.ndarray:
    """Weights, and the bias below them, at each entry: (entries, inputs + 1, outputs)."""
    weight = layer.get_parameter("weight").detach().unflatten(0, (CONTROL_POINTS, -1)).transpose(1, 2)
    bias = layer.get_parameter("bias").detach().view(CONTROL_POINTS, 1, -1)
    points = torch.cat([weight, bias], dim=1)
    return torch.mm(torch.from_numpy(coefficients), points.flatten(1)).view(-1, *points.shape[1:]).numpy()


def _elu(x: np.ndarray) -> np.ndarray:
    return np.maximum(x, np.expm1(np.minimum(x, 0)))
