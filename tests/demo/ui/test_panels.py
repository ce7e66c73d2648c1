"""Panels as pictures: each against a golden one, and the widgets they are made of."""

import numpy as np
import pytest

from demo.state.bindings import DEFAULT
from demo.state.presets import Presets
from demo.state.style_choice import StyleChoice
from demo.ui import help, hud, layout, panels
from demo.ui.canvas import ACCENT, ALERT, INK, SMALL, Canvas, shorten, text_width, wrap
from demo.ui.menu import Menu
from demo.ui.plots import FRAMES, STAGES, Dial, Times
from demo.ui.text import Flow, Sentence
from demo.ui.widgets import LEAST_SHOWN, Cell, Choice, Choices, Region
from sim.body.skeleton import PART_NAMES
from sim.latency import Latency
from sim.style_spec import PartSpec, StyleSpec
from tests.support.fakes import Walker
from tests.support.golden import assert_golden

STYLES = ("bouncy", "happy", "marching", "old", "proud", "sad", "tired", "young")
BACKGROUND = 90  # of 255, that the panels are laid over


def picture(panel: hud.Panel) -> np.ndarray:
    """(height, width, 3) of a panel over grey."""
    (placed,) = layout.place((panel,), (1280, 720))
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
    "help": lambda: help.pages()[0],
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


def test_a_long_list_shows_what_is_about_the_chosen_line():
    choices = Choices(tuple(Choice(str(number), f"choose:{number}") for number in range(30)), 20, 5, ("up", "down"))
    regions = choices.regions((0, 0, 100, 105))
    assert [region.action for region in regions] == [f"choose:{number}" for number in range(18, 23)]
    assert regions[2] == Region((0, 42, 94, 20), "choose:20", wheel=("up", "down"))


def test_a_list_becomes_shorter_but_not_too_short():
    choices = Choices(tuple(Choice(str(number), f"choose:{number}") for number in range(30)), 20, 8, ("up", "down"))
    assert [choices.shortened(units).shown for units in (-5, 1, 21, 22, 1000)] == [8, 7, 7, 6, LEAST_SHOWN]


def test_words_go_on_in_the_next_line():
    long = Sentence("one two three four five six", width=90)
    assert long.size()[0] <= 90 and long.size()[1] == 3 * Sentence("one").size()[1]
    cells = Flow(tuple(Cell(word) for word in ("one", "two", "three", "four")))
    assert cells.wrapped(70).size()[0] <= 70 and cells.wrapped(70).size()[1] > cells.size()[1]


@pytest.mark.parametrize("degrees", range(0, 360, 5))
def test_the_number_of_the_dial_is_never_crossed_out(degrees):
    """No drawing but the letters' own touches the box that the letters take."""
    drawn = []

    class Seen(Canvas):
        def line(self, points, colour, width=1.5):
            drawn.extend((x, y, width / 2) for x, y in np.linspace(*points, 20))

        def disc(self, x, y, radius, colour):
            drawn.append((x, y, radius if colour == ACCENT else 0))

        def text(self, text, x, middle, colour=None, size=None, align=0.0):
            if text.endswith("°"):
                drawn[:] = [(px - x, py - middle, radius) for px, py, radius in drawn if radius]
                drawn.append(text_width(text, size) / 2)

    Dial(np.radians(degrees), (0, 0, 0, 0)).paint(Seen(190, 88, 1), (0, 0, 190, 88))
    marks, half = [mark for mark in drawn if isinstance(mark, tuple)], next(x for x in drawn if isinstance(x, float))
    assert marks and all(abs(x) - r > half or abs(y) - r > SMALL / 2 for x, y, r in marks)


def test_text_that_is_too_long_is_shortened():
    assert shorten("old", 200) == "old"
    short = shorten("a very long name of a preset", 60)
    assert short.endswith("…") and text_width(short) <= 60


def test_times_show_the_newest_frames_last():
    few = Latency()
    few.seconds["controller"].extend([0.001, 0.002])
    columns = Times.of(few).columns
    assert len(columns) == FRAMES and [column[0] for column in columns[-3:]] == [0.0, 1.0, 2.0]


def test_a_word_that_is_too_long_goes_on_after_a_hyphen_or_anywhere():
    lines = wrap("a-name-of-some-length and others", 90)
    assert lines[0].endswith("-") and all(text_width(line) <= 90 for line in lines)
    assert "".join(lines).replace(" ", "") == "a-name-of-some-lengthandothers"
    assert "".join(wrap("x" * 100, 50)) == "x" * 100 and wrap("", 50) == []


@pytest.mark.parametrize("name", ["x" * 40, "not-confident", "a-name-as-long-as-a-style-can-have-it-40x"[:40]])
def test_names_and_strengths_are_never_cut(name):
    """Every letter of them is drawn, in the list, beside the body, in a preset and in the line where it is renamed."""
    drawn = []

    class Seen(Canvas):
        def text(self, text, *where, **how):
            drawn.append(text)

    choice = StyleChoice((name, "old"), users_own=(name,))
    choice.restore({part: (name, 1.25, "old", 0.5) for part in PART_NAMES})
    slots = Presets(None)
    slots.slots = {1: (f"{name} and 4 more", choice.style)}
    for panel in (panels.style_panel(choice, True, False, (name, name)), panels.presets(slots)):
        for placed in layout.place((panel,), (1280, 720)):
            (width, height), boxes = placed.panel.size(), hud._layout(placed.panel)[1]
            canvas = Seen(width, height, 1)
            for widget, box in zip(placed.panel.widgets, boxes, strict=True):
                widget.paint(canvas, box)
    seen = "".join(drawn).replace(" ", "")
    assert not any("…" in text for text in drawn)
    assert seen.count(f"{name}›50%oldat125%") == 5 and f"{name}and4more" in seen and drawn.count(name) >= 2


def test_a_message_that_is_said_again_stands_there_once_with_a_count():
    panel = panels.messages([("ground: hills", INK), ("cannot write", ALERT), ("ground: hills", INK)])
    assert [widget.text for widget in panel.widgets] == ["ground: hills (2 times)", "cannot write"]
    assert panels.messages([("cannot write", ALERT)]).widgets[0].colour == ALERT


def test_of_messages_that_find_no_room_the_last_ones_are_left_out():
    long = "words that go on and on " * 90
    (placed,) = layout.place((panels.messages([("newest", INK), (long, INK), ("oldest", INK)]),), (800, 600))
    assert [widget.text for widget in placed.panel.widgets] == ["newest"]


def test_a_part_and_its_style_look_unlike_and_an_empty_preset_says_what_it_does(tmp_path):
    name, style = list(panels._style_lines(dressed(), 200))[1:3]
    assert (name.text, style.text) == ("left leg", "old 120%")
    assert name.letters < style.letters and name.colour != style.colour and style.swatch and not name.swatch
    presets = Presets(tmp_path / "presets.json")
    presets.slots = {1: ("strut", StyleSpec({"legs": "old"}))}
    buttons = [button for row in panels.presets(presets).widgets[1:] for button in row.buttons]
    assert [(button.text, button.action) for button in buttons[:2]] == [
        ("strut", "preset_1"),
        ("save styles here", "save_2"),
    ]
