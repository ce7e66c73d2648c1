"""The panels of the live window: what each part wears, the status line, the help, single lines."""

from functools import cache
from typing import Collection, Mapping

from demo import bindings
from demo.colours import OWN_STYLE, style_colour
from demo.hud import ACCENT, ALERT, FAINT, INK, Cell, Panel
from demo.style_choice import OWN, StyleChoice
from sim.skeleton import PART_NAMES


class Figures:
    """Frame time, drawing time and pictures a second, each the mean of a short while, so that they can be read."""

    def __init__(self, seconds: float) -> None:
        self._seconds, self._since, self._ticks = seconds, None, []
        self.frame_ms = self.draw_ms = self.rate = 0.0

    def tick(self, now: float, frame_ms: float, draw_ms: float) -> None:
        """Takes in one picture at time `now` in seconds."""
        if self._since is None:
            self._since, self.frame_ms = now, frame_ms
            return
        self._ticks.append((frame_ms, draw_ms))
        if now - self._since >= self._seconds:
            self.frame_ms, self.draw_ms = (sum(column) / len(self._ticks) for column in zip(*self._ticks, strict=True))
            self.rate = len(self._ticks) / (now - self._since)
            self._since, self._ticks = now, []


def readable(part: str) -> str:
    """A part's or a group's name as it is shown."""
    return "whole body" if part == "all" else part.replace("_", " ")


def parts(style: Mapping[str, tuple[str, float]], picked: Collection[str] = ()) -> Panel:
    """The five parts with the styles and strengths of `style` (as in a Command); those that are picked are lit."""
    rows = []
    for part in PART_NAMES:
        name, strength = style.get(part, (OWN, None))
        swatch = OWN_STYLE if strength is None else style_colour(name)
        rows.append((Cell(readable(part), INK, swatch), Cell(name, FAINT if strength is None else INK),
                     Cell("" if strength is None else f"{strength:.0%}")))
    return Panel(tuple(rows), "top left", tuple(i for i, part in enumerate(PART_NAMES) if part in picked))


def status(choice: StyleChoice, figures: Figures, missed: int, facing_held: bool, recorder) -> Panel:
    """The line that is always there: part, style, strength, frame time, missed frames."""
    styled = choice.name != OWN
    cells = [Cell(readable(choice.picked), ACCENT), Cell(choice.name),
             Cell(f"strength {choice.strength:.0%}", INK if styled else FAINT),
             Cell(f"frame {figures.frame_ms:.1f} ms", FAINT), Cell(f"drawing {figures.draw_ms:.1f} ms", FAINT),
             Cell(f"{figures.rate:.0f} pictures/s", FAINT), Cell(f"missed {missed}", ALERT if missed else FAINT)]
    if facing_held:
        cells.append(Cell("facing held, F frees it", ACCENT))
    if recorder:
        cells.append(Cell("recording, R stops", INK, ALERT))
    return Panel((tuple(cells),), "bottom")


def line(text: str, anchor: str, colour=INK) -> Panel:
    """One sentence."""
    return Panel(((Cell(text, colour),),), anchor)


@cache
def controls() -> Panel:
    """The help: every control with its key, mouse and gamepad."""
    head = tuple(Cell(text, FAINT) for text in ("", "keyboard", "mouse", "gamepad"))
    rows = [(Cell(what), Cell(keys, ACCENT), Cell(mouse), Cell(pad)) for what, keys, mouse, pad in bindings.help_rows()]
    return Panel((head, *rows), "center")
