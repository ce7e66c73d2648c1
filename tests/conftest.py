"""Stand-ins for the two trained models, so that the line around them is tested without weights."""

import numpy as np
import pytest

from sim.body.pose import Pose
from sim.body.skeleton import JOINT_COUNT, PARTS, REST_HIPS_HEIGHT
from sim.command import Commands
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.motion.playback_pace import OWN_PACE, Pace
from sim.session import Session
from stylizer.styles.clip_table import CLIPS


class FakeController:
    """Glides in the rest pose as fast as the stick asks, facing where it goes; no foot is ever planted."""

    fingerprint = trajectory = None

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        self.position, self.facing, self.frame = np.zeros(3), 0.0, 0

    def stand_on(self, ground) -> None:
        self.restart()

    def step(self, command, pace=OWN_PACE) -> Pose:
        x, z = command.desired_velocity
        self.position = self.position + np.array([x, 0.0, z]) / FPS
        if command.face or any(command.move):
            self.facing = float(rot.yaw_of(np.array(command.face or command.move)))
        self.frame += 1
        hips = self.position + np.array([0.0, REST_HIPS_HEIGHT, 0.0])
        rotations = np.tile(rot.from_yaw(self.facing), (JOINT_COUNT, 1))
        return Pose(self.position, self.facing, hips, rotations, np.zeros(4), self.frame % FPS * 2 * np.pi / FPS)

    def crowd(self, count) -> "FakeCrowd":
        return FakeCrowd([FakeController() for _ in range(count)])


class FakeStylizer:
    """Turns every joint of a restyled part by half its strength in radians."""

    name, styles, noncommercial, users_own, own_of, seed = "joints", ("old", "proud"), ("old",), (), None, None

    def movements(self, style) -> tuple[str, ...]:
        if style not in CLIPS:
            raise ValueError(f"unknown style '{style}': did you mean old?")
        return ("walk",)

    def step(self, window, neutral, style, travel=1.0) -> Pose:
        rotations = neutral.rotations.copy()
        for part, spec in style.items():
            turn = rot.from_axis_angle(np.array([0.0, 0.0, 1.0]), spec.strength / 2)
            rotations[list(PARTS[part])] = rot.multiply(rotations[list(PARTS[part])], turn)
        return neutral.with_body(neutral.hips, rotations)

    def leg_strengths(self) -> np.ndarray:
        return np.zeros(2)

    def pace(self, gaits) -> tuple[np.ndarray, np.ndarray]:
        return np.ones(()), np.ones(())

    def restart(self) -> None:
        pass

    def crowd(self, count) -> "FakeCrowd":
        return FakeCrowd([FakeStylizer() for _ in range(count)])

    def resample(self, seed=None) -> None:
        raise ValueError("this stylizer samples no styles")

    def attention(self, window, part) -> np.ndarray:
        raise ValueError("this stylizer has no attention")

    def transfer_state(self, other) -> None:
        pass


class FakeCrowd:
    """Controllers or stylizers side by side, each stepped alone."""

    fingerprint = trajectory = own_of = None

    def __init__(self, each) -> None:
        self.each = each

    def restart(self) -> None:
        for one in self.each:
            one.restart()

    def stand_on(self, ground) -> None:
        self.restart()

    def leg_strengths(self) -> np.ndarray:
        return np.array([one.leg_strengths() for one in self.each])

    def pace(self, gaits) -> tuple[np.ndarray, np.ndarray]:
        return np.ones(len(self.each)), np.ones(len(self.each))

    def step(self, *asked) -> Pose:
        asked = [
            values.each if isinstance(values, Commands) else values for values in asked if not isinstance(values, Pace)
        ]
        return Pose.stacked(
            [
                one.step(*(values if isinstance(values, float) else values[i] for values in asked))
                for i, one in enumerate(self.each)
            ]
        )


def fake_session(stylizer=None, latency=None, ground=None) -> Session:
    """In place of demo.assemble.build_session."""
    return Session(FakeController(), FakeStylizer(), latency, ground)


@pytest.fixture
def fake_models(monkeypatch):
    """Every session that the demo builds is made of stand-ins."""
    from demo import assemble

    monkeypatch.setattr(assemble, "build_session", fake_session)
