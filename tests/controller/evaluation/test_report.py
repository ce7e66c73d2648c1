"""The controller's evaluation: each measure on motion with a known answer, the suite, the figures and the command."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from controller.evaluation import metrics as measures
from controller.evaluation import report
from controller.evaluation.figures import Figure, between_halves, endurance, feet, likeness, standing
from controller.evaluation.plots import save_plots
from controller.evaluation.reference_clips import RealClips
from controller.evaluation.report import Evaluation, evaluate
from controller.evaluation.steering_figures import steering
from controller.evaluation.suite import (
    LEAD_IN_SECONDS,
    RANDOM_SECONDS,
    WAIT,
    Motion,
    Trial,
    Unstyled,
    follow,
    play,
    random_sticks,
    script,
    suite,
)
from controller.runtime.controller import PhaseFunctionedController
from controller.training.dataset import is_held_out
from demo import cli
from sim.body.kinematics import forward_kinematics
from sim.body.skeleton import BONE_OFFSETS, JOINT_COUNT, REST_HIPS_HEIGHT
from sim.command import Command
from sim.ground.catalogue import FLAT, load_ground
from sim.io import bvh
from sim.math import rotations as rot
from sim.math.vectors import UP
from sim.motion.clip import FPS, Clip, RootFrame
from sim.session import Session
from tests.support.walker import SPEED, planted_clip, walking_clip

FORWARD = np.array([0.0, 1.3])


def ramp(seconds: float, total: float = 3.0) -> np.ndarray:
    """Velocity (frames, 2) that grows evenly to FORWARD."""
    return np.clip(np.arange(round(total * FPS)) / (seconds * FPS), 0, 1)[:, None] * FORWARD


def glide(
    commands, late: int = 0, scale: float = 1.0, turn: float = 0.0, ground: str = FLAT, height: np.ndarray | float = 0.0
) -> Trial:
    """A statue that is moved as asked, `late` frames late, `scale` times as fast and `turn` radians astray; flat on the
    floor, or a height (frames,) over it, both feet in contact."""
    desired = np.array([command.desired_velocity for command in commands])
    velocity = np.concatenate([np.zeros((late, 2)), desired])[: len(desired)] * scale
    velocity = rot.rotate(rot.from_yaw(turn), np.insert(velocity, 1, 0.0, axis=1))
    root = np.cumsum(velocity, axis=0) / FPS
    facing = np.array([0.0 if command.face is None else rot.yaw_of(np.array(command.face)) for command in commands])
    facing = np.concatenate([np.zeros(late), facing])[: len(desired)]
    rotations = np.tile(rot.IDENTITY, (len(desired), JOINT_COUNT, 1))
    hips = root + [0.0, REST_HIPS_HEIGHT, 0.0] + np.multiply.outer(np.broadcast_to(height, len(root)), UP)
    positions = forward_kinematics(hips, rotations)
    motion = Motion(positions, rotations, RootFrame(root, facing), np.ones((len(desired), 4)))
    return Trial(commands, motion, motion, root[:, [0, 2]], desired, load_ground(ground), ground)


# ---- measures


def test_speed_and_direction():
    velocity = 0.8 * rot.rotate(rot.from_yaw(np.radians(10)), np.tile([0.0, 0.0, 1.3], (60, 1)))[:, [0, 2]]
    assert measures.speed_share(velocity, FORWARD) == pytest.approx(0.8 * math.cos(math.radians(10)))
    assert math.degrees(measures.direction_error(velocity, FORWARD)) == pytest.approx(10)
    assert math.degrees(measures.direction_error(velocity * [-1, 1], FORWARD)) == pytest.approx(10)
    assert math.degrees(measures.direction_error(-velocity, FORWARD)) == pytest.approx(170)
    astray = np.concatenate([velocity, velocity * [-1, 1]])
    assert math.degrees(measures.direction_error(astray, FORWARD)) == pytest.approx(10), "swaying does not average out"


def test_arrival():
    assert measures.arrival_time(ramp(1.0), FORWARD) == pytest.approx(0.9, abs=1 / FPS)
    assert measures.arrival_time(0.5 * ramp(1.0), FORWARD) == pytest.approx(0.9, abs=1 / FPS), "of its own steady speed"
    assert measures.arrival_time(-ramp(1.0), FORWARD) == math.inf


def test_stopping():
    slowing = ramp(1.0)[:FPS][::-1]  # 1.3 m/s to 0 in a second
    rest = np.zeros((FPS, 2))
    assert measures.time_until_still(np.concatenate([slowing, rest])) == pytest.approx(1 - 0.1 / 1.3, abs=2 / FPS)
    assert measures.time_until_still(np.concatenate([slowing, rest, slowing, rest])) > 2.9, "it has to stay"
    assert measures.time_until_still(np.concatenate([rest, slowing[:5]])) == math.inf
    assert measures.time_until_still(rest) == 0.0


def test_contact_speed_counts_planted_joints_only():
    joints = np.zeros((10, 2, 3))
    joints[..., 2] = np.arange(10)[:, None] * 0.3 / FPS
    speed = measures.contact_speed(joints, np.tile([0.9, 0.4], (10, 1)))
    np.testing.assert_allclose(speed[1:, 0], 0.3)
    assert np.isnan(speed[:, 1]).all()


def test_floor_drift_and_liveliness():
    heights = np.array([[0.1, 0.0], [0.1, -0.02], [-0.03, 0.1]])
    np.testing.assert_allclose(measures.depth_under(heights, 0.0), [0, 0.02, 0.03])
    assert measures.drift(np.array([[0.0, 0], [3, 4], [0, 1]])) == 5.0, "the way back does not undo it"
    sway = np.zeros((600, 2, 3))
    sway[:, 1, 0] = 0.02 * np.sin(np.arange(600) / 600 * 2 * np.pi * 5)
    assert measures.motion_amplitude(sway) == pytest.approx(0.02 / math.sqrt(2) / 2, rel=1e-3)


def test_joint_angles_and_their_range():
    rotations = np.tile(rot.IDENTITY, (3, JOINT_COUNT, 1))
    facing = np.array([0.0, 1.0, 2.0])
    rotations[:, 0] = rot.from_yaw(facing)
    rotations[:, 5] = rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.5, -0.4]))
    angles = measures.joint_angles(rotations, facing)
    np.testing.assert_allclose(angles[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(angles[:, 5, 0], [0.0, 0.5, -0.4])
    low, high = np.full((JOINT_COUNT, 3), -0.25), np.full((JOINT_COUNT, 3), 0.25)
    np.testing.assert_array_equal(measures.outside(angles, low, high, 0.2), [False, True, False])
    np.testing.assert_array_equal(measures.outside(angles, low, high, 0.1), [False, True, True])


def test_spells():
    holds = np.zeros(300, bool)
    holds[10:70] = holds[100:161] = holds[239:] = True
    assert measures.spells(holds, 1.0) == [slice(100, 161), slice(239, 300)]
    assert measures.spells(np.zeros(5, bool), 0.0) == []


# ---- suite


def test_the_suite_is_fixed_and_starts_from_standing():
    assert suite() == suite()
    for name, commands in suite().items():
        assert not any(any(command.move) for command in commands[: round(WAIT * FPS)]), name
    assert max(np.linalg.norm(c.desired_velocity) for c in suite()["run 2.0 m/s"]) == pytest.approx(2.0)


def test_random_sticks_are_the_same_restless_ones_each_time():
    commands = random_sticks()
    assert commands == random_sticks() != random_sticks(seed=2)
    assert len(commands) == RANDOM_SECONDS * FPS
    assert max(math.hypot(*command.move) for command in commands) <= 1 + 1e-9
    assert {command.gait for command in commands} == {"walk", "run", "crouch"}
    assert 2 < sum(command.jump for command in commands) < 60
    assert len({command.move for command in commands}) > 200


def test_following_asks_for_the_clips_own_way():
    clip = Motion.of_clip(walking_clip(yaw=1.0))
    commands = follow(clip)
    assert len(commands) == LEAD_IN_SECONDS * FPS + len(clip)
    for command in commands[20:-20]:
        np.testing.assert_allclose(command.desired_velocity, [0.0, SPEED], atol=1e-3)
        np.testing.assert_allclose(command.face, [0.0, 1.0], atol=1e-3)


# ---- figures


@pytest.fixture(scope="module")
def desired() -> dict:
    return suite()


def test_a_character_that_does_as_asked_reaches_every_steering_figure(desired):
    figures = steering({name: glide(commands) for name, commands in desired.items()})
    never_asked = {name for name, figure in figures.items() if figure.ours is None}
    assert never_asked <= {"speed_held_run_3_5_m_s_share"}
    assert all(figure.reached for name, figure in figures.items() if name not in never_asked)
    assert figures["reversal_run_s"].ours == figures["stop_walk_s"].ours == 0.0


def test_each_steering_figure_falls_short_where_it_should(desired):
    late = steering({name: glide(commands, late=80) for name, commands in desired.items()})
    for name in (
        "reversal_walk_s",
        "reversal_run_s",
        "start_walk_s",
        "stop_walk_s",
        "stop_run_s",
        "turn_run_s",
        "turn_on_the_spot_s",
    ):
        assert late[name].ours == pytest.approx(80 / FPS) and late[name].reached is False
    slow = steering({name: glide(commands, scale=0.85) for name, commands in desired.items()})
    held = [figure for name, figure in slow.items() if name.startswith("speed_held") and figure.ours]
    assert len(held) >= 7 and all(f.ours == pytest.approx(0.85) and f.reached is False for f in held)
    astray = steering({name: glide(commands, turn=0.1) for name, commands in desired.items()})
    for kind in ("straight", "strafing", "backing"):
        figure = astray[f"direction_error_{kind}_deg"]
        assert figure.ours == pytest.approx(math.degrees(0.1)) and figure.reached is False


def test_the_worst_take_counts(desired):
    trials = {name: glide(commands) for name, commands in desired.items()}
    trials["stop run 2"] = glide(desired["stop run 2"], late=50)
    trials["back left"] = glide(desired["back left"], scale=1.3)
    figures = steering(trials)
    assert figures["stop_run_s"].ours == pytest.approx(50 / FPS)
    assert figures["speed_held_backing_share"].ours == pytest.approx(1.3)


def test_feet_of_a_gliding_statue():
    walk = glide(script((4, Command((0.0, 1.0)))))
    figures = feet({"walk": walk}, None)
    for name in ("skate_walk_cm_s", "contact_speed_walk_cm_s"):
        assert figures[name].ours == pytest.approx(130, rel=0.01) and figures[name].reached is False
    assert figures["toe_contact_left_share"].ours == 1.0 and figures["skate_run_cm_s"].ours is None
    for sunk, pierced, dip in ((0.0, 0.0, 0.0), (0.03, 1.0, 3.0)):  # metres; the toe joint lies 2 cm up
        walk.locked.positions[..., 1] -= sunk
        figures = feet({"walk": walk}, None)
        assert figures["floor_pierced_p99_cm"].ours == pytest.approx(pierced, abs=1e-9)
        assert figures["toe_dip_p99_cm"].ours == pytest.approx(dip, abs=1e-9)


def test_real_clips_set_the_limit_of_skating():
    sliding = glide(script((4, Command((0.0, 0.04 / 1.3)))))  # too slow to be walking
    walk = glide(script((4, Command((0.0, 1.0)))))
    still_feet = Motion(
        walk.locked.positions - walk.locked.root.positions[:, None],
        walk.locked.rotations,
        walk.locked.root,
        walk.locked.contacts,
    )
    real = RealClips([still_feet, sliding.locked], [], [], np.zeros((JOINT_COUNT, 3)), np.zeros((JOINT_COUNT, 3)))
    figure = feet({"walk": walk}, real)["skate_walk_cm_s"]
    assert figure.real == figure.high == pytest.approx(0.0, abs=1e-9)


def test_a_statue_stands_still_but_is_not_alive():
    figures = standing(glide(script((19, Command()))), None)
    assert figures["standing_drift_cm"].ours == figures["standing_jerk_m_s3"].ours == 0.0
    assert figures["standing_alive_mm"].reached is False


def test_a_stand_is_alive_from_half_of_what_the_real_ones_are():
    def swaying(millimetres: float) -> Trial:
        trial = glide(script((19, Command())))
        time = np.arange(len(trial.desired)) / FPS
        trial.locked.positions[120:, :, 0] += 1e-3 * millimetres * math.sqrt(2) * np.sin(2 * np.pi * time[120:, None])
        return trial

    zero = np.zeros((JOINT_COUNT, 3))
    real = RealClips([], [swaying(4.0).locked], [], zero, zero)
    for millimetres, alive in ((1.9, False), (2.1, True)):
        figure = standing(swaying(millimetres), real)["standing_alive_mm"]
        assert figure.ours == pytest.approx(millimetres, rel=1e-3) and figure.reached is alive
        assert figure.real == pytest.approx(4.0, rel=1e-3)


def test_endurance_counts_what_breaks():
    walk = Command((0.0, 1.0))
    fine = endurance(glide(script((5, walk), (5, Command((1.0, 0.0))))), None)
    assert all(figure.ours in (0, None) for figure in fine.values())
    stuck = glide(script((5, walk)), scale=0.0)
    assert endurance(stuck, None)["random_freezes_count"].ours == 1
    fast = glide(script((5, walk)), scale=1.6)
    assert endurance(fast, None)["random_runaways_count"].ours == 1
    left_behind = glide(script((5, walk)))
    left_behind.simulated[30:40] += 0.6
    assert endurance(left_behind, None)["random_runaways_count"].ours == 1
    fast.locked.positions[7, 3] = np.nan
    assert endurance(fast, None)["random_nan_count"].ours == 3


def test_looking_like_captured_motion_is_no_distance_at_all():
    """What is played is the captured walk itself, then a statue on its way."""
    zero = np.zeros((JOINT_COUNT, 3))
    clips = [Motion.of_clip(walking_clip(240, yaw)) for yaw in (0.0, 1.0, 2.0)]
    real = RealClips(clips, [], [], zero, zero)
    late = LEAD_IN_SECONDS * FPS
    late_clips = [Motion.of_clip(walking_clip(240 + late, yaw)) for yaw in (0.0, 1.0, 2.0)]  # two whole cycles later
    same = likeness(real, late_clips)
    assert same["same_ways_frechet_distance_cm2"].ours < 1.0
    jerk = same["same_ways_walking_jerk_m_s3"]
    assert jerk.ours == pytest.approx(jerk.real, rel=0.02) and jerk.high == 1.2 * jerk.real > 10
    statue = likeness(real, [glide(follow(clip)).locked for clip in clips])
    assert statue["same_ways_frechet_distance_cm2"].ours > 100.0
    assert statue["same_ways_walking_jerk_m_s3"].ours < 0.1 * jerk.real
    assert all(figure.ours is None and figure.reached is None for figure in likeness(None, []).values())


def test_halves_are_cut_between_clips():
    random = np.random.default_rng(0)
    near, far = random.normal(size=(2, 500, 3)), 10 + random.normal(size=(2, 500, 3))
    assert between_halves([*near]) < 0.1
    assert between_halves([near[0], far[0]]) == pytest.approx(300, rel=0.05)
    uneven = [*near, *far, far[0] + 7.0]
    assert between_halves(uneven) == between_halves(uneven), "the same halves each time"


def test_figures_know_whether_they_are_reached():
    assert Figure(5.0, high=5.0).reached and not Figure(5.1, high=5.0).reached
    assert Figure(0.5, low=0.45, high=0.7).reached and not Figure(0.4, low=0.45, high=0.7).reached
    assert Figure(1.0).reached is None and Figure(None, high=1.0).reached is False
    assert Figure(1.0, 2.0, None, 3.0).as_json() == {"ours": 1.0, "real": 2.0, "reach": [None, 3.0]}
    assert Figure(1.0).as_json()["reach"] is None
    never = Figure(math.inf, None, None, 0.6).rounded()
    assert never.ours is None and never.reached is False, "JSON knows no infinity"
    assert Figure(1.23456, None, None, 3).rounded() == Figure(1.235, None, None, 3)


# ---- real clips, the whole line, the command


@pytest.fixture
def folder(tmp_path) -> Path:
    """A small folder of captures: the statue on both sides of the split, and one with a bent knee to learn from."""
    clips = [f"clip{i}" for i in range(99)]
    names = {held: next(name for name in clips if is_held_out(name) == held) for held in (True, False)}
    for name in names.values():
        bvh.write(tmp_path / f"{name}.bvh", planted_clip(240))
    bent = planted_clip(60)
    bent.rotations[:, 2] = rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), 0.4)
    bvh.write(tmp_path / f"{names[False]}0.bvh", Clip(bent.hips, bent.rotations))
    bvh.write(tmp_path / "JumpUp.bvh", planted_clip(240))
    return tmp_path


def test_real_clips(folder):
    real = RealClips.load(folder)
    assert len(real.held_out) == 1 and [len(stand) for stand in real.idle] == [240, 240]
    assert real.high[2, 0] == pytest.approx(0.4, abs=0.02) == real.high[6, 0], "left and right, for training mirrors"
    assert real.high[14].max() < 0.05


def test_a_folder_without_clips_is_refused(tmp_path):
    with pytest.raises(ValueError, match="too few usable BVH files"):
        RealClips.load(tmp_path)


@pytest.fixture(scope="module")
def walked() -> Trial:
    standing = PhaseFunctionedController.from_pretrained()
    play(script(), standing)  # leaves no trace in what is played next
    return play(script((4, Command((0.0, 1.0)))), standing)


def test_the_product_itself_is_what_is_played(walked):
    assert len(walked.neutral) == len(walked.locked) == len(walked.simulated) == len(walked.desired) == 300
    first = Session(PhaseFunctionedController.from_pretrained(), Unstyled()).step(walked.script[0])
    np.testing.assert_array_equal(walked.locked.positions[0], first.styled.positions)
    assert walked.neutral.root.positions[-1, 2] == pytest.approx(5.0, abs=0.4)
    moved = np.linalg.norm(walked.locked.positions - walked.neutral.positions, axis=-1)
    assert moved[:, 3].max() > 0.002 and moved.max() < 0.3, "the foot lock is at work"
    lengths = np.linalg.norm(np.diff(walked.locked.positions[:, [1, 2]], axis=1), axis=-1)
    np.testing.assert_allclose(lengths, np.linalg.norm(BONE_OFFSETS[2]), atol=1e-9)


def test_plots_are_drawn(walked, tmp_path):
    bvh.write(tmp_path / "Female1_B03_Walk1.bvh", walking_clip(200))
    paths = save_plots(tmp_path / "new", {"walk 1.3 m/s": walked, "b": walked}, tmp_path)
    assert [path.name for path in paths] == ["trajectory.png", "speed.png", "feet.png", "strips.png"]
    assert all(path.read_bytes()[:4] == b"\x89PNG" and path.stat().st_size > 10_000 for path in paths)


def test_the_command_prints_a_table_and_writes_what_it_says(folder, tmp_path, monkeypatch, capsys):
    """The whole evaluation, of a statue."""
    monkeypatch.setattr(report, "random_sticks", lambda: random_sticks(2))
    monkeypatch.setattr(report, "play", lambda commands, standing, tick, ground=FLAT: glide(commands, ground=ground))
    monkeypatch.setattr("controller.evaluation.plots.save_plots", lambda folder, played, data: [folder / "some.png"])
    assert (
        cli.main(
            [
                "evaluate",
                "controller",
                "--data",
                str(folder),
                "--json",
                str(tmp_path / "e.json"),
                "--plots",
                str(tmp_path / "plots"),
            ]
        )
        == 0
    )
    out, err = capsys.readouterr()
    written = json.loads((tmp_path / "e.json").read_text())
    assert set(written) == {"figures"} and "same_ways_frechet_distance_cm2" in written["figures"]
    for name, figure in written["figures"].items():
        assert set(figure) == {"ours", "real", "reach"} and name in out
    assert err == "" and out.count("wrote ") == 2
    assert {line.split()[-1] for line in out.splitlines()} >= {"ok", "short", "-"}


MISTAKES = {
    ("stylizer",): "name a folder that holds Bandai-Namco's with --data",
    ("controller", "--data", "nowhere"): "there is no folder nowhere",
    ("controller", "--json", "nowhere/e.json"): "there is no folder nowhere",
    ("controller", "--data", "empty"): "too few usable BVH files",
    ("controller", "--plots", "a_file"): "a_file: it is not a folder",
}


@pytest.mark.parametrize("line", MISTAKES, ids=" ".join)
def test_a_mistake_is_one_line_and_status_2(line, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("empty").mkdir()
    Path("a_file").touch()
    monkeypatch.setattr(report, "suite", lambda: pytest.fail("nothing is played before the arguments are right"))
    assert cli.main(["evaluate", *line]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and MISTAKES[line] in err


def test_the_same_weights_give_the_same_figures(monkeypatch):
    """Twice through the real line, on a short suite."""
    short = {"stand": script((1, Command())), "walk": script((1, Command((0.0, 1.0))))}
    monkeypatch.setattr(report, "suite", lambda: short)
    monkeypatch.setattr(report, "random_sticks", lambda: random_sticks(1))
    monkeypatch.setattr(report, "steering", lambda played: {})
    monkeypatch.setattr(report, "terrain_suite", lambda: {"ramp": ("hills", short["walk"])})
    for figures in ("bearing", "crouching"):
        monkeypatch.setattr(report, figures, lambda played, real: {})
    monkeypatch.setattr(report, "jumping", lambda played: {})
    first, second = evaluate(), evaluate()
    assert isinstance(first, Evaluation) and first.figures == second.figures
    assert first.figures["random_nan_count"].ours == 0 and first.figures["standing_jerk_m_s3"].ours > 0
