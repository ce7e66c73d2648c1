"""The gait of a motion, read from its ankles: stride phase, cadence, stride length, and what kind of movement it is.

A stride is one full cycle, from a step of one foot to the next step of the same foot."""

import numpy as np

from sim.body.skeleton import CONTACT_JOINTS, INDEX, TOE_HEIGHT
from sim.math.easing import smooth_step
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT
from sim.motion.thresholds import BACK_SPEED, RUN_SPEED, SIDE_SPEED, STAND_SPEED, STYLE_WALK_OR_RUN

ANKLES = [INDEX["LeftFoot"], INDEX["RightFoot"]]
HYSTERESIS = 0.25  # share of the signal's deviation by which it must pass its mean before a crossing counts
SMALLEST_STEP = 0.03  # metres, deviation of the distance between the ankles under which nobody steps
HARMONICS, FEW_HARMONICS = 6, 3  # of the stride, that a motion of SURE_STRIDES or more tells, and a shorter one
SURE_STRIDES = 1.8
AIRBORNE_HEIGHT = 0.05  # metres over its height on the floor at which the lower foot is surely in the air

# A run slower than RUN_SPEED is known by the share of time that both feet are in the air, or by its strides a second.
SLOWEST_RUN, AIRBORNE_SHARE, RUN_CADENCE = 1.3, 0.12, 1.22
TURN_RATE = 0.5  # radians a second
SLOW = 0.3  # metres a second: speeds are compared by the logarithm of how many times this they are
SIDEWAYS = 2.0  # by how much more another direction counts than another speed
TURN_UNIT = 2.0  # radians a second of turning that count as much as a speed SLOW e^1 does beside standing
RUN_APART = 2.0  # by which a run is further from a walk than its speed says
TURN_AND_RUN = np.array([1 / TURN_UNIT, RUN_APART])
LEAST_SPEED = np.array(1e-9)  # metres a second: who is slower goes in no direction
MOVEMENTS = ("stand", "walk", "run", "back", "strafe left", "strafe right", "turn left", "turn right")


def stride_phase(features: np.ndarray) -> np.ndarray | None:
    """Unwrapped stride phase (frames,) in radians of features (frames, 21, 15) at 60 Hz; None for a motion of less than
    a stride.

    A stride begins where the left ankle passes the right one, forwards along the way that the root goes."""
    velocity = features[:, 0, LAYOUT["root"]][:, :2].mean(axis=0)
    direction = velocity / max(float(np.linalg.norm(velocity)), 1e-9)
    feet = features[:, ANKLES, LAYOUT["position"]][..., [0, 2]]
    apart = (feet[:, 0] - feet[:, 1]) @ direction
    apart = apart - apart.mean()
    if apart.std() < SMALLEST_STEP:
        return None
    margin = HYSTERESIS * apart.std()
    rising, falling = _rising_crossings(apart, margin), _rising_crossings(-apart, margin)
    steps = np.sort(np.concatenate([rising, falling]))
    if len(steps) < 3:
        return None
    turns = np.pi * np.arange(len(steps)) + (np.pi if steps[0] in falling else 0.0)
    frames = np.arange(len(apart))
    phase = np.interp(frames, steps, turns)
    rate = (turns[-1] - turns[0]) / (steps[-1] - steps[0])
    before, after = frames < steps[0], frames > steps[-1]
    phase[before] = turns[0] + (frames[before] - steps[0]) * rate
    phase[after] = turns[-1] + (frames[after] - steps[-1]) * rate
    return phase


def _rising_crossings(signal: np.ndarray, margin: float) -> np.ndarray:
    """Where a signal (frames,) rises through 0, in frames and parts of one, having been under -margin before."""
    starts, below = [], False
    for frame in range(1, len(signal)):
        below = below or signal[frame - 1] < -margin
        if below and signal[frame - 1] <= 0 < signal[frame]:
            starts.append(frame - signal[frame] / (signal[frame] - signal[frame - 1]))
            below = False
    return np.array(starts)


def cadence(features: np.ndarray) -> float:
    """Strides a second of features (frames, 21, 15) at 60 Hz; 0 where nobody steps."""
    phase = stride_phase(features)
    return 0.0 if phase is None else float((phase[-1] - phase[0]) / (2 * np.pi) * FPS / (len(phase) - 1))


def airborne_share(features: np.ndarray) -> float:
    """The share of the frames in which both feet are off the floor, of features (frames, 21, 15)."""
    lowest = features[:, CONTACT_JOINTS, 1].min(axis=1)
    return float((lowest > TOE_HEIGHT + AIRBORNE_HEIGHT).mean())


