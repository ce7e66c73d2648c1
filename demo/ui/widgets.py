"""The widgets that panels are built of: values that say how large they are, how they look and where they can be
touched.

A widget is a frozen dataclass, made anew for each picture from what the program knows; equal widgets look equal, so a
picture of them is kept until one changes. Nothing here remembers anything: what a touch means is an action's name."""

import math
from dataclasses import dataclass, replace
from typing import Protocol

from demo.ui.canvas import (
    ACCENT,
    FAINT,
    FIELD,
    INK,
    LIT,
    SMALL,
    TEXT,
    Box,
    Canvas,
    Colour,
    fitting,
    shorten,
    text_width,
    wrap,
)

LINE = 23  # units from line to line
ROW = 21  # of a list
GAP = 13  # between columns
MOST_LINES = 4  # of words in a button
SWATCH = 5.5  # radius of a dot of colour
LEAST_SHOWN = 3  # lines of a list for which there is little room


@dataclass(frozen=True)
class Region:
    """A box that the mouse can touch, and the actions (demo.live.actions) it then asks for.

    kind: `press`; `hold`, from the press to the release; `slide` and `point` append `:x` and `:x,y`, shares of the box.
    other: what the right button does. wheel: what its turns up and down do."""

    box: Box
    action: str
    kind: str = "press"
    other: str = ""
    wheel: tuple[str, str] | None = None


class Widget(Protocol):
    def size(self) -> tuple[float, float]:
        """The least width, and the height, in units."""

    def paint(self, canvas: Canvas, box: Box) -> None:
        """Draws itself into the box."""

    def regions(self, box: Box) -> list[Region]:
        """Where it can be touched when it fills the box."""


class Untouched:
    """For widgets that are only looked at."""

    def regions(self, box: Box) -> list[Region]:
        return []


@dataclass(frozen=True)
class Cell:
    """A piece of text; with `swatch`, a dot of that colour stands before it."""

    text: str
    colour: Colour = INK
    swatch: Colour | None = None

    def width(self, letters: float) -> float:
        """In units, with letters of that height."""
        return text_width(self.text, letters) + (GAP * 1.5 if self.swatch else 0)

    def paint(self, canvas: Canvas, left: float, middle: float, letters: float) -> None:
        """Draws it from `left` on, about a height."""
        if self.swatch:
            canvas.disc(left + 7, middle, SWATCH, self.swatch)
            left += GAP * 1.5
        canvas.text(self.text, left, middle, self.colour, letters)


@dataclass(frozen=True)
class Table(Untouched):
    """Rows of cells in aligned columns; some rows lit; `letters` high, in lines of `line` units."""

    rows: tuple[tuple[Cell, ...], ...]
    lit_rows: tuple[int, ...] = ()
    letters: float = TEXT
    line: float = LINE

    def _widths(self) -> list[float]:
        columns = max(map(len, self.rows))
        return [
            max(row[column].width(self.letters) for row in self.rows if column < len(row)) for column in range(columns)
        ]

    def size(self) -> tuple[float, float]:
        widths = self._widths()
        return sum(widths) + GAP * (len(widths) - 1), self.line * len(self.rows)

    def paint(self, canvas: Canvas, box: Box) -> None:
        for number, row in enumerate(self.rows):
            top, left = box[1] + number * self.line, box[0]
            if number in self.lit_rows:
                canvas.box((left - 6, top + 1, box[2] + 12, self.line - 2), LIT)
            for cell, width in zip(row, self._widths(), strict=False):  # a short row leaves columns empty
                cell.paint(canvas, left, top + self.line / 2, self.letters)
                left += width + GAP


@dataclass(frozen=True)
class Label(Untouched):
    """A line of text, shortened to the room there is; with `swatch`, a dot of that colour stands before it."""

    text: str
    colour: Colour = INK
    letters: float = TEXT
    swatch: Colour | None = None
    indent: float = 0

    def size(self) -> tuple[float, float]:
        return 0, self.letters + 5

    def paint(self, canvas: Canvas, box: Box) -> None:
        room, middle = box[2] - self.indent, box[1] + box[3] / 2
        if self.swatch:
            canvas.disc(box[0] + SWATCH, middle, SWATCH, self.swatch)
        canvas.text(shorten(self.text, room, self.letters), box[0] + self.indent, middle, self.colour, self.letters)


