"""Styles of the user's own in the window: learned once, put on as they are, renamed, removed."""

import pygame
import pytest

from demo.live.live import Live
from demo.state.presets import Presets
from sim.style_spec import PartSpec
from tests.demo.live import test_drop_import
from tests.demo.live.test_drop_import import drop, finish, run, said
from tests.support.fakes import key, text

bundled, screen, live, limp = (getattr(test_drop_import, name) for name in ("bundled", "screen", "live", "limp"))


@pytest.fixture
def learned(live, limp) -> Live:
    """A window in which a file of that name was dropped."""
    drop(live, limp)
    finish(live)
    return live


def test_the_same_file_again_is_the_same_style(learned, limp, tmp_path):
    learned.do("reset")
    drop(learned, limp)
    finish(learned)
    assert learned.choice.styles == ("My-limp", "marching", "neutral") and learned.choice.name == "My-limp"
    assert len(list((tmp_path / "user").iterdir())) == 1
    assert any(text.startswith("“My-limp” is this very motion (walk): now on the whole body") for text in said(learned))


def test_a_dropped_style_takes_the_place_of_what_is_there_and_is_seen(live, limp):
    """It is not blended in where the list would, nor laid under a blend, nor shown at strength 0."""
    live.choice.restore({"all": ("marching", 0.0, "neutral", 0.5)})
    live.do("blend:on")
    drop(live, limp)
    finish(live)
    assert set(live.choice.style.values()) == {PartSpec("My-limp", 1.0)} and not live.choice.blending


def press(live: Live, *events: pygame.event.Event) -> None:
    for event in events:
        pygame.event.post(event)
    run(live, 2)


def letters(word: str) -> list[pygame.event.Event]:
    return [pygame.event.Event(pygame.KEYDOWN, key=ord(letter), mod=0, unicode=letter) for letter in word]


def test_a_style_is_renamed(learned, tmp_path):
    learned.do("save_2")
    learned.do("save_2")  # it replaces another
    learned.do("rename")
    assert learned.naming == ("My-limp", "My-limp") and learned.devices.mode == "typing"
    press(learned, *[key("backspace")] * 7, text("a b"), key("return"))
    assert "no style name" in said(learned)[-1] and learned.naming == ("My-limp", "a b"), "it can be typed on"
    press(learned, *[key("backspace")] * 3, *(text(letter) for letter in "stroll"), key("return"))
    assert learned.naming is None and learned.devices.mode == "" and learned.choice.name == "stroll"
    assert learned.frame.command.style["spine"].name == "stroll" and learned.choice.users_own == {"stroll"}
    assert [path.stem for path in (tmp_path / "user").iterdir()] == ["stroll"]
    title, style = Presets().slots[2]
    assert title == "stroll" and style.names == ("stroll",)


def test_a_name_that_is_not_wanted_after_all(learned):
    learned.do("rename")
    press(learned, text("x"), key("escape"))
    assert learned.naming is None and learned.devices.mode == "" and learned.choice.name == "My-limp"


def test_a_style_is_removed_when_that_is_asked_twice(learned, tmp_path):
    learned.do("remove")
    assert "once more deletes the style “My-limp”" in said(learned)[-1] and "My-limp" in learned.choice.styles
    learned.do("remove")
    run(learned, 2)
    assert learned.choice.styles == ("marching", "neutral") and learned.choice.style == {}
    assert list((tmp_path / "user").iterdir()) == []


def test_a_removal_that_is_not_confirmed_soon_is_asked_for_anew(learned):
    for _ in range(2):
        learned.do("remove")
        run(learned, 600)
    assert "My-limp" in learned.choice.styles


def test_what_comes_with_patchwalk_stays(live):
    live.choice.choose("marching")
    for action in ("rename", "remove"):
        live.do(action)
        assert "choose a style of your own first" in said(live)[-1] and live.naming is None


def test_what_a_recording_names_stays(learned):
    learned.do("record")
    for action in ("rename", "remove", "remove"):
        learned.do(action)
        assert said(learned)[-1] == "a recording names its styles: stop it first"
    assert "My-limp" in learned.choice.styles
    learned.do("record")
