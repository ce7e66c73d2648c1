"""Dropping files on the window: a clip is learned, worn and shown; what is none says why; nothing is lost or held
up."""

import shutil
from concurrent.futures import wait
from dataclasses import replace
from pathlib import Path
from threading import Event

import numpy as np
import pygame
import pytest

from demo.live.drop_import import PATIENCE, DropImport, describe_file
from demo.live.live import Live
from demo.render.inset import SECONDS, Inset
from sim.io import bvh
from sim.session import Session
from stylizer.runtime.catalogue import make_stylizer
from stylizer.styles.bank import BUNDLED, StyleBank
from stylizer.systems import checkpoint
from tests.demo.live.test_live import Clock
from tests.support.fakes import Walker, key, offscreen
from tests.support.walker import walking_clip

SIZE = (800, 600)  # in which there is room for the panels
FRAMES_PLAYED = round(60 * SECONDS)
TOO_LONG = 120  # seconds after which learning is given up; nothing is measured by it


@pytest.fixture(scope="module")
def bundled(tmp_path_factory) -> Path:
    """The trained stylizer's bank with few styles, which is quicker to read."""
    folder = tmp_path_factory.mktemp("styles")
    (folder / checkpoint.SHIPPED).mkdir()
    for name in ("own_motion", f"{checkpoint.SHIPPED}/neutral", f"{checkpoint.SHIPPED}/marching"):
        shutil.copy(BUNDLED / f"{name}.safetensors", folder / f"{name}.safetensors")
    return folder


@pytest.fixture
def screen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path / "home"))
    with offscreen(SIZE) as opened:
        yield opened


@pytest.fixture
def live(screen, bundled, tmp_path) -> Live:
    stylizer = make_stylizer(StyleBank(bundled=bundled, user=tmp_path / "user"))
    return Live(Session(Walker(), stylizer), stylizer.styles, screen, clock=Clock())


BEGIN, COMPLETE = (pygame.event.Event(kind) for kind in (pygame.DROPBEGIN, pygame.DROPCOMPLETE))


def file(path: Path) -> pygame.event.Event:
    return pygame.event.Event(pygame.DROPFILE, file=str(path))


def drop(live: Live, *paths: Path, frames: int = 2) -> None:
    """Drops files together and runs for some frames."""
    for event in (BEGIN, *map(file, paths), COMPLETE):
        pygame.event.post(event)
    run(live, frames)


def finish(live: Live) -> None:
    """Waits until something came of what was dropped, shows it, and goes a step with it."""
    assert not wait(live.drop_import._waiting, TOO_LONG).not_done
    run(live, 2)


def run(live: Live, frames: int) -> None:
    live.run((live.frames + frames) / 60, live.clock.sleep)


def said(live: Live) -> list[str]:
    return [text for _, text, _ in live.toasts]


@pytest.fixture
def limp(tmp_path) -> Path:
    path = tmp_path / "My limp.bvh"
    bvh.write(path, walking_clip(600))
    return path


def test_a_dropped_clip_is_worn_by_the_picked_part_and_shown(live, limp, tmp_path, bundled):
    for event in (key("4"), key("w")):
        pygame.event.post(event)
    run(live, 5)
    drop(live, limp)
    finish(live)
    assert "My-limp" in live.choice.styles and live.choice.style == {"left_arm": ("My-limp", 1.0)}
    assert live.frame.command.style == live.choice.style and any("learned “My-limp”" in text for text in said(live))
    assert StyleBank(bundled=bundled, user=tmp_path / "user").names == ("My-limp", "marching", "neutral"), (
        "kept for the next start"
    )

    live.draw()
    with_inset = live.window.read_pixels().astype(int)
    for _ in range(20):
        live.inset.step()
    live.paint()
    live.paint()  # the clip moves in every second picture
    moved = live.window.read_pixels().astype(int)
    for _ in range(FRAMES_PLAYED):
        live.inset.step()
    live.paint()
    without = live.window.read_pixels().astype(int)
    left, top, width, height = live.inset_box
    changed = np.abs(moved - without).max(axis=2) > 8
    inside = changed[top : top + height, left : left + width]
    assert changed.sum() == inside.sum() > 0.5 * width * height, "in its panel and nowhere else"
    assert np.abs(moved - with_inset).max() > 30, "it moves"


def test_the_walk_goes_on_while_a_style_is_learned(live, limp, monkeypatch):
    learn, walked_on = live.session.stylizer.learn, Event()
    monkeypatch.setattr(live.session.stylizer, "learn", lambda *paths: walked_on.wait(TOO_LONG) and learn(*paths))
    before = live.frames
    drop(live, limp, frames=20)
    assert live.frames == before + 20 and len(live.drop_import._waiting) == 1 and live.choice.style == {}
    walked_on.set()
    finish(live)
    assert live.choice.name == "My-limp"


