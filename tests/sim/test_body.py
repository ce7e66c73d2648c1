"""Skeleton table, rotations, kinematics and springs against answers worked out by hand or by scipy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim.body.kinematics import forward_kinematics, to_global, to_local, two_bone_ik
from sim.body.skeleton import (
    ANCESTORS,
    BONE_OFFSETS,
    GROUPS,
    INDEX,
    JOINT_COUNT,
    MIRROR,
    PARENTS,
    PARTS,
    REST_HIPS_HEIGHT,
    TOE_HEIGHT,
    expand_part,
)
from sim.math import rotations as rot
from sim.math.springs import decay, lag, soft_spring_step, spring_step, spring_travel

RNG = np.random.default_rng(0)
QUATERNIONS = rot.normalize(RNG.normal(size=(50, JOINT_COUNT, 4)))
VECTORS = RNG.normal(size=(50, JOINT_COUNT, 3))


def test_parts_cover_every_joint_once():
    assert sorted(j for joints in PARTS.values() for j in joints) == list(range(JOINT_COUNT))
    assert PARENTS.tolist() == [-1, 0, 1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 10, 13, 14, 15, 10, 17, 18, 19]
    assert all(set(parts) <= set(PARTS) for parts in GROUPS.values())
    assert expand_part("upper") == ("spine", "left_arm", "right_arm")
    with pytest.raises(ValueError, match="unknown body part 'tail'"):
        expand_part("tail")


def test_rest_pose_stands_on_the_floor_and_is_symmetric():
    rest = forward_kinematics(np.array([0, REST_HIPS_HEIGHT, 0]), np.tile(rot.IDENTITY, (JOINT_COUNT, 1)))
    assert rest[INDEX["LeftToe"], 1] == pytest.approx(TOE_HEIGHT)
    np.testing.assert_allclose(rest[MIRROR] * [-1, 1, 1], rest, atol=1e-12)
    assert rest[INDEX["LeftHand"], 0] > 0.5 and rest[INDEX["LeftToe"], 2] > 0.1  # left is +X, toes point to +Z


def test_quaternions_agree_with_scipy():
    a, b = QUATERNIONS[:, 0], QUATERNIONS[:, 1]
    scipy_a, scipy_b = rot.to_scipy(a), rot.to_scipy(b)
    np.testing.assert_allclose((rot.to_scipy(rot.multiply(a, b)) * (scipy_a * scipy_b).inv()).magnitude(), 0, atol=1e-7)
    np.testing.assert_allclose(rot.rotate(a, VECTORS[:, 0]), scipy_a.apply(VECTORS[:, 0]), atol=1e-12)
    np.testing.assert_allclose(rot.rotate(rot.inverse(a), rot.rotate(a, VECTORS[:, 0])), VECTORS[:, 0], atol=1e-12)
    np.testing.assert_allclose(
        rot.to_scipy(rot.slerp(a, b, 0.3)).as_matrix(), _scipy_slerp(scipy_a, scipy_b, 0.3), atol=1e-9
    )


def test_matrices_agree_with_scipy_and_half_turns_come_back():
    half_turns = np.eye(4)[1:]
    for q in (QUATERNIONS[:, 0], half_turns, rot.IDENTITY):
        matrices = rot.to_matrix(q)
        np.testing.assert_allclose(matrices.reshape(-1, 3, 3), rot.to_scipy(q).as_matrix(), atol=1e-12)
        np.testing.assert_allclose(np.abs(np.vecdot(rot.from_matrix(matrices), q)), 1, atol=1e-12)


def _scipy_slerp(a: Rotation, b: Rotation, t: float) -> np.ndarray:
    return (Rotation.from_rotvec(t * (b * a.inv()).as_rotvec()) * a).as_matrix()


@pytest.mark.parametrize("order", ["ZXY", "XYZ", "YXZ", "ZYX"])
def test_euler_round_trip(order):
    degrees = rot.to_euler(order, QUATERNIONS)
    same = np.abs(np.sum(rot.from_euler(order, degrees) * QUATERNIONS, axis=-1))
    np.testing.assert_allclose(same, 1, atol=1e-9)


def test_six_numbers_are_forward_and_up_and_come_back():
    axes = rot.to_6d(QUATERNIONS)
    np.testing.assert_allclose(axes[..., :3], rot.rotate(QUATERNIONS, np.array([0, 0, 1.0])), atol=1e-12)
    np.testing.assert_allclose(axes[..., 3:], rot.rotate(QUATERNIONS, np.array([0, 1.0, 0])), atol=1e-12)
    np.testing.assert_allclose(np.abs(np.sum(rot.from_6d(3 * axes) * QUATERNIONS, axis=-1)), 1, atol=1e-9)


def test_between_turns_one_direction_onto_the_other_even_the_opposite():
    a, b = rot.normalize(VECTORS[:, 0]), rot.normalize(VECTORS[:, 1])
    np.testing.assert_allclose(rot.rotate(rot.between(a, b), a), b, atol=1e-9)
    np.testing.assert_allclose(rot.rotate(rot.between(a, -a), a), -a, atol=1e-6)


def test_yaw_zero_faces_z_and_a_quarter_turn_faces_x():
    np.testing.assert_allclose(rot.rotate(rot.from_yaw(np.pi / 2), np.array([0, 0, 1.0])), [1, 0, 0], atol=1e-12)
    assert rot.yaw_of(np.array([1.0, 0.0])) == pytest.approx(np.pi / 2)


def test_forward_kinematics_agrees_with_walking_the_chain():
    hips = VECTORS[:, 0]
    local = to_local(QUATERNIONS)
    np.testing.assert_allclose(np.abs(np.sum(to_global(local) * QUATERNIONS, axis=-1)), 1, atol=1e-9)
    positions = forward_kinematics(hips, QUATERNIONS)
    expected = np.empty_like(positions)
    expected[:, 0] = hips
    for joint in range(1, JOINT_COUNT):
        parent = PARENTS[joint]
        expected[:, joint] = expected[:, parent] + rot.rotate(QUATERNIONS[:, parent], BONE_OFFSETS[joint])
    np.testing.assert_allclose(positions, expected, atol=1e-12)
    assert ANCESTORS.sum() == sum(len(_chain(j)) for j in range(JOINT_COUNT))


def _chain(joint: int) -> list[int]:
    return [joint] if joint == 0 else [joint, *_chain(PARENTS[joint])]


def test_two_bone_ik_reaches_the_target_and_keeps_bone_lengths():
    hip, knee, ankle = np.array([0, 1.0, 0]), np.array([0, 0.55, 0.05]), np.array([0, 0.12, 0.0])
    for target in np.array([[0.1, 0.2, 0.2], [0, 0.3, -0.3], [-0.2, 0.4, 0.0]]):
        upper, lower = two_bone_ik(hip, knee, ankle, target, np.array([0, 0, 1.0]))
        new_knee = hip + rot.rotate(upper, knee - hip)
        new_ankle = new_knee + rot.rotate(lower, ankle - knee)
        np.testing.assert_allclose(new_ankle, target, atol=1e-9)
        assert new_knee[2] > (hip[2] + target[2]) / 2  # the knee still bends forward


def test_two_bone_ik_stretches_toward_what_it_cannot_reach():
    # a straight leg, no plane
    hip, knee, ankle = np.array([0, 1.0, 0]), np.array([0, 0.55, 0.0]), np.array([0, 0.1, 0.0])
    upper, lower = two_bone_ik(hip, knee, ankle, np.array([0, -1.0, 0.5]), np.array([0, 0, 1.0]))
    way = rot.rotate(upper, knee - hip) + rot.rotate(lower, ankle - knee)
    assert np.linalg.norm(way) == pytest.approx(0.9 * 0.999)
    np.testing.assert_allclose(rot.normalize(way), rot.normalize(np.array([0, -2.0, 0.5])), atol=1e-9)


def test_a_knee_stretched_a_little_too_far_bends_forward_and_without_a_jump():
    hip, ankle, target, pole = (
        np.array([0, 1.0, 0]),
        np.array([0, 0.1, 0.0]),
        np.array([0, 0.2, 0.0]),
        np.array([0, 0, 1.0]),
    )
    knees = np.stack([np.full(201, 0.002), np.full(201, 0.55), np.linspace(-0.03, 0.03, 201)], axis=-1)
    upper, _ = two_bone_ik(hip, knees, ankle, target, pole, hinge=True)
    bent = hip + rot.rotate(upper, knees - hip)
    assert (bent[:, 2] > 0.1).all() and np.linalg.norm(np.diff(bent, axis=0), axis=-1).max() < 0.01


def test_springs_do_not_depend_on_the_frame_rate():
    x, v = 0.0, 0.0
    for _ in range(60):
        x, v = spring_step(x, v, 1.0, 0.2, 1 / 60)
    assert (x, v) == pytest.approx(spring_step(0.0, 0.0, 1.0, 0.2, 1.0))
    assert spring_step(0.0, 0.0, 1.0, 0.2, 0.2)[0] == pytest.approx(0.5, abs=1e-3)
    assert decay(0.2, 0.4) == pytest.approx(0.25)


def test_a_soft_spring_begins_without_a_jolt():
    state = (1.0, 0.0, 0.0)
    for _ in range(60):
        state = soft_spring_step(*state, 0.2, 1 / 60)
    assert state == pytest.approx(soft_spring_step(1.0, 0.0, 0.0, 0.2, 1.0))
    assert soft_spring_step(1.0, 0.0, 0.0, 0.2, 0.2)[0] == pytest.approx(0.5, abs=1e-3)
    x, v, a = (
        np.array([soft_spring_step(0.2, -0.5, 2.0, 0.15, t)[i] for t in np.linspace(0, 1, 10001)]) for i in range(3)
    )
    assert (x[0], v[0], a[0]) == (pytest.approx(0.2), pytest.approx(-0.5), pytest.approx(2.0))
    assert np.gradient(x, 1e-4)[1:-1] == pytest.approx(v[1:-1], abs=1e-5)
    assert np.gradient(v, 1e-4)[1:-1] == pytest.approx(a[1:-1], abs=1e-3)


def test_spring_travel_is_the_integral_of_the_velocity():
    times = np.linspace(0, 1.5, 20001)
    velocity, _ = spring_step(0.3, -0.5, 2.0, 0.15, times)
    assert spring_travel(0.3, -0.5, 2.0, 0.15, 1.5) == pytest.approx(np.trapezoid(velocity, times), abs=1e-6)


def test_lag_is_how_far_a_spring_is_behind_what_moves_steadily():
    x = v = 0.0
    for frame in range(600):
        x, v = spring_step(x, v, frame / 60, 0.1, 1 / 60)
    assert 599 / 60 - x == pytest.approx(lag(0.1), rel=0.1)
