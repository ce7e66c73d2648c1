"""`patchwalk styles`: what a style was learned from is said, and what each knows is listed beside its name."""

from dataclasses import replace
from pathlib import Path

import pytest

from demo import cli
from demo.state.presets import Presets
from demo.state.style_names import movement_names
from sim.io import bvh
from sim.style_spec import StyleSpec
from stylizer.runtime import catalogue
from stylizer.styles.code_bank import CodeBank
from stylizer.systems.registry import SYSTEMS
from tests.support.walker import planted_clip, walking_clip


@pytest.fixture
def clips(tmp_path, monkeypatch) -> list[str]:
    """Three files in the working folder: a walk of 5 s, a run of 4 s, standing for 3 s; and an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path / "home"))
    run = walking_clip(240)
    run = replace(run, hips=run.hips * [1, 1, 2.2])
    motions = {"walk.bvh": walking_clip(300), "run.bvh": run, "stand.bvh": planted_clip(180)}
    for name, clip in motions.items():
        bvh.write(tmp_path / name, clip)
    Path("points").mkdir()
    return list(motions)


def test_several_files_make_one_style_and_each_says_what_was_taken(clips, capsys):
    assert cli.main(["styles", "add", *clips, "--name", "limp"]) == 0
    said, wrong = capsys.readouterr()
    assert (
        said
        == (
            "added limp\nwalk.bvh: walk from 0.0 to 5.0 s\nrun.bvh: run from 0.0 to 4.0 s\n"
            "stand.bvh: stand from 0.0 to 3.0 s\n"
        )
        and wrong == ""
    )
    assert cli.main(["styles", "list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(catalogue.load_bank().names)
    columns = {line.split()[0]: line.split("  ", 1)[1].strip() for line in lines}
    assert (
        columns["limp"] == "walk, run, stand" and "strafe left" in columns["neutral"] and "_" not in columns["neutral"]
    )
    assert cli.main(["styles", "remove", "limp"]) == 0 and capsys.readouterr().out == "removed limp\n"
    assert cli.main(["styles", "list"]) == 0 and "limp" not in capsys.readouterr().out


def test_a_style_is_renamed_in_the_presets_too(clips, capsys):
    cli.main(["styles", "add", "walk.bvh", "--name", "limp"])
    Presets().save(8, StyleSpec({"legs": "limp"}))
    capsys.readouterr()
    assert cli.main(["styles", "rename", "limp", "hobble"]) == 0
    assert capsys.readouterr().out == "renamed limp to hobble\n"
    assert "hobble" in catalogue.load_bank().names and "limp" not in catalogue.load_bank().names
    assert Presets().slots[8] == ("hobble legs", StyleSpec({"legs": "hobble"}))


@pytest.mark.parametrize(
    "names, said",
    [
        ("zombie ghoul", "'zombie' comes with Patchwalk and cannot be renamed"),
        ("nobody ghoul", "unknown style 'nobody'"),
        ("limp zombie", "zombie"),
    ],
)
def test_what_cannot_be_renamed_stays(clips, capsys, names, said):
    cli.main(["styles", "add", "walk.bvh", "--name", "limp"])
    capsys.readouterr()
    assert cli.main(["styles", "rename", *names.split()]) == 2
    out, wrong = capsys.readouterr()
    assert said in wrong and wrong.count("\n") == 1 and out == ""
    assert "limp" in catalogue.load_bank().names


@pytest.mark.parametrize(
    "words, said",
    [
        ("points walk.bvh", "points holds no BVH file: key points of a video are read with --stylizer unpaired"),
        ("walk.bvh nowhere.bvh", "nowhere.bvh: No such file"),
    ],
)
def test_one_that_cannot_be_used_is_named_and_nothing_is_learned(clips, capsys, words, said):
    assert cli.main(["styles", "add", *words.split(), "--name", "limp"]) == 2
    out, wrong = capsys.readouterr()
    assert said in wrong and wrong.count("\n") == 1 and out == ""
    assert "limp" not in catalogue.load_bank().names


class Points(CodeBank):
    """As much of a bank as reads key points."""

    system = SYSTEMS["unpaired"]

    def __init__(self) -> None:
        pass

    def add_points(self, folder, name, fps) -> None:
        raise AssertionError("it must not come so far")


def test_key_points_make_a_style_by_themselves(clips, capsys, monkeypatch):
    monkeypatch.setattr(catalogue, "load_bank", lambda name: Points())
    assert cli.main(["styles", "add", "walk.bvh", "points", "--name", "limp", "--stylizer", "unpaired"]) == 2
    assert "points holds key points, which make a style by themselves: name it alone" in capsys.readouterr().err


def test_speeds_and_repetitions_are_no_movements_of_their_own():
    assert movement_names(("walk_0.4", "walk_1.0", "strafe_left_0.65", "run", "run")) == ("walk", "strafe left", "run")
