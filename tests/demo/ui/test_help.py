"""The help: whole in every window, on as few pages as it can."""

import pytest

from demo.state.bindings import CONTROLS, DEFAULT
from demo.ui import help, layout
from demo.ui.text import Columns

SIZES = (800, 600), (1152, 648), (1280, 720), (1920, 1080), (2560, 1440), (3840, 2160)


def controls(pages) -> list[str]:
    """What all pages say of what the controls do, headings left out."""
    columns = (widget for page in pages for widget in page.widgets if isinstance(widget, Columns))
    rows = (row for column in columns for table in column.tables for row in table.rows[1:])
    return [row[0].text for row in rows if len(row) > 1]


@pytest.mark.parametrize("size", SIZES)
def test_every_control_is_there_once_and_every_page_fits(size):
    pages = help.pages(DEFAULT, size)
    assert controls(pages) == [control.help for control in CONTROLS]
    for page in pages:
        (placed,) = layout.place((page,), size)
        left, top, width, height = placed.box
        assert left >= 0 and top >= 0 and left + width <= size[0] and top + height <= size[1]


@pytest.mark.parametrize("size", SIZES)
def test_every_page_leaves_room_for_the_figure_beside_it(size):
    for page in help.pages(DEFAULT, size):
        (placed,) = layout.place((page,), size)
        assert size[0] - placed.box[0] - placed.box[2] > 0.2 * size[0]


def test_it_is_one_page_of_two_columns_where_the_window_is_wide_enough_for_that_too():
    (page,) = help.pages(DEFAULT, (2560, 1080))
    assert len(page.widgets[0].tables) == 2
    assert len(help.pages(DEFAULT, (1280, 720))) == len(help.pages(DEFAULT, (800, 600))) == 2


def test_controls_stand_under_headings():
    groups = DEFAULT.help_groups()
    assert sum(map(len, groups.values())) == len(CONTROLS) and all(groups.values())
    assert len(groups) == sum(bool(control.group) for control in CONTROLS) > 3
