"""Playback at another rate: the same motion, slower or quicker, on the same way; and what a stride that carries farther
changes."""

import numpy as np
import pytest

from controller.runtime.controller import PhaseFunctionedController
from controller.runtime.playback import CATCH_UP, Playback
from sim.body.kinematics import forward_kinematics
from sim.body.pose import Pose
from sim.body.skeleton import JOINT_COUNT, REST_HIPS_HEIGHT
from sim.command import Command, Commands
from sim.math import rotations as rot
from sim.motion.feature_window import RingBuffer
from sim.motion.features import LAYOUT
from sim.motion.playback_pace import HALFLIFE, OWN_PACE, Pace, PaceFollower

WALK = Command((0.0, 1.0))
CURVE = Command((0.8, 0.6))
SCRIPT = [WALK] * 80 + [CURVE] * 60 + [Command((0.0, 1.0), gait="run")] * 80
FIELDS = ("root_position", "root_facing", "hips", "rotations", "contacts", "phase")
VELOCITY, TRAVEL, TURN = LAYOUT["velocity"], slice(12, 14), 14


@pytest.fixture(scope="module")
def controller() -> PhaseFunctionedController:
    return PhaseFunctionedController.from_pretrained()


@pytest.fixture(scope="module")
def walk(controller) -> list[Pose]:
    """Three seconds of setting out at its own rate, one command all the way."""
    controller.restart()
    return [controller.step(WALK) for _ in range(200)]


def equal(one: Pose, other: Pose) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in FIELDS)


def between(poses: list[Pose], index: float) -> np.ndarray:
    """Joints (21, 3) at an index between two poses, by a cubic through four of them."""
    whole = min(max(int(index), 1), len(poses) - 3)
    c = index - whole
    points = np.array([pose.positions for pose in poses[whole - 1 : whole + 3]])
    weights = (
        -c * (c - 1) * (c - 2) / 6,
        (c + 1) * (c - 1) * (c - 2) / 2,
        -(c + 1) * c * (c - 2) / 2,
        (c + 1) * c * (c - 1) / 6,
    )
    return np.tensordot(weights, points, 1)


def test_at_its_own_pace_it_is_the_controller_bit_for_bit(controller):
    controller.restart()
    before = [controller.step(command) for command in SCRIPT]
    controller.restart()
    for pose, command in zip(before, SCRIPT):
        assert equal(controller.step(command, Pace(1.0, 1.0, 1.0)), pose)


@pytest.mark.parametrize("rate", [0.7, 0.8, 1.3, 1.5])
def test_the_same_way_is_gone_slower_or_quicker(controller, walk, rate):
    """A frame at a rate lies where the controller is after so much of its own time: on its way to a few millimetres."""
    controller.restart()
    for frame in range(1, 121):
        pose = controller.step(WALK, Pace(1.0, rate, 1.0))
        if rate * frame > 2:
            apart = np.linalg.norm(pose.positions - between(walk, rate * frame - 1), axis=-1)
            assert apart.max() < 0.004
        assert np.linalg.norm(pose.rotations, axis=-1) == pytest.approx(1, abs=1e-9)
        np.testing.assert_allclose(pose.positions, forward_kinematics(pose.hips, pose.rotations), atol=1e-12)
        assert 0 <= pose.contacts.min() and pose.contacts.max() <= 1 and 0 <= pose.phase < 2 * np.pi


@pytest.mark.parametrize("rate", [0.8, 1.3])
def test_nothing_jumps_while_frames_are_left_out_or_come_twice(controller, walk, rate):
    controller.restart()
    played = np.array([controller.step(WALK, Pace(1.0, rate, 1.0)).positions for _ in range(110)])
    own = np.array([pose.positions for pose in walk[:150]])
    roughness = [np.abs(np.diff(positions[10:], 2, axis=0)).max() for positions in (played, own)]
    assert roughness[0] < max(1.0, rate**2) * roughness[1] * 1.15


