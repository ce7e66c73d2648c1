"""Panels as pictures: each against a golden one, and the widgets they are made of."""

import numpy as np
import pytest

from demo.state.bindings import DEFAULT
from demo.state.presets import Presets
from demo.state.style_choice import StyleChoice
from demo.ui import hud, panels
from demo.ui.canvas import shorten, text_width
from demo.ui.menu import Menu
from demo.ui.plots import FRAMES, STAGES, Times
from demo.ui.widgets import Choice, Choices, Region
from sim.latency import Latency
from sim.style_spec import PartSpec
from tests.support.fakes import Walker
from tests.support.golden import assert_golden

STYLES = ("bouncy", "happy", "marching", "old", "proud", "sad", "tired", "young")
BACKGROUND = 90  # of 255, that the panels are laid over


def picture(panel: hud.Panel) -> np.ndarray:
    """(height, width, 3) of a panel over grey."""
    (placed,) = hud.place((panel,), (1280, 720))
    width, height = placed.box[2:]
    rgba = np.frombuffer(placed.pixels(), np.uint8).reshape(height, width, 4).astype(float)
    return rgba[..., :3] + BACKGROUND * (1 - rgba[..., 3:] / 255)


def dressed() -> StyleChoice:
    choice = StyleChoice(STYLES)
    choice.restore({"left_leg": ("old", 1.2), "right_leg": ("old", 1.2), "spine": ("proud", 0.6, "sad", 0.3)})
    choice.pick("spine")
    return choice


def latency() -> Latency:
    result = Latency()
    for place, stage in enumerate(STAGES):
        result.seconds[stage].extend(1e-3 * (1 + place + (frame % 20) / 10) for frame in range(FRAMES))
    return result


def attention_panel() -> hud.Panel:
    rows = np.exp(-0.05 * (np.arange(48) % 16 - 2.0 * np.arange(8)[:, None]) ** 2)
    return panels.attention(rows / rows.sum(1, keepdims=True), "left_arm", PartSpec("old"))


def presets_panel() -> hud.Panel:
    return panels.presets(Presets(None))


def menu_panel() -> hud.Panel:
    return panels.menu(Menu(DEFAULT), Presets(None), lambda action: action == "skeleton")


PANELS = {
    "wardrobe": lambda: panels.style_panel(dressed(), typing=False, comparing=False),
    "presets": presets_panel,
    "menu": menu_panel,
    "attention": attention_panel,
    "help": panels.help_of,
    "times": lambda: panels.times(latency()),
    "dial": lambda: panels.dial(Walker()._pose(1.0)),
}


@pytest.mark.parametrize("name", PANELS)
def test_golden_panels(name, monkeypatch, tmp_path):
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path))
    assert_golden(f"panel_{name}", picture(PANELS[name]()))


def test_equal_panels_are_one_picture_and_others_are_not():
    choice = dressed()
    one, same = (panels.style_panel(choice, False, False) for _ in range(2))
    assert one == same and hash(one) == hash(same)
    choice.set_strength(0.7)
    assert panels.style_panel(choice, False, False) != one


def test_panels_at_one_anchor_do_not_overlap():
    lines = panels.line("a", "top"), panels.line("b", "top"), panels.lift(panels.line("c", "bottom"), 100)
    placed = hud.place(lines, (1280, 720))
    assert placed[0].box[1] + placed[0].box[3] <= placed[1].box[1]
    assert placed[2].box[1] + placed[2].box[3] <= 720 - 100


def test_a_long_list_shows_what_is_about_the_chosen_line():
    choices = Choices(tuple(Choice(str(number), f"choose:{number}") for number in range(30)), 20, 5, ("up", "down"))
    regions = choices.regions((0, 0, 100, 105))
    assert [region.action for region in regions] == [f"choose:{number}" for number in range(18, 23)]
    assert regions[2] == Region((0, 42, 94, 20), "choose:20", wheel=("up", "down"))


def test_text_that_is_too_long_is_shortened():
    assert shorten("old", 200) == "old"
    short = shorten("a very long name of a preset", 60)
    assert short.endswith("…") and text_width(short) <= 60


def test_times_show_the_newest_frames_last():
    few = Latency()
    few.seconds["controller"].extend([0.001, 0.002])
    columns = Times.of(few).columns
    assert len(columns) == FRAMES and [column[0] for column in columns[-3:]] == [0.0, 1.0, 2.0]
