"""Which foot steps first: who stands and is asked to go aslant begins with the foot of that side.

While it stands a character's phase says next to nothing, and stays where the last step left it. Begun with the other
foot, a way back and aside takes three seconds to find its gait; nobody captured does so."""

import math

import numpy as np

from controller.runtime.trajectory import Trajectory, rotate_2d
from sim.math import rotations as rot
from sim.math.easing import ramp
from sim.motion.clip import FPS

ASLANT = 0.3  # sine of the angle between the way and the facing from which on the side counts
SETTING_OFF = 0.5  # share of the speed that is asked for under which the character sets off
STANDS = (0.5, 1.0)  # weights of standing between which it stands: who creeps has a step under way
STEP_NEXT = 0.0, math.pi  # phases at which the left foot, and the right one, is the next to step: the other has landed
FREE = 1.4  # radians about these within which it still is
FASTEST = 30.0 / FPS  # radians a frame: fast enough to be there before the first step, and no joint is seen to jump
BRISK = 1.0  # metres a second: who is asked to go slower has longer until that step, and would be seen to twitch


def choose_first_foot(phase: np.ndarray, trajectory: Trajectory) -> np.ndarray:
    """The phase (...) in radians, moved towards where the foot that fits steps next."""
    way, facing = trajectory.wanted_velocity, trajectory.facing
    asked, speed = rot.length(way)[..., 0], rot.length(trajectory.velocity)[..., 0]
    to_left = rotate_2d(way[..., None, :], -facing)[..., 0, 0]  # metres a second
    side = to_left / np.maximum(asked, 1e-6)
    chooses = (np.abs(side) > ASLANT) & (speed < SETTING_OFF * asked)
    beyond = rot.wrap_angle(np.where(side > 0, *STEP_NEXT) - phase)
    beyond = beyond - _within(beyond, FREE)
    fastest = FASTEST * np.minimum(asked / BRISK, 1.0)
    step = _within(beyond, fastest) * ramp(trajectory.standing, *STANDS)
    return (phase + np.where(chooses, step, 0.0)) % (2 * math.pi)


def _within(values: np.ndarray | float, bound: np.ndarray | float) -> np.ndarray:
    """Numbers (...) kept to -bound .. bound."""
    return np.minimum(np.maximum(values, -bound), bound)