def test_the_inset_plays_a_short_clip_again_and_follows_the_window(screen):
    inset = Inset()
    assert not inset.playing
    inset.play(walking_clip(60), "old")
    for _ in range(FRAMES_PLAYED - 1):
        inset.step()
    assert inset.playing and inset._frame() is inset._frames[(FRAMES_PLAYED - 1) % 60]
    sizes = []
    for box in ((200, 80, 43, 54), (10, 10, 60, 70)):
        inset.draw(screen.size, box)
        sizes.append((inset._picture.width, inset._picture.height))
    assert sizes == [(43, 54), (60, 70)]
    inset.step()
    assert not inset.playing


def test_files_dropped_together_are_one_style_that_knows_the_movements_of_all(live, limp, tmp_path):
    walk = walking_clip(300)
    bvh.write(tmp_path / "Hurry.bvh", replace(walk, hips=walk.hips * [1, 1, 2.2]))
    drop(live, limp, tmp_path / "Hurry.bvh")
    finish(live)
    assert live.choice.name == "My-limp" and "Hurry" not in live.choice.styles
    assert live.session.stylizer.bank["My-limp"].gait.movements == ("walk", "run")
    assert any("learning My limp.bvh and Hurry.bvh" in text for text in said(live))
    assert any(text.startswith("learned “My-limp” (walk, run): now on the whole body") for text in said(live))


def test_one_that_cannot_be_used_refuses_all_that_were_dropped_with_it(live, limp, tmp_path):
    for broken in ("notes.txt", "empty.bvh"):
        (tmp_path / broken).write_text("")
        drop(live, limp, tmp_path / broken)
        finish(live)
        assert said(live)[-1].startswith(f"{broken} ") and live.choice.style == {} and not (tmp_path / "user").exists()


class Learner:
    """A stylizer that remembers what it was given to learn."""

    def __init__(self) -> None:
        self.given: list[str] = []

    def learn(self, *paths: Path):
        self.given.append(" ".join(path.stem for path in paths))
        raise ValueError("too short")


A, B, C = (file(Path(f"{letter}.bvh")) for letter in "abc")
OTHER = pygame.event.Event(pygame.WINDOWEXPOSED)


@pytest.mark.parametrize(
    "turns, learned",
    [
        ([[BEGIN, A, B, COMPLETE]], ["a b"]),
        ([[BEGIN, A], [], [B, OTHER], [COMPLETE]], ["a b"]),
        ([[BEGIN, A, COMPLETE, BEGIN, B, C, COMPLETE]], ["a", "b c"]),
        ([[A, OTHER, B], [C]], ["a b", "c"]),
        ([[BEGIN, A, B], *[[]] * PATIENCE, [C]], ["a b", "c"]),
        ([[BEGIN, A, B], [BEGIN, C, COMPLETE]], ["a b", "c"]),
        ([[BEGIN, COMPLETE], [OTHER]], []),
    ],
    ids=["at once", "in several turns", "two drops", "no begin, no end", "no end", "no end and another", "nothing"],
)
def test_what_belongs_together_is_what_was_dropped_together(turns, learned):
    learner = Learner()
    drop_import = DropImport(lambda: learner)
    taken = [" ".join(path.stem for path in paths) for events in turns for paths in drop_import.take(events)]
    results = [waiting.result() for waiting in drop_import._waiting]
    assert taken == learner.given == learned and len(drop_import.finished()) == len(results) == len(learned)


def test_a_drop_waits_for_its_end():
    drop_import = DropImport(Learner)
    assert drop_import.take([BEGIN, A]) == drop_import.take([]) == [] and drop_import.take([COMPLETE]) == [
        [Path("a.bvh")]
    ]


def test_many_files_are_named_shortly():
    assert describe_file([Path("x/a.bvh"), *[Path("b.bvh")] * 7]) == "a.bvh and 7 more files"


BROKEN = {
    "notes.txt": ("hello", "notes.txt cannot be used: drop a motion as a .bvh, .glb or SMPL .npz file"),
    "empty.bvh": ("", "empty.bvh is not a whole BVH file: it has no MOTION line"),
    "crab.bvh": (
        "HIERARCHY\nROOT Claw\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n}\nMOTION\nFrames: 1\n"
        "Frame Time: 0.01\n0 0 0\n",
        "crab.bvh: this skeleton is not known: no joint found for Hips, ",
    ),
    "gone.bvh": (None, "gone.bvh cannot be used: No such file or directory"),
    "short.bvh": (walking_clip(20), "short.bvh: the clip is too short for a style: give at least 1.1 s of motion"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_cannot_be_used_says_why_in_a_sentence(live, tmp_path, name):
    content, sentence = BROKEN[name]
    if isinstance(content, str):
        (tmp_path / name).write_text(content)
    elif content is not None:
        bvh.write(tmp_path / name, content)
    before = live.choice.styles
    drop(live, tmp_path / name)
    finish(live)
    (text,) = [text for text in said(live) if not text.startswith("learning")]
    assert text.startswith(sentence) and str(tmp_path) not in text
    assert len(text) < 250 and ("..." not in text or "`patchwalk styles add` with --map FILE" in text), (
        "cut, but not what to do"
    )
    assert live.choice.styles == before and live.choice.style == {} and not live.inset.playing
    assert not (tmp_path / "user").exists()
