"""Switches: neither place nor speed jumps, the gap closes to nothing, and half a circle is gone one way, not too
fast."""

import numpy as np
import pytest

from sim.body.skeleton import JOINT_COUNT
from sim.math import rotations as rot
from sim.motion.clip import FPS
from stylizer.runtime.inertialization import HALFLIFE, Inertializer

ROWS = JOINT_COUNT + 1
X, Y, Z = np.eye(3)
SWITCH = 40  # the frame in which it happens
FASTEST = 1500  # degrees a second


def about(axis: np.ndarray, angle) -> np.ndarray:
    """All joints turned about an axis by an angle in radians."""
    return np.tile(rot.from_axis_angle(axis, np.asarray(float(angle))), (JOINT_COUNT, 1))


def drawn(turns, shifts, frames: int = 240, switches=(SWITCH,)) -> tuple[np.ndarray, np.ndarray]:
    """What is drawn, (frames, 21, 4) and (frames, 3), of functions of the frame that jump at the switches."""
    inertializer, result = Inertializer(), []
    for frame in range(frames):
        result.append(inertializer.step(turns(frame), shifts(frame), np.full(ROWS, frame in switches)))
    return tuple(map(np.array, zip(*result)))


def steps(turns: np.ndarray) -> np.ndarray:
    """(frames - 1, 21, 3) rotation vectors from one frame to the next."""
    return rot.to_rotation_vector(rot.multiply(turns[1:], rot.inverse(turns[:-1])))


def still(frame: int) -> np.ndarray:
    return np.zeros(3)


def test_without_a_switch_it_passes_through_to_the_last_bit():
    def turns(frame):
        return about(Z, 0.3 * np.sin(frame / 5))

    ours, shifts = drawn(turns, lambda frame: X * frame, switches=())
    np.testing.assert_array_equal(ours, [turns(frame) for frame in range(240)])
    np.testing.assert_array_equal(shifts, np.arange(240)[:, None] * X)


@pytest.mark.parametrize("apart", [0.3, 1.5, 2.8])
def test_neither_place_nor_speed_jumps(apart):
    """Before the switch it moves; after it another way, setting out from rest as smoothed deltas do: what is drawn goes
    from the one over into the other, its speed changing no quicker than where the gap alone is closed."""

    def setting_out(frame):
        return -0.01 * (frame - SWITCH) ** 2 / (frame - SWITCH + 6)

    def turns(frame):
        return about(Z, 0.02 * (frame - SWITCH) if frame < SWITCH else apart + setting_out(frame))

    def shifts(frame):
        return Y * (0.001 * (frame - SWITCH) if frame < SWITCH else 0.2 * apart)

    ours, shift = drawn(turns, shifts)
    alone, alone_shift = drawn(
        lambda frame: about(Z, apart * (frame >= SWITCH)), lambda frame: 0.2 * apart * Y * (frame >= SWITCH)
    )
    rates, alone_rates = (steps(each)[:, 0, 2] for each in (ours, alone))
    assert rot.to_rotation_vector(rot.multiply(turns(SWITCH), rot.inverse(turns(SWITCH - 1))))[0, 2] > 0.29, (
        "a jump is asked for"
    )
    assert rates[SWITCH - 1] == pytest.approx(0.02, abs=0.003 * (1 + apart)), "that frame goes on as those before it"
    assert np.abs(np.diff(rates)).max() < np.abs(np.diff(alone_rates)).max() + 0.003
    assert np.abs(np.diff(shift, axis=0)).max() < np.abs(np.diff(alone_shift, axis=0)).max() + 0.001
    assert np.abs(np.diff(shift, 2, axis=0)).max() < np.abs(np.diff(alone_shift, 2, axis=0)).max() + 0.0002


def test_half_of_a_gap_is_closed_after_the_halflife():
    ours, shift = drawn(lambda frame: about(Z, 1.0 * (frame >= SWITCH)), lambda frame: X * (frame >= SWITCH))
    frame = SWITCH + round(HALFLIFE * FPS)
    assert rot.to_rotation_vector(ours[frame, 3])[2] == pytest.approx(0.5, abs=0.08)
    assert shift[frame, 0] == pytest.approx(0.5, abs=0.08)


