"""Widgets whose words go on in another line where there is little room, and the room for what others draw."""

from dataclasses import dataclass, replace
from typing import Self

from demo.ui.canvas import INK, SMALL, TEXT, Box, Canvas, Colour, shorten, text_width, wrap
from demo.ui.widgets import GAP, Cell, Table, Untouched

COLUMN_GAP = 28  # units between the columns of a page


@dataclass(frozen=True)
class Sentence(Untouched):
    """Words on as many lines as they need."""

    text: str
    colour: Colour = INK
    letters: float = TEXT
    width: float = 640

    def wrapped(self, width: float) -> Self:
        """The same, not wider than that."""
        return replace(self, width=min(self.width, width))

    def _lines(self) -> list[str]:
        return wrap(self.text, self.width, self.letters)

    def size(self) -> tuple[float, float]:
        lines = self._lines()
        widest = max((text_width(line, self.letters) for line in lines), default=0.0)
        return widest, (self.letters + 5) * len(lines)

    def paint(self, canvas: Canvas, box: Box) -> None:
        for number, line in enumerate(self._lines()):
            middle = box[1] + (number + 0.5) * (self.letters + 5)
            canvas.text(shorten(line, box[2], self.letters), box[0], middle, self.colour, self.letters)


@dataclass(frozen=True)
class Flow(Untouched):
    """Cells side by side, on as many lines as they need."""

    cells: tuple[Cell, ...]
    letters: float = SMALL
    width: float = 640

    def wrapped(self, width: float) -> Self:
        """The same, not wider than that."""
        return replace(self, width=min(self.width, width))

    def _lines(self) -> list[list[Cell]]:
        lines: list[list[Cell]] = []
        left = self.width + 1
        for cell in self.cells:
            width = cell.width(self.letters)
            if left + width > self.width:
                lines.append([])
                left = 0.0
            lines[-1].append(cell)
            left += width + GAP
        return lines

    def _width(self, line: list[Cell]) -> float:
        return sum(cell.width(self.letters) + GAP for cell in line) - GAP

    def size(self) -> tuple[float, float]:
        lines = self._lines()
        return max(map(self._width, lines), default=0.0), (self.letters + 7) * len(lines)

    def paint(self, canvas: Canvas, box: Box) -> None:
        for number, line in enumerate(self._lines()):
            middle, left = box[1] + (number + 0.5) * (self.letters + 7), box[0] + (box[2] - self._width(line)) / 2
            for cell in line:
                cell.paint(canvas, left, middle, self.letters)
                left += cell.width(self.letters) + GAP


@dataclass(frozen=True)
class Hole(Untouched):
    """Room for what is drawn there by something else."""

    width: float
    height: float

    def size(self) -> tuple[float, float]:
        return self.width, self.height

    def paint(self, canvas: Canvas, box: Box) -> None:
        pass


@dataclass(frozen=True)
class Columns(Untouched):
    """Tables side by side."""

    tables: tuple[Table, ...]

    def size(self) -> tuple[float, float]:
        sizes = [table.size() for table in self.tables]
        return sum(width for width, _ in sizes) + COLUMN_GAP * (len(sizes) - 1), max(height for _, height in sizes)

    def paint(self, canvas: Canvas, box: Box) -> None:
        left = box[0]
        for table in self.tables:
            width, height = table.size()
            table.paint(canvas, (left, box[1], width, height))
            left += width + COLUMN_GAP
