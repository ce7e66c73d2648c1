"""Light that a posed body keeps from itself."""

import numpy as np

from demo.figure import skin
from demo.figure.body import figure
from demo.figure.forms import BIND
from demo.figure.occlusion import Occlusion, obstruction
from sim.body.capsules import CAPSULE_ENDS, CAPSULE_RADII, capsule_ends
from sim.body.skeleton import INDEX
from sim.math import rotations as rot

COARSE, MEDIUM = skin.load_skin(skin.COARSE), skin.load_skin(skin.MEDIUM)


def corners(pose) -> np.ndarray:
    return COARSE.posed(figure(pose, np.ones((5, 3))).bones)


def test_the_bind_pose_takes_nothing_beyond_its_skins_own_openness():
    gone = Occlusion(COARSE, capsule_ends(BIND)).at(corners(BIND), capsule_ends(BIND))
    assert gone.max() < 1e-3


def test_an_arm_before_the_breast_takes_light_from_it_and_not_from_the_back():
    rotations = BIND.rotations.copy()
    for name, degrees in (("LeftArm", 80), ("LeftForeArm", 130), ("LeftHand", 130)):
        inwards = rot.from_axis_angle(np.array([0.0, 1.0, 0.0]), -np.radians(degrees))
        rotations[INDEX[name]] = rot.multiply(inwards, rotations[INDEX[name]])
    pose = BIND.with_body(BIND.hips, rotations)
    occlusion = Occlusion(COARSE, capsule_ends(BIND))
    gone = occlusion.carry_to(MEDIUM) @ occlusion.at(corners(pose), capsule_ends(pose))
    main = MEDIUM.joints[np.arange(len(MEDIUM.joints)), MEDIUM.weights.argmax(1)]
    chest = main == INDEX["Chest"]
    before, behind = (gone[chest & (MEDIUM.normals[:, 2] * side > 0.6)] for side in (1, -1))
    assert before.max() > 0.3 and behind.max() < 0.1


def test_a_capsule_straight_before_takes_more_than_one_beside_or_behind():
    place, ends = np.zeros((1, 3), np.float32), np.full_like(CAPSULE_ENDS, 100.0)
    ends[0] = [[-0.1, 0.2, 0.0], [0.1, 0.2, 0.0]]
    up, slant, down = (
        obstruction(place, np.array([normal], np.float32), ends, CAPSULE_RADII)[0]
        for normal in ((0.0, 1.0, 0.0), (0.8, 0.6, 0.0), (0.0, -1.0, 0.0))
    )
    assert up > slant > down == 0.0 and len(CAPSULE_RADII) == len(ends)