def test_the_gap_closes_to_nothing():
    """To the last bit: what is drawn is then what is asked for, and costs nothing."""
    inertializer = Inertializer()
    for frame in range(400):
        asked = about(Z, 1.2 * (frame >= SWITCH)), 0.3 * Y * (frame >= SWITCH)
        turns, shift = inertializer.step(*asked, np.full(ROWS, frame == SWITCH))
        if frame == SWITCH:
            assert inertializer.offset.any()
    assert not inertializer.offset.any()
    np.testing.assert_array_equal(turns, asked[0])
    np.testing.assert_array_equal(shift, asked[1])


@pytest.mark.parametrize("angle", np.radians([170, 179.9, 180, 180.1, 190]))
@pytest.mark.parametrize("axis", [X, rot.normalize(np.array([1.0, 2.0, -1.0]))])
def test_half_a_circle_is_gone_one_way(angle, axis):
    """Though the style that is asked for sways about where the ways round are equally long."""

    def turns(frame):
        return about(axis, angle + 0.2 * np.sin(frame / 6)) if frame >= SWITCH else about(axis, 0.0)

    ours, _ = drawn(turns, still, 200)
    rates = steps(ours)[:, 0] @ axis
    assert np.degrees(np.abs(rates).max()) * FPS < FASTEST
    underway = rates[SWITCH : SWITCH + round(2 * HALFLIFE * FPS)]
    sway = 0.2 / 6
    assert (underway > -sway - 1e-3).all() or (underway < sway + 1e-3).all(), "it never turns back on its way"
    assert abs(abs(rates[SWITCH - 1 :].sum()) - np.pi) < 0.5, "and goes about half a circle in all"


@pytest.mark.parametrize("apart", [0.5, 3.1])
def test_one_switch_after_another_before_the_first_is_done(apart):
    """As in a session whose styles are changed every few frames."""
    switches = range(20, 200, 7)

    def turns(frame):
        return about((Y, Z, X)[(min(frame, 199) - 20) // 7 % 3] if frame >= 20 else X, apart)

    ours, _ = drawn(turns, still, 320, switches)
    speeds = np.degrees(np.linalg.norm(steps(ours), axis=-1)) * FPS
    assert speeds.max() < FASTEST
    np.testing.assert_allclose(np.abs(np.vecdot(ours[-1], turns(319))), 1, atol=1e-9)


def test_only_joints_that_switch_are_changed():
    inertializer = Inertializer()
    for frame in range(120):
        jumping = np.zeros(ROWS, dtype=bool)
        jumping[[4, 7]] = frame == SWITCH
        asked = about(Z, 0.01 * frame)
        asked[[4, 7]] = about(X, 2.0 * (frame >= SWITCH))[0]
        turns, shift = inertializer.step(asked, Y * frame, jumping)
        others = [joint for joint in range(JOINT_COUNT) if joint not in (4, 7)]
        np.testing.assert_allclose(turns[others], asked[others], atol=1e-15)
        np.testing.assert_array_equal(shift, Y * frame)


def test_each_of_a_crowd_switches_as_it_would_alone():
    scripts = [
        (lambda frame: about(Z, 1.5 * (frame >= 40)), {40}),
        (lambda frame: about(X, 0.02 * frame), set()),
        (lambda frame: about(Y, (frame // 25) % 3), {25, 50, 75, 100}),
    ]
    crowd, alone = Inertializer((3,)), [Inertializer() for _ in scripts]
    for frame in range(120):
        jumping = np.array([np.full(ROWS, frame in when) for _, when in scripts])
        asked = np.array([turns(frame) for turns, _ in scripts])
        turns, shift = crowd.step(asked, np.zeros((3, 3)), jumping)
        for one, inertializer in enumerate(alone):
            ours, _ = inertializer.step(asked[one], np.zeros(3), jumping[one])
            np.testing.assert_allclose(turns[one], ours, atol=1e-5)  # one closes its gap when all do
