"""The figures that the controller is judged by: ours, that of real clips measured alike, and what is to be reached."""

import math
from dataclasses import dataclass
from typing import Callable, Mapping, Sequence

import numpy as np

from controller.evaluation.metrics import (
    contact_speed,
    depth_under,
    drift,
    joint_angles,
    motion_amplitude,
    outside,
    spells,
)
from controller.evaluation.reference_clips import IDLE_SECONDS, RealClips
from controller.evaluation.suite import Motion, Trial, compare
from sim.body.skeleton import TOE_HEIGHT, TOES
from sim.motion.clip import FPS
from sim.motion.metrics import foot_skate, frechet_distance, jerk, pose_and_velocity
from sim.motion.thresholds import PLANTED

WALKING, RUNNING = 1, 2  # columns of Motion.gait
GAITS_MEASURED = ((WALKING, "walk"), (RUNNING, "run"))
JERKS = (("m_s3", 1), ("30_hz_m_s3", 2))  # unit and rate in the name, and every which frame is looked at
HALVINGS = 20  # ways to cut the real clips in two that are averaged
ANGLE_MARGIN = math.radians(10)
FROZEN_SPEED, WALK_AT_LEAST = 0.05, 0.2  # metres a second: what is no movement, what is asking for some
RUNAWAY_SHARE, RUNAWAY_METRES = 1.5, 0.5
SLOWEST_DESIRED = 0.4  # metres a second: under this "1.5 times as fast as asked" is no running away
SPELL_SECONDS = 1.0
CENTI, MILLI = 100, 1000

Measure = Callable[[Motion], np.ndarray]  # (F, ...), NaN where it does not apply


@dataclass(frozen=True)
class Figure:
    """A measured value, that of real clips where there is one, and the bounds to reach (None: open)."""

    ours: float | None
    real: float | None = None
    low: float | None = None
    high: float | None = None

    @property
    def reached(self) -> bool | None:
        """Whether ours lies within the bounds, which nothing measurable does not; None where there are no bounds."""
        if self.low is None and self.high is None:
            return None
        return (
            self.ours is not None
            and (self.low is None or self.ours >= self.low)
            and (self.high is None or self.ours <= self.high)
        )

    def as_json(self) -> dict:
        """The entry of the report; reach is [low, high], null where open."""
        reach = [self.low, self.high]
        return {"ours": self.ours, "real": self.real, "reach": None if reach == [None, None] else reach}

    def rounded(self) -> "Figure":
        """Four significant digits of every number; what is not finite, as a stop that never comes, is None."""

        def short(value: float | None) -> float | None:
            if value is None or not math.isfinite(value):
                return None
            return value if isinstance(value, int) else float(f"{value:.4g}")

        return Figure(*(short(value) for value in vars(self).values()))


def feet(played: Mapping[str, Trial], real: RealClips | None) -> dict[str, Figure]:
    """Skating, sliding contacts and the floor, over all frames of the suite that walk or run."""
    trials = list(played.values())
    neutral, locked = [trial.neutral for trial in trials], [trial.locked for trial in trials]
    captured = real.held_out if real else []
    result = {}
    for gait, name in GAITS_MEASURED:
        theirs = _pooled(captured, _skate, gait)
        result[f"skate_{name}_before_lock_cm_s"] = Figure(_pooled(neutral, _skate, gait), theirs)
        limit = 10.0 if theirs is None else min(10.0, theirs)
        result[f"skate_{name}_cm_s"] = Figure(_pooled(locked, _skate, gait), theirs, high=limit)
    for gait, name in GAITS_MEASURED:
        slide, theirs = (_pooled(motions, _contact_speed, gait) for motions in (locked, captured))
        result[f"contact_speed_{name}_cm_s"] = Figure(slide, theirs, high=2.0)
    for toe, side in enumerate(("left", "right")):
        share, theirs = (_pooled(motions, _toe_contact(toe), WALKING) for motions in (locked, captured))
        result[f"toe_contact_{side}_share"] = Figure(share, theirs, low=0.45, high=0.7)
    # Two readings of the floor: no joint is under it; no toe joint is lower than in a flat foot, or the sole dips in.
    for name, joints, level in (("floor_pierced", slice(None), 0.0), ("toe_dip", TOES, TOE_HEIGHT)):
        depth, theirs = (
            _percentile_99([depth_under(m.positions[:, joints, 1], level) * CENTI for m in motions])
            for motions in (locked, captured)
        )
        result[f"{name}_p99_cm"] = Figure(depth, theirs, high=1.0)
    return result


def _skate(motion: Motion) -> np.ndarray:
    return foot_skate(motion.positions[:, TOES]) * CENTI


def _toe_contact(toe: int) -> Measure:
    """Whether the left toe (0) or the right (1) is in contact."""
    return lambda motion: motion.contacts[:, 2 * toe + 1] > PLANTED


def _contact_speed(motion: Motion) -> np.ndarray:
    return contact_speed(motion.feet, motion.contacts) * CENTI


def standing(trial: Trial, real: RealClips | None) -> dict[str, Figure]:
    """Twenty seconds without a wish, beside the stands of all real clips."""
    ours, theirs = [trial.locked], real.idle if real else []
    result = {"standing_drift_cm": Figure(drift(trial.locked.root.positions) * CENTI, high=1.0)}
    for unit, step in JERKS:
        captured = _pooled(theirs, _jerk_at(step))
        result[f"standing_jerk_{unit}"] = Figure(_pooled(ours, _jerk_at(step)), captured, high=captured)

    captured = _alive(theirs)
    result["standing_alive_mm"] = Figure(_alive(ours), captured, low=1.0 if captured is None else captured / 2)
    result["standing_alive_20_s_mm"] = Figure(motion_amplitude(_relative(trial.locked)) * MILLI)
    return result