@dataclass(frozen=True)
class Stack(Untouched):
    """Labels under each other, close together."""

    labels: tuple[Label, ...]

    def size(self) -> tuple[float, float]:
        return 0, sum(label.letters + 2 for label in self.labels)

    def paint(self, canvas: Canvas, box: Box) -> None:
        top = box[1]
        for label in self.labels:
            label.paint(canvas, (box[0], top, box[2], label.letters + 2))
            top += label.letters + 2


@dataclass(frozen=True)
class Button:
    """One button of a row of them."""

    text: str
    action: str
    lit: bool = False
    kind: str = "press"
    other: str = ""
    swatches: tuple[Colour, ...] = ()


@dataclass(frozen=True)
class Buttons:
    """Equally wide buttons side by side. room: units that all of them take together, so that words which do not fit
    in a button's share go on in its next line; 0: they are shortened."""

    buttons: tuple[Button, ...]
    letters: float = TEXT
    room: float = 0

    def size(self) -> tuple[float, float]:
        widest = max(text_width(button.text, self.letters) for button in self.buttons) if self.letters == TEXT else 0
        lines = max(len(self._lines(button, self.room / len(self.buttons) - 4)) for button in self.buttons)
        return (widest + 14) * len(self.buttons), 25 + (lines - 1) * (self.letters + 1.5)

    def _lines(self, button: Button, width: float) -> list[str]:
        """A button's words, where it is that wide."""
        width -= 8 + _indent(button)
        if not self.room:
            return [shorten(button.text, width, self.letters) if width > 0 else button.text]
        lines = wrap(button.text, width, self.letters)
        return [*lines[: MOST_LINES - 1], shorten(" ".join(lines[MOST_LINES - 1 :]), width, self.letters)][: len(lines)]

    def _boxes(self, box: Box) -> list[Box]:
        width = (box[2] + 4) / len(self.buttons)
        return [(box[0] + width * number, box[1] + 1, width - 4, box[3] - 3) for number in range(len(self.buttons))]

    def paint(self, canvas: Canvas, box: Box) -> None:
        for button, place in zip(self.buttons, self._boxes(box), strict=True):
            canvas.box(place, LIT if button.lit else FIELD)
            for number, colour in enumerate(button.swatches):
                canvas.box((place[0] + 5 + 4 * number, place[1] + 5, 4, place[3] - 10), colour, 0)
            indent, colour = _indent(button), ACCENT if button.lit else INK
            centre = place[0] + indent + (place[2] - indent) / 2
            lines = self._lines(button, place[2])
            for number, line in enumerate(lines):
                middle = place[1] + place[3] / 2 + (number - (len(lines) - 1) / 2) * (self.letters + 1.5)
                canvas.text(line, centre, middle, colour, self.letters, align=0.5)

    def regions(self, box: Box) -> list[Region]:
        return [
            Region(place, button.action, button.kind, button.other)
            for button, place in zip(self.buttons, self._boxes(box), strict=True)
        ]


def _indent(button: Button) -> float:
    """Units that a button's swatches take before its words."""
    return 4 * len(button.swatches) + (4 if button.swatches else 0)


@dataclass(frozen=True)
class Slider:
    """A share 0..1 of a bar, with its name and its value in words; wheel turns do `wheel`."""

    name: str
    value: str
    share: float
    action: str
    colour: Colour
    wheel: tuple[str, str]
    mark: float | None = None  # a share that is told apart by a notch

    def size(self) -> tuple[float, float]:
        return 150, 25

    def _bar(self, box: Box) -> Box:
        return box[0] + 72, box[1] + 5, box[2] - 72 - 48, box[3] - 10

    def paint(self, canvas: Canvas, box: Box) -> None:
        left, top, width, height = bar = self._bar(box)
        middle = top + height / 2
        canvas.text(self.name, box[0], middle, FAINT, SMALL)
        canvas.box(bar, FIELD, height / 2)
        canvas.box((left, top, max(height, width * self.share), height), self.colour, height / 2)
        if self.mark is not None:
            canvas.box((left + width * self.mark - 1, top, 2, height), FAINT, 0)
        canvas.disc(left + width * self.share, middle, height * 0.62, INK)
        canvas.text(self.value, box[0] + box[2], middle, INK, SMALL, align=1.0)

    def regions(self, box: Box) -> list[Region]:
        left, _, width, _ = self._bar(box)
        return [Region((left, box[1], width, box[3]), self.action, "slide", wheel=self.wheel)]


