"""The controller as shipped: what it does when it is asked to stand, walk, run, turn, strafe and stop."""

import numpy as np
import pytest

from controller.runtime.controller import PhaseFunctionedController
from controller.runtime.trajectory import MAX_LEAD, Trajectory
from sim.body.pose import Pose
from sim.body.skeleton import BONE_OFFSETS, PARENTS
from sim.command import Command, Commands
from sim.motion.clip import FPS

FORWARD = (0.0, 1.0)


def play(*script: tuple[float, Command]) -> list[Pose]:
    """Seconds and command, one after the other, from standing."""
    controller = PhaseFunctionedController.from_pretrained()
    return [controller.step(command) for seconds, command in script for _ in range(round(seconds * FPS))]


def velocity(poses: list[Pose], seconds: float = 1.0) -> np.ndarray:
    """Mean root velocity (x, z) over the last seconds."""
    way = poses[-1].root_position - poses[-1 - round(seconds * FPS)].root_position
    return way[[0, 2]] / seconds


@pytest.mark.parametrize(
    "command",
    [
        Command(FORWARD),
        Command((0.6, 0.8)),
        Command((0.0, 0.5)),
        Command(FORWARD, gait="run"),
        Command((1.0, 0.0), FORWARD),
        Command((-1.0, 0.0), FORWARD),
        Command((0.0, -1.0), FORWARD),
    ],
    ids=str,
)
def test_speed_and_direction_are_what_the_stick_asks(command):
    wanted = command.desired_velocity
    got = velocity(play((4, command)), 2.0)
    assert np.linalg.norm(got) == pytest.approx(np.linalg.norm(wanted), rel=0.2)
    assert np.degrees(np.arccos(np.dot(got, wanted) / np.linalg.norm(got) / np.linalg.norm(wanted))) < 10


@pytest.mark.parametrize("gait", ["walk", "run"])
def test_it_stops_and_stays(gait):
    poses = play((3, Command(FORWARD, gait=gait)), (3, Command()), (10, Command()))
    still = np.array([p.root_position for p in poses[-10 * FPS :]])
    assert np.linalg.norm(still - still[0], axis=-1).max() < 0.1


def test_it_turns_to_where_it_is_told_to_face():
    assert play((1, Command()), (3, Command((0, 0), (1.0, 0.0))))[-1].root_facing == pytest.approx(np.pi / 2, abs=0.2)
    assert abs(play((2, Command(FORWARD)), (3, Command((0.0, -1.0))))[-1].root_facing) == pytest.approx(np.pi, abs=0.2)


def test_random_sticks_never_break_the_body():
    rng = np.random.default_rng(7)
    script = []
    for _ in range(20):
        angle = rng.uniform(0, 2 * np.pi, 2)
        face = (float(np.sin(angle[1])), float(np.cos(angle[1]))) if rng.random() < 0.4 else None
        length = rng.choice([0.0, 0.4, 1.0])
        script.append(
            (
                1.0,
                Command(
                    (float(np.sin(angle[0])) * length, float(np.cos(angle[0])) * length),
                    face,
                    str(rng.choice(["walk", "run"])),
                ),
            )
        )
    poses = play(*script)
    positions = np.array([p.positions for p in poses])
    assert np.isfinite(positions).all()
    bones = np.linalg.norm(positions[:, 1:] - positions[:, PARENTS[1:]], axis=-1)
    np.testing.assert_allclose(
        bones, np.broadcast_to(np.linalg.norm(BONE_OFFSETS[1:], axis=-1), bones.shape), atol=1e-6
    )
    assert positions[:, 0, 1].min() > 0.6 and positions[:, 12, 1].min() > 1.0  # never on its knees
    assert positions[..., 1].min() > -0.1


def test_two_controllers_given_the_same_input_agree_bit_for_bit():
    script = (1, Command(FORWARD)), (0.5, Command((1.0, 0.0), gait="run"))
    for a, b in zip(play(*script), play(*script)):
        np.testing.assert_array_equal(a.positions, b.positions)
        assert a.phase == b.phase


def test_a_restarted_controller_is_a_new_one_bit_for_bit():
    controller = PhaseFunctionedController.from_pretrained()
    script = [Command(FORWARD, gait="run")] * 30 + [Command()] * 10
    first = [controller.step(command) for command in script]
    controller.restart()
    for a, b in zip(first, (controller.step(command) for command in script)):
        np.testing.assert_array_equal(a.positions, b.positions)
        assert a.phase == b.phase


def test_the_simulated_body_stays_on_its_leash_and_gets_up_to_speed():
    trajectory = Trajectory()
    for _ in range(30):
        samples = trajectory.samples(Command(FORWARD))
        trajectory.follow(np.zeros(3), np.zeros((5, 2)), np.tile([0.0, 1.0], (5, 1)))
    assert np.linalg.norm(trajectory.simulated - trajectory.position) == pytest.approx(MAX_LEAD)
    assert np.linalg.norm(trajectory.velocity) == pytest.approx(1.3, rel=0.15)
    assert samples["trajectory_positions"].shape == (12, 2) and samples["trajectory_gaits"][-1].argmax() == 1


def test_a_crowd_moves_as_each_would_alone():
    """Different ways, gaits and phases; single precision adds in another order when many are multiplied at once."""
    controller, rng = PhaseFunctionedController.from_pretrained(), np.random.default_rng(0)
    angles = rng.uniform(0, 2 * np.pi, (4, 3))  # of the stick, three times each
    scripts = [
        [
            Command(
                (float(np.sin(angle)), float(np.cos(angle))), FORWARD if one == 3 else None, ("walk", "run")[one % 2]
            )
            for angle in angles[one]
            for _ in range(30)
        ]
        + [Command()] * 30
        for one in range(4)
    ]
    crowd = controller.crowd(4)
    together = [crowd.step(Commands(commands)) for commands in zip(*scripts)]
    for one, script in enumerate(scripts):
        controller.restart()
        for pose, poses in zip(map(controller.step, script), together, strict=True):
            np.testing.assert_allclose(poses.positions[one], pose.positions, atol=1e-4)
            assert poses.root_facing[one] == pytest.approx(pose.root_facing, abs=1e-4)
    crowd.restart()
    again = crowd.step(Commands([script[0] for script in scripts]))
    np.testing.assert_array_equal(again.positions, together[0].positions)
