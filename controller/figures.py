"""The figures that the controller is judged by: ours, that of real clips measured alike, and what is to be reached."""

import math
from dataclasses import dataclass
from typing import Callable, Mapping, Sequence

import numpy as np

from controller.measures import (
    PLANTED,
    arrival_time,
    contact_speed,
    depth_under,
    direction_error,
    drift,
    joint_angles,
    liveliness,
    outside,
    speed_share,
    spells,
    time_until,
    time_until_still,
)
from controller.real_clips import IDLE_SECONDS, RealClips
from controller.suite import FACING_FORWARD, INSTANTS, SPEEDS, TURNS, Motion, Played, compared, speed_name
from sim import rotations as rot
from sim.clip import FPS
from sim.measures import foot_skate, frechet_distance, jerk, pose_and_velocity
from sim.skeleton import TOE_HEIGHT, TOES

SETTLED_SECONDS = 1.0  # after a wish has changed, speed and direction are held to it
WALKING, RUNNING = 1, 2  # columns of Motion.gait
GAITS_MEASURED = ((WALKING, "walk"), (RUNNING, "run"))
JERKS = (("m_s3", 1), ("30_hz_m_s3", 2))  # unit and rate in the name, and every which frame is looked at
HALVINGS = 20  # ways to cut the real clips in two that are averaged
ANGLE_MARGIN = math.radians(10)
FROZEN_SPEED, WALK_AT_LEAST = 0.05, 0.2  # metres a second: what is no movement, what is asking for some
RUNAWAY_SHARE, RUNAWAY_METRES = 1.5, 0.5
SLOWEST_ASKED = 0.4  # metres a second: under this "1.5 times as fast as asked" is no running away
SPELL_SECONDS = 1.0
FACED = math.radians(10)  # of the facing asked for, at which a turn on the spot counts as done
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
        return (self.ours is not None and (self.low is None or self.ours >= self.low)
                and (self.high is None or self.ours <= self.high))

    def as_json(self) -> dict:
        """The entry of the report (DESIGN.md, Sec. 4); reach is [low, high], null where open."""
        reach = [self.low, self.high]
        return {"ours": self.ours, "real": self.real, "reach": None if reach == [None, None] else reach}

    def rounded(self) -> "Figure":
        """Four significant digits of every number; what is not finite, as a stop that never comes, is None."""
        def short(value: float | None) -> float | None:
            if value is None or not math.isfinite(value):
                return None
            return value if isinstance(value, int) else float(f"{value:.4g}")
        return Figure(*(short(value) for value in vars(self).values()))


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
        turns = [_last_change(played[f"turn {gait} {angle}"]) for angle in TURNS]
        result[f"turn_{gait}_s"] = Figure(max(arrival_time(*turn) for turn in turns), None, None, limit)
    starts = [_stretches(played[f"stop walk {instant}"])[i] for instant in range(INSTANTS) for i in (1, 3)]
    result["start_walk_s"] = Figure(max(arrival_time(*start) for start in starts), None, None, 0.6)
    for gait in ("walk", "run"):
        stops = [_stretches(played[f"stop {gait} {instant}"])[2][0] for instant in range(INSTANTS)]
        result[f"stop_{gait}_s"] = Figure(max(map(time_until_still, stops)), None, None, 0.6)
    result["turn_on_the_spot_s"] = Figure(_facing_time(played["turn on the spot"]), None, None, 0.9)  # as a walk reversed
    # The simulated body waits for the character on its leash (controller.trajectory.LEASH): this one guards that.
    lead = max(_ahead(take).max() for take in played.values())
    result["simulated_body_ahead_max_cm"] = Figure(float(lead) * CENTI, None, None, 15.0)
    return result


