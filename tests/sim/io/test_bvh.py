"""BVH files: known answers for any channel order, the oddities of files in the wild, round trips, writes that fail."""

import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim.body.skeleton import BONE_OFFSETS, JOINT_COUNT, REST_HIPS_HEIGHT
from sim.io import bvh
from sim.math import rotations as rot
from sim.motion.clip import Clip

FRAMES, FPS = 40, 25
OFFSETS = np.array([[1.0, 2.0, 3.0], [0.0, 10.0, 0.0], [5.0, 0.0, -2.0]])
TIP = np.array([0.0, 7.0, 1.0])


def wave(joint: int, channel: int) -> np.ndarray:
    """The value of a channel over time: sinusoids that differ in size, pace and phase."""
    t = np.arange(FRAMES) / FPS
    return (20 + 15 * joint + 5 * channel) * np.sin((1 + joint + 0.3 * channel) * t + joint - channel)


def sinusoidal(orders: list[str], newline: str = "\n") -> str:
    """BVH text of a three-joint chain; a joint's order, such as 'xyzZXY', names its channels (small: position)."""

    def channels(order: str) -> str:
        return f"CHANNELS {len(order)} " + " ".join(
            c.upper() + ("position" if c.islower() else "rotation") for c in order
        )

    lines = [
        "HIERARCHY",
        "ROOT base",
        "{",
        "OFFSET 1 2 3",
        channels(orders[0]),
        "JOINT middle",
        "{",
        "OFFSET 0 10 0",
        channels(orders[1]),
        "JOINT top",
        "{",
        "OFFSET 5 0 -2",
        channels(orders[2]),
        "End Site",
        "{",
        "OFFSET 0 7 1",
        "}",
        "}",
        "}",
        "}",
        "MOTION",
        f"Frames: {FRAMES}",
        f"Frame Time: {1 / FPS}",
    ]
    columns = [wave(joint, channel) for joint, order in enumerate(orders) for channel in range(len(order))]
    return newline.join(lines + [" ".join(f"{value:.9f}" for value in row) for row in np.array(columns).T]) + newline


def tip_path(orders: list[str]) -> np.ndarray:
    """Where the end of the chain is (F, 3), by 4x4 matrices and scipy alone."""
    total = np.tile(np.eye(4), (FRAMES, 1, 1))
    for joint, order in enumerate(orders):
        step = np.tile(np.eye(4), (FRAMES, 1, 1))
        step[:, :3, 3] = OFFSETS[joint]
        for channel, letter in enumerate(order):
            if letter.islower():
                step[:, "xyz".index(letter), 3] = wave(joint, channel)
            else:
                turn = Rotation.from_euler(letter.lower(), wave(joint, channel)[:, None], degrees=True).as_matrix()
                step[:, :3, :3] = step[:, :3, :3] @ turn
        total = total @ step
    return (total @ np.append(TIP, 1.0))[:, :3]


@pytest.fixture
def read(tmp_path):
    def read_text(text: str | bytes) -> bvh.Motion:
        path = tmp_path / "clip.bvh"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return bvh.read(path)

    return read_text


def tip(motion: bvh.Motion) -> np.ndarray:
    positions, rotations = motion.global_transforms()
    return positions[:, -1] + rot.rotate(rotations[:, -1], motion.end_sites[len(motion.names) - 1])


@pytest.mark.parametrize(
    "orders",
    [
        ["xyzZXY", "ZXY", "ZXY"],
        ["xyzYXZ", "YXZ", "XYZ"],
        ["ZYXzyx", "XZY", "YZX"],
        ["xyzZXY", "xyzZXY", "xyzZXY"],  # position channels everywhere, as Bandai-Namco has
        ["yXZ", "Z", "zXxY"],
        ["XYX", "", "ZXZ"],
    ],
)
def test_any_channel_order_gives_the_known_answer(read, orders):
    motion = read(sinusoidal(orders))
    assert motion.fps == FPS and len(motion) == FRAMES
    assert motion.names == ["base", "middle", "top"] and motion.parents == [-1, 0, 1]
    np.testing.assert_allclose(tip(motion), tip_path(orders), atol=1e-6)


def test_position_channels_replace_the_offset(read):
    motion = read(sinusoidal(["xyzZXY", "ZyXY", "ZXY"]))
    np.testing.assert_allclose(motion.positions[:, 1], wave(1, 1)[:, None] * [0, 1, 0], atol=1e-8)
    np.testing.assert_allclose(motion.positions[:, 2], np.tile(OFFSETS[2], (FRAMES, 1)))


ORDERS = ["xyzZXY", "ZXY", "ZXY"]
TIDY = sinusoidal(ORDERS)


