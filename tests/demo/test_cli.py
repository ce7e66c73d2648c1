"""The command line: a mistake is one line and status 2, help needs no torch, replays leave what they say."""

import json
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from demo import assemble, cli
from demo.state.style_names import parse_style
from sim.body.skeleton import PART_NAMES
from sim.command import GAIT_SPEEDS
from sim.ground.catalogue import load_ground
from sim.io import recording
from sim.io.provenance import NONCOMMERCIAL
from sim.style_spec import PartSpec
from stylizer.styles.clip_table import CLIPS, licence_of
from stylizer.systems import weight_files
from stylizer.systems.motion_puzzle.config import CONFIGS
from stylizer.systems.registry import all_networks
from tests.conftest import fake_session
from tests.support.skinned import write

ROOT = Path(__file__).parents[2]
GOOD = """{"format": "patchwalk-recording", "version": 1, "fps": 60}
{"frame": 0, "move": [0.0, 1.0], "style": {"left_arm": ["old", 1.0]}}
{"frame": 30, "end": true}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working folder, with a few files to get wrong."""
    monkeypatch.chdir(tmp_path)
    Path("good.jsonl").write_text(GOOD)
    Path("cut.jsonl").write_text(GOOD[:-5])
    Path("bad.jsonl").write_text(GOOD.replace("[0.0, 1.0]", "[2.0, 1.0]"))
    Path("odd.jsonl").write_text(GOOD.replace("old", "odl"))
    Path("a_folder").mkdir()
    Path("words.txt").write_text("no recording\n")
    Path("words.png").write_text("no picture\n")
    for name, ground in (("lost", "gone.png"), ("moon", "moon")):
        Path(f"{name}.jsonl").write_text(GOOD.replace('"fps": 60', f'"fps": 60, "ground": "{ground}"'))
    for name in ("clips/walk.bvh", "a_run/checkpoint.pt"):
        Path(name).parent.mkdir()
        Path(name).touch()
    return tmp_path


