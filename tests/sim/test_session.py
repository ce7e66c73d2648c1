"""A session heals: a frame that is not finite draws the neutral pose, and styling begins anew."""

import numpy as np
import pytest

from sim.command import Command, Commands
from sim.session import Session
from tests.conftest import FakeController, FakeStylizer


class Poisoned(FakeStylizer):
    """A style that is not finite makes every frame so until the stylizer is restarted, as smoothing does."""

    poisoned = False

    def step(self, window, neutral, style, travel=1.0):
        self.poisoned = self.poisoned or "old" in {spec.name for spec in style.values()}
        pose = super().step(window, neutral, style, travel)
        return pose.with_body(pose.hips, pose.rotations * np.nan) if self.poisoned else pose

    def restart(self) -> None:
        self.poisoned = False


def test_a_frame_that_is_not_finite_draws_the_neutral_pose_and_is_counted():
    session = Session(FakeController(), Poisoned())
    ill, well = Command((0, 1), style={"arms": "old"}), Command((0, 1), style={"arms": "proud"})
    for _ in range(3):
        frame = session.step(ill)
        assert frame.styled is frame.neutral and frame.styled.is_finite()
    assert session.healed == 3
    after = session.step(well)
    assert session.healed == 3 and after.styled.is_finite() and after.styled is not after.neutral


def test_a_controller_that_is_not_finite_is_put_back_at_the_start():
    session = Session(FakeController(), FakeStylizer())
    session.step(Command((0, 1)))
    session.controller.position = np.full(3, np.nan)
    with pytest.raises(ValueError, match="controller's motion is not finite"):
        session.step(Command((0, 1)))
    assert session.step(Command((0, 1))).styled.is_finite()


@pytest.mark.parametrize("count", [0, -1, 2.5, True, None])
def test_a_crowd_is_a_whole_number_from_one_on(count):
    with pytest.raises(ValueError, match="give a whole number from 1 on"):
        Session(FakeController(), FakeStylizer()).crowd(count)


def test_a_crowd_makes_no_crowd():
    with pytest.raises(ValueError, match="this is a crowd already"):
        Session(FakeController(), FakeStylizer()).crowd(2).crowd(2)


def test_each_of_a_crowd_is_asked_and_nobody_else():
    session = Session(FakeController(), FakeStylizer())
    crowd = session.crowd(2)
    assert crowd.step(Commands([Command()] * 2)).styled.positions.shape == (2, 21, 3)
    for wrong in (Command(), Commands([Command()]), Commands([Command()] * 3)):
        with pytest.raises(ValueError, match="a session of 2 takes Commands of 2, but was given"):
            crowd.step(wrong)
    with pytest.raises(ValueError, match="a session of one takes a Command, but was given Commands of 2"):
        session.step(Commands([Command()] * 2))


class Overflown(FakeController):
    """Weights whose output is not finite, so that the controller cannot go on."""

    restarts = 0

    def step(self, command, pace=None):
        raise FloatingPointError("the network's output is not finite")

    def restart(self):
        self.restarts += 1


def test_a_controller_that_cannot_go_on_is_put_back_and_the_session_says_so():
    session = Session(Overflown(), FakeStylizer())
    before = session.controller.restarts
    with pytest.raises(ValueError, match="the controller's motion is not finite: it was put back at the start"):
        session.step(Command())
    assert session.healed == 1 and session.controller.restarts == before + 1