@pytest.mark.parametrize(
    "wild",
    [
        sinusoidal(ORDERS, "\r\n"),
        TIDY.replace(" ", "\t"),
        TIDY.replace("ROOT", "root")
        .replace("JOINT", "Joint")
        .replace("CHANNELS", "channels")
        .replace("End Site", "end site")
        .replace("rotation", "ROTATION")
        .replace("MOTION", "motion")
        .replace("Frames:", "FRAMES:"),
        "\ufeff" + TIDY,
        TIDY + "\n  \n\n",
        TIDY.rstrip("\n"),
        TIDY.replace("ROOT base\n{\n", "ROOT base {\n").replace("}\n}\n}\n}", "} } } }"),
        TIDY.replace("OFFSET 5 0 -2", "OFFSET +5.0e+000 -0 -2."),
        TIDY.replace("Frames: 40\nFrame Time: 0.04", "Frames:\t40\nFrame Time:\t4.0e-002\n"),
        TIDY.replace(" ", "   "),
        "\n".join(line if i < 23 else line.replace(" ", "\n", 5) for i, line in enumerate(TIDY.split("\n"))),
    ],
    ids=[
        "crlf",
        "tabs",
        "case",
        "bom",
        "blank end",
        "no newline at the end",
        "braces",
        "numbers",
        "colons",
        "spaces",
        "wrapped rows",
    ],
)
def test_oddities_of_the_wild_read_like_the_tidy_file(read, wild):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_allclose(tip(read(wild)), tip_path(ORDERS), atol=1e-6)


def test_scientific_notation_name_spaces_and_a_missing_end_site(read):
    text = TIDY.replace("End Site\n{\nOFFSET 0 7 1\n}\n", "").replace("JOINT top", "JOINT mixamorig:The Top")
    first = text.index("Frame Time")
    text = text[:first] + text[first:].replace("0.000000000", "1.9e-005")
    motion = read(text)
    assert motion.end_sites == {} and motion.names[2] == "mixamorig:The Top"


def test_the_rows_are_believed_where_the_frame_count_disagrees(read):
    with pytest.warns(UserWarning, match="7 frames announced, 40 found"):
        assert len(read(TIDY.replace("Frames: 40", "Frames: 7"))) == FRAMES


def test_a_last_frame_cut_short_is_left_out(read):
    with pytest.warns(UserWarning, match="cut short") as caught:
        assert len(read(TIDY[:-40])) == FRAMES - 1
    assert len(caught) == 1


