"""How the live evaluation counts arms that are in the body, and elbows that are thrown about."""

import numpy as np
import pytest

from demo.assemble import build_session
from sim.body.pose import Pose
from sim.body.skeleton import INDEX, JOINT_COUNT, REST_HIPS_HEIGHT
from sim.math import rotations as rot
from sim.motion.clip import FPS
from stylizer.evaluation import arm_benchmark
from stylizer.evaluation.arm_benchmark import SWITCHES, arm_figures, format_arms, frames_of, measure_arms
from stylizer.evaluation.live_benchmark import MOVEMENTS

REST = Pose(
    np.zeros(3), 0.0, np.array([0, REST_HIPS_HEIGHT, 0.0]), np.tile(rot.IDENTITY, (JOINT_COUNT, 1)), np.zeros(4), 0.0
)


def turned(name: str, degrees: float, axis: int) -> Pose:
    """The T-pose with all of an arm from a joint on turned about an axis of the world."""
    rotations = REST.rotations.copy()
    for joint in range(INDEX[name], INDEX["LeftHand"] + 1):
        rotations[joint] = rot.from_axis_angle(np.eye(3)[axis], np.radians(degrees))
    return REST.with_body(REST.hips, rotations)


def test_arms_in_the_body_and_fast_elbows_are_counted():
    away, across = turned("LeftArm", 0.0, 2), turned("LeftForeArm", 180.0, 1)  # folded back through the upper arm
    still = arm_figures(Pose.stacked([away] * 4)[:, None])
    assert still == {"hands_in": 0.0, "forearms_in": 0.0, "elbow_m_s2": 0.0}
    one_of_four = arm_figures(Pose.stacked([away, away, away, across])[:, None])
    assert one_of_four["hands_in"] == 0.25 and one_of_four["elbow_m_s2"] == 0.0
    degree = arm_figures(Pose.stacked([away, away, turned("LeftArm", 1.0, 1)])[:, None])
    upper = rot.length(REST.positions[INDEX["LeftForeArm"]] - REST.positions[INDEX["LeftArm"]])[0]
    assert degree["elbow_m_s2"] == pytest.approx(np.radians(1.0) * upper * FPS**2, rel=1e-3)


def test_arms_are_kept_out_better_than_they_would_be_left_alone(monkeypatch):
    monkeypatch.setattr(arm_benchmark, "SECONDS", 1)
    monkeypatch.setattr(arm_benchmark, "SETTLE_SECONDS", 1)
    monkeypatch.setattr(arm_benchmark, "STYLES", ("old", "tiptoeing", "a style that is not there"))
    movements = {name: MOVEMENTS[name] for name in ("walk_1.3", "strafe")}
    ticks: list[int] = []
    rows = measure_arms(build_session(), movements, MOVEMENTS["walk_1.3"], lambda: ticks.append(1))
    assert [row["movement"] for row in rows] == ["walk_1.3", SWITCHES] and len(ticks) == frames_of(movements)
    strong = rows[0]["strength_1.5"]
    assert strong["hands_in"] + strong["forearms_in"] < strong["unkept"]["hands_in"] + strong["unkept"]["forearms_in"]
    assert "walk_1.3" in format_arms(rows)
