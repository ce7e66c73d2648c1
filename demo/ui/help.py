"""The help: every control with its key, mouse and gamepad, in groups, on as many pages as a window needs."""

from functools import cache

from demo.state.bindings import DEFAULT, Bindings
from demo.ui.canvas import ACCENT, BACKGROUND, FAINT, INK, SMALL
from demo.ui.hud import PADDING, Panel, scale_for
from demo.ui.layout import MARGIN
from demo.ui.text import Columns, Sentence
from demo.ui.widgets import Cell, Table

SHEET = (*BACKGROUND[:3], 0.97)
LINE = 16.8  # units from line to line
FIGURE = 250  # units beside the help that it leaves to the figure, if it can
Rows = tuple[tuple[Cell, ...], ...]
HEAD = tuple(Cell(text, FAINT) for text in ("", "keyboard", "mouse", "gamepad"))


def pages(bindings: Bindings = DEFAULT, size: tuple[int, int] = (1280, 720)) -> tuple[Panel, ...]:
    """The pages for a window of (width, height) pixels, at its left, so that the figure is seen beside them."""
    groups = tuple((name, tuple(rows)) for name, rows in bindings.help_groups().items())
    width, height = (side / scale_for(size) for side in size)
    return _pages(groups, width - 2 * MARGIN - 2 * PADDING - FIGURE, height - 2 * MARGIN - 2 * PADDING - 2 * LINE)


@cache
def _pages(groups: tuple, width: float, height: float) -> tuple[Panel, ...]:
    blocks, most = [_block(name, rows) for name, rows in groups], int(height // LINE)
    for beside in (3, 2, 1):
        lines = next((lines for lines in range(1, most) if len(_columns(blocks, lines)) <= beside), most)
        columns = [Table((HEAD, *rows), letters=SMALL, line=LINE) for rows in _columns(blocks, lines)]
        sheets = [Columns(tuple(columns[place : place + beside])) for place in range(0, len(columns), beside)]
        if max(sheet.size()[0] for sheet in sheets) <= width:
            break
    return tuple(_page(sheet, number, len(sheets)) for number, sheet in enumerate(sheets, 1))


def _page(columns: Columns, number: int, count: int) -> Panel:
    turn = f"Page {number} of {count}: F1 turns it" if number < count else "F1 or Esc closes this"
    foot = f"LT, RT: left and right trigger; LB, RB: left and right shoulder button.  {turn}"
    return Panel((columns, Sentence(foot, FAINT, SMALL)), "top left", colour=SHEET)


def _block(name: str, rows: tuple[tuple[str, str, str, str], ...]) -> Rows:
    """A group: its heading, a line for each control, and a free one."""
    lines = (
        (Cell(what), Cell(keys, ACCENT), *(Cell(text, FAINT if text == "menu" else INK) for text in (mouse, pad)))
        for what, keys, mouse, pad in rows
    )
    return ((Cell(name, ACCENT),), *lines, (Cell(""),))


def _columns(blocks: list[Rows], lines: int) -> list[Rows]:
    """The blocks one after the other, in columns of so many lines at most where a block is not longer by itself."""
    columns: list[Rows] = []
    for block in blocks:
        if columns and len(columns[-1]) + len(block) - 1 <= lines:
            columns[-1] += block
        else:
            columns.append(block)
    return columns
