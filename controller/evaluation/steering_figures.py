"""The figures of steering: does it go where the stick says, as fast, and how soon after the stick has moved."""

import math
from typing import Mapping

import numpy as np

from controller.evaluation.figures import CENTI, Figure
from controller.evaluation.metrics import arrival_time, direction_error, speed_share, time_until, time_until_still
from controller.evaluation.suite import FACING_FORWARD, INSTANTS, SPEEDS, TURNS, Trial, speed_name
from sim.math import rotations as rot
from sim.motion.clip import FPS

SETTLED_SECONDS = 1.0  # after a wish has changed, speed and direction are held to it
FACED = math.radians(10)  # of the facing asked for, at which a turn on the spot counts as done


def steering(played: Mapping[str, Trial]) -> dict[str, Figure]:
    """Speed, direction, and how quickly a new wish is fulfilled; of several trials the worst counts."""
    # The simulated body waits for the character at its longest lead (controller.runtime.trajectory.MAX_LEAD): this one
    # guards that.
    lead = float(max(trial.lead.max() for trial in played.values()))
    return {**_held(played), **_fulfilled(played), "simulated_body_ahead_max_cm": Figure(lead * CENTI, high=15.0)}


def _held(played: Mapping[str, Trial]) -> dict[str, Figure]:
    """Speed and direction while the stick rests."""
    result = {}
    for gait, speed in SPEEDS:
        trial = played.get(speed_name(gait, speed))
        share = None if trial is None else speed_share(*settled(trial))
        result[f"speed_held_{gait}_{speed}_m_s_share".replace(".", "_")] = Figure(share, low=0.9, high=1.1)
    kinds = {
        "straight": [speed_name(*kind) for kind in SPEEDS],
        "strafing": [name for name in FACING_FORWARD if not name.startswith("back")],
        "backing": [name for name in FACING_FORWARD if name.startswith("back")],
    }
    for kind, names in kinds.items():
        trials = [settled(played[name]) for name in names if name in played]
        if kind != "straight":  # each speed of which has a figure of its own
            shares = [speed_share(*trial) for trial in trials]
            result[f"speed_held_{kind}_share"] = Figure(
                max(shares, key=lambda share: abs(share - 1)), low=0.9, high=1.1
            )
        error = max(direction_error(*trial) for trial in trials)
        result[f"direction_error_{kind}_deg"] = Figure(math.degrees(error), high=5.0)
    return result


def _fulfilled(played: Mapping[str, Trial]) -> dict[str, Figure]:
    """Seconds until a reversal, a turn, a start or a stop is done."""
    result = {}
    for gait, limit in (("walk", 0.9), ("run", 1.2)):
        changes = {
            "reversal": [f"reverse {gait} {instant}" for instant in range(INSTANTS)],
            "turn": [f"turn {gait} {angle}" for angle in TURNS],
        }
        for change, names in changes.items():
            slowest = max(arrival_time(*_stretches(played[name])[-1]) for name in names)
            result[f"{change}_{gait}_s"] = Figure(slowest, high=limit)
    starts = [_stretches(played[f"stop walk {instant}"])[i] for instant in range(INSTANTS) for i in (1, 3)]
    result["start_walk_s"] = Figure(max(arrival_time(*start) for start in starts), high=0.6)
    for gait in ("walk", "run"):
        stops = [_stretches(played[f"stop {gait} {instant}"])[2][0] for instant in range(INSTANTS)]
        result[f"stop_{gait}_s"] = Figure(max(map(time_until_still, stops)), high=0.6)
    result["turn_on_the_spot_s"] = Figure(_facing_time(played["turn on the spot"]), high=0.9)  # as a walk reversed
    return result


def _stretches(trial: Trial) -> list[tuple[np.ndarray, np.ndarray]]:
    """(velocity (F, 2), asked (2,)) of each stretch over which the stick asks for one and the same."""
    edges = np.flatnonzero(np.any(np.diff(trial.desired, axis=0) != 0, axis=1)) + 1
    return [
        (velocity, desired[0])
        for velocity, desired in zip(np.split(trial.neutral.velocity, edges), np.split(trial.desired, edges))
    ]


def settled(trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """Velocity from SETTLED_SECONDS after the stick has moved, and what it asks for."""
    velocity, desired = _stretches(trial)[-1]
    return velocity[round(SETTLED_SECONDS * FPS) :], desired


def _facing_time(trial: Trial) -> float:
    """Seconds until the facing last asked for is within FACED, and stays there; infinite where it never is."""
    face = [command.face for command in trial.script]
    asked = next(frame for frame in range(len(face) - 1, 0, -1) if face[frame] != face[frame - 1])
    off = np.abs(rot.wrap_angle(trial.neutral.root.facing[asked:] - rot.yaw_of(np.array(face[-1]))))
    return time_until(off < FACED)