def feet(played: Mapping[str, Played], real: RealClips | None) -> dict[str, Figure]:
    """Skating, sliding contacts and the floor, over all frames of the suite that walk or run."""
    takes = list(played.values())
    neutral, locked = [take.neutral for take in takes], [take.locked for take in takes]
    captured = real.held_out if real else []
    result = {}
    for gait, name in GAITS_MEASURED:
        theirs = _pooled(captured, _skate, gait)
        result[f"skate_{name}_before_lock_cm_s"] = Figure(_pooled(neutral, _skate, gait), theirs)
        limit = 10.0 if theirs is None else min(10.0, theirs)
        result[f"skate_{name}_cm_s"] = Figure(_pooled(locked, _skate, gait), theirs, None, limit)
    for gait, name in GAITS_MEASURED:
        slide = (_pooled(motions, _contact_speed, gait) for motions in (locked, captured))
        result[f"contact_speed_{name}_cm_s"] = Figure(*slide, None, 2.0)
    for toe, side in enumerate(("left", "right")):
        share = (_pooled(motions, lambda m, toe=toe: m.contacts[:, 2 * toe + 1] > PLANTED, WALKING)
                 for motions in (locked, captured))
        result[f"toe_contact_{side}_share"] = Figure(*share, 0.45, 0.7)
    # Two readings of the floor: no joint is under it; no toe joint is lower than in a flat foot, or the sole dips in.
    for name, joints, level in (("floor_pierced", slice(None), 0.0), ("toe_dip", TOES, TOE_HEIGHT)):
        depth = (_percentile_99([depth_under(m.positions[:, joints, 1], level) * CENTI for m in motions])
                 for motions in (locked, captured))
        result[f"{name}_p99_cm"] = Figure(*depth, None, 1.0)
    return result


def _skate(motion: Motion) -> np.ndarray:
    return foot_skate(motion.positions[:, TOES]) * CENTI


def _contact_speed(motion: Motion) -> np.ndarray:
    return contact_speed(motion.feet, motion.contacts) * CENTI


def standing(take: Played, real: RealClips | None) -> dict[str, Figure]:
    """Twenty seconds without a wish, beside the stands of all real clips."""
    ours, theirs = [take.locked], real.idle if real else []
    result = {"standing_drift_cm": Figure(drift(take.locked.root.positions) * CENTI, None, None, 1.0)}
    for unit, step in JERKS:
        captured = _pooled(theirs, _jerk_at(step))
        result[f"standing_jerk_{unit}"] = Figure(_pooled(ours, _jerk_at(step)), captured, None, captured)

    captured = _alive(theirs)
    result["standing_alive_mm"] = Figure(_alive(ours), captured, 1.0 if captured is None else captured / 2)
    result["standing_alive_20_s_mm"] = Figure(liveliness(_relative(take.locked)) * MILLI)
    return result


def _alive(motions: Sequence[Motion]) -> float | None:
    """Millimetres, over windows of IDLE_SECONDS for all alike, for the longer one looks, the more a body has shifted; the
    median, for a few of the real stands are gestures."""
    size = round(IDLE_SECONDS * FPS)
    windows = [m[start:start + size] for m in motions for start in range(0, len(m) - size + 1, size)]
    return float(np.median([liveliness(_relative(w)) for w in windows])) * MILLI if windows else None


def smoothness(played: Mapping[str, Played], real: RealClips | None) -> dict[str, Figure]:
    """Jerk of all frames of the suite that walk."""
    return _walking_jerk("", [take.locked for take in played.values()], real.held_out if real else [])


def likeness(real: RealClips | None, followed: Sequence[Motion]) -> dict[str, Figure]:
    """Like for like: what was played along the ways of the held-out clips, beside those clips. The suite asks for
    livelier movement than most of them show."""
    pairs = [compared(clip, motion) for clip, motion in zip(real.held_out, followed)] if real else []
    captured, ours = [clip for clip, _ in pairs], [motion for _, motion in pairs]
    result = {}
    for gait, name in GAITS_MEASURED:
        theirs = _pooled(captured, _skate, gait)
        result[f"same_ways_skate_{name}_cm_s"] = Figure(_pooled(ours, _skate, gait), theirs, None, theirs)
    result |= _walking_jerk("same_ways_", ours, captured)
    theirs, ours = ([pose_and_velocity(motion.features()) for motion in side] for side in (captured, ours))
    distance = frechet_distance(np.concatenate(ours), np.concatenate(theirs)) * CENTI**2 if real else None
    halves = between_halves(theirs) * CENTI**2 if len(theirs) > 1 else None
    result["same_ways_frechet_distance_cm2"] = Figure(distance, halves, None, None if halves is None else 1.5 * halves)
    return result