@pytest.mark.parametrize(
    "broken, sentence",
    [
        ("", "no MOTION"),
        ("hello world\n", "no MOTION"),
        (b"\x00\xff\xfe" * 99, "no MOTION"),
        ("HIERARCHY\nMOTION\nFrames: 0\nFrame Time: 0.1\n", "no ROOT"),
        (TIDY.replace("OFFSET 5 0 -2", "OFFSET 5 0"), "line 12: OFFSET needs three numbers"),
        (TIDY.replace("OFFSET 5 0 -2", "OFFSET 5 0 two"), "line 12: OFFSET needs three numbers"),
        (TIDY.replace("CHANNELS 6", "CHANNELS 7"), "line 5: CHANNELS"),
        (TIDY.replace("Xposition", "Xpos"), "line 5: CHANNELS"),
        (TIDY.replace("}\n}\n}\n}", "}\n}\n}"), "never closed"),
        (TIDY.replace("}\n}\n}\n}", "}\n}\n}\n}\n}"), "closes nothing"),
        (TIDY.replace("JOINT top", "BONE top"), "line 10: 'BONE' is not a BVH keyword"),
        (TIDY.replace("Frame Time: 0.04", ""), "'Frame Time:' above zero is missing"),
        (TIDY.replace("Frame Time: 0.04", "Frame Time: 0"), "'Frame Time:' above zero is missing"),
        (TIDY.replace("Frame Time: 0.04", "Frame Time: 0,04"), "needs one number"),
        (TIDY[: TIDY.index("0.04") + 5], "no frames"),
        (TIDY.replace("Frame Time: 0.04\n", "Frame Time: 0.04\n1 2 3\n"), "line 24: 3 numbers where each frame has 12"),
        (TIDY + "1 2 3 4 5 6 7 8 9 10 11 twelve\n", "line 64: a frame holds something that is not a number"),
        (TIDY + "1 2 3 4 5 6 7 8 9 10 11 nan\n", "line 64: a frame holds something that is not a number"),
        (TIDY + "1 2 3 4 5 6 7 8 9 10 11 1e300\n", "line 64: a frame holds something that is not a number"),
        (TIDY.replace("OFFSET 5 0 -2", "OFFSET 5 1e308 0"), "line 12: the OFFSET of joint 'top' is too long"),
        (TIDY.replace("OFFSET 5 0 -2", "OFFSET 5 inf 0"), "line 12: the OFFSET of joint 'top' is too long"),
        (TIDY.replace("Frames: 40", "Frames: inf"), "line 22: 'Frames:' is inf, which is no count"),
        (TIDY.replace("Frames: 40", "Frames: " + "9" * 400), "line 22: 'Frames:' is inf, which is no count"),
        (TIDY.replace("Frame Time: 0.04", "Frame Time: inf"), "line 23: 'Frame Time: inf' is no time .* --fps"),
        (TIDY.replace("Frame Time: 0.04", "Frame Time: 3600"), "line 23: 'Frame Time: 3600' is no time .* --fps"),
        (TIDY.replace("Frame Time: 0.04", "Frame Time: 1.0"), "line 23: 'Frame Time: 1' is no time .* --fps"),
        (TIDY.replace("Frame Time: 0.04", "Frame Time: 1e-300"), "line 23: .* is no time .* --fps"),
        (TIDY.replace("CHANNELS 3 Zr", "CHANNELS 3 Zrotation Zrotation Zrotation\nCHANNELS 3 Zr", 1), "twice in a row"),
        (TIDY.replace("JOINT top", "CHANNELS 1 Xposition\nJOINT top"), "line 10: joint 'middle' has CHANNELS already"),
        (TIDY.replace("JOINT top\n", "JOINT a\n{\n}\n" * 1000 + "JOINT top\n"), "more than 1000 joints"),
        (TIDY.replace("JOINT top\n", "JOINT a\n{\n" * 990 + "JOINT top\n"), "line 407: joints lie more than 200 deep"),
        (TIDY.replace("JOINT top", "\x1b[31m" + "x" * 100_000), r"line 10: '\?\[31mx{32}\.\.\.' is not a BVH keyword"),
    ],
)
def test_a_bad_file_is_refused_in_one_sentence_with_its_place(read, broken, sentence):
    with pytest.raises(ValueError, match=sentence) as error:
        read(broken)
    assert "clip.bvh" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    "stated, fps, meaning",
    [
        ("16.667", 60, "milliseconds"),
        ("33.3333", 30, "milliseconds"),
        ("40", 25, "milliseconds"),
        ("60", 60, "frames a second"),
        ("120", 120, "frames a second"),
        ("24", 24, "frames a second"),
    ],
)
def test_a_frame_time_in_milliseconds_or_as_a_rate_is_read_with_a_warning(read, stated, fps, meaning):
    with pytest.warns(UserWarning, match=f"line 23: .* read as {meaning}: .*--fps"):
        assert read(TIDY.replace("Frame Time: 0.04", f"Frame Time: {stated}")).fps == pytest.approx(fps, rel=1e-4)


