"""A session heals: a frame that is not finite draws the neutral pose, and styling begins anew."""

import numpy as np
import pytest

from sim.command import Command
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
