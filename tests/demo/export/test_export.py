"""What a replay leaves behind: poses as designed, equal bytes for equal input, BVH and latency that read back."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from demo.export.export import WRITERS, Result, check_length, check_outputs
from demo.figure.colours import part_colours
from sim.body.kinematics import forward_kinematics, to_global
from sim.body.skeleton import JOINTS, PARTS
from sim.command import GAIT_SPEEDS, Command
from sim.ground.catalogue import load_ground
from sim.io import bvh, poses_npz
from sim.io.atomic_write import atomic_write
from tests.conftest import fake_session
from tests.support.fakes import fake_session as walker_session

# It turns over the side where the sign of a facing's quaternion changes.
COMMANDS = (
    [Command((0.6, 0.8), style={"left_arm": ("old", 1.0)})] * 40
    + [Command((-0.1, -0.9))] * 5
    + [Command((0.0, -1.0), gait="run")] * 15
)


@pytest.fixture
def result():
    session = fake_session()
    return Result([session.step(command) for command in COMMANDS], session.latency, startup_s=0.5)


def products(turns: np.ndarray) -> np.ndarray:
    """Of quaternions (frames, 21, 4) with those of the frame before."""
    return np.sum(turns[1:] * turns[:-1], axis=-1)


def test_poses(result, tmp_path):
    poses_npz.write(tmp_path / "a.npz", result.frames)
    with np.load(tmp_path / "a.npz", allow_pickle=False) as file:
        poses = dict(file)
    frames = len(COMMANDS)
    assert {name: array.shape for name, array in poses.items()} == {
        "fps": (),
        "neutral_positions": (frames, 21, 3),
        "positions": (frames, 21, 3),
        "neutral_rotations": (frames, 21, 4),
        "rotations": (frames, 21, 4),
        "contacts": (frames, 4),
        "phase": (frames,),
        "root_position": (frames, 3),
        "root_facing": (frames,),
        "desired_velocity": (frames, 2),
        "bone_offsets": (21, 3),
        "parents": (21,),
        "joint_names": (21,),
    }
    assert poses["joint_names"][[0, 4, 12]].tolist() == ["Hips", "LeftToe", "Head"]
    bones = poses["positions"][:, 1:] - poses["positions"][:, poses["parents"][1:]]
    assert np.abs(np.linalg.norm(bones, axis=-1) - np.linalg.norm(poses["bone_offsets"][1:], axis=-1)).max() < 1e-4
    rebuilt = forward_kinematics(poses["positions"][:, 0], to_global(poses["rotations"]))
    assert np.abs(rebuilt - poses["positions"]).max() < 1e-6
    assert poses["desired_velocity"][[0, -1]] == pytest.approx(np.array([[0.78, 1.04], [0.0, -GAIT_SPEEDS["run"]]]))
    moved = np.abs(poses["positions"] - poses["neutral_positions"]).max(axis=(0, 2)) > 0.01
    assert moved[PARTS["left_arm"][-1]] and not moved[list(PARTS["right_arm"])].any()
    for name, turns in (
        ("neutral_rotations", [frame.neutral.local_rotations for frame in result.frames]),
        ("rotations", [frame.styled.local_rotations for frame in result.frames]),
    ):
        assert products(np.array(turns)).min() < 0 <= products(poses[name]).min(), "signs run on; the session's do not"


def test_equal_input_gives_equal_bytes(tmp_path):
    for name in ("a", "b"):
        session = fake_session()
        result = Result([session.step(command) for command in COMMANDS], session.latency, 0.0)
        poses_npz.write(tmp_path / f"{name}.poses", result.frames)
        WRITERS["bvh"](tmp_path / f"{name}.bvh", result)
    assert (tmp_path / "a.poses").read_bytes() == (tmp_path / "b.poses").read_bytes()
    assert (tmp_path / "a.bvh").read_bytes() == (tmp_path / "b.bvh").read_bytes()


def test_poses_are_written_as_they_come_and_are_the_same(result, tmp_path, monkeypatch):
    poses_npz.write(tmp_path / "whole.npz", result.frames)
    monkeypatch.setattr(poses_npz, "CHUNK", 7)
    poses_npz.write(tmp_path / "parts.npz", result.frames)
    assert (tmp_path / "whole.npz").read_bytes() == (tmp_path / "parts.npz").read_bytes()
    with poses_npz.writer(tmp_path / "kept.npz") as add:
        for frame in result.frames[:20]:
            add(frame)
        assert not (tmp_path / "kept.npz").exists(), "it appears whole"
    assert len(np.load(tmp_path / "kept.npz")["positions"]) == 20


def test_frames_that_are_not_finite_are_not_written(result, tmp_path):
    broken = replace(result.frames[0], styled=result.frames[0].styled.with_body(np.full(3, np.nan), np.zeros((21, 4))))
    for write in (
        lambda: poses_npz.write(tmp_path / "a.npz", [broken]),
        lambda: WRITERS["glb"](tmp_path / "a.glb", Result([broken], result.latency, 0.0)),
        lambda: WRITERS["bvh"](tmp_path / "a.bvh", Result([broken], result.latency, 0.0)),
    ):
        with pytest.raises(ValueError, match="not finite"):
            write()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind, name", [("bvh", "o.fbx"), ("bvh", "out"), ("glb", "out.gltf"), ("video", "out.bvh")])
def test_an_ending_that_is_not_theirs_is_refused(tmp_path, kind, name):
    with pytest.raises(ValueError, match=f"{name}"):
        check_outputs({kind: tmp_path / name})


def test_what_holds_all_frames_at_once_is_bounded(tmp_path):
    check_length("day.jsonl", 24 * 3600 * 60, {"poses": tmp_path / "a.npz"})
    with pytest.raises(ValueError, match="day.jsonl lasts 1440 minutes: bvh, glb and video hold 60 at most"):
        check_length("day.jsonl", 24 * 3600 * 60, {"bvh": tmp_path / "a.bvh"})


def test_bvh_is_the_styled_motion(result, tmp_path):
    WRITERS["bvh"](tmp_path / "a.bvh", result)
    motion = bvh.read(tmp_path / "a.bvh")
    positions = motion.global_transforms()[0] / bvh.CENTIMETRES
    assert motion.fps == 60
    assert np.abs(positions - [frame.styled.positions for frame in result.frames]).max() < 1e-4


def test_another_reader_finds_the_same_joints_in_the_bvh(result, tmp_path):
    pybvh = pytest.importorskip("pybvh", reason="pybvh reads the file a second time")
    WRITERS["bvh"](tmp_path / "a.bvh", result)
    motion = pybvh.read_bvh_file(str(tmp_path / "a.bvh"))
    assert motion.joint_names == list(JOINTS)
    positions = motion.joint_positions() / bvh.CENTIMETRES
    assert np.abs(positions - [frame.styled.positions for frame in result.frames]).max() < 1e-3


def test_glb_is_the_styled_motion_in_the_last_frame_s_colours(result, tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr("demo.export.gltf.write", lambda path, clip, colours, *_: seen.append((clip, colours)))
    WRITERS["glb"](tmp_path / "a.glb", result)
    ((clip, colours),) = seen
    np.testing.assert_allclose(clip.positions(), [frame.styled.positions for frame in result.frames], atol=1e-9)
    np.testing.assert_array_equal(colours, part_colours(result.frames[-1].command.style))


def test_heights_over_uneven_ground_are_in_every_export(tmp_path):
    ground = load_ground("hills")
    session = walker_session(ground)
    frames = [session.step(Command((0.6, 0.8), gait="run")) for _ in range(240)]
    result = Result(frames, session.latency, 0.0, ground)
    for kind in ("bvh", "glb"):
        WRITERS[kind](tmp_path / f"a.{kind}", result)
    poses_npz.write(tmp_path / "a.npz", frames)
    poses = np.load(tmp_path / "a.npz")
    root = poses["root_position"]
    assert np.ptp(root[:, 1]) > 0.2
    np.testing.assert_allclose(root[:, 1], ground.smooth_height_at(root[:, [0, 2]]))
    positions = bvh.read(tmp_path / "a.bvh").global_transforms()[0] / bvh.CENTIMETRES
    np.testing.assert_allclose(positions, poses["positions"], atol=1e-4)
    assert b'"Ground"' in (tmp_path / "a.glb").read_bytes()


def test_latency(result, tmp_path):
    WRITERS["latency"](tmp_path / "a.json", result)
    report = json.loads((tmp_path / "a.json").read_text())
    assert report["frames"] == len(COMMANDS) and report["startup_s"] == 0.5 and report["first_frame_ms"] > 0
    assert set(report["machine"]) == {"cpu", "cores", "threads", "torch"}
    for stage in ("controller", "features", "stylizer", "foot_lock", "frame"):
        assert set(report[stage]) == {"p50_ms", "p95_ms", "p99_ms", "max_ms"}


def test_video(result, tmp_path):
    try:
        check_outputs({"video": tmp_path / "a.mp4"})
    except ValueError as missing:
        pytest.skip(str(missing))
    import imageio_ffmpeg

    few = Result(result.frames[:5], result.latency, 0.0)
    WRITERS["video"](tmp_path / "a.mp4", few)
    video = imageio_ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    header = next(video)
    pictures = [np.frombuffer(picture, np.uint8) for picture in video]
    assert header["fps"] == 60 and len(pictures) == 5 and pictures[0].std() > 10, "not an empty picture"
    assert len(result.latency.seconds["render"]) == 5


def test_gif(result, tmp_path):
    path = tmp_path / "a.GIF"
    try:
        check_outputs({"video": path})
    except ValueError as missing:
        pytest.skip(str(missing))
    WRITERS["video"](path, Result(result.frames[:12], result.latency, 0.0))
    with Image.open(path) as gif:
        assert gif.n_frames == 4 and gif.info["duration"] == 50, "every third frame, in real time"
        assert np.array(gif.convert("RGB")).std() > 10, "not an empty picture"


def test_a_video_of_another_kind_is_refused(tmp_path):
    with pytest.raises(ValueError, match="an .mp4 or a .gif"):
        check_outputs({"video": tmp_path / "a.avi"})


def test_a_file_is_replaced_only_by_a_whole_one(tmp_path):
    path = tmp_path / "kept.txt"
    path.write_text("old")
    with pytest.raises(RuntimeError), atomic_write(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]
    with atomic_write(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new" and list(tmp_path.iterdir()) == [path]
