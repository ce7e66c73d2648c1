"""A jump follows gravity, keeps a press that comes too early, and belongs to one character of a crowd."""

import numpy as np

from controller.model.gait_phase import GRAVITY
from controller.runtime.jump import ANTICIPATION, FLIGHT, RECOVERY, Jump
from sim.motion.clip import FPS


def play(jump: Jump, seconds: float, press=False) -> np.ndarray:
    """Lift (frames, ...) of so many seconds; press: in the first frame."""
    lifts = []
    for frame in range(round(seconds * FPS)):
        jump.press(np.asarray(press) & (frame == 0))
        lifts.append(jump.lift())
        jump.advance()
    return np.array(lifts)


def test_nobody_who_does_not_press_is_lifted():
    jump = Jump()
    assert not play(jump, 1.0).any() and not jump.under_way and not jump.airborne


def test_it_gathers_flies_by_gravity_and_lands():
    lift = play(Jump(), 2.0, press=True)
    flying = np.flatnonzero(lift > 0)
    assert flying[0] / FPS > ANTICIPATION - 1 / FPS and flying[-1] / FPS < ANTICIPATION + FLIGHT + 1 / FPS
    np.testing.assert_allclose(np.diff(lift[flying], 2) * FPS**2, -GRAVITY, rtol=1e-6)
    np.testing.assert_allclose(lift.max(), GRAVITY / 8 * FLIGHT**2, rtol=0.01)


def test_what_is_to_come_is_what_comes():
    jump = Jump()
    jump.press(True)
    ahead = jump.lift(np.array([0.2, 0.5, 0.7]))
    lift = play(jump, 1.0)
    np.testing.assert_allclose(ahead, lift[[12, 30, 42]], atol=1e-9)
    assert np.ptp(jump.weight(np.linspace(-1, 1, 50))) == 1.0


def test_a_press_in_the_air_is_kept_and_answered_after_the_landing():
    jump = Jump()
    first = play(jump, ANTICIPATION + FLIGHT / 2, press=True)
    assert first[-1] > 0
    second = play(jump, 2.0, press=True)
    landed = np.flatnonzero(second == 0)[0]
    again = np.flatnonzero(second[landed:])[0] / FPS
    assert RECOVERY + ANTICIPATION - 0.05 < again < RECOVERY + ANTICIPATION + 0.1


def test_each_of_a_crowd_jumps_alone():
    lift = play(Jump((3,)), 1.5, press=np.array([False, True, False]))
    assert not lift[:, [0, 2]].any()
    np.testing.assert_array_equal(lift[:, 1], play(Jump(), 1.5, press=True))