def _walking_jerk(prefix: str, ours: Sequence[Motion], captured: Sequence[Motion]) -> dict[str, Figure]:
    result = {}
    for unit, step in JERKS:
        theirs = _pooled(captured, _jerk_at(step), WALKING)
        limit = None if theirs is None else 1.2 * theirs
        result[f"{prefix}walking_jerk_{unit}"] = Figure(_pooled(ours, _jerk_at(step), WALKING), theirs, None, limit)
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


def endurance(take: Played, real: RealClips | None) -> dict[str, Figure]:
    """Ten minutes of random sticks: what breaks."""
    asked = np.linalg.norm(take.asked, axis=1)
    speed = np.linalg.norm(take.neutral.velocity, axis=1)
    frozen = spells((speed < FROZEN_SPEED) & (asked > WALK_AT_LEAST), SPELL_SECONDS)
    fast = spells(speed > RUNAWAY_SHARE * np.maximum(asked, SLOWEST_ASKED), SPELL_SECONDS)
    return {
        "random_nan_count": Figure(int((~np.isfinite(take.locked.positions)).sum()), None, None, 0),
        "random_outside_joint_range_share": Figure(None) if real is None else Figure(
            _outside_share([take.locked], real), _outside_share(real.held_out, real), None, 0.001),
        "random_freezes_count": Figure(len(frozen), None, None, 0),
        "random_runaways_count": Figure(len(fast) + len(spells(_ahead(take) > RUNAWAY_METRES, 0.0)), None, None, 0),
    }


def _outside_share(motions: Sequence[Motion], real: RealClips) -> float:
    """Share of frames with a joint further than ANGLE_MARGIN out of the training clips' range."""
    angles = np.concatenate([joint_angles(m.local_rotations, m.root.facing) for m in motions])
    return float(outside(angles, real.low, real.high, ANGLE_MARGIN).mean())


def _stretches(take: Played) -> list[tuple[np.ndarray, np.ndarray]]:
    """(velocity (F, 2), asked (2,)) of each stretch over which the stick asks for one and the same."""
    edges = np.flatnonzero(np.any(np.diff(take.asked, axis=0) != 0, axis=1)) + 1
    return [(velocity, asked[0]) for velocity, asked in
            zip(np.split(take.neutral.velocity, edges), np.split(take.asked, edges))]


def _facing_time(take: Played) -> float:
    """Seconds until the facing last asked for is within FACED, and stays there; infinite where it never is."""
    face = [command.face for command in take.script]
    asked = next(frame for frame in range(len(face) - 1, 0, -1) if face[frame] != face[frame - 1])
    off = np.abs(rot.wrap_angle(take.neutral.root.facing[asked:] - rot.yaw_of(np.array(face[-1]))))
    return time_until(off < FACED)


def _last_change(take: Played) -> tuple[np.ndarray, np.ndarray]:
    return _stretches(take)[-1]


def _settled(take: Played) -> tuple[np.ndarray, np.ndarray]:
    """Velocity from SETTLED_SECONDS after the stick has moved, and what it asks for."""
    velocity, asked = _last_change(take)
    return velocity[round(SETTLED_SECONDS * FPS):], asked


def _ahead(take: Played) -> np.ndarray:
    """How far (F,) the simulated body is from the character."""
    return np.linalg.norm(take.simulated - take.neutral.root.positions[:, [0, 2]], axis=1)


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
    values = np.concatenate([np.empty(0), *values])
    values = values[~np.isnan(values)]
    return float(values.mean()) if len(values) else None


def _percentile_99(values: Sequence[np.ndarray]) -> float | None:
    return float(np.percentile(np.concatenate(values), 99)) if values else None