def test_a_frame_rate_that_is_given_is_believed(tmp_path):
    (tmp_path / "clip.bvh").write_text(TIDY.replace("Frame Time: 0.04", "Frame Time: 1.0"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert bvh.read(tmp_path / "clip.bvh", fps=30).fps == 30
    with pytest.raises(ValueError, match="0 is no frame rate"):
        bvh.read(tmp_path / "clip.bvh", fps=0)


def test_channels_of_an_end_site_are_skipped(read):
    none = TIDY.replace("OFFSET 0 7 1", "OFFSET 0 7 1\nCHANNELS 0")
    np.testing.assert_allclose(tip(read(none)), tip_path(ORDERS), atol=1e-6)
    head, frames = TIDY.split("0.04\n")
    head = head.replace("OFFSET 0 7 1", "OFFSET 0 7 1\nCHANNELS 3 Xrotation Yrotation Zrotation")
    some = head + "0.04\n" + frames.replace("\n", " 90 90 90\n")
    np.testing.assert_allclose(tip(read(some)), tip_path(ORDERS), atol=1e-6)


def test_a_motion_longer_than_half_an_hour_is_refused(read):
    head, frames = TIDY.split("0.04\n")
    row = frames.split("\n")[0] + "\n"
    with pytest.raises(ValueError, match="46000 frames, 31 minutes of motion: cut it"):
        read(head.replace("Frames: 40", "Frames: 46000") + "0.04\n" + row * 46000)


def test_a_file_is_read_no_further_than_its_bound(read, monkeypatch):
    monkeypatch.setattr(bvh, "MAX_MEGABYTES", 1)
    with pytest.raises(ValueError, match="clip.bvh is larger than 1 MB"):
        read(TIDY + " " * 1_000_001)


def test_the_numbers_of_a_file_come_back_whichever_angles_they_are(read, tmp_path):
    """Beyond a quarter turn of the middle axis, and round the circle, where a decomposition would choose others."""
    text = TIDY.replace("\n0.", "\n400.")
    motion = read(text)
    motion.angles[:, 1] += [180.0, 0.0, 360.0]
    motion = replace(motion, rotations=bvh._rotations(motion.channels, motion.angles))
    bvh.write(tmp_path / "again.bvh", motion)
    np.testing.assert_allclose(bvh.read(tmp_path / "again.bvh").angles, motion.angles, atol=1e-5)


def test_joints_with_fewer_channels_are_written_in_them(read, tmp_path):
    motion = read(sinusoidal(["xyzZXY", "X", "ZY"]))
    turned = replace(motion, angles=None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bvh.write(tmp_path / "again.bvh", turned)
    again = bvh.read(tmp_path / "again.bvh")
    assert again.channels == motion.channels
    np.testing.assert_allclose(tip(again), tip(motion), atol=1e-4)
    sideways = rot.from_axis_angle(np.array([0.0, 0.0, 1.0]), 0.3)
    turned.rotations[:, 1] = rot.multiply(turned.rotations[:, 1], sideways)
    with pytest.warns(UserWarning, match="middle cannot turn every way"):
        bvh.write(tmp_path / "again.bvh", turned)


def test_a_missing_file_is_an_os_error(tmp_path):
    with pytest.raises(OSError):
        bvh.read(tmp_path / "nothing.bvh")


def wild_clip(frames: int = 50) -> Clip:
    """Every joint turns every way, through gimbal lock too."""
    rng = np.random.default_rng(1)
    axes = rot.normalize(rng.normal(size=(JOINT_COUNT, 3)))
    angles = np.linspace(-3, 3, frames)[:, None] * rng.random(JOINT_COUNT)
    rotations = rot.from_axis_angle(np.tile(axes, (frames, 1, 1)), angles)
    rotations[frames // 3] = rot.from_euler("ZXY", np.array([30.0, 90.0, -50.0]))
    return Clip(rng.normal(size=(frames, 3)) + [0, REST_HIPS_HEIGHT, 0], rotations, 60, "wild")


def test_our_clips_come_back(tmp_path):
    clip = wild_clip()
    bvh.write(tmp_path / "out.bvh", clip)
    motion = bvh.read(tmp_path / "out.bvh")
    positions, _ = motion.global_transforms()
    assert motion.fps == 60
    np.testing.assert_allclose(positions / 100, clip.positions(), atol=1e-4)
    np.testing.assert_allclose(motion.offsets / 100, BONE_OFFSETS, atol=1e-6)
    assert (tmp_path / "out.bvh").read_text().count("End Site") == 5


def test_any_motion_comes_back_in_its_own_channels(read, tmp_path):
    motion = read(sinusoidal(["ZYXzyx", "xyzXZY", "YZX"]))
    bvh.write(tmp_path / "again.bvh", motion)
    again = bvh.read(tmp_path / "again.bvh")
    assert again.channels == motion.channels and again.fps == motion.fps
    np.testing.assert_allclose(tip(again), tip(motion), atol=1e-4)


def test_a_failing_write_leaves_the_old_file_and_no_litter(tmp_path, monkeypatch, read):
    path = tmp_path / "out.bvh"
    path.write_text("precious")

    def full_disk(*_):
        raise OSError("no space left on device")

    monkeypatch.setattr("os.replace", full_disk)
    with pytest.raises(OSError):
        bvh.write(path, wild_clip(3))
    monkeypatch.undo()
    motion = read(TIDY)
    (tmp_path / "clip.bvh").unlink()
    motion.positions[3, 0, 1] = np.nan
    with pytest.raises(ValueError, match="out.bvh: .* are not finite"):
        bvh.write(path, motion)
    assert path.read_text() == "precious" and [p.name for p in tmp_path.iterdir()] == ["out.bvh"]


def count_steps(action) -> int:
    """The bytecodes of Python that an action runs; what numpy does at once is one of them."""
    steps, before = 0, sys.gettrace()

    def trace(frame, event, _):
        nonlocal steps
        frame.f_trace_opcodes = True
        steps += event == "opcode"
        return trace

    sys.settrace(trace)
    try:
        action()
    finally:
        sys.settrace(before)
    return steps


def test_numbers_are_read_a_file_at_a_time(tmp_path):
    """A loop over the numbers of a file would take a hundred times as long."""
    steps = []
    for frames in (100, 300):
        bvh.write(tmp_path / "long.bvh", wild_clip(frames))
        steps.append(count_steps(lambda: bvh.read(tmp_path / "long.bvh")))
    numbers = 200 * (3 + 3 * JOINT_COUNT)
    assert 200 < steps[1] - steps[0] < numbers
