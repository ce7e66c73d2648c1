"""Taking the motion away from the window: recordings that replay to equal poses, and F9's export."""

from dataclasses import astuple, replace
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pygame
import pytest

from demo import assemble
from demo.export import export_jobs
from demo.live import capture
from demo.live.live import run_live
from sim.ground.catalogue import load_ground
from sim.io import bvh, recording
from sim.session import Frame
from tests.demo.live.test_live import Clock, play
from tests.support.fakes import BENDS, fake_session, key

STYLES = tuple(BENDS)


def shown_since_restart(session) -> list[Frame]:
    """A list that fills with the frames the session makes, anew after each restart."""
    frames, step, restart = [], session.step, session.restart

    def watched_step(command) -> Frame:
        frames.append(step(command))
        return frames[-1]

    def watched_restart() -> None:
        frames.clear()
        restart()

    session.step, session.restart = watched_step, watched_restart
    return frames


def test_a_recording_replays_to_equal_poses(screen):
    """With the trained models: what the window showed from R to R is what a new session makes of the recording,
    whatever was looked at meanwhile."""
    session = assemble.build_session()
    frames = shown_since_restart(session)
    live, _ = play(
        screen,
        {
            0: [key("w")],
            5: [key("6"), key("]")],
            20: [key("d"), key("left shift")],
            40: [key("r")],
            60: [key("3"), key("]"), key("a")],
            75: [key("q"), key("=")],
            80: [key("i")],
            85: [key("t"), key("o"), key("h"), key("p"), key("k"), key("g")],
            90: [key("backspace")],
            95: [key("v"), key("b"), key("]")],
            120: [key("r")],
        },
        2.2,
        session,
        session.stylizer.styles,
    )
    recorded = recording.read(live.files[0])
    assert 75 < len(recorded) < len(frames) and len(recorded.styles) > 2
    assert any(spec.other for command in recorded for spec in command.style.values()), "blends are in it"
    assert list(recorded)[0].style, "styles worn are kept, and stand in the first line"
    paces = [command.pace for command in recorded]
    paced = paces.index(False)
    assert paces == [True] * paced + [False] * (len(recorded) - paced), "and who sets the pace, until I was pressed"
    plain = assemble.build_session()
    unpaced = [plain.step(replace(command, pace=False)).styled.root_position for command in list(recorded)[:paced]]
    assert np.abs(unpaced[-1] - frames[paced - 1].styled.root_position).max() > 0.003, "which makes a difference here"
    assert np.abs(frames[0].styled.root_position).max() < 0.05, "back at the start point"
    again = assemble.build_session()
    for command, frame in zip(recorded, frames):
        for ours, theirs in zip(astuple(frame.styled), astuple(again.step(command).styled), strict=True):
            np.testing.assert_array_equal(ours, theirs)


def test_a_recording_keeps_its_ground_and_replays_on_it(screen):
    session = fake_session()
    frames = shown_since_restart(session)
    script = {2: [key("f2")], 6: [key("r")], 10: [key("w"), key("space")], 20: [key("f2")], 80: [key("r")]}
    live, _ = play(screen, script, 1.5, session)
    assert any("its ground: stop it first" in text for _, text, _ in live.toasts)
    recorded = recording.read(live.files[0])
    assert recorded.ground == "hills" and sum(command.jump for command in recorded) == 1
    again = fake_session(load_ground(recorded.ground))
    for command, frame in zip(recorded, frames):
        np.testing.assert_array_equal(frame.styled.positions, again.step(command).styled.positions)


