"""Phase and gait labels on contacts whose strikes are known."""

import numpy as np
import pytest

from controller.model.gait_phase import foot_strikes, label_gait, label_phase
from sim.body.skeleton import JOINT_COUNT

CYCLE = 60


def walking_contacts(frames: int) -> np.ndarray:
    """Right foot strikes at 0, 60, 120 ..., left at 30, 90 ...; each stays down for 36 frames."""
    t = np.arange(frames)
    right, left = t % CYCLE < 36, (t + CYCLE // 2) % CYCLE < 36
    return np.stack([left, left, right, right], axis=-1).astype(float)


def moving(frames: int, speed: float = 1.0) -> np.ndarray:
    positions = np.zeros((frames, JOINT_COUNT, 3))
    positions[..., 2] = np.cumsum(np.broadcast_to(speed, frames))[:, None] / 60
    return positions


def test_phase_is_zero_at_right_strikes_and_pi_at_left_ones():
    phase, strikes = label_phase(moving(300), walking_contacts(300)), foot_strikes(walking_contacts(300))
    assert strikes == [(frame, frame // 30 % 2) for frame in range(30, 300, 30)]
    for frame, foot in strikes:
        assert np.cos(phase[frame] - np.pi * foot) == pytest.approx(1, abs=1e-9)
    assert np.diff(phase).min() > 0
    assert np.diff(phase)[40:250] == pytest.approx(2 * np.pi / CYCLE)


def test_phase_all_but_stands_still_in_a_stop_and_keeps_a_step_for_the_start():
    contacts = walking_contacts(600)
    contacts[200:440] = 1.0
    speed = np.where((np.arange(600) < 200) | (np.arange(600) >= 430), 1.0, 0.0)
    phase = label_phase(moving(600, speed), contacts)
    standing = np.diff(phase)[230:400]
    assert 0 < standing.max() < 0.1 * 2 * np.pi / CYCLE


def test_flickering_labels_are_one_strike():
    contacts = walking_contacts(120)
    contacts[33, :2] = 0
    assert foot_strikes(contacts) == foot_strikes(walking_contacts(120)) == [(30, 1), (60, 0), (90, 1)]


def test_gaits_sum_to_one_and_turning_on_the_spot_is_walking():
    velocity = np.stack([np.linspace(0, 5, 50), np.zeros(50)], axis=-1)
    gait = label_gait(velocity, np.zeros(50))
    np.testing.assert_allclose(gait.sum(axis=-1), 1)
    assert gait[0].argmax() == 0 and gait[12].argmax() == 1 and gait[-1].argmax() == 2
    assert label_gait(np.zeros(2), np.array(3.0)).argmax() == 1


def test_landing_with_both_feet_is_no_step():
    contacts = np.zeros((120, 4))
    contacts[60:] = 1.0
    assert np.isfinite(label_phase(moving(120), contacts)).all()
