"""Evaluation of the controller: plays the fixed suite and computes every figure beside that of held-out real clips."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Iterable, Mapping, Sequence

import numpy as np
import torch

from controller import weights
from controller.measures import (
    arrival_time, contact_speed, depth_under, direction_error, drift, joint_angles, liveliness, outside, speed_share, spells,
    time_until_still)
from controller.real_clips import IDLE_SECONDS, RealClips
from controller.suite import (
    BACK, FACING_FORWARD, INSTANTS, SPEEDS, WAIT, Motion, Played, compared, follow, play, random_sticks, speed_name, suite)
from sim.clip import FPS
from sim.measures import foot_skate, frechet_distance, jerk, pose_and_velocity
from sim.skeleton import TOE_HEIGHT

SETTLED_SECONDS = 1.0  # after a wish has changed, speed and direction are held to it
WALKING, RUNNING = 1, 2  # columns of Motion.gait
HALVINGS = 20  # ways to cut the real clips in two that are averaged
ANGLE_MARGIN = math.radians(10)
FROZEN_SPEED, WALK_AT_LEAST = 0.05, 0.2  # metres a second: what is no movement, what is asking for some
RUNAWAY_SHARE, RUNAWAY_METRES = 1.5, 0.5
SLOWEST_ASKED = 0.4  # metres a second: under this "1.5 times as fast as asked" is no running away
SPELL_SECONDS = 1.0
CENTI, MILLI = 100, 1000


@dataclass(frozen=True)
class Figure:
    """A measured value, that of real clips where there is one, and the bounds to reach (None: open)."""

    ours: float | None
    real: float | None = None
    low: float | None = None
    high: float | None = None

    @property
    def reached(self) -> bool | None:
        """Whether ours lies within the bounds; None where there are none."""
        if self.ours is None or (self.low is None and self.high is None):
            return None
        return (self.low is None or self.ours >= self.low) and (self.high is None or self.ours <= self.high)

    def as_json(self) -> dict:
        """The entry of the report (DESIGN.md, Sec. 4); reach is [low, high], null where open."""
        reach = [self.low, self.high]
        return {"ours": self.ours, "real": self.real, "reach": None if reach == [None, None] else reach}


@dataclass(frozen=True)
class Evaluation:
    """The figures by name and the suite as it was played, for the plots."""

    figures: Mapping[str, Figure]
    played: Mapping[str, Played]


def evaluate(data: Path | None = None, progress: Callable[[int], Callable[[], object]] | None = None) -> Evaluation:
    """Plays everything with the shipped weights and measures it; `data` is a folder of BVH files or None.

    progress(frames) is told how much there is to play and returns what to call once a frame. The same weights and clips
    give the same figures. Raises ValueError where weights are missing or `data` holds no clips to compare with."""
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    network = weights.load()
    real = None if data is None else RealClips.load(data)
    scripts = {**suite(), "random": random_sticks()}
    ways = [follow(clip) for clip in real.held_out] if real else []
    tick = progress(sum(map(len, [*scripts.values(), *ways]))) if progress else lambda: None
    played = {name: play(script, network, tick) for name, script in scripts.items()}
    random = played.pop("random")
    followed = [play(way, network, tick).locked for way in ways]
    figures = {**steering(played), **feet(played, real), **standing(played["stand"], real), **look(played, real, followed),
               **endurance(random, real)}
    return Evaluation({name: _rounded(figure) for name, figure in figures.items()}, played)


def steering(played: Mapping[str, Played]) -> dict[str, Figure]:
    """Speed, direction, and how quickly a new wish is fulfilled; of several takes the worst counts."""
    result = {}
    for gait, speed in SPEEDS:
        take = played.get(speed_name(gait, speed))
        share = None if take is None else speed_share(*_settled(take))
        result[f"speed_held_{gait}_{speed}_m_s_share".replace(".", "_")] = Figure(share, None, 0.9, 1.1)
    kinds = {"straight": [speed_name(*kind) for kind in SPEEDS],
             "strafing": [name for name in FACING_FORWARD if not name.startswith("back")],
             "backing": [name for name in FACING_FORWARD if name.startswith("back")]}
    for kind, names in kinds.items():
        takes = [_settled(played[name]) for name in names if name in played]
        if kind != "straight":
            shares = [speed_share(*take) for take in takes]
            result[f"speed_held_{kind}_share"] = Figure(max(shares, key=lambda share: abs(share - 1)), None, 0.9, 1.1)
        error = max(direction_error(*take) for take in takes)
        result[f"direction_error_{kind}_deg"] = Figure(math.degrees(error), None, None, 5.0)
    for gait, limit in (("walk", 0.9), ("run", 1.2)):
        changes = [_last_change(played[f"reverse {gait} {instant}"]) for instant in range(INSTANTS)]
        result[f"reversal_{gait}_s"] = Figure(max(arrival_time(*change) for change in changes), None, None, limit)
    starts = [_stretches(played[f"stop walk {instant}"])[i] for instant in range(INSTANTS) for i in (1, 3)]
    result["start_walk_s"] = Figure(max(arrival_time(*start) for start in starts), None, None, 0.6)
    for gait in ("walk", "run"):
        stops = [_stretches(played[f"stop {gait} {instant}"])[2][0] for instant in range(INSTANTS)]
        result[f"stop_{gait}_s"] = Figure(max(map(time_until_still, stops)), None, None, 0.6)
    lead = max(np.linalg.norm(take.simulated - take.neutral.root.positions[:, [0, 2]], axis=1).max() for take in played.values())
    result["simulated_body_ahead_max_cm"] = Figure(lead * CENTI, None, None, 15.0 + 1e-6)
    return result


def feet(played: Mapping[str, Played], real: RealClips | None) -> dict[str, Figure]:
    """Skating, sliding contacts and the floor, over all frames of the suite that walk or run."""
    takes = list(played.values())
    neutral, locked = [take.neutral for take in takes], [take.locked for take in takes]
    captured = real.held_out if real else []
    result = {}
    for gait, name in ((WALKING, "walk"), (RUNNING, "run")):
        def skate(motion: Motion) -> np.ndarray:
            return foot_skate(motion.feet[:, 1::2]) * CENTI

        theirs = _pooled(captured, skate, gait)
        result[f"skate_{name}_before_lock_cm_s"] = Figure(_pooled(neutral, skate, gait), theirs)
        limit = 10.0 if theirs is None else min(10.0, theirs)
        result[f"skate_{name}_cm_s"] = Figure(_pooled(locked, skate, gait), theirs, None, limit)
    for gait, name in ((WALKING, "walk"), (RUNNING, "run")):
        def slide(motion: Motion) -> np.ndarray:
            return contact_speed(motion.feet, motion.contacts) * CENTI

        result[f"contact_speed_{name}_cm_s"] = Figure(_pooled(locked, slide, gait), _pooled(captured, slide, gait), None, 2.0)
    for toe, side in ((1, "left"), (3, "right")):
        def share(motion: Motion) -> np.ndarray:
            return motion.contacts[:, toe] > 0.5

        result[f"toe_contact_{side}_share"] = Figure(_pooled(locked, share, WALKING), _pooled(captured, share, WALKING), 0.45, 0.7)
    # Two readings of the floor: no joint under it; and no toe joint lower than it lies in a flat foot, or the sole dips in.
    for name, joints, level in (("floor_pierced", slice(None), 0.0), ("toe_dip", [4, 8], TOE_HEIGHT)):
        def depth(motion: Motion) -> np.ndarray:
            return depth_under(motion.positions[:, joints, 1], level) * CENTI

        result[f"{name}_p99_cm"] = Figure(*(_percentile_99(motions, depth) for motions in (locked, captured)), None, 1.0)
    return result


def standing(take: Played, real: RealClips | None) -> dict[str, Figure]:
    """Twenty seconds without a wish, beside the stands of all real clips."""
    ours, theirs = [take.locked], real.idle if real else []
    result = {"standing_drift_cm": Figure(drift(take.locked.root.positions) * CENTI, None, None, 1.0)}
    for name, step in (("m_s3", 1), ("30_hz_m_s3", 2)):
        captured = _pooled(theirs, _jerk_at(step))
        result[f"standing_jerk_{name}"] = Figure(_pooled(ours, _jerk_at(step)), captured, None, captured)

    def moving(motions: Sequence[Motion]) -> float | None:
        """Over windows of IDLE_SECONDS, ours and theirs alike: the longer one looks, the more a body has shifted."""
        size = round(IDLE_SECONDS * FPS)
        windows = [m[start:start + size] for m in motions for start in range(0, len(m) - size + 1, size)]
        return float(np.mean([liveliness(_relative(w)) for w in windows])) * MILLI if windows else None

    captured = moving(theirs)
    result["standing_alive_mm"] = Figure(moving(ours), captured, 1.0 if captured is None else captured / 2)
    result["standing_alive_20_s_mm"] = Figure(liveliness(_relative(take.locked)) * MILLI)
    return result


def look(played: Mapping[str, Played], real: RealClips | None, followed: Sequence[Motion]) -> dict[str, Figure]:
    """Smoothness while walking, and how like captured motion it is on the very ways of the held-out clips."""
    locked, captured = [take.locked for take in played.values()], real.held_out if real else []
    result = {}
    for name, step in (("m_s3", 1), ("30_hz_m_s3", 2)):
        theirs = _pooled(captured, _jerk_at(step), WALKING)
        limit = None if theirs is None else 1.2 * theirs
        result[f"walking_jerk_{name}"] = Figure(_pooled(locked, _jerk_at(step), WALKING), theirs, None, limit)
    if not real:
        return {**result, "frechet_distance_cm2": Figure(None)}
    theirs, ours = ([pose_and_velocity(features) for features in side]
                    for side in zip(*(compared(clip, motion) for clip, motion in zip(captured, followed))))
    distance = frechet_distance(np.concatenate(ours), np.concatenate(theirs)) * CENTI**2
    halves = between_halves(theirs) * CENTI**2
    return {**result, "frechet_distance_cm2": Figure(distance, halves, None, 1.5 * halves)}


def between_halves(clips: Sequence[np.ndarray]) -> float:
    """Mean Frechet distance between random halves of the clips' features, cut between clips, HALVINGS times."""
    random, middle = np.random.default_rng(0), len(clips) // 2
    distances = []
    for _ in range(HALVINGS):
        order = random.permutation(len(clips))
        distances.append(frechet_distance(*(np.concatenate([clips[i] for i in half]) for half in (order[:middle], order[middle:]))))
    return float(np.mean(distances))