def test_f9_exports_the_last_ten_seconds(screen, monkeypatch):
    monkeypatch.setattr(export_jobs.ExportJobs, "SECONDS", 0.25)
    session = fake_session()
    frames = shown_since_restart(session)
    live, _ = play(screen, {0: [key("w")], 40: [key("f9"), key("f9")]}, seconds=0.75, session=session)
    assert sum("still being written" in text for _, text, _ in live.toasts) == 1
    assert live.frames == 45, "the walk goes on"
    assert live.takes.progress is not None
    written = live.takes.finished(wait=True)
    assert live.takes.progress is None and live.takes._done.value == (0 if written.problems else 1)
    capture.show_written(live, written)
    paths = {path.suffix: path for path in Path.cwd().iterdir()}
    assert set(written.files) == set(live.files) == set(paths.values()) and {".bvh", ".glb"} <= set(paths)
    assert len({path.stem for path in paths.values()}) == 1
    assert {".mp4", ".gif"} & set(paths) or "no video" in written.problems[0]
    motion = bvh.read(paths[".bvh"])
    positions = motion.global_transforms()[0] / bvh.CENTIMETRES
    last = next(i for i in range(len(frames)) if np.abs(frames[i].styled.positions - positions[-1]).max() < 1e-4)
    assert len(motion) == 15 and 38 <= last <= 41
    assert live.takes.finished() is None, "said once"


def test_what_cannot_be_exported_is_said_and_the_rest_is_written(screen, tmp_path):
    frames = [fake_session().step(command) for command in [recording.Command()] * 5]
    (tmp_path / "take.glb").mkdir()
    written = export_jobs.write_all(frames, tmp_path / "take")
    assert tmp_path / "take.bvh" in written.files and tmp_path / "take.glb" not in written.files
    assert written.problems[0].startswith("no glb: ")


def test_whatever_goes_wrong_with_one_kind_is_said(screen, tmp_path, monkeypatch):
    def fail(path, result):
        raise RuntimeError("the graphics driver refused")

    frames = [fake_session().step(command) for command in [recording.Command()] * 5]
    monkeypatch.setitem(export_jobs.export.WRITERS, "video", fail)
    written = export_jobs.write_all(frames, tmp_path / "take")
    assert {path.suffix for path in written.files} == {".bvh", ".glb"}
    assert written.problems == ("no video: the graphics driver refused",)


def test_an_export_says_how_much_of_it_is_done(screen, tmp_path):
    frames, said = [fake_session().step(command) for command in [recording.Command()] * 5], []
    written = export_jobs.write_all(frames, tmp_path / "take", progress=said.append)
    assert said == ([] if written.problems else sorted(said)) and (written.problems or said[-1] == 1)


def test_an_export_that_dies_is_said_and_the_walk_goes_on(monkeypatch, tmp_path):
    jobs = export_jobs.ExportJobs()
    jobs.frames.append(lambda: "what cannot be sent to another process")
    jobs.export(tmp_path / "take")
    written = jobs.finished(wait=True)
    assert written.files == () and written.problems[0].startswith("the export stopped: ")


def test_before_there_is_a_frame_nothing_is_exported(screen):
    live, _ = play(screen, {}, seconds=0.05)
    live.takes.frames.clear()
    live.do("export")
    assert live.toasts[-1][1] == "there is nothing to export yet" and not live.takes.busy


def test_an_export_is_finished_before_the_program_ends(screen, capsys):
    pygame.event.post(key("f9"))
    clock = Clock()
    options = {"window": screen, "clock": clock, "sleep": clock.sleep, "ground": "rough"}
    report = run_live(fake_session(), STYLES, seconds=0.1, **options)
    assert {".bvh", ".glb"} <= {path.suffix for path in report.files} and all(path.is_file() for path in report.files)
    assert "Finishing the export" in capsys.readouterr().out


@pytest.mark.parametrize("taken", ["jsonl", "glb"])
def test_names_of_new_files_are_free(tmp_path, monkeypatch, taken):
    one_second = datetime(2026, 1, 2)
    monkeypatch.setattr(capture, "datetime", SimpleNamespace(now=lambda: one_second))
    first = capture.new_file(tmp_path, "bvh", taken)
    first.with_suffix(f".{taken}").touch()
    assert capture.new_file(tmp_path, "bvh", taken).stem != first.stem
