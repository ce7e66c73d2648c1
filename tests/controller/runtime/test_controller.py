"""The controller as shipped: what it does when it is asked to stand, walk, run, turn, strafe and stop."""

import numpy as np
import pytest

from controller.model.io_layout import OUTPUT_SIZE
from controller.runtime.controller import PhaseFunctionedController
from controller.runtime.jump import ANTICIPATION, FLIGHT
from controller.runtime.trajectory import MAX_LEAD, Trajectory
from sim.body.pose import Pose
from sim.body.skeleton import BONE_OFFSETS, CONTACT_JOINTS, PARENTS
from sim.command import Command, Commands
from sim.ground.catalogue import load_ground
from sim.ground.ground import Ground
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
    assert samples["trajectory_positions"].shape == (12, 3) and samples["trajectory_gaits"][-1].argmax() == 1


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


def hips(poses: list[Pose]) -> np.ndarray:
    """Height over the root's ground (frames,) in metres."""
    return np.array([pose.hips[1] for pose in poses])


@pytest.mark.parametrize("move", [(0.0, 0.0), FORWARD, (0.0, -1.0), (1.0, 0.0)], ids=str)
def test_it_crouches_in_every_direction_and_gets_up(move):
    crouch = Command(move, FORWARD, "crouch")
    poses = play((1, Command()), (3, crouch), (2, Command()))
    up, down, again = (hips(poses)[round(second * FPS)] for second in (0.9, 3.9, 5.9))
    assert down < up - 0.08 and again > up - 0.05
    got = velocity(poses[: 4 * FPS])
    np.testing.assert_allclose(got, crouch.desired_velocity, atol=0.25)


@pytest.mark.parametrize("move, gait", [((0.0, 0.0), "walk"), (FORWARD, "walk"), (FORWARD, "run")], ids=str)
def test_it_jumps_and_lands_on_its_feet(move, gait):
    go = Command(move, gait=gait)
    poses = play((3, go), (1 / FPS, Command(move, gait=gait, jump=True)), (2, go))
    feet = np.array([pose.positions[CONTACT_JOINTS] for pose in poses])
    press = 3 * FPS
    assert hips(poses)[press:].max() > hips(poses)[press] + 0.2
    assert feet[press:, :, 1].min(axis=1).max() > 0.15, "both feet leave the ground"
    assert feet[-30:, :, 1].min(axis=1).max() < 0.1 and hips(poses)[-30:].min() > 0.6
    contacts = np.array([pose.contacts.max() for pose in poses[press:]])
    assert contacts[round((ANTICIPATION + FLIGHT / 2) * FPS)] < 0.5 < contacts[-30:].max()


def test_a_command_that_arrives_in_the_air_waits():
    run, back = Command(FORWARD, gait="run"), Command((0.0, -1.0), gait="run")
    poses = play((3, run), (1 / FPS, Command(FORWARD, gait="run", jump=True)), (0.5, run), (0.2, back), (2, back))
    in_the_air = poses[3 * FPS + 32 : 3 * FPS + 42]
    assert in_the_air[-1].root_position[2] - in_the_air[0].root_position[2] > 0.35
    assert velocity(poses)[1] < -2


def on_ground(name: str, seconds: float, command: Command) -> list[Pose]:
    controller = PhaseFunctionedController.from_pretrained()
    controller.stand_on(load_ground(name))
    return [controller.step(command) for _ in range(round(seconds * FPS))]


@pytest.mark.parametrize("gait", ["walk", "run", "crouch"])
@pytest.mark.parametrize("name", ["hills", "stairs", "rough"])
def test_the_root_goes_over_the_ground(name, gait):
    ground, poses = load_ground(name), on_ground(name, 6, Command(FORWARD, gait=gait))
    roots = np.array([pose.root_position for pose in poses])
    np.testing.assert_allclose(roots[:, 1], ground.smooth_height_at(roots[:, ::2]), atol=1e-6)
    assert np.ptp(roots[:, 1]) > 0.03
    feet = np.array([pose.positions[CONTACT_JOINTS] for pose in poses])
    over = (feet[..., 1] - ground.height_at(feet[..., ::2])).min(axis=1)
    assert np.abs(np.median(over)) < 0.08 and 0.6 < (hips(poses) - roots[:, 1]).min()


def test_a_slope_takes_speed_and_level_floor_takes_none():
    ramp = np.tile(0.4 * (np.arange(400) - 200) * 0.1, (400, 1)).astype(np.float32)  # rises along +x
    speeds = []
    for move in ((1.0, 0.0), (0.0, 1.0)):
        controller = PhaseFunctionedController.from_pretrained()
        controller.stand_on(Ground(ramp, 0.1, tiled=False))
        poses = [controller.step(Command(move)) for _ in range(4 * FPS)]
        speeds.append(np.linalg.norm(velocity(poses)))
    uphill, along = speeds
    assert 0.75 < uphill < 1.1 < along < 1.45


def test_another_ground_starts_again_and_the_same_goes_on():
    controller = PhaseFunctionedController.from_pretrained()
    for _ in range(30):
        controller.step(Command(FORWARD))
    place = controller.trajectory.position.copy()
    controller.stand_on(None)
    assert np.array_equal(controller.trajectory.position, place)
    controller.stand_on(load_ground("hills"))
    assert not controller.trajectory.position.any()


def test_a_crowd_jumps_crouches_and_climbs_each_as_alone():
    scripts = [
        [Command(FORWARD, jump=frame == 30) for frame in range(120)],
        [Command((1.0, 0.0), gait="crouch")] * 120,
        [Command((0.0, -0.7), gait="run")] * 120,
    ]
    controller = PhaseFunctionedController.from_pretrained()
    controller.stand_on(load_ground("hills"))
    crowd = controller.crowd(len(scripts))
    together = [crowd.step(Commands(each)) for each in zip(*scripts)]
    for one, script in enumerate(scripts):
        controller.restart()
        alone = [controller.step(command) for command in script]
        for frame in (40, 60, 119):
            np.testing.assert_allclose(together[frame].positions[one], alone[frame].positions, atol=2e-3)


def test_weights_that_overflow_are_said_to(monkeypatch):
    controller = PhaseFunctionedController.from_pretrained()
    monkeypatch.setattr(controller.network, "output_deviation", np.full(OUTPUT_SIZE, np.inf, np.float32))
    with pytest.raises(FloatingPointError):
        controller.step(Command(move=(0.0, 1.0)))