def endurance(take: Played, real: RealClips | None) -> dict[str, Figure]:
    """Ten minutes of random sticks: what breaks."""
    def share_outside(motions: Iterable[Motion]) -> float | None:
        if not real:
            return None
        return float(np.mean(np.concatenate([
            outside(joint_angles(m.local_rotations, m.root.facing), real.low, real.high, ANGLE_MARGIN) for m in motions])))

    asked = np.linalg.norm(take.asked, axis=1)
    speed = np.linalg.norm(take.neutral.velocity, axis=1)
    ahead = np.linalg.norm(take.simulated - take.neutral.root.positions[:, [0, 2]], axis=1)
    frozen = spells((speed < FROZEN_SPEED) & (asked > WALK_AT_LEAST), SPELL_SECONDS)
    fast = spells(speed > RUNAWAY_SHARE * np.maximum(asked, SLOWEST_ASKED), SPELL_SECONDS)
    return {
        "random_nan_count": Figure(int((~np.isfinite(take.locked.positions)).sum()), None, None, 0),
        "random_outside_joint_range_share": Figure(share_outside([take.locked]), share_outside(real.held_out if real else []),
                                                   None, 0.001),
        "random_freezes_count": Figure(len(frozen), None, None, 0),
        "random_runaways_count": Figure(len(fast) + len(spells(ahead > RUNAWAY_METRES, 0.0)), None, None, 0),
    }