def test_back_at_its_own_rate_it_catches_up_with_whole_frames(controller, walk):
    """And is then the controller's own pose again, to the last bit."""
    controller.restart()
    for rate in [0.8] * 41 + [1.3] * 12:
        controller.step(WALK, Pace(1.0, rate, 1.0))
    assert controller.playback.clock != 1
    for _ in range(round(1 / CATCH_UP) + 1):
        if controller.playback.clock == 1:
            break
        pose = controller.step(WALK, Pace(1.0, 1.0, 1.0))
    assert controller.playback.clock == 1
    place = next(index for index, each in enumerate(walk) if equal(each, pose))
    for _ in range(20):
        place += 1
        assert equal(controller.step(WALK), walk[place])


def test_a_restart_forgets_the_rate(controller, walk):
    controller.restart()
    for _ in range(7):
        controller.step(WALK, Pace(1.0, 0.8, 1.0))
    controller.restart()
    assert all(equal(controller.step(WALK), pose) for pose in walk[:20])


def test_a_crowd_with_mixed_rates_moves_as_each_would_alone(controller):
    """Some wait, some go on by a frame and some by two; rates change underway."""
    scripts = [
        [(WALK, 1.0)] * 60,
        [(WALK, 0.8)] * 25 + [(WALK, 1.0)] * 35,
        [(CURVE, 1.3)] * 60,
        [(Command((0.0, 1.0), gait="run"), 1.0 + 0.4 * np.sin(frame / 9)) for frame in range(60)],
        [(Command(), 1.5)] * 30 + [(CURVE, 0.7)] * 30,
    ]
    crowd, together = controller.crowd(len(scripts)), []
    for each in zip(*scripts):
        pace = Pace(np.ones(len(scripts)), np.array([rate for _, rate in each]), np.ones(len(scripts)))
        together.append(crowd.step(Commands([command for command, _ in each]), pace))
    for one, script in enumerate(scripts):
        controller.restart()
        for (command, rate), poses in zip(script, together):
            alone = controller.step(command, Pace(1.0, rate, 1.0))
            np.testing.assert_allclose(poses.positions[one], alone.positions, atol=1e-4)
            assert rot.wrap_angle(poses.root_facing[one] - alone.root_facing) == pytest.approx(0, abs=1e-4)
            assert rot.wrap_angle(poses.phase[one] - alone.phase) == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize("stride", [0.6, 1.4])
def test_a_longer_stride_goes_farther_and_is_the_same_motion(controller, walk, stride):
    """The network does not see how far styled legs carry the root: neither its pose nor its next frame changes by
    it."""
    controller.restart()
    for own in walk[:90]:
        pose = controller.step(WALK, Pace(1.0, 1.0, stride))
        np.testing.assert_allclose(pose.hips - pose.root_position, own.hips - own.root_position, atol=1e-6)
        np.testing.assert_allclose(pose.rotations, own.rotations, atol=1e-5)
        np.testing.assert_allclose(pose.root_position[2], stride * own.root_position[2], rtol=1e-4, atol=1e-5)


def test_another_speed_is_what_the_stick_asks_at_that_length(controller):
    for gait, length in (("walk", 0.6), ("run", 0.8)):
        controller.restart()
        halved = [controller.step(Command((0.0, 1.0), gait=gait), Pace(length, 1.0, 1.0)) for _ in range(90)][-1]
        controller.restart()
        asked = [controller.step(Command((0.0, length), (0.0, 1.0), gait)) for _ in range(90)][-1]
        np.testing.assert_allclose(halved.positions, asked.positions, atol=1e-6)


# ---- the window of features ---------------------------------------------------------------


def steady(frame: float) -> Pose:
    """A body that goes forwards at 1.2 m/s, turns at 0.6 radians a second and waves its arms."""
    time = frame / 60
    facing = 0.6 * time
    place = np.array([1.2 / 0.6 * (1 - np.cos(facing)), 0.0, 1.2 / 0.6 * np.sin(facing)])
    rotations = np.tile(rot.from_yaw(facing), (JOINT_COUNT, 1))
    rotations[13:] = rot.multiply(
        rotations[13:], rot.from_axis_angle(np.array([0.0, 0, 1]), np.array(0.8 * np.sin(5 * time)))
    )
    return Pose(place, facing, place + [0, REST_HIPS_HEIGHT, 0], rotations, np.zeros(4), 0.0)


