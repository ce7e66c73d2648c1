"""A style as one or more clips show it: walking, running, backing ... each encoded by itself, interpolated by root
velocity."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Sequence

import numpy as np
import torch
from torch import Tensor

from sim.body.skeleton import JOINT_COUNT
from sim.math.easing import smooth_step
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT, STRIDE
from sim.motion.gait import HARMONICS, airborne_share, cadence, fit_cycle, movement_of, stride_phase
from sim.motion.thresholds import STYLE_WALK_OR_RUN
from stylizer.networks.layers import BlockFeatures
from stylizer.styles.stride_residual import rest_unsure_joints, stride_residual
from stylizer.systems.motion_puzzle.config import KEY_POSES
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures

BODY = slice(0, LAYOUT["root"].start)  # the features that are not the root's path
WINDOW = 32  # samples at 30 Hz, as in training: the encoder has learned the edges of such a window too
SHORTEST = WINDOW * STRIDE  # frames, about a second: one stride
HOP = SHORTEST // 4  # frames between two windows that are looked at
MANY = 12  # windows that one movement is read from at most
SPEED_RANGE = 0.35  # share by which a window's speed may be off the movement's median: starts and stops are left out
SLOW = 0.3  # metres a second: speeds are compared by the logarithm of how many times this they are
SIDEWAYS = 2.0  # by how much more another direction counts than another speed
TURN_UNIT = 2.0  # radians a second of turning that count as much as a speed SLOW e^1 does beside standing
PLAYBACK_RATES = (0.7, 1.5)  # of the controller's motion, slowest and quickest
PACE_STEPS = 200  # speeds that are looked at
RUN_APART = 2.0  # by which a run is further from a walk than its speed says
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
        steady = np.abs(speeds - np.median(speeds)) <= SPEED_RANGE * np.median(speeds) + 1e-6
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


class Gait(NamedTuple):
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

    def weights(self, root_velocity: np.ndarray) -> np.ndarray:
        """How much each clip counts (..., n), sums of 1, for a content that moves at root velocities (..., 3).

        Inverse distance weighting (Shepard 1968): smooth, exact at the clips, and needs no grid."""
        velocity = np.asarray(root_velocity, dtype=float)[..., None, :]
        run = smooth_step(velocity[..., 1], *STYLE_WALK_OR_RUN) - self.runs
        square = _apart(velocity, self.root_velocities) + np.square(RUN_APART * run) + NEAREST**2
        weights = square**-2
        weights = np.maximum(weights / weights.sum(axis=-1, keepdims=True) - LEAST_WEIGHT, 0.0)
        return weights / weights.sum(axis=-1, keepdims=True)

    def pace_of(self, movement: str, own: "Gait") -> tuple[float, float]:
        """How this style walks or runs, for a controller whose own gait is `own`: the speed in metres a second that is
        to be asked of the controller, and its playback rate.

        The controller goes at the speed where its stride is as long as the style's, played slower or quicker to the
        style's cadence. Raises KeyError where no clip shows that movement, or none that makes strides."""
        clip = next((i for i, name in enumerate(self.movements) if name == movement and self.cadences[i] > 0), None)
        if clip is None:
            raise KeyError(movement)
        strides_a_second = self.cadences[clip]
        stride = self.root_velocities[clip, 1] / strides_a_second
        ours = [i for i, name in enumerate(own.movements) if name.startswith(f"{movement}_")]
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


def _apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The square of how far root velocities (..., 3) are apart: who goes another way differs more than who goes at
    another speed, and between two speeds their ratio counts."""
    speeds = [np.hypot(v[..., 0], v[..., 1]) for v in (one, other)]
    reach = [np.log1p(speed / SLOW) for speed in speeds]
    cosine = (one[..., :2] * other[..., :2]).sum(axis=-1) / np.maximum(speeds[0] * speeds[1], 1e-9)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0)) * SIDEWAYS * np.minimum(*reach)
    return np.square(reach[0] - reach[1]) + np.square(angle) + np.square((one[..., 2] - other[..., 2]) / TURN_UNIT)


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
        weights = torch.from_numpy(self.gait.weights(root_velocity).astype(np.float32))
        if isinstance(self.features, Tensor):
            return weights @ self.features
        weights = torch.atleast_2d(weights)
        counting = weights.any(dim=0).nonzero()[:, 0]
        mixed = weights[:, counting] @ self._flat[counting]
        return self._nearest(tuple(weights.argmax(dim=1).tolist())) | {
            level: BlockFeatures(*(part.unflatten(1, shape).transpose(0, 1) for part, shape in zip(parts, shapes)))
            for (level, shapes), parts in zip(self._shapes.items(), self._split(mixed))
        }

    def _nearest(self, clips: tuple[int, ...]) -> StyleFeatures:
        """The levels that are not interpolated, of a batch whose contents go most as these clips do. A lone one's are
        the same objects each time, so that who puts styles together sees what has not changed."""
        if len(clips) == 1 and clips in self._seen:
            return self._seen[clips]
        result = {
            level: BlockFeatures(*(t[:, list(clips)] for t in part))
            for level, part in self.features.items()
            if level not in self._interpolated
        }
        if len(clips) == 1:
            self._seen[clips] = result
        return result

    @cached_property
    def _seen(self) -> dict[tuple[int, ...], StyleFeatures]:
        """What `_nearest` has found, by its clip."""
        return {}

    @cached_property
    def _interpolated(self) -> StyleFeatures:
        """The levels that are interpolated: the key poses, where there are some. Of the others, which add little beside
        them and are many more numbers, the nearest clip's are taken."""
        return {KEY_POSES: self.features[KEY_POSES]} if KEY_POSES in self.features else self.features

    @cached_property
    def _shapes(self) -> dict[int, list[tuple[int, ...]]]:
        """By level the shapes, without the batch axis, of a BlockFeatures's fields."""
        return {level: [(t.shape[0], *t.shape[2:]) for t in part] for level, part in self._interpolated.items()}

    @cached_property
    def _flat(self) -> Tensor:
        """(n, N): each clip's features one after the other, so that clips are interpolated by a single product."""
        return torch.cat([t.transpose(0, 1).flatten(1) for part in self._interpolated.values() for t in part], dim=1)

    def _split(self, flat: Tensor) -> list[list[Tensor]]:
        """(B, N) -> by level the fields of a BlockFeatures, flat."""
        sizes = [int(np.prod(shape)) for shapes in self._shapes.values() for shape in shapes]
        pieces, result = iter(flat.split(sizes, dim=1)), []
        for shapes in self._shapes.values():
            result.append([next(pieces) for _ in shapes])
        return result


def single_clip(features: Encoded, motion: np.ndarray) -> StyleClips:
    """A style of one clip, encoded to features (a batch of 1, or a code (C,)), whose motion is features (frames, 21,
    15)."""
    gait = Gait(("clip",), _root_velocity(motion)[None], np.zeros(1), np.zeros(1), no_cycles(1), None)
    return StyleClips(features[None] if isinstance(features, Tensor) else features, gait)


def main_clip(clips: StyleClips) -> StyleClips:
    """The same style as its first clip alone shows it."""
    first = slice(0, 1)
    features = (
        clips.features[first]
        if isinstance(clips.features, Tensor)
        else {level: BlockFeatures(*(t[:, first] for t in part)) for level, part in clips.features.items()}
    )
    gait = clips.gait
    return replace(
        clips,
        features=features,
        gait=gait._replace(
            movements=gait.movements[first],
            root_velocities=gait.root_velocities[first],
            runs=gait.runs[first],
            cadences=gait.cadences[first],
            cycles=gait.cycles[first],
        ),
    )
