"""The figures of crouching, jumping and uneven ground, and of the head, beside captured clips where there are any."""

import math
from typing import Mapping, Sequence

import numpy as np

from controller.evaluation.figures import CENTI, Figure
from controller.evaluation.metrics import contact_speed, speed_share, time_until
from controller.evaluation.reference_clips import RealClips
from controller.evaluation.steering_figures import SETTLED_SECONDS, settled
from controller.evaluation.suite import (
    CROUCHES,
    JUMPS,
    PRESS_SECONDS,
    SPEEDS,
    TURN_ON_THE_SPOT,
    WAIT,
    Motion,
    Trial,
    speed_name,
)
from controller.model.io_layout import GAITS
from sim.body.skeleton import INDEX
from sim.feet.foot_lock import FLAT_HEIGHTS
from sim.math import rotations as rot
from sim.math.vectors import FORWARD
from sim.motion.clip import FPS
from sim.motion.thresholds import PLANTED

CROUCHED = 0.05  # metres from the steady height of the hips at which a crouch, or getting up, is done
AIRBORNE = 0.05  # metres over its place on the floor of the lower foot, at which both are in the air
LANDING_SECONDS = 0.3  # after a landing in which feet may not slide
CROSSED = 0.02  # metres that the left foot stands to the right of the right one


def crouching(played: Mapping[str, Trial], real: RealClips | None) -> dict[str, Figure]:
    """Speed and height in every direction, and how soon it is down and up again."""
    shares = [speed_share(*settled(played[name])) for name in CROUCHES["moves"]]
    heights = [_hips(played[name].locked)[-_frames(SETTLED_SECONDS) :].mean() for name in CROUCHES["moves"]]
    captured = [np.median(_hips(motion)[motion.crouch > 0.99]) for motion in (real.crouching if real else [])]
    theirs = float(np.mean(captured)) * CENTI if captured else None
    down, up = zip(*(_crouch_seconds(played[name]) for name in CROUCHES["changes"]))
    bounds = {} if theirs is None else {"low": theirs - 5, "high": theirs + 5}
    return {
        "speed_held_crouching_share": Figure(max(shares, key=lambda share: abs(share - 1)), low=0.9, high=1.1),
        "crouching_hips_height_cm": Figure(float(np.mean(heights)) * CENTI, theirs, **bounds),
        "crouch_down_s": Figure(max(down), high=0.5),
        "crouch_up_s": Figure(max(up), high=0.5),
    }


def jumping(played: Mapping[str, Trial]) -> dict[str, Figure]:
    """How high from the spot, how far from a run, and how the feet land."""
    landings = [_landing_speed(played[name].locked) for name in JUMPS]
    spot, run = (played[name].locked for name in ("jump on the spot", "jump from a run"))
    press = _frames(WAIT + PRESS_SECONDS)
    return {
        "jump_height_cm": Figure(float(_hips(spot)[press:].max() - _hips(spot)[press - 1]) * CENTI, low=35.0),
        "jump_distance_run_m": Figure(_jump_distance(run), low=2.0),
        "jump_landing_skate_cm_s": Figure(max(landings) * CENTI, high=10.0),
    }


def terrain(played: Mapping[str, Trial]) -> dict[str, Figure]:
    """Where planted feet are, how they slide and how the speed is held, over all trials on each kind of ground."""
    result: dict[str, Figure] = {}
    for ground in sorted({trial.ground_name for trial in played.values()}):
        trials = [trial for trial in played.values() if trial.ground_name == ground]
        off = np.concatenate([_off_ground(trial) for trial in trials])
        slide = np.concatenate([contact_speed(trial.locked.feet, trial.locked.contacts) for trial in trials])
        speeds = [_speed_on_slope(trial) for trial in trials]
        result |= {
            f"{ground}_planted_foot_off_ground_cm": Figure(float(off.mean()) * CENTI, high=1.0),
            f"{ground}_planted_foot_off_ground_p99_cm": Figure(float(np.percentile(off, 99)) * CENTI, high=3.0),
            f"{ground}_planted_foot_speed_cm_s": Figure(float(np.nanmean(slide)) * CENTI, high=10.0),
            f"{ground}_speed_held_share": Figure(min(speeds), low=0.9),
        }
    return result


def bearing(played: Mapping[str, Trial], real: RealClips | None) -> dict[str, Figure]:
    """How the head is held, by gait and from speed to speed, and whether the feet cross in a turn on the spot."""
    captured = real.held_out if real else []
    result: dict[str, Figure] = {}
    names = {
        "standing": ["stand"],
        "walking": [speed_name(*each) for each in SPEEDS if each[0] == "walk"],
        "running": [speed_name(*each) for each in SPEEDS if each[1] >= 3.0],
    }
    for gait, (name, trials) in zip(("stand", "walk", "run"), names.items(), strict=True):
        ours = _pitch([played[trial].locked for trial in trials], gait)
        theirs = _pitch(captured, gait)
        bounds = {} if theirs is None else {"low": theirs - 5, "high": theirs + 5}
        result[f"head_pitch_{name}_deg"] = Figure(ours, theirs, **bounds)
    pitches = [_steady_pitch(played["stand"].locked)]
    pitches += [_steady_pitch(played[speed_name(*each)].locked) for each in SPEEDS if speed_name(*each) in played]
    result["head_pitch_change_max_deg"] = Figure(float(np.abs(np.diff(pitches)).max()), high=6.0)
    result["feet_crossed_turning_on_the_spot_count"] = Figure(_crossed(played[TURN_ON_THE_SPOT].locked), high=0)
    return result


