"""Characters made in code, one of each kind that users bring."""

import numpy as np
import pytest

from controller.runtime.controller import PhaseFunctionedController
from sim.body.skeleton import INDEX, JOINTS
from sim.command import Command
from sim.math import rotations as rot
from sim.session import Session
from tests.support.fakes import FakeStylizer
from tests.support.skinned import T_POSE, Build, a_pose

UNREAL = dict(
    zip(
        JOINTS,
        "pelvis thigh_l calf_l foot_l ball_l thigh_r calf_r foot_r ball_r spine_01 spine_03 neck_01 head clavicle_l "
        "upperarm_l lowerarm_l hand_l clavicle_r upperarm_r lowerarm_r hand_r".split(),
        strict=True,
    )
)
NAMELESS = {name: f"b{number}" for number, name in enumerate(JOINTS)}
UNLIKE = {"UpLeg": 1.1, "Leg": 0.9, "Foot": 1.3, "Toe": 1.3, "Arm": 0.7, "Spine": 1.4}  # proportions


def arms_forward() -> np.ndarray:
    result = T_POSE.copy()
    for side, sign in (("Left", -1.0), ("Right", 1.0)):
        turn = rot.from_axis_angle(np.array([0.0, sign, 0.0]), np.radians(85))
        for name in ("Arm", "ForeArm", "Hand"):
            result[INDEX[side + name]] = turn
    return result


KINDS = {
    "our names": Build(),
    "centimetres, A-pose, backwards": Build(rest=a_pose(), unit=0.01, yaw=np.pi),
    "VRM 0": Build(names=NAMELESS, vrm=0, yaw=np.pi, rest=a_pose(20)),
    "VRM 1": Build(names=NAMELESS, vrm=1, seed=1),
    "by shape": Build(names=NAMELESS, seed=2),
    "arms held forwards": Build(names=UNREAL, rest=arms_forward()),
    "arms held up": Build(names=UNREAL, rest=a_pose(-40)),
    "saved in a movement": Build(names=UNREAL, moved=True, rest=a_pose(), root="root"),
    "other proportions": Build(
        names=UNREAL,
        longer=UNLIKE,
        rest=a_pose(30),
        extra={"spine_02": ("Spine", (0.0, 0.07, 0.0)), "hair": ("Head", (0.0, 0.1, -0.1))},
    ),
    "few joints": Build(
        names={ours: name for ours, name in UNREAL.items() if ours[-3:] not in ("Toe", "der") and ours != "Spine"}
    ),
}


@pytest.fixture(params=KINDS)
def build(request) -> Build:
    """One kind after the other."""
    return KINDS[request.param]


@pytest.fixture(scope="session")
def walk() -> list:
    """Poses of the shipped controller, as the foot lock leaves them: it stands, walks off, turns and stops."""
    session = Session(PhaseFunctionedController.from_pretrained(), FakeStylizer())
    moves = [(0.0, 0.0)] * 20 + [(0.0, 1.0)] * 120 + [(0.7, 0.7)] * 60 + [(0.0, 0.0)] * 60
    return [session.step(Command(move)).styled for move in moves]