def movement_of(root_velocity: np.ndarray, airborne: float = 0.0, strides: float = 0.0) -> str:
    """Which of MOVEMENTS a stretch of motion is.

    root_velocity: its mean (3,), sideways and forwards in metres a second and turn rate in radians a second; airborne:
    the share of its frames in which both feet are off the floor; strides: a second, where that is known."""
    side, forward, turn = root_velocity
    if abs(turn) > TURN_RATE:
        return "turn left" if turn > 0 else "turn right"
    if np.hypot(side, forward) < STAND_SPEED:
        return "stand"
    if abs(side) > max(SIDE_SPEED, abs(forward)):
        return "strafe left" if side > 0 else "strafe right"
    if forward < -BACK_SPEED:
        return "back"
    quick = airborne > AIRBORNE_SHARE or strides > RUN_CADENCE
    return "run" if forward > RUN_SPEED or (forward > SLOWEST_RUN and quick) else "walk"


def with_run(root_velocity: np.ndarray) -> np.ndarray:
    """Gaits (..., 4) of root velocities (..., 3): as fourth number how far they are a run's, 0..1."""
    return np.concatenate([root_velocity, smooth_step(root_velocity[..., 1:2], *STYLE_WALK_OR_RUN)], axis=-1)


def gait_distance(one: np.ndarray, other: np.ndarray, sideways: np.ndarray | float = SIDEWAYS) -> np.ndarray:
    """The square of how far gaits (..., 4), see `with_run`, are apart: who goes another way differs more than who goes
    at another speed, by `sideways` (...), between two speeds their ratio counts, and a run is no quick walk."""
    return point_distance(gait_point(one), gait_point(other), sideways)


def gait_point(gait: np.ndarray) -> np.ndarray:
    """Where gaits (..., 4) lie for `point_distance`, (..., 5): the logarithm of the speed, turning and running, each in
    its unit, then the direction over the floor, of length 1."""
    speed = np.hypot(gait[..., :1], gait[..., 1:2])
    direction = gait[..., :2] / np.maximum(speed, LEAST_SPEED)
    return np.concatenate([np.log1p(speed / SLOW), gait[..., 2:] * TURN_AND_RUN, direction], axis=-1)


def point_distance(one: np.ndarray, other: np.ndarray, sideways: np.ndarray | float = SIDEWAYS) -> np.ndarray:
    """`gait_distance` of gaits that `gait_point` has made points (..., 5) of."""
    apart = one[..., :3] - other[..., :3]
    cosine = np.vecdot(one[..., 3:], other[..., 3:])
    angle = np.arccos(np.minimum(np.maximum(cosine, -1.0), 1.0)) * sideways * np.minimum(one[..., 0], other[..., 0])
    return np.vecdot(apart, apart) + np.square(angle)


def fit_cycle(signal: np.ndarray, phase: np.ndarray) -> np.ndarray:
    """What of a signal (frames, ...) repeats with the stride phase (frames,): Fourier coefficients (1 + 2 HARMONICS,
    ...), the mean first, by least squares. Harmonics that a short motion cannot tell are 0."""
    strides = (phase[-1] - phase[0]) / (2 * np.pi)
    harmonics = HARMONICS if strides >= SURE_STRIDES else FEW_HARMONICS
    flat = signal.reshape(len(signal), -1)
    found = np.linalg.lstsq(_basis(phase, harmonics), flat, rcond=None)[0]
    result = np.zeros((1 + 2 * HARMONICS, flat.shape[1]))
    result[: len(found)] = found
    return result.reshape(-1, *signal.shape[1:])


def cycle_at(coefficients: np.ndarray, phase: np.ndarray) -> np.ndarray:
    """The signal (frames, ...) of Fourier coefficients at stride phases (frames,)."""
    flat = coefficients.reshape(len(coefficients), -1)
    return (_basis(phase, HARMONICS) @ flat).reshape(len(phase), *coefficients.shape[1:])


def _basis(phase: np.ndarray, harmonics: int) -> np.ndarray:
    """(frames, 1 + 2 harmonics): 1, then cosine and sine of each harmonic."""
    angles = phase[:, None] * np.arange(1, harmonics + 1)
    waves = np.stack([np.cos(angles), np.sin(angles)], axis=-1).reshape(len(phase), -1)
    return np.concatenate([np.ones((len(phase), 1)), waves], axis=1)
