"""Recorded input: the contract's example, the round trip, what a crash leaves, a sentence for each kind of bad file."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from sim.body.skeleton import PART_NAMES
from sim.command import Command
from sim.io.recording import HEADER, Recorder, read

EXAMPLE = """{"format": "patchwalk-recording", "version": 1, "fps": 60}
{"frame": 0, "move": [0.0, 1.0], "face": null, "gait": "walk", "style": {}}
{"frame": 180, "style": {"left_arm": ["old", 1.0], "right_arm": ["old", 1.0]}}
{"frame": 300, "move": [1.0, 0.0], "face": [0.0, 1.0], "gait": "run"}
{"frame": 600, "end": true}
"""
START = {"frame": 0}
FORWARD = (0.0, 1.0)
BLEND = {"spine": ("old", 0.9, "proud", 1 / 3)}
COMMANDS = (
    [Command((0.1 + 0.2, -1 / 3), (1e-3, 0.9), "run", {"spine": ("old", 1 / 7)})] * 3
    + [Command(style=BLEND)] * 2
    + [Command()] * 200
    + [Command(style={"left_arm": ("proud", strength)}) for strength in (1.5, 1.5, 0.0)]
)


@pytest.fixture
def write(tmp_path):
    def write(text: str):
        path = tmp_path / "input.jsonl"
        path.write_bytes(text.encode())
        return path

    return write


def lines(*entries) -> str:
    return "".join(json.dumps(entry) + "\n" for entry in (HEADER, *entries))


def test_contract_example(write):
    commands = list(read(write(EXAMPLE)))
    arms = {"left_arm": ("old", 1.0), "right_arm": ("old", 1.0)}
    assert (
        commands
        == [Command((0.0, 1.0))] * 180
        + [Command((0.0, 1.0), style=arms)] * 120
        + [Command((1.0, 0.0), (0.0, 1.0), "run", arms)] * 300
    )
    assert read(write(EXAMPLE)).styles == ("old",)


def test_round_trip_is_exact(tmp_path):
    with Recorder(tmp_path / "r.jsonl") as recorder:
        for command in COMMANDS:
            recorder.write(command)
    recording = read(tmp_path / "r.jsonl")
    assert len(recording) == len(COMMANDS) and list(recording) == COMMANDS


def test_a_recording_says_which_stylizer_it_was_made_with(tmp_path, write):
    for name in ("latent", None):
        with Recorder(tmp_path / f"{name}.jsonl", name) as recorder:
            recorder.write(Command())
        assert read(tmp_path / f"{name}.jsonl").stylizer == name
    with pytest.raises(ValueError, match="line 1: stylizer is 7, but must be a name"):
        read(write(EXAMPLE.replace('"version": 1', '"version": 1, "stylizer": 7')))


@pytest.mark.parametrize("at_start", [False, True])
def test_a_recording_says_who_sets_the_pace_and_when_that_changes(tmp_path, at_start):
    commands = [Command((0.0, 1.0), pace=pace) for pace in [at_start] * 5 + [not at_start] * 4 + [at_start] * 3]
    with Recorder(tmp_path / "r.jsonl", pace=at_start) as recorder:
        for command in commands:
            recorder.write(command)
    assert list(read(recorder.path)) == commands
    header, *written = [json.loads(line) for line in recorder.path.read_text().splitlines()]
    assert header.get("pace", False) is at_start
    assert [(line["frame"], line["pace"]) for line in written if "pace" in line] == [(5, not at_start), (9, at_start)]


def test_a_recorder_that_was_told_another_pace_still_records_the_one_that_was(tmp_path):
    for told in (False, True):
        with Recorder(tmp_path / f"{told}.jsonl", pace=told) as recorder:
            recorder.write(Command(pace=not told))
        assert [command.pace for command in read(recorder.path)] == [not told]


def test_without_pace_a_recording_is_what_it_always_was(tmp_path, write):
    with Recorder(tmp_path / "r.jsonl") as recorder:
        for command in read(write(EXAMPLE)):
            assert command.pace is False
            recorder.write(command)
    whole = [line for line in recorder.path.read_text().splitlines() if len(json.loads(line)) > 1]
    assert "\n".join(whole) + "\n" == EXAMPLE


def test_pace_keeps_its_value_until_it_changes(write):
    recording = read(
        write(
            lines(START, {"frame": 2, "gait": "run"}, {"frame": 3, "pace": False}, {"frame": 5, "end": True}).replace(
                '"fps": 60', '"fps": 60, "pace": true'
            )
        )
    )
    assert [command.pace for command in recording] == [True] * 3 + [False] * 2


@pytest.mark.parametrize(
    "text, number",
    [
        (json.dumps(HEADER | {"pace": "yes"}) + "\n", 1),
        (json.dumps(HEADER | {"pace": None}) + "\n", 1),
        (json.dumps(HEADER) + '\n{"frame": 0}\n{"frame": 1, "pace": 1}\n', 3),
    ],
)
def test_a_pace_is_true_or_false(write, text, number):
    with pytest.raises(ValueError, match=f"line {number}: pace is .*, but must be true or false"):
        read(write(text))


def test_a_stick_that_rounding_made_too_long_is_scaled_and_no_longer_one(write):
    def stick(move: list) -> tuple[float, float]:
        (command,) = read(write(lines({"frame": 0, "move": move}, {"frame": 1, "end": True})))
        return command.move

    for move in ([1.001, 0.0], [0.6005, -0.8005], [-0.7071068, 0.7071068]):
        x, z = stick(move)
        assert np.hypot(x, z) == pytest.approx(1, abs=1e-12) and x * move[1] == pytest.approx(z * move[0], abs=1e-12)
    full = (np.nextafter(1.0, 2.0), 0.0)
    assert stick(list(full)) == full, "the last bit of what the window asked is kept, for equal poses"
    with pytest.raises(ValueError, match=r"line 2: move is \[1.0011, 0.0\], longer than 1"):
        stick([1.0011, 0.0])


def test_random_sticks_round_trip(tmp_path):
    random = np.random.default_rng(3)
    commands = [Command(tuple(random.uniform(-0.7, 0.7, 2)), gait=random.choice(["walk", "run"])) for _ in range(300)]
    with Recorder(tmp_path / "r.jsonl") as recorder:
        for command in commands:
            recorder.write(command)
    assert list(read(tmp_path / "r.jsonl")) == commands


def test_a_blend_of_two_styles(write):
    recording = read(write(lines({"frame": 0, "style": {"arms": ["old", 1, "proud", 0.4]}}, {"frame": 1, "end": True})))
    (command,) = recording
    assert command.style == dict.fromkeys(("left_arm", "right_arm"), ("old", 1.0, "proud", 0.4))
    assert recording.styles == ("old", "proud")


def test_what_a_header_says_that_is_not_known_is_named_once(write):
    with pytest.warns(UserWarning) as caught:
        recording = read(write(EXAMPLE.replace('"version": 1', '"version": 1, "grond": "hills", "mood": 1')))
    (warning,) = caught
    assert 'line 1: "grond", "mood" counts for nothing: did you mean \'ground\'?' in str(warning.message)
    assert recording.ground is None


def test_a_jump_is_pressed_in_one_frame(tmp_path, write):
    pressed = [Command(FORWARD), Command(FORWARD, jump=True), Command(FORWARD, jump=True), Command(FORWARD), Command()]
    with Recorder(tmp_path / "r.jsonl") as recorder:
        for command in pressed:
            recorder.write(command)
    assert list(read(tmp_path / "r.jsonl")) == pressed
    by_hand = lines({"frame": 0, "gait": "crouch"}, {"frame": 2, "jump": True}, {"frame": 5, "end": True})
    played = list(read(write(by_hand)))
    assert [command.jump for command in played] == [False, False, True, False, False]
    assert {command.gait for command in played} == {"crouch"}


def test_a_jump_in_the_last_frame_of_a_recording_that_was_cut_short(write):
    with pytest.warns(match="cut short"):
        played = list(read(write(lines(START, {"frame": 1, "jump": True}))))
    assert [command.jump for command in played] == [False, True]


def test_a_jump_in_the_line_that_ends_it_is_refused(write):
    with pytest.raises(ValueError, match="line 3: jump stands in the last line"):
        read(write(lines(START, {"frame": 4, "jump": True, "end": True})))


def test_a_recording_says_what_it_walks_on(tmp_path, write):
    with Recorder(tmp_path / "r.jsonl", ground="stairs") as recorder:
        recorder.write(Command())
    assert read(tmp_path / "r.jsonl").ground == "stairs"
    assert read(write(EXAMPLE)).ground is None


def test_the_first_frames_of_a_recording(write):
    whole = read(write(EXAMPLE))
    assert list(whole.first(200)) == list(whole)[:200] and whole.first(9999) == whole


def test_only_changes_are_written(tmp_path):
    with Recorder(tmp_path / "r.jsonl") as recorder:
        for frame in range(20):
            recorder.write(
                Command(
                    (0.0, 1.0), gait="run" if frame > 9 else "walk", style={"spine": ("old", 1.0)} if frame > 9 else {}
                )
            )
    written = [json.loads(line) for line in (tmp_path / "r.jsonl").read_text().splitlines()]
    assert written[2:] == [{"frame": 10, "gait": "run", "style": {"spine": ["old", 1.0]}}, {"frame": 20, "end": True}]


def test_a_crash_loses_less_than_a_second(tmp_path):
    for survived in (1, 59, 60, 61, 500):
        recorder = Recorder(tmp_path / f"{survived}.jsonl")
        for _ in range(survived):
            recorder.write(Command((0.0, 1.0)))
        with pytest.warns(UserWarning, match="cut short"):
            recording = read(recorder.path)
        assert survived - 60 < len(recording) <= survived
        recorder.close()
        assert len(read(recorder.path)) == survived


def test_recorder_keeps_an_existing_recording(write):
    path = write(EXAMPLE)
    with pytest.raises(FileExistsError):
        Recorder(path)
    assert path.read_text() == EXAMPLE


def test_every_cut_plays_up_to_the_last_whole_line(write):
    whole = list(read(write(EXAMPLE)))
    ends = {EXAMPLE.index(end) + len(end): frame for frame, end in ((0, "{}}"), (180, "1.0]}}"), (300, '"run"}'))}
    for cut in range(min(ends), len(EXAMPLE) - 2):
        with pytest.warns(UserWarning, match="cut short"):
            frames = list(read(write(EXAMPLE[:cut])))
        last = max(frame for end, frame in ends.items() if end <= cut)
        assert frames == whole[: last + 1]


def test_tolerates_what_other_programs_write(write):
    assert len(read(write(EXAMPLE.replace("\n", "\r\n\r\n")))) == 600
    assert len(read(write(EXAMPLE.rstrip()))) == 600  # no newline after the last line
    assert len(read(write("\ufeff" + EXAMPLE))) == 600
    late = read(write(lines({"frame": 5, "move": [0, 1]}, {"frame": 7, "end": True})))
    assert list(late) == [Command()] * 5 + [Command((0.0, 1.0))] * 2
    diagonal = list(read(write(lines({"frame": 0, "move": [0.7071068, 0.7071068]}, {"frame": 1, "end": True}))))
    assert np.hypot(*diagonal[0].move) == pytest.approx(1, abs=1e-12)


def test_groups_and_null(write):
    commands = list(
        read(
            write(
                lines(
                    {"frame": 0, "style": {"all": ["old", 1]}},
                    {"frame": 1, "style": {"legs": None, "spine": ["proud", 0.5]}},
                    {"frame": 2, "end": True},
                )
            )
        )
    )
    assert set(commands[0].style) == set(PART_NAMES)
    assert commands[1].style == {"left_arm": ("old", 1.0), "right_arm": ("old", 1.0), "spine": ("proud", 0.5)}


@pytest.mark.parametrize(
    "text, number, said",
    [
        ("", 1, "no recording"),
        ("{}", 1, "no recording"),
        ("\x89PNG\r\n\x1a\n\0\0", 1, "no recording"),
        (lines().replace('"version": 1', '"version": 2'), 1, "version is 2"),
        (lines().replace("60", "30"), 1, "fps is 30"),
        (lines(START) + "nonsense\n" + lines(START), 3, "not a line of JSON"),
        (lines(START) + "[" * 100_000 + "\n", 3, "not a line of JSON"),
        (lines(START, [1, 2]), 3, "object"),
        (lines(START, {"move": [0, 1]}), 3, "frame is null"),
        (lines({"frame": True}), 2, "frame is true"),
        (lines({"frame": 1.5}), 2, "frame is 1.5"),
        (lines({"frame": -1}), 2, "frame is -1"),
        (lines({"frame": 10**12}), 2, "frame is 1000000000000"),
        (lines({"frame": 5}, {"frame": 5}), 3, "does not come after"),
        (lines({"frame": 5}, {"frame": 4, "end": True}), 3, "does not come after"),
        (lines(START, {"frame": 1, "end": True}, {"frame": 2}), 4, "ended on an earlier line"),
        (lines({"frame": 0, "end": False}), 2, "end is false"),
        (lines({"frame": 0, "mvoe": [0, 1]}), 2, "did you mean 'move'"),
        (lines({"frame": 0, "move": [0.8, 0.8]}), 2, "longer than 1"),
        (lines({"frame": 0, "move": [1]}), 2, "two numbers"),
        (lines({"frame": 0, "move": [float("nan"), 0]}), 2, "two numbers"),
        (lines({"frame": 0, "move": [float("inf"), 0]}), 2, "two numbers"),
        (lines({"frame": 0, "move": [10**400, 0]}), 2, "two numbers"),
        (lines({"frame": 0, "move": ["0", True]}), 2, "two numbers"),
        (lines({"frame": 0, "face": [0, 0]}), 2, "no direction"),
        (lines({"frame": 0, "gait": "gallop"}), 2, "walk, run"),
        (lines({"frame": 0, "gait": ["walk"]}), 2, "walk, run"),
        (lines({"frame": 0, "style": ["old"]}), 2, "style is"),
        (lines({"frame": 0, "style": {"tail": ["old", 1]}}), 2, "unknown body part 'tail'"),
        (lines({"frame": 0, "style": {"spine": "old"}}), 2, "the style of spine"),
        (lines({"frame": 0, "style": {"spine": ["old", 1.6]}}), 2, "0 .. 1.5"),
        (lines({"frame": 0, "style": {"spine": ["old", -0.1]}}), 2, "0 .. 1.5"),
        (lines({"frame": 0, "style": {"spine": ["old", float("nan")]}}), 2, "the style of spine"),
        (lines({"frame": 0, "style": {"spine": ["old", 1, "proud"]}}), 2, '["NAME", STRENGTH, "OTHER", SHARE]'),
        (lines({"frame": 0, "style": {"spine": ["old", 1, "proud", 1.1]}}), 2, "the share of spine is 1.1"),
    ],
)
def test_bad_recordings(write, text, number, said):
    with pytest.raises(ValueError, match=f"line {number}: ") as error:
        read(write(text))
    assert said in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("text", [lines(), lines({"frame": 0, "end": True})])
def test_no_frames(write, text):
    with pytest.raises(ValueError, match="no frames"):
        read(write(text))


def test_the_seed_of_drawn_styles_is_kept(tmp_path):
    with Recorder(tmp_path / "a.jsonl", "latent", seed=7) as recorder:
        recorder.write(Command())
    assert read(tmp_path / "a.jsonl").seed == 7
    with Recorder(tmp_path / "b.jsonl", "latent", seed=0) as recorder:
        recorder.write(Command())
    assert read(tmp_path / "b.jsonl").seed is None, "the one that a start has"


@pytest.mark.parametrize("seed", ["1", 1.5, -1, True, 2**31])
def test_a_seed_that_is_none_is_refused(tmp_path, seed):
    path = tmp_path / "a.jsonl"
    path.write_text(json.dumps({"format": "patchwalk-recording", "version": 1, "fps": 60, "seed": seed}) + "\n")
    with pytest.raises(ValueError, match="line 1: seed is"):
        read(path)


def test_a_full_disk_names_the_recording(tmp_path, monkeypatch):
    def full(_):
        raise OSError(28, "No space left on device")

    recorder = Recorder(tmp_path / "a.jsonl")
    with monkeypatch.context() as disk:
        disk.setattr(recorder, "_file", SimpleNamespace(write=full, flush=lambda: None))
        with pytest.raises(OSError) as caught:
            recorder.write(Command())
    recorder.close()
    assert caught.value.filename == str(tmp_path / "a.jsonl")