def _alive(motions: Sequence[Motion]) -> float | None:
    """Millimetres, over windows of IDLE_SECONDS for all alike, for the longer one looks, the more a body has shifted;
    the median, for a few of the real stands are gestures."""
    size = round(IDLE_SECONDS * FPS)
    windows = [m[start : start + size] for m in motions for start in range(0, len(m) - size + 1, size)]
    return float(np.median([motion_amplitude(_relative(w)) for w in windows])) * MILLI if windows else None


def smoothness(played: Mapping[str, Trial], real: RealClips | None) -> dict[str, Figure]:
    """Jerk of all frames of the suite that walk."""
    return _walking_jerk("", [trial.locked for trial in played.values()], real.held_out if real else [])


def likeness(real: RealClips | None, followed: Sequence[Motion]) -> dict[str, Figure]:
    """Like for like: what was played along the paths of the held-out clips, beside those clips. The suite asks for
    livelier movement than most of them show."""
    pairs = [compare(clip, motion) for clip, motion in zip(real.held_out, followed)] if real else []
    captured, ours = [clip for clip, _ in pairs], [motion for _, motion in pairs]
    result = {}
    for gait, name in GAITS_MEASURED:
        theirs = _pooled(captured, _skate, gait)
        result[f"same_ways_skate_{name}_cm_s"] = Figure(_pooled(ours, _skate, gait), theirs, high=theirs)
    result |= _walking_jerk("same_ways_", ours, captured)
    real_features, our_features = (
        [pose_and_velocity(motion.features()) for motion in side] for side in (captured, ours)
    )
    distance = (
        frechet_distance(np.concatenate(our_features), np.concatenate(real_features)) * CENTI**2 if real else None
    )
    halves = between_halves(real_features) * CENTI**2 if len(real_features) > 1 else None
    result["same_ways_frechet_distance_cm2"] = Figure(distance, halves, high=None if halves is None else 1.5 * halves)
    return result


def _walking_jerk(prefix: str, ours: Sequence[Motion], captured: Sequence[Motion]) -> dict[str, Figure]:
    result = {}
    for unit, step in JERKS:
        theirs = _pooled(captured, _jerk_at(step), WALKING)
        limit = None if theirs is None else 1.2 * theirs
        result[f"{prefix}walking_jerk_{unit}"] = Figure(_pooled(ours, _jerk_at(step), WALKING), theirs, high=limit)
    return result


def between_halves(clips: Sequence[np.ndarray]) -> float:
    """Mean Frechet distance between random halves of two or more clips' features, cut between clips, HALVINGS times."""
    random, middle = np.random.default_rng(0), len(clips) // 2
    distances = []
    for _ in range(HALVINGS):
        order = random.permutation(len(clips))
        halves = (np.concatenate([clips[i] for i in half]) for half in (order[:middle], order[middle:]))
        distances.append(frechet_distance(*halves))
    return float(np.mean(distances))


def endurance(trial: Trial, real: RealClips | None) -> dict[str, Figure]:
    """Ten minutes of random sticks: what breaks."""
    desired = np.linalg.norm(trial.desired, axis=1)
    speed = np.linalg.norm(trial.neutral.velocity, axis=1)
    frozen = spells((speed < FROZEN_SPEED) & (desired > WALK_AT_LEAST), SPELL_SECONDS)
    fast = spells(speed > RUNAWAY_SHARE * np.maximum(desired, SLOWEST_DESIRED), SPELL_SECONDS)
    return {
        "random_nan_count": Figure(int((~np.isfinite(trial.locked.positions)).sum()), high=0),
        "random_outside_joint_range_share": Figure(None)
        if real is None
        else Figure(_outside_share([trial.locked], real), _outside_share(real.held_out, real), high=0.001),
        "random_freezes_count": Figure(len(frozen), high=0),
        "random_runaways_count": Figure(len(fast) + len(spells(trial.lead > RUNAWAY_METRES, 0.0)), high=0),
    }


def _outside_share(motions: Sequence[Motion], real: RealClips) -> float:
    """Share of frames with a joint further than ANGLE_MARGIN out of the training clips' range."""
    angles = np.concatenate([joint_angles(m.local_rotations, m.root.facing) for m in motions])
    return float(outside(angles, real.low, real.high, ANGLE_MARGIN).mean())


def _relative(motion: Motion) -> np.ndarray:
    return motion.positions - motion.root.positions[:, None]


def _jerk_at(step: int) -> Measure:
    """Jerk of every step-th frame. Clips captured at 30 Hz have corners where they were resampled to 60, which every
    second frame goes around."""

    def measure(motion: Motion) -> np.ndarray:
        result = np.full((len(motion), motion.positions.shape[1]), np.nan)
        result[::step] = jerk(motion.positions[::step], motion.root.positions[::step], FPS / step)
        return result

    return measure


def _pooled(motions: Sequence[Motion], measure: Measure, gait: int | None = None) -> float | None:
    """Mean of a measure over all frames of one gait (None: every frame) where it applies; None if it never does."""
    values = [measure(m)[slice(None) if gait is None else m.gait[:, gait] > 0.5].ravel() for m in motions]
    pooled = np.concatenate([np.empty(0), *values])
    pooled = pooled[~np.isnan(pooled)]
    return float(pooled.mean()) if len(pooled) else None


def _percentile_99(values: Sequence[np.ndarray]) -> float | None:
    return float(np.percentile(np.concatenate(values), 99)) if values else None