def _stretches(take: Played) -> list[tuple[np.ndarray, np.ndarray]]:
    """(velocity (F, 2), asked (2,)) of each stretch over which the stick asks for one and the same."""
    edges = np.flatnonzero(np.any(np.diff(take.asked, axis=0) != 0, axis=1)) + 1
    return [(velocity, asked[0]) for velocity, asked in
            zip(np.split(take.neutral.velocity, edges), np.split(take.asked, edges))]


def _last_change(take: Played) -> tuple[np.ndarray, np.ndarray]:
    return _stretches(take)[-1]


def _settled(take: Played) -> tuple[np.ndarray, np.ndarray]:
    """Velocity from SETTLED_SECONDS after the stick has moved, and what it asks for."""
    velocity, asked = _last_change(take)
    return velocity[round(SETTLED_SECONDS * FPS):], asked


def _relative(motion: Motion) -> np.ndarray:
    return motion.positions - motion.root.positions[:, None]


def _jerk_at(step: int) -> Callable[[Motion], np.ndarray]:
    """Jerk of every step-th frame. Clips captured at 30 Hz have corners where they were resampled to 60, which every second
    frame goes around."""
    def measure(motion: Motion) -> np.ndarray:
        result = np.full((len(motion), motion.positions.shape[1]), np.nan)
        result[::step] = jerk(motion.positions[::step], motion.root.positions[::step], FPS / step)
        return result
    return measure


def _pooled(motions: Sequence[Motion], measure: Callable[[Motion], np.ndarray], gait: int | None = None) -> float | None:
    """Mean of a measure (F, ...) over all frames of one gait (None: every frame) where it applies; None if it never does."""
    values = [measure(m)[slice(None) if gait is None else m.gait[:, gait] > 0.5].ravel() for m in motions]
    values = np.concatenate([np.empty(0), *values])
    values = values[~np.isnan(values)]
    return float(values.mean()) if len(values) else None


def _percentile_99(motions: Sequence[Motion], measure: Callable[[Motion], np.ndarray]) -> float | None:
    return float(np.percentile(np.concatenate([measure(m) for m in motions]), 99)) if motions else None


def _rounded(figure: Figure) -> Figure:
    """Four significant digits of every number; what is no number at all, as a stop that never comes, is None and so short."""
    def short(value):
        return value if value is None or isinstance(value, int) else float(f"{value:.4g}")
    return Figure(*(short(value) for value in vars(figure).values()))