@dataclass(frozen=True)
class Field:
    """A line to type in; `hint` stands in it while it is empty."""

    text: str
    hint: str
    typing: bool
    action: str

    def size(self) -> tuple[float, float]:
        return 120, 26

    def paint(self, canvas: Canvas, box: Box) -> None:
        middle, room = box[1] + box[3] / 2, box[2] - 18
        text, letters = self.text or self.hint, fitting(self.text or self.hint, room)
        while text_width(text, letters) > room:  # of a long one the end, where it is written on
            text = text[1:]
        canvas.box((box[0], box[1] + 1, box[2], box[3] - 3), FIELD)
        if self.typing:
            canvas.frame((box[0], box[1] + 1, box[2], box[3] - 3), ACCENT)
            end = text_width(text, letters) if self.text else 0
            canvas.box((box[0] + 9 + end, box[1] + 6, 1.5, box[3] - 13), ACCENT, 0)
        canvas.text(text, box[0] + 8, middle, INK if self.text else FAINT, letters)

    def regions(self, box: Box) -> list[Region]:
        return [Region(box, self.action)]


@dataclass(frozen=True)
class Choice:
    """One line of a list: text at the left, a note at the right."""

    text: str
    action: str
    swatch: Colour | None = None
    note: str = ""
    other: str = ""


@dataclass(frozen=True)
class Choices:
    """A list of which `shown` lines are seen about the `chosen` one; wheel turns do `wheel`."""

    choices: tuple[Choice, ...]
    chosen: int | None
    shown: int
    wheel: tuple[str, str]

    def size(self) -> tuple[float, float]:
        widths = [text_width(choice.text, SMALL) + text_width(choice.note, SMALL) for choice in self.choices]
        return max(widths, default=0) + 50, ROW * self.shown

    def shortened(self, units: float) -> "Choices":
        """A list that is lower by so much, as far as it can be."""
        lines = self.shown - max(0, math.ceil(units / ROW))
        return replace(self, shown=max(lines, min(self.shown, LEAST_SHOWN)))

    def _visible(self) -> range:
        count = len(self.choices)
        first = min(max((self.chosen or 0) - self.shown // 2, 0), max(count - self.shown, 0))
        return range(first, min(first + self.shown, count))

    def paint(self, canvas: Canvas, box: Box) -> None:
        visible = self._visible()
        for number, place in zip(visible, self._rows(box), strict=True):
            choice, (left, top, width, height) = self.choices[number], place
            if number == self.chosen:
                canvas.box(place, LIT)
            if choice.swatch:
                canvas.disc(left + 11, top + height / 2, SWATCH, choice.swatch)
            canvas.text(
                choice.text,
                left + (23 if choice.swatch else 7),
                top + height / 2,
                ACCENT if number == self.chosen else INK,
                fitting(choice.text, width - text_width(choice.note, SMALL) - 40),
            )
            canvas.text(choice.note, left + width - 8, top + height / 2, FAINT, SMALL, align=1.0)
        if len(visible) < len(self.choices):  # where in the whole list this is
            part = box[3] / len(self.choices)
            canvas.box((box[0] + box[2] - 3, box[1] + visible.start * part, 3, len(visible) * part), LIT, 1.5)

    def _rows(self, box: Box) -> list[Box]:
        return [(box[0], box[1] + place * ROW, box[2] - 6, ROW - 1) for place in range(len(self._visible()))]

    def regions(self, box: Box) -> list[Region]:
        return [
            Region(place, self.choices[number].action, other=self.choices[number].other, wheel=self.wheel)
            for number, place in zip(self._visible(), self._rows(box), strict=True)
        ]


@dataclass(frozen=True)
class Beside:
    """Two widgets side by side; the second gets the room that is left."""

    first: Widget
    second: Widget

    def size(self) -> tuple[float, float]:
        (a, height), (b, other) = self.first.size(), self.second.size()
        return a + GAP + b, max(height, other)

    def _boxes(self, box: Box) -> tuple[Box, Box]:
        (width, height), (_, other) = self.first.size(), self.second.size()
        left = box[0] + width + GAP
        return (
            (box[0], box[1] + (box[3] - height) / 2, width, height),
            (left, box[1] + (box[3] - other) / 2, box[2] - width - GAP, other),
        )

    def paint(self, canvas: Canvas, box: Box) -> None:
        for widget, place in zip((self.first, self.second), self._boxes(box), strict=True):
            widget.paint(canvas, place)

    def regions(self, box: Box) -> list[Region]:
        return [
            region
            for widget, place in zip((self.first, self.second), self._boxes(box), strict=True)
            for region in widget.regions(place)
        ]
