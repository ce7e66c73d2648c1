"""Exact springs by half-life: what is left after the half-life is half of what was, whatever the frame rate."""

import math
from typing import Any, Callable, overload

import numpy as np

LN2 = math.log(2.0)


def decay(halflife: float, dt: float) -> float:
    """The share of a difference that is left after dt seconds, both in seconds."""
    return math.exp(-LN2 * dt / max(halflife, 1e-6))


def _stiffness(halflife: float) -> float:
    """Rate (1/s) of the critically damped spring that has covered half its way, from rest, after about `halflife`
    seconds."""
    return 1.678 / max(halflife, 1e-6)  # the root of (1 + y) exp(-y) = 1/2


@overload
def spring_step(x: float, v: float, target: float, halflife: float, dt: float) -> tuple[float, float]: ...
@overload
def spring_step(
    x: np.ndarray, v: np.ndarray, target: np.ndarray | float, halflife: float, dt: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]: ...
def spring_step(x: Any, v: Any, target: Any, halflife: float, dt: Any) -> tuple[Any, Any]:
    """Position and velocity of a critically damped spring after dt seconds, exactly; any shapes that broadcast."""
    y = _stiffness(halflife)
    e = (np if isinstance(dt, np.ndarray) else math).exp(-y * dt)
    gap = x - target
    return target + e * (1 + y * dt) * gap + e * dt * v, e * (1 - y * dt) * v - e * y * y * dt * gap


def lag(halflife: float) -> float:
    """Seconds by which `spring_step` is behind a target that moves steadily."""
    return 2 / _stiffness(halflife)


def soft_spring_step(
    x: np.ndarray, v: np.ndarray, a: np.ndarray, halflife: float, dt: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration of a spring of third order that pulls to 0, after dt seconds, exactly: its
    acceleration never jumps, so a gap that opens in one frame is closed without a jolt."""
    y = 2.674 / max(halflife, 1e-6)  # the root of (1 + y + y^2 / 2) exp(-y) = 1/2
    j1 = v + x * y
    j2 = (a + (v + j1) * y) / 2
    e = math.exp(-y * dt)
    x, v = e * (x + (j1 + j2 * dt) * dt), e * (j1 + 2 * j2 * dt)
    v, a = v - y * x, 2 * (e * j2 - y * v) + y * y * x
    return x, v, a


def spring_travel(
    v: np.ndarray, a: np.ndarray, target: np.ndarray | float, halflife: float, dt: np.ndarray | float
) -> np.ndarray:
    """How far a body travels in dt seconds while its velocity v (acceleration a) springs to a target velocity,
    exactly."""
    y = _stiffness(halflife)
    j0 = v - target
    j1 = a + j0 * y
    e = np.exp(-y * dt)
    return e * (-j1 / y**2 - (j0 + j1 * dt) / y) + j1 / y**2 + j0 / y + target * dt


def response(
    spring: Callable[..., np.ndarray | tuple[np.ndarray, ...]], halflife: float, times: np.ndarray | float
) -> np.ndarray:
    """A spring as a matrix (..., 3): what it gives at `times` is this times (where, how fast, target), for it is linear
    in them.

    spring: spring_step, whose positions come before its velocities, spring_travel, or soft_spring_step, whose matrix
    takes and gives (where, how fast, how much faster)."""
    return np.stack([np.concatenate(np.atleast_2d(spring(*unit, halflife, times))) for unit in np.eye(3)], axis=-1)
