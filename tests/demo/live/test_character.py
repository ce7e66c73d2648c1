"""The user's own character in the window: dropped, drawn, steered, exported, kept; what is none says why."""

import struct
from concurrent.futures import wait
from dataclasses import replace
from pathlib import Path

import numpy as np
import pygame
import pytest

from demo.export import export_jobs
from demo.live import capture
from demo.live.live import Live
from demo.state import characters
from tests.demo.live.test_live import STYLES, Clock
from tests.support.fakes import fake_session, key
from tests.support.skinned import Build, encode, write

TOO_LONG = 120  # seconds after which reading is given up; nothing is measured by it


@pytest.fixture
def live(screen) -> Live:
    return Live(fake_session(), STYLES, screen, clock=Clock())


def run(live: Live, frames: int) -> None:
    live.run((live.frames + frames) / 60, live.clock.sleep)


def drop(live: Live, *paths: Path) -> None:
    for event in (
        pygame.event.Event(pygame.DROPBEGIN),
        *(pygame.event.Event(pygame.DROPFILE, file=str(path)) for path in paths),
        pygame.event.Event(pygame.DROPCOMPLETE),
    ):
        pygame.event.post(event)
    run(live, 2)
    assert not wait(live.drop_import._waiting, TOO_LONG).not_done
    run(live, 2)


def said(live: Live) -> str:
    return " | ".join(text for _, text, _ in live.toasts)


def picture(live: Live) -> np.ndarray:
    live.draw()
    return live.window.read_pixels().astype(int)


def test_a_dropped_character_is_drawn_steered_and_kept(live, tmp_path):
    run(live, 2)
    live.toasts.clear()
    before = picture(live)
    drop(live, write(tmp_path / "Hero.glb"))
    assert "“Hero” is your character now" in said(live) and live.shown.name == "Hero"
    live.toasts.clear()
    dressed = picture(live)
    assert (np.abs(dressed - before).max(axis=-1) > 30).mean() > 0.005, "somebody else stands there"
    pygame.event.post(key("w"))
    run(live, 30)
    body = live.view.character.points
    root = live.frame.styled.root_position
    assert np.linalg.norm(root) > 0.2 and np.abs(body.mean(axis=0) - root)[[0, 2]].max() < 0.3, "it goes along"
    kept = characters.kept()
    assert kept.name == "Hero" and kept.path.parent.parent == Path(tmp_path / "home")


def test_f3_changes_between_the_character_and_the_figure(live, tmp_path):
    pygame.event.post(key("f3"))
    run(live, 2)
    assert "drop a character on the window" in said(live)
    drop(live, write(tmp_path / "hero.glb"))
    shown = []
    for _ in range(2):
        pygame.event.post(key("f3"))
        run(live, 2)
        shown.append(live.shown.name if live.shown else None)
    assert shown == [None, "hero"]


def test_a_window_opens_with_the_character_it_is_given(screen, tmp_path):
    from sim.character.character import load_character

    tall = load_character(write(tmp_path / "tall.glb", Build(longer={"Spine": 4.0})))
    live = Live(fake_session(), STYLES, screen, clock=Clock(), character=tall)
    run(live, 2)
    assert live.shown is tall and live.view.camera.tall > 1.05, "seen from farther away, so that it is seen whole"
    places = live.view.pixels(live.view.character.points, live.window.size)
    assert (places[:, 1] > 0).all() and (places[:, 1] < live.window.size[1]).all()


@pytest.mark.parametrize(
    "name, data, why",
    [
        ("cut.vrm", b"glTF" + struct.pack("<II", 2, 12), "cut.vrm: it is a .glb without a glTF 2.0 document"),
        ("hero.fbx", b"Kaydara", "hero.fbx"),
        ("hero.obj", b"v 0 0 0", "a character as a .glb or .vrm"),
        (
            "nobody.glb",
            encode(Build(names={"Hips": "a", "Spine": "b", "LeftFoot": "c", "RightFoot": "d"})),
            "not known",
        ),
    ],
)
def test_what_is_no_character_says_why_and_changes_nothing(live, tmp_path, name, data, why):
    (tmp_path / name).write_bytes(data)
    drop(live, tmp_path / name)
    assert why in said(live) and live.shown is None and characters.kept() is None


def test_an_export_is_of_the_character_that_is_seen(live, tmp_path, monkeypatch):
    monkeypatch.setattr(export_jobs.ExportJobs, "SECONDS", 0.1)
    drop(live, write(tmp_path / "hero.glb", Build(vrm=1)))
    run(live, 10)
    capture.export(live)
    written = live.takes.finished(wait=True)
    glb = next(path for path in written.files if path.suffix == ".glb")
    bvh = next(path for path in written.files if path.suffix == ".bvh")
    assert b"VRMC_vrm" in glb.read_bytes() and b'"Patchwalk"' in glb.read_bytes()
    assert "ROOT Hips" in bvh.read_text()


def test_a_jump_to_the_start_point_moves_the_character_at_once(live, tmp_path):
    drop(live, write(tmp_path / "hero.glb"))
    pygame.event.post(key("w"))
    run(live, 60)
    live.start_over()
    run(live, 3)
    assert np.abs(live.view.character.points.mean(axis=0)[[0, 2]]).max() < 0.3


def test_the_twin_stays_the_figure(live, tmp_path):
    drop(live, write(tmp_path / "hero.glb"))
    live.view.twin = "beside"
    run(live, 2)
    figures = live.renderer._figures(live.frame, live.view)
    assert [figure.model.picture is None for figure in figures] == [False, True]
    assert replace(live.view).character is live.view.character
