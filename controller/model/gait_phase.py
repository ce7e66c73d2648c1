"""Phase and gait of recorded motion, labelled from its foot contacts."""

import numpy as np

from controller.model.io_layout import GAITS
from sim.body.skeleton import CONTACT_JOINTS
from sim.math import rotations as rot
from sim.math.easing import ramp
from sim.motion.clip import FPS
from sim.motion.thresholds import STAND_OR_WALK, WALK_OR_RUN

STEP_LONGEST = 0.9  # seconds between two foot strikes of one walk; a longer pause is a stand in between
STEP_SHORTEST = 0.15  # seconds; quicker repeats are one strike whose label flickered
CYCLE_SECONDS = 1.1  # a plain walk's cycle, for the ends of a clip where no strike tells
CYCLE_SHORTEST = 0.6  # seconds that it takes there at least, however busy the feet
WALK_ACTIVITY = 1.0  # metres a second: mean foot speed of a plain walk
# metres a second that feet are taken to have at any time, lest a pause has no activity to share out
LEAST_ACTIVITY = 0.01
ACTIVITY_SMOOTHING = 0.1  # seconds (Gaussian sigma)
GRAVITY = 9.81  # metres a second squared
# Seconds before the take-off that a jump begins, and after the landing that it has ended.
JUMP_EDGES = (0.3, 0.3)
TURN_RADIUS = 0.25  # metres: turning counts for the gait as the feet's way around the body


def foot_strikes(contacts: np.ndarray) -> list[tuple[int, int]]:
    """(frame, foot) of each landing in time order, foot 0 right and 1 left; contacts (frames, 4)."""
    strikes = []
    for foot, joints in ((1, contacts[:, :2]), (0, contacts[:, 2:])):
        down = joints.max(axis=1) > 0.5
        frames = np.flatnonzero(~down[:-1] & down[1:]) + 1
        last = -FPS
        for frame in frames.tolist():
            if frame - last > STEP_SHORTEST * FPS:
                strikes.append((frame, foot))
                last = frame
    return sorted(strikes)


def label_phase(positions: np.ndarray, contacts: np.ndarray) -> np.ndarray:
    """Unwrapped phase (frames,) in radians: 2 pi k where the right foot lands, 2 pi k + pi where the left does.

    Between two steps of a walk it runs evenly. Over a longer pause it runs with the feet's activity, so that it all but
    stands still while the character stands and the first step after a stop has a step's worth of phase. positions
    (frames, 21, 3), contacts (frames, 4)."""
    from scipy.ndimage import gaussian_filter1d  # the live loop imports this file and labels no phase

    feet = np.linalg.norm(np.gradient(positions[:, CONTACT_JOINTS], 1 / FPS, axis=0), axis=-1).mean(axis=1)
    activity = gaussian_filter1d(feet, ACTIVITY_SMOOTHING * FPS) + LEAST_ACTIVITY
    walking_rate = activity / WALK_ACTIVITY * (2 * np.pi / CYCLE_SECONDS / FPS)
    rate = np.minimum(walking_rate, 2 * np.pi / CYCLE_SHORTEST / FPS)  # radians a frame

    strikes = foot_strikes(contacts)
    for (start, foot), (end, next_foot) in zip(strikes, strikes[1:]):
        advance = np.pi if foot != next_foot else 2 * np.pi
        if start == end:  # both feet land at once: a jump, no step
            continue
        if end - start <= STEP_LONGEST * FPS:
            rate[start:end] = advance / (end - start)
        else:
            span = activity[start:end]
            rate[start:end] = advance * span / span.sum()
    phase = np.concatenate([[0.0], np.cumsum(rate[:-1])])
    if strikes:
        frame, foot = strikes[0]
        phase += np.pi * foot - phase[frame]
    return phase


def label_gait(velocity: np.ndarray, turn_rate: np.ndarray) -> np.ndarray:
    """Gait weights (frames, GAITS) from root velocity (frames, 2) m/s and turn rate rad/s: stand, walk and run, which
    sum to 1; no crouch and no jump."""
    speed = rot.length(velocity)[..., 0]
    moving = ramp(np.maximum(speed, np.abs(turn_rate) * TURN_RADIUS), *STAND_OR_WALK)
    running = moving * ramp(speed, *WALK_OR_RUN)
    gait = np.zeros((*speed.shape, len(GAITS)))
    gait[..., 0], gait[..., 1], gait[..., 2] = 1 - moving, moving - running, running
    return gait


def flight_lift(time: np.ndarray, seconds: float) -> np.ndarray:
    """Metres (...) over the ground that gravity lets a body be, a time (...) in seconds after a take-off whose flight
    takes `seconds`; 0 before and after it."""
    return np.maximum(0.0, GRAVITY / 2 * time * (seconds - time))


def jump_weight(time: np.ndarray, seconds: float) -> np.ndarray:
    """How far (...) it is in a jump, 0..1, at a time (...) in seconds after a take-off whose flight takes `seconds`."""
    before, after = JUMP_EDGES
    return np.minimum(ramp(time, -before, -before / 2), 1 - ramp(time - seconds, after / 2, after))