def shortened(pose: Pose, stride: float) -> Pose:
    """The same, on a way that is so many times as long."""
    shift = (stride - 1) * pose.root_position
    return Pose(
        pose.root_position + shift, pose.root_facing, pose.hips + shift, pose.rotations, pose.contacts, pose.phase
    )


@pytest.mark.parametrize("rate, stride", [(0.7, 1.0), (1.4, 1.0), (1.0, 0.6), (0.8, 1.3)])
def test_velocities_are_told_in_the_controllers_own_time(rate, stride):
    """As if the body went at its own pace: joints, way over the floor and turning."""
    history, own = RingBuffer(), RingBuffer()
    for frame in range(40):
        history.push(shortened(steady(160 - rate * (39 - frame)), stride), Pace(1.0, rate, stride))
        own.push(steady(160 - (39 - frame)))
    ours, wanted = history.window()[-1], own.window()[-1]
    np.testing.assert_allclose(ours[:, :9], wanted[:, :9], atol=1e-9)
    np.testing.assert_allclose(ours[:, VELOCITY], wanted[:, VELOCITY], atol=0.1)  # they look back over two frames
    np.testing.assert_allclose(ours[:, TRAVEL], wanted[:, TRAVEL], atol=0.02)
    np.testing.assert_allclose(ours[:, TURN], 0.6, atol=1e-6)
    assert np.abs(wanted[:, VELOCITY]).max() > 1.0, "it does move"


def test_velocities_of_a_crowd_are_told_for_each():
    paces = [OWN_PACE, Pace(1.0, 0.7, 1.0), Pace(1.0, 1.2, 1.4)]
    crowd, alone = RingBuffer(), [RingBuffer() for _ in paces]
    for frame in range(40):
        poses = [shortened(steady(pace.rate * frame), pace.stride) for pace in paces]
        crowd.push(
            Pose.stacked(poses), Pace(*(np.array([getattr(pace, name) for pace in paces]) for name in Pace._fields))
        )
        for history, pose, pace in zip(alone, poses, paces):
            history.push(pose, pace)
    for one, history in enumerate(alone):
        np.testing.assert_allclose(crowd.window()[one], history.window(), atol=1e-9)


# ---- on the way to a pace -----------------------------------------------------------------


def test_the_pace_follows_smoothly_and_comes_back_exactly():
    follower, paces = PaceFollower(), []
    for frame in range(400):
        paces.append(follower.step(0.6 if frame < 200 else 1.0, 1.2 if frame < 200 else 1.0))
    paces = np.array(paces)
    assert paces[199] == pytest.approx([0.6, 1.2], abs=1e-3) and tuple(paces[-1]) == (1.0, 1.0)
    assert np.abs(np.diff(paces, axis=0)).max() < 0.02 and np.abs(np.diff(paces, 2, axis=0)).max() < 0.005
    assert paces[round(HALFLIFE * 60), 0] == pytest.approx(0.8, abs=0.02)


def test_paces_of_a_crowd():
    crowd, alone = PaceFollower(), [PaceFollower() for _ in range(3)]
    for frame in range(60):
        wanted = np.array([[1.0, 0.7, 1.3][i] if frame < 30 else 1.0 for i in range(3)])
        speed, rate = crowd.step(wanted, 1.0)
        for one, follower in enumerate(alone):
            np.testing.assert_allclose((speed[one], rate[one]), follower.step(wanted[one], 1.0), atol=1e-6)


def test_a_clock_that_was_never_changed_is_never_off():
    playback = Playback((2,))
    for _ in range(100):
        (moving,) = playback.advance(1.0)
        assert moving.all() and (playback.clock == 1).all()
