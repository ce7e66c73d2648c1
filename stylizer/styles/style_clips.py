"""A style as one or more clips show it: walking, running, backing ... each encoded by itself, interpolated by root
velocity."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Sequence

import numpy as np
import torch
from torch import Tensor

from sim.body.skeleton import JOINT_COUNT
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT, STRIDE
from sim.motion.gait import (
    HARMONICS,
    airborne_share,
    cadence,
    fit_cycle,
    gait_point,
    movement_of,
    point_distance,
    stride_phase,
    with_run,
)
from stylizer.styles.stride_residual import rest_unsure_joints, stride_residual
from stylizer.systems.motion_puzzle.style_tensors import pack, to_tensors, unpack

BODY = slice(0, LAYOUT["root"].start)  # the features that are not the root's path
WINDOW = 32  # samples at 30 Hz, as in training: the encoder has learned the edges of such a window too
SHORTEST = WINDOW * STRIDE  # frames, about a second: one stride
HOP = SHORTEST // 4  # frames between two windows that are looked at
MANY = 12  # windows that one movement is read from at most
SPEED_RANGE = 0.35  # share by which a window's speed may be off the movement's median: starts and stops are left out
PLAYBACK_RATES = (0.7, 1.5)  # of the controller's motion, slowest and quickest
PACE_STEPS = 200  # speeds that are looked at
NEAREST = 0.01  # closer than this a clip counts alone
LEAST_WEIGHT = 0.02  # a clip that would count less than this is left out


class Movement(NamedTuple):
    """One kind of movement that a clip shows.

    name: of sim.motion.gait.MOVEMENTS; windows: features (m, WINDOW, 21, 15) at 30 Hz; features: (frames, 21, 15) at 60
    Hz of the longest stretch that the windows cover; seconds: where in the clip the windows lie, from and to."""

    name: str
    windows: np.ndarray
    features: np.ndarray
    seconds: tuple[float, float]


def movements_in(features: np.ndarray) -> list[Movement]:
    """The kinds of movement in a clip's features (frames, 21, 15) at 60 Hz, the longest first.

    Standing counts only in a clip that does nothing else, so pauses and T-poses at its ends are left out.
    Raises ValueError for a clip shorter than one window."""
    style_windows(features, 1)
    starts = np.unique(np.append(np.arange(0, len(features) - SHORTEST + 1, HOP), len(features) - SHORTEST))
    velocities = np.array([_root_velocity(features[start : start + SHORTEST]) for start in starts])
    names = np.array(
        [
            movement_of(velocity, airborne_share(features[start : start + SHORTEST]))
            for start, velocity in zip(starts, velocities)
        ]
    )
    found = []
    moving = [name for name in dict.fromkeys(names) if name != "stand"] or ["stand"]
    for name in moving:
        speeds = np.linalg.norm(velocities[names == name, :2], axis=1)
        off = np.abs(speeds - np.median(speeds))
        steady = off <= max(SPEED_RANGE * np.median(speeds), off.min()) + 1e-6  # of two that differ much both are kept
        found.append((name, starts[names == name][steady]))
    longest = max(len(chosen) for _, chosen in found)
    found = [(name, chosen) for name, chosen in found if len(chosen) >= min(2, longest)]
    return [_movement(features, name, chosen) for name, chosen in sorted(found, key=lambda each: -len(each[1]))]


def style_windows(features: np.ndarray, count: int = 3) -> np.ndarray:
    """(count, WINDOW, ...) at 30 Hz, evenly spread over a clip's features (frames, ...) at 60 Hz.

    Raises ValueError for a clip shorter than one window."""
    if len(features) < SHORTEST:
        raise ValueError(f"the clip is too short for a style: give at least {SHORTEST / FPS:.1f} s of motion")
    starts = np.linspace(0, len(features) - SHORTEST, count).round().astype(int)
    return features[starts[:, None] + STRIDE * np.arange(WINDOW)]


def _movement(features: np.ndarray, name: str, starts: np.ndarray) -> Movement:
    chosen = starts[np.unique(np.linspace(0, len(starts) - 1, min(MANY, len(starts))).round().astype(int))]
    breaks = np.flatnonzero(np.diff(starts) > SHORTEST) + 1
    longest = max(np.split(starts, breaks), key=len)
    stretch = features[longest[0] : longest[-1] + SHORTEST]
    if name == "walk":
        name = movement_of(_root_velocity(stretch), airborne_share(stretch), cadence(stretch))
    seconds = float(starts[0] / FPS), float((starts[-1] + SHORTEST) / FPS)
    return Movement(name, features[chosen[:, None] + STRIDE * np.arange(WINDOW)], stretch, seconds)


def _root_velocity(features: np.ndarray) -> np.ndarray:
    """The mean (3,) of features (..., 21, 15): sideways and forwards in metres a second, turn rate in radians a
    second."""
    return features[..., 0, LAYOUT["root"]].reshape(-1, 3).astype(float).mean(axis=0)


@dataclass(frozen=True, eq=False)
class Gait:
    """What is known of a style's clips without any network: n clips.

    movements: their names; root_velocities (n, 3); runs (n,) 1 where the clip is a run; cadences (n,) strides a second,
    0 where it makes none; cycles (n, coefficients, 21, 12): what of its features, all but the root's, repeats with the
    stride (see sim.motion.gait.fit_cycle), 0 where it makes none; residual: (T, 21, 3), see
    stylizer.styles.stride_residual, None where no clip is long enough."""

    movements: tuple[str, ...]
    root_velocities: np.ndarray
    runs: np.ndarray
    cadences: np.ndarray
    cycles: np.ndarray
    residual: np.ndarray | None

    @classmethod
    def of(cls, movements: Sequence[Movement]) -> "Gait":
        """Measured on movements."""
        steady = [m for m in movements if m.name in ("walk", "stand")] or movements
        longest = max(steady, key=lambda m: len(m.features))
        return cls(
            tuple(m.name for m in movements),
            np.array([_root_velocity(m.windows) for m in movements]),
            np.array([float(m.name == "run") for m in movements]),
            np.array([cadence(m.features) for m in movements]),
            np.array([_cycle(m.features) for m in movements]),
            stride_residual(longest.features),
        )

    @property
    def gaits(self) -> np.ndarray:
        """(n, 4) the clips' root velocities, and as fourth number whether they run: see sim.motion.gait.with_run."""
        return np.column_stack([self.root_velocities, self.runs])

    def weights(self, root_velocity: np.ndarray) -> np.ndarray:
        """How much each clip counts (..., n), sums of 1, for a content that moves at root velocities (..., 3).

        Inverse distance weighting (Shepard 1968): smooth, exact at the clips, and needs no grid."""
        if len(self.movements) == 1:
            return np.ones((*np.shape(root_velocity)[:-1], 1))
        content = gait_point(with_run(np.asarray(root_velocity, dtype=float)))[..., None, :]
        weights = 1 / np.square(point_distance(content, self._points) + NEAREST**2)
        weights = np.maximum(weights / weights.sum(axis=-1, keepdims=True) - LEAST_WEIGHT, 0.0)
        return weights / weights.sum(axis=-1, keepdims=True)

    @cached_property
    def _points(self) -> np.ndarray:
        """(n, 5) of the clips, see sim.motion.gait.gait_point."""
        return gait_point(self.gaits)

    def pace_of(self, movement: str, own: "Gait") -> tuple[float, float]:
        """How this style walks or runs, for a controller whose own gait is `own`: the speed in metres a second that is
        to be asked of the controller, and its playback rate.

        The controller goes at the speed where its stride is as long as the style's, played slower or quicker to the
        style's cadence. Raises KeyError where no clip shows that movement, or none that makes strides."""
        clip = next((i for i, name in enumerate(self.movements) if name == movement and self.cadences[i] > 0), None)
        ours = [i for i, name in enumerate(own.movements) if name.startswith(f"{movement}_")]
        if clip is None or not ours:
            raise KeyError(movement)
        strides_a_second = self.cadences[clip]
        stride = self.root_velocities[clip, 1] / strides_a_second
        speeds = np.linspace(own.root_velocities[ours, 1].min(), own.root_velocities[ours, 1].max(), PACE_STEPS)
        cadences = np.interp(speeds, own.root_velocities[ours, 1], own.cadences[ours])
        fits = (speeds / cadences >= stride) & (strides_a_second / cadences <= PLAYBACK_RATES[1])
        place = int(fits.argmax()) if fits.any() else PACE_STEPS - 1
        return float(speeds[place]), float(np.clip(strides_a_second / cadences[place], *PLAYBACK_RATES))