MISTAKES = {
    "dance": "invalid choice: 'dance'",
    "--sideways": "--sideways",
    "--crowd 1": "'1' is no size of a crowd: give 2 to 64",
    "--crowd many": "'many' is no size of a crowd",
    "--crowd ٣": "'٣' is no size of a crowd",
    "--seconds 3": "--seconds goes with --crowd N",
    "export": "required: format, OUT",
    "--crowd 3 --seconds 1 --vmc": "a crowd without a window is only timed: leave --vmc out",
    "--crowd 3 --seconds 1 --character hero.glb --map map.json": "leave --character and --map out",
    "serve --host a..b": "--host a..b is no name of a machine",
    "serve --host=": "nothing stands behind --host",
    "stylize clips/walk.bvh --style arms=old -o .": "cannot write bvh to .: it is not a file",
    "export fbx out": "invalid choice: 'fbx'",
    "export onnx out --ground flat": "'flat' is what the player walks on without a ground",
    "export onnx out --ground moon": "unknown ground 'moon'",
    "replay": "required: REC",
    "replay good.jsonl --headles": "--headles",
    "replay nowhere.jsonl --headless": "nowhere.jsonl: No such file",
    "replay a_folder --headless": "a_folder: Is a directory",
    "replay words.txt --headless": "words.txt, line 1: this is no recording",
    "replay bad.jsonl --headless": "bad.jsonl, line 2: move is [2.0, 1.0], longer than 1",
    "replay odd.jsonl --headless --poses out.npz": "unknown style 'odl': did you mean old?",
    "--ground moon": "unknown ground 'moon': use one of flat, hills, stairs, rough, or a height map FILE.png",
    "--ground words.png": "words.png: this is no picture",
    "replay good.jsonl --headless --ground moon": "unknown ground 'moon'",
    "replay good.jsonl --headless --ground gone.png": "gone.png: No such file",
    "replay moon.jsonl --headless": "unknown ground 'moon'",
    "replay lost.jsonl --headless": "gone.png: No such file",
    "replay good.jsonl --headless --poses nowhere/out.npz": "there is no folder nowhere",
    "replay good.jsonl --headless --poses a_folder": "it is not a file",
    "replay good.jsonl --headless --poses good.jsonl": "it is the recording itself",
    "replay good.jsonl --headless --poses out --bvh out": "it is where poses goes already",
    "replay good.jsonl --headless --poses words.txt/out.npz": "there is no folder words.txt",
    "stylize walk.bvh --style arms -o out.bvh": "PART=NAME",
    "stylize walk.bvh --style tail=old -o out.bvh": "unknown body part 'tail'",
    "stylize walk.bvh --style arms=old+proud@2 -o out.bvh": "the share in 'arms=old+proud@2' must lie in 0 .. 1",
    "stylize walk.bvh --style arms=old --style left_arm=proud -o out.bvh": "left_arm is given two styles",
    "stylize walk.bvh --style arms=old -o walk.bvh": "walk.bvh is the content itself",
    "stylize walk.bvh --style arms=old -o nowhere/out.bvh": "there is no folder nowhere",
    "stylize nowhere.bvh --style arms=old -o out.bvh": "nowhere.bvh: No such file",
    "stylize words.txt --style arms=old -o out.bvh": "words.txt is not a whole BVH file",
    "stylize words.txt --style arms=old --map words.txt -o out.bvh": "words.txt is not a JSON file",
    "evaluate stylizer": "name a folder that holds Bandai-Namco's with --data",
    "evaluate stylizer --movements back": "--movements back; see patchwalk evaluate stylizer --help",
    "evaluate live --data clips --movements hop": "there is no movement 'hop': use some of walk_0.65",
    "evaluate character nowhere.glb": "nowhere.glb",
    "evaluate stylizer --data clips": "clips holds no labelled motion",
    "evaluate stylizer --data clips --weights nowhere": "there is no folder nowhere",
    "evaluate stylizer --data clips --all magic": "there is no network 'magic': use one of full",
    "evaluate stylizer --data clips --all joints --plots p": "--all draws no pictures: leave --plots out",
    "train stylizer --data clips --recipe live": "give both --recipe live and --start FILE",
    "styles": "list|add|rename|remove",
    "styles add good.jsonl": "--name",
    "bench --seconds 0": "above 0",
    "bench --characters many": "above 0",
    "bench --json nowhere/out.json": "there is no folder nowhere",
    "bench --plot nowhere/out.png": "there is no folder nowhere",
    "bench --plot out.png --quality good.jsonl": "no report of the stylizer",
    "bench --quality good.jsonl": "--plot",
    "train dancer": "invalid choice: 'dancer'",
    "train controller --data nowhere": "there is no folder nowhere",
    "train controller --data a_folder": "holds no BVH files",
    "train controller": "name a folder of BVH files with --data",
    "train controller --minutes soon": "soon",
    "train controller --data clips --network slim": "unrecognized arguments: --network slim",
    "train controller --data clips --start nowhere.safetensors": "there is no weight file nowhere.safetensors",
    "train stylizer --data clips --start nowhere.safetensors": "there is no weight file nowhere.safetensors",
    "train controller --data clips --resume --out a_folder": "a_folder holds no run to go on with",
    "train controller --data clips --out a_run": "a_run holds a run already",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistake_is_one_line_and_status_2(line, folder, fake_models, capsys):
    before = sorted(folder.rglob("*"))
    assert cli.main(line.split()) == 2
    out, err = capsys.readouterr()
    assert err.startswith("patchwalk: ") and err.count("\n") == 1 and MISTAKES[line] in err
    assert out == "" and sorted(folder.rglob("*")) == before, "nothing half is left"


@pytest.mark.parametrize("line", ["replay good.jsonl --headless", "bench --seconds 1"])
def test_an_own_style_of_another_controller_is_refused(line, folder, monkeypatch, capsys):
    monkeypatch.setattr("controller.model.checkpoint.fingerprint", lambda *_, **__: "another")
    assert cli.main(line.split()) == 2
    out, err = capsys.readouterr()
    assert err.startswith("patchwalk: the own style was captured from another controller") and err.count("\n") == 1
    assert "patchwalk styles capture" in err and out == ""


def test_a_failing_replay_keeps_the_older_file(folder, fake_models, monkeypatch):
    Path("out.npz").write_text("precious")
    monkeypatch.setattr("sim.io.poses_npz.to_arrays", lambda frames: 1 / 0)
    assert cli.main("replay good.jsonl --headless --poses out.npz".split()) == 1, "a mistake of ours, not the user's"
    assert Path("out.npz").read_text() == "precious" and not list(folder.glob(".patchwalk-*"))


def test_a_mistake_of_ours_is_a_sentence_and_its_traceback_is_kept(folder, fake_models, monkeypatch, capsys):
    monkeypatch.setenv("PATCHWALK_HOME", str(folder / "home"))

    def fail(_):
        raise KeyError("\x1b[31m" + "x" * 5000)

    monkeypatch.setattr("sim.io.recording.read", fail)
    assert cli.main("replay good.jsonl --headless".split()) == 1
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "a mistake in Patchwalk (KeyError" in err and "error.log" in err
    assert "\x1b" not in err and len(err) < 700
    assert "Traceback" in (folder / "home" / "cache" / "error.log").read_text()


def test_messages_have_a_length_and_steer_no_terminal(folder, monkeypatch, capsys):
    def fail(_):
        raise ValueError("\x1b]0;title\x07" + "long " * 50_000)

    monkeypatch.setattr("sim.io.recording.read", fail)
    assert cli.main("replay good.jsonl --headless".split()) == 2
    err = capsys.readouterr().err
    assert len(err) < 1100 and "\x1b" not in err and "\x07" not in err


def test_warnings_of_a_kind_are_counted(folder, fake_models, monkeypatch, capsys):
    def read(path):
        for number in range(10):
            warnings.warn(f"{path}{number}.bvh: frame {number}, 7 jumps away", stacklevel=1)
        warnings.warn("something else", stacklevel=1)
        raise ValueError("enough")

    monkeypatch.setattr("sim.io.recording.read", read)
    assert cli.main("replay good.jsonl --headless".split()) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 6 and lines[4:] == [
        "patchwalk: enough",
        "patchwalk: warning: and 7 more like it: frame jumps away",
    ]


def test_the_version_is_printed(capsys):
    assert cli.main(["--version"]) == 0 and capsys.readouterr().out.startswith("patchwalk")


@pytest.mark.parametrize(
    "line", ["export onnx", "serve --host", "replay good.jsonl --headless --poses", "styles remove"]
)
@pytest.mark.parametrize("nothing", ["", "  "])
def test_an_empty_word_is_no_place_to_write_to(line, nothing, folder, capsys):
    before = sorted(folder.rglob("*"))
    assert cli.main([*line.split(), nothing]) == 2
    assert f"nothing stands behind {line.split()[-1]}" in capsys.readouterr().err
    assert sorted(folder.rglob("*")) == before


def test_a_crowd_without_a_display_says_what_it_leaves_out(folder, fake_models, monkeypatch, capsys):
    monkeypatch.setattr("demo.render.window.has_display", lambda: False)
    assert cli.main("--crowd 3 --vmc".split()) == 2
    assert "a crowd without a window is only timed: leave --vmc out" in capsys.readouterr().err


UNKNOWN_STYLE = "stylize clips/walk.bvh --style arms=nothing -o out.bvh --stylizer"


@pytest.mark.parametrize(
    "line, status",
    [
        ("--version", 0),
        *((f"styles list --stylizer {name}", 0) for name in weight_files.names()),
        *((f"{UNKNOWN_STYLE} {name}", 2) for name in weight_files.names()),
        ("styles remove nothing", 2),
        ("styles list --stylizer nothing", 2),
        ("styles add nothing.bvh --name mine", 2),
        ("styles add clips/walk.bvh --name mine --stylizer nothing", 2),
        ("stylize nothing.bvh --style arms=zombie -o out.bvh", 2),
        ("replay odd.jsonl --headless", 2),
        ("replay good.jsonl --headless --stylizer nothing", 2),
        ("train stylizer --data clips --network nothing", 2),
        ("serve --stylizer nothing", 2),
        ("--stylizer nothing", 2),
        ("--ground nothing", 2),
        ("--crowd 3 --seconds 1 --stylizer nothing", 2),
    ],
)
def test_what_needs_no_network_loads_none(folder, line, status):
    assert not {"torch", "scipy"} & loaded_by(line, status), "they take seconds to load"


@pytest.mark.parametrize("line", ["--character nothing.glb", "serve --character nothing.glb", "--vmc nowhere:x"])
def test_what_needs_no_network_loads_no_torch(folder, line):
    assert "torch" not in loaded_by(line, 2)


def loaded_by(line: str, status: int) -> set[str]:
    """The packages that a command line imports, which ends with this status."""
    script = f"""import sys
from demo.cli import main
status = main({line.split()})
print(*(name for name in sys.modules if "." not in name), sep=chr(10))
sys.exit(status)"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == status, done.stderr
    return set(done.stdout.splitlines())


def test_a_recordings_stylizer_is_a_name_and_no_path(folder, capsys):
    Path("path.jsonl").write_text(GOOD.replace('"fps": 60', '"fps": 60, "stylizer": "../weights/joints"'))
    assert cli.main("replay path.jsonl --headless".split()) == 2
    assert "is no name of a stylizer" in capsys.readouterr().err


def test_a_replay_draws_the_styles_by_the_recordings_seed(folder, monkeypatch):
    drawn = []
    monkeypatch.setattr("tests.conftest.FakeStylizer.resample", lambda self, seed=None: drawn.append(seed))
    monkeypatch.setattr(assemble, "build_session", fake_session)
    Path("drawn.jsonl").write_text(GOOD.replace('"fps": 60', '"fps": 60, "seed": 3'))
    for name in ("drawn.jsonl", "good.jsonl"):
        assert cli.main(f"replay {name} --headless".split()) == 0
    assert drawn == [3]


def test_replay_writes_what_it_says(folder, fake_models, capsys):
    assert cli.main("replay good.jsonl --headless --poses a.npz --bvh a.bvh --latency a.json".split()) == 0
    out, err = capsys.readouterr()
    assert err == "" and "30 frames" in out
    assert [line.removeprefix("wrote ") for line in out.splitlines()[1:]] == ["a.npz", "a.bvh", "a.json"]
    assert all(Path(name).stat().st_size for name in ("a.npz", "a.bvh", "a.json"))


def test_a_replay_walks_on_the_recording_s_ground_or_on_the_one_that_is_asked_for(folder, monkeypatch):
    stood_on = []

    def build_session(stylizer=None, ground=None):
        stood_on.append(ground)
        return fake_session(ground=ground)

    monkeypatch.setattr(assemble, "build_session", build_session)
    Path("maps").mkdir()
    Image.fromarray(np.tile(np.arange(64, dtype=np.uint8), (64, 1))).save("maps/ramp.png")
    for name, ground in (("stairs", "stairs"), ("ramp", "ramp.png")):
        Path(f"maps/{name}.jsonl").write_text(GOOD.replace('"fps": 60', f'"fps": 60, "ground": "{ground}"'))
    for line in ("stairs.jsonl", "stairs.jsonl --ground hills", "stairs.jsonl --ground flat", "ramp.jsonl"):
        assert cli.main(f"replay maps/{line} --headless".split()) == 0
    assert stood_on[:3] == [load_ground("stairs"), load_ground("hills"), None]
    assert stood_on[3].name == "ramp.png", "beside the recording"


def test_the_video_of_a_replay_shows_its_ground(folder, fake_models, monkeypatch):
    shown = []
    monkeypatch.setattr("demo.export.video.check", lambda path: None)
    monkeypatch.setattr("demo.export.video.render", lambda path, *what: (path.touch(), shown.append(what[2])))
    assert cli.main("replay good.jsonl --headless --ground rough --video out.gif".split()) == 0
    assert shown == [load_ground("rough")]


def test_a_recording_cut_short_plays_with_a_warning(folder, fake_models, capsys):
    assert cli.main("replay cut.jsonl --headless".split()) == 0
    out, err = capsys.readouterr()
    assert err.startswith("patchwalk: warning: cut.jsonl was cut short") and err.count("\n") == 1
    assert "1 frames" in out


def test_without_a_display_the_bundled_recording_goes_to_out(folder, fake_models, monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("demo.render.window.has_display", lambda: False)
    monkeypatch.setattr("demo.export.video.check", no_video)
    monkeypatch.setattr(assemble, "BUNDLED_RECORDING", folder / "good.jsonl")
    assert cli.main([]) == 0
    out = capsys.readouterr().out
    assert "No video: a video needs OpenGL" in out
    for name in ("poses.npz", "styled.bvh", "latency.json"):
        assert (folder / "out" / name).is_file() and f"wrote out/{name}" in out


def no_video(path) -> None:
    raise ValueError("a video needs OpenGL: none here")


def test_bench_reports_every_field(folder, fake_models, monkeypatch, capsys):
    monkeypatch.setattr(assemble, "BUNDLED_RECORDING", folder / "good.jsonl")
    monkeypatch.setattr("demo.bench.bench.TURNS", 2)
    monkeypatch.setattr("demo.bench.bench.make_rival", lambda config: config)
    monkeypatch.setattr(
        "demo.bench.bench.time_call", {CONFIGS["full"]: 0.03, CONFIGS["paper_slim"]: 0.02}.get
    )  # seconds
    rows = [
        {
            "model": "joints",
            "mode": "live",
            "sra": [0.9, 0.1],
            "geodesic": [0.3, 0.0],
            "jitter_ratio": [1.2, 0.1],
            "ms_per_frame": [2.0, 0.0],
        },
        {"model": "full", "mode": "offline", "sra": None, "ms_per_frame": None},
    ]
    Path("eval.json").write_text(json.dumps({"rows": rows}))
    options = "--seconds 1 --characters 2 --json bench.json --plot bench.png --quality eval.json"
    assert cli.main(["bench", *options.split()]) == 0
    report = json.loads(Path("bench.json").read_text())
    assert report["frames"] == 60 and report["frame"]["p50_ms"] > 0 and len(report["timeline"]) == 1
    assert set(report) >= {
        "machine",
        "stylizer_ms",
        "ratio",
        "characters",
        "rss_mb",
        "first_frame_s",
        "first_frame_ms",
        "noise",
    }
    times = report["stylizer_ms"]
    assert (times["full"]["p50"], times["paper_slim"]["p50"]) == (30.0, 20.0) and times["shipped"]["p50"] > 0
    assert report["ratio"]["full_over_shipped"] == pytest.approx(
        times["full"]["p50"] / times["shipped"]["p50"], rel=0.02
    )
    assert set(report["characters"]) == {"1", "2", "4", "16", "64"} and min(report["characters"].values()) > 0
    # the tests' stylizer has no network, and a second no minutes
    assert report["bound"] is None and report["steady"] is None
    assert report["machine_speed"]["read_gb_s"] > 0 and Path("bench.png").stat().st_size > 10_000
    assert "one of 64" in capsys.readouterr().out


def test_bundled_recording_is_sound():
    recorded = recording.read(assemble.BUNDLED_RECORDING)
    commands = list(recorded)
    assert 110 <= len(recorded) / 60 <= 130 and recorded.ground == "stairs"
    assert set(GAIT_SPEEDS) == {command.gait for command in commands} and any(command.face for command in commands)
    assert sum(command.jump for command in commands) >= 3
    assert {part for command in commands for part in command.style} == set(PART_NAMES)
    assert set(recorded.styles) <= {name for name, clips in CLIPS.items() if NONCOMMERCIAL not in licence_of(clips)}


def test_interrupt_is_quiet(monkeypatch, capsys):
    def interrupted(args):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli.doctor, "run", interrupted)
    assert cli.main(["doctor"]) == 130
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("command", ["", *cli.COMMANDS])
def test_help_shows_an_example(command, capsys):
    assert cli.main([*command.split(), "--help"]) == 0
    assert "example:\n  patchwalk" in capsys.readouterr().out


def test_the_help_of_training_names_every_network(capsys):
    assert cli.main(["train", "stylizer", "--help"]) == 0
    named = set(re.findall(r"\w+", capsys.readouterr().out))
    assert named >= set(all_networks())


def test_a_help_lists_what_applies_and_nothing_else(capsys):
    for line, there, absent in (
        ("train controller", ("--start", "--data"), ("--network", "--leave-out", "--permissive", "shared")),
        ("train stylizer", ("--network", "--recipe", "--start"), ("--map", "--permissive")),
        ("evaluate controller", ("--data", "--plots"), ("--all", "--movements", "--weights", "--permissive")),
        ("evaluate stylizer", ("--all", "--weights", "--permissive"), ("--movements", "--stylizer")),
        ("evaluate live", ("--movements", "--stylizer", "--permissive"), ("--all",)),
        ("evaluate character", ("--json",), ("--data", "--plots")),
        ("keys", ("--write",), ("--permissive",)),
        ("styles list", ("--permissive",), ("--name",)),
    ):
        assert cli.main([*line.split(), "--help"]) == 0
        words = re.findall(
            r"--[a-z-]+|[a-z]+", capsys.readouterr().out.replace("example:", "").partition("\nexample")[0]
        )
        assert {*there} <= {*words} and not {*absent} & {*words}, line


def test_help_is_quick_and_its_reader_may_leave():
    script = (
        "import sys; from demo import cli; cli.main(['--help']); "
        "print(*{'torch', 'scipy', 'pygame'} & {*sys.modules}, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True)
    assert done.stderr == "\n", "nothing heavy is imported for a --help"
    reader = 'exec 3>&1; { python=$0; "$python" -m demo --help; echo $? >&3; } | true'
    done = subprocess.run(["bash", "-c", reader, sys.executable], cwd=ROOT, capture_output=True, text=True)
    assert done.stderr == "" and done.stdout.strip() in ("0", "141")


def test_a_character_is_measured(folder, fake_models, monkeypatch, capsys):
    monkeypatch.setattr("demo.commands.evaluate.CHARACTER_SECONDS", 1)
    write(folder / "hero.glb")
    assert cli.main("evaluate character hero.glb --json hero.json".split()) == 0
    figures = json.loads((folder / "hero.json").read_text())["hero.glb"]
    assert figures["arms_degrees_p95"] < 1e-3 and all(name in capsys.readouterr().out for name in [*figures][:1])


def test_styles_on_the_command_line():
    assert parse_style("arms=old:0.8") == (("left_arm", "right_arm"), PartSpec("old", 0.8))
    assert parse_style("spine=proud") == (("spine",), PartSpec("proud", 1.0))
    assert parse_style("spine=C:\\walk.bvh:1.5") == (("spine",), PartSpec("C:\\walk.bvh", 1.5))
    assert parse_style("spine=old+C:\\a+b@2x.bvh@0.4:0.5") == (("spine",), PartSpec("old", 0.5, "C:\\a+b@2x.bvh", 0.4))
    assert parse_style("spine=a+b.bvh") == (("spine",), PartSpec("a+b.bvh", 1.0))
    for bad in ("arms", "arms=", "=old", "tail=old", "arms=old:1.6", "arms=old:-1", "arms=old:nan", "arms=a+b@1.2"):
        with pytest.raises(ValueError):
            parse_style(bad)
