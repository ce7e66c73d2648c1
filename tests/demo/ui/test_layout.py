"""Where panels go: none over another, none beyond the window, and the largest area left to the figure."""

import pytest

from demo.ui import layout, panels
from demo.ui.hud import Panel
from demo.ui.text import Hole
from demo.ui.widgets import Choice, Choices


def block(width: float, height: float, anchor: str) -> Panel:
    return Panel((Hole(width - 20, height - 20),), anchor)


def boxes(*blocks: Panel, size=(1280, 720)) -> list[tuple[int, int, int, int]]:
    return [placed.box for placed in layout.place(blocks, size)]


def test_panels_at_one_anchor_are_stacked_from_its_border():
    lines = panels.line("a", "top"), panels.line("b", "top"), panels.line("c", "bottom")
    a, b, c = boxes(*lines)
    assert a[1] == layout.MARGIN and b[1] == a[1] + a[3] + layout.GAP and c[1] + c[3] == 720 - layout.MARGIN


def test_a_side_has_panels_at_both_ends_and_leaves_out_what_finds_no_room():
    placed = boxes(*(block(200, 300, anchor) for anchor in ("top right", "bottom right", "top right")))
    assert placed == [(1066, 14, 200, 300), (1066, 406, 200, 300)]


def test_a_list_becomes_shorter_where_the_side_is_full():
    choices = Choices(tuple(Choice(str(n), "") for n in range(30)), 0, 20, ("", ""))
    listed, below = layout.place((Panel((choices,)), block(200, 400, "top left")), (1280, 720))
    assert listed.panel.widgets[0].shown < 20 and below.box[1] + below.box[3] <= 720 - layout.MARGIN


def test_what_lies_between_the_sides_is_wrapped_to_the_room_there():
    sides = block(500, 600, "top left"), block(400, 200, "top right")
    words = "a sentence of so many words that it needs more than a line, and then some more of them"
    *_, top, bottom = boxes(*sides, panels.line(words, "top"), panels.line(words, "bottom"))
    assert top[0] >= 514 + layout.GAP and top[0] + top[2] <= 866 - layout.GAP
    assert bottom[2] > top[2] and bottom[3] < top[3], "below there is one side only"


def test_what_lies_between_is_as_near_to_the_middle_as_the_sides_let_it_be():
    assert boxes(block(100, 50, "top")) == [(590, 14, 100, 50)]
    assert boxes(block(700, 400, "top left"), block(100, 50, "top"))[1][0] == 714 + layout.GAP


@pytest.mark.parametrize(
    "taken, area",
    [
        ((), (0, 0, 1000, 500)),
        (((0, 0, 300, 500),), (300, 0, 700, 500)),
        (((0, 0, 300, 500), (800, 0, 200, 100)), (300, 0, 500, 500)),
        (((0, 0, 300, 500), (400, 0, 600, 100)), (300, 100, 700, 400)),
        (((0, 0, 1000, 500),), (0, 0, 1000, 500)),
    ],
)
def test_the_free_area_is_where_the_figure_is_largest(taken, area):
    assert layout.free_area(taken, (1000, 500), 0.8) == area


def test_within_its_area_the_figure_is_near_the_middle_of_the_picture():
    assert layout.within((300, 0, 700, 500), (1000, 500), 0.8) == (300, 0, 400, 500)
    assert layout.within((100, 0, 900, 500), (1000, 500), 0.8) == (300, 0, 400, 500)
    assert layout.within((0, 0, 200, 500), (1000, 500), 0.8) == (0, 125, 200, 250)