def no_cycles(count: int) -> np.ndarray:
    """The cycles of so many clips that make no strides."""
    return np.zeros((count, 1 + 2 * HARMONICS, JOINT_COUNT, BODY.stop))


def _cycle(features: np.ndarray) -> np.ndarray:
    """The cycle of one clip's features (frames, 21, 15)."""
    phase = stride_phase(features)
    if phase is None:
        return no_cycles(1)[0]
    cycle = fit_cycle(features[..., BODY], phase)
    cycle[..., LAYOUT["rotation"]] = rest_unsure_joints(cycle[..., LAYOUT["rotation"]])
    return cycle


class OwnMotion(NamedTuple):
    """The controller's own motion: of each movement windows (m, WINDOW, 21, 15) and the stride phase (m, WINDOW) of
    their samples, NaN where it makes no strides; what is known of its gait; and the fingerprint of the controller's
    weights."""

    windows: list[np.ndarray]
    phases: list[np.ndarray]
    gait: Gait
    controller: str


# What a style is encoded to: StyleFeatures, or, for a whole-body system, a Tensor. Each system meets only its own kind.
Encoded = Any


@dataclass(frozen=True)
class StyleClips:
    """The features of a style: of n clips along the batch axis, or a whole-body system's codes (n, C); and what `gait`
    says."""

    features: Encoded
    gait: Gait

    def at(self, root_velocity: np.ndarray) -> Encoded:
        """The style for contents that move at root velocities (B, 3), as a batch of B, or (3,), as a batch of 1; a code
        (B, C) or (C,)."""
        if isinstance(self.features, Tensor):
            return torch.from_numpy(self.gait.weights(root_velocity).astype(np.float32)) @ self.features
        return to_tensors(unpack(self.numbers_at(root_velocity), self.features))

    def numbers_at(self, root_velocity: np.ndarray) -> np.ndarray:
        """The same as numbers (B, 5, N) of `pack`; a clip that counts alone is not copied. Not for a whole-body
        system."""
        if len(self.gait.movements) == 1:
            count = np.size(root_velocity) // 3
            return np.broadcast_to(self._numbers, (count, *self._numbers.shape[1:])) if count > 1 else self._numbers
        weights = np.atleast_2d(self.gait.weights(root_velocity).astype(np.float32))
        counting = np.flatnonzero(weights.any(axis=0))
        if len(weights) == len(counting) == 1:
            return self._numbers[counting[0], None]
        clips = self._numbers[counting].reshape(len(counting), -1)
        mixed = torch.mm(torch.from_numpy(weights[:, counting]), torch.from_numpy(clips))
        return mixed.numpy().reshape(-1, *self._numbers.shape[1:])

    def check_like(self, own: "StyleClips") -> None:
        """Raises ValueError where what is kept of its clips has other names or shapes than in another style of the same
        network, as in a damaged file."""
        clips = len(self.gait.movements)
        ours, theirs = (
            {"code": style.features[None]} if isinstance(style.features, Tensor) else style.features
            for style in (self, own)
        )
        for name in ours.keys() | theirs.keys():
            one, other = ours.get(name), theirs.get(name)
            if one is None or other is None or one.shape[:1] + one.shape[2:] != other.shape[:1] + other.shape[2:]:
                raise ValueError(f"'{name}' has another shape than in the own style")
            if one.shape[1] != clips:
                raise ValueError(f"'{name}' is kept of {one.shape[1]} clips, but the style has {clips}")
        for name in ("root_velocities", "cadences", "runs", "cycles"):
            values, wanted = getattr(self.gait, name), getattr(own.gait, name)
            if values.shape != (clips, *wanted.shape[1:]):
                raise ValueError("what is known of its gait has another shape than in the own style")

    @cached_property
    def _numbers(self) -> np.ndarray:
        """(n, 5, N) of all clips."""
        return pack(self.features)


def single_clip(features: Encoded, motion: np.ndarray) -> StyleClips:
    """A style of one clip, encoded to features (a batch of 1, or a code (C,)), whose motion is features (frames, 21,
    15)."""
    gait = Gait(("clip",), _root_velocity(motion)[None], np.zeros(1), np.zeros(1), no_cycles(1), None)
    return StyleClips(features[None] if isinstance(features, Tensor) else features, gait)