def _frames(seconds: float) -> int:
    return round(seconds * FPS)


def _hips(motion: Motion) -> np.ndarray:
    """Height (F,) of the hips over the floor, in metres."""
    return motion.positions[:, 0, 1]


def _crouch_seconds(trial: Trial) -> tuple[float, float]:
    """Seconds from the press until the hips are within CROUCHED of their crouching height, and from its end until they
    are back at the height they had before; the stride's own rise and fall, averaged over it, does not count."""
    crouched = np.array([command.gait == "crouch" for command in trial.script])
    start, stop = np.flatnonzero(crouched)[[0, -1]] + (0, 1)
    hips = _hips(trial.locked)
    steady = _frames(SETTLED_SECONDS)
    low, high = hips[stop - steady : stop].mean(), hips[-steady:].mean()
    return (
        time_until(hips[start:stop] < max(low, hips[stop - steady : stop].max()) + CROUCHED),
        time_until(hips[stop:] > min(high, hips[-steady:].min()) - CROUCHED),
    )


def _airborne(motion: Motion) -> np.ndarray:
    """The frames of the longest stretch in which both feet are in the air."""
    low = (motion.feet[..., 1] - np.tile(FLAT_HEIGHTS, 2)).min(axis=1) > AIRBORNE
    edges = np.flatnonzero(np.diff(np.concatenate([[0], low, [0]])))
    stretches = list(zip(edges[::2], edges[1::2]))
    start, stop = max(stretches, key=lambda each: each[1] - each[0], default=(0, 0))
    return np.arange(start, stop)


def _jump_distance(motion: Motion) -> float:
    """Metres from where the last toe leaves the floor to where the first foot comes down on it again."""
    flight = _airborne(motion)
    if not len(flight):
        return 0.0
    before, after = motion.feet[flight[0] - 1], motion.feet[flight[-1] + 1]
    way = motion.velocity[flight[len(flight) // 2]]
    way = way / max(float(np.linalg.norm(way)), 1e-9)
    left = before[before[:, 1].argmin()]
    landed = after[after[:, 1].argmin()]
    return float((landed - left)[[0, 2]] @ way)


def _landing_speed(motion: Motion) -> float:
    """Mean speed in metres a second of joints in contact, for LANDING_SECONDS after a landing."""
    flight = _airborne(motion)
    if not len(flight):
        return math.inf
    frames = slice(int(flight[-1]), int(flight[-1]) + _frames(LANDING_SECONDS))
    speeds = contact_speed(motion.feet, motion.contacts)[frames]
    return math.inf if np.isnan(speeds).all() else float(np.nanmean(speeds))


def _off_ground(trial: Trial) -> np.ndarray:
    """How far (n,) in metres each planted foot is off the ground: under it with one of its joints, or above it with
    both."""
    feet = trial.locked.feet.reshape(-1, 2, 2, 3)
    assert trial.ground is not None
    heights = feet[..., 1] - FLAT_HEIGHTS - trial.ground.height_at(feet[..., ::2])
    planted = (trial.locked.contacts.reshape(-1, 2, 2) > PLANTED).any(axis=-1)
    return np.abs(heights.min(axis=-1))[planted]


def _speed_on_slope(trial: Trial) -> float:
    """The speed as a share of what the stick asks for on the slopes that it went over."""
    start = _frames(WAIT + SETTLED_SECONDS)
    went, wanted = (np.linalg.norm(each[start:], axis=1).sum() for each in (trial.neutral.velocity, trial.wanted))
    return float(went / wanted) if wanted else 1.0


def _head_pitch(motion: Motion) -> np.ndarray:
    """Degrees (F,) that the head looks up; negative is down."""
    forward = rot.rotate(motion.rotations[:, INDEX["Head"]], FORWARD)
    return np.degrees(np.arcsin(np.clip(forward[:, 1], -1, 1)))


def _pitch(motions: Sequence[Motion], gait: str) -> float | None:
    """Median over the frames of one of GAITS."""
    values = [_head_pitch(motion)[motion.gait[:, GAITS.index(gait)] > 0.5] for motion in motions]
    pooled = np.concatenate([np.empty(0), *values])
    return float(np.median(pooled)) if len(pooled) else None


def _steady_pitch(motion: Motion) -> float:
    return float(np.median(_head_pitch(motion)[-_frames(2.0) :]))


def _crossed(motion: Motion) -> int:
    """In how many frames the left ankle is to the right of the right one, as the character faces."""
    apart = motion.feet[:, 0] - motion.feet[:, 2]
    left = rot.rotate(rot.from_yaw(-motion.root.facing), apart)[:, 0]
    return int((left < -CROSSED).sum())
