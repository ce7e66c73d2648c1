"""Widgets that draw numbers: time by stage of the last frames, the phase dial, a heat map."""

from dataclasses import dataclass

import numpy as np

from demo.figure.colours import oklch
from demo.ui.canvas import ACCENT, ALERT, BACKGROUND, FAINT, FIELD, INK, SMALL, Box, Canvas, Colour, text_width
from demo.ui.widgets import Untouched
from sim.latency import BUDGET_MS, Latency

STAGES = ("controller", "features", "stylizer", "foot_lock", "render")  # of a picture, in the order they happen
STAGE_COLOURS = tuple(oklch(0.74, 0.12, hue) for hue in (2.5, 1.6, 4.6, 0.6, 5.8))
TIMES_OF_ROWS = "0.5 s ago", "now"  # the first and the last of a heat map
FRAMES = 120  # two seconds
LINE = 16  # units from line to line
GRAPH, TOP_MS = 60, 40.0  # height of the graph in units and in milliseconds
INNER = 21  # units about the middle of the dial that are its number's alone
NAMES = ("left foot", "left toe", "right foot", "right toe")  # of the contacts


@dataclass(frozen=True)
class Times(Untouched):
    """Bars of the last frames' milliseconds by stage, stacked, with a line where 60 frames a second end."""

    columns: tuple[tuple[float, ...], ...]  # a frame each: its milliseconds in STAGES

    @classmethod
    def of(cls, latency: Latency) -> "Times":
        """The newest frames of a latency. A picture may show several steps; the time it took stands with the newest."""
        columns = np.zeros((FRAMES, len(STAGES)))
        for place, stage in enumerate(STAGES):
            newest = 1e3 * np.array(latency.seconds[stage][-FRAMES:])
            columns[FRAMES - len(newest) :, place] = newest
        return cls(tuple(map(tuple, columns.round(1).tolist())))

    def size(self) -> tuple[float, float]:
        return 1.5 * FRAMES, GRAPH + 8 + LINE * len(STAGES)

    def paint(self, canvas: Canvas, box: Box) -> None:
        height = GRAPH
        ends = np.cumsum(self.columns, axis=1) * height / TOP_MS  # (frames, stages), units above the bottom
        rows = np.arange(height, 0, -1)[:, None]
        pixels = np.full((height, FRAMES, 3), np.array(FIELD[:3]) * 255)
        for place in reversed(range(len(STAGES))):
            pixels[rows <= ends[:, place].round()] = np.array(STAGE_COLOURS[place]) * 255
        canvas.picture(pixels.astype(np.uint8), (box[0], box[1], box[2], height))
        line = box[1] + height * (1 - BUDGET_MS / TOP_MS)
        canvas.line([(box[0], line), (box[0] + box[2], line)], ALERT, 1)
        budget = f"{BUDGET_MS:.1f} ms: 60 pictures/s"
        canvas.box((box[0] + 2, line - 16, text_width(budget, SMALL) + 8, 14), BACKGROUND, 3)
        canvas.text(budget, box[0] + 6, line - 9, ALERT, SMALL)
        means = np.array(self.columns[-30:]).mean(0)
        for place, (stage, mean) in enumerate(zip(STAGES, means, strict=True)):
            middle = box[1] + height + 8 + LINE * (place + 0.5)
            canvas.disc(box[0] + 6, middle, 4.5, STAGE_COLOURS[place])
            canvas.text("drawing" if stage == "render" else stage.replace("_", " "), box[0] + 17, middle, INK, SMALL)
            canvas.text(f"{mean:.1f} ms", box[0] + box[2], middle, INK, SMALL, align=1.0)


@dataclass(frozen=True)
class Dial(Untouched):
    """The phase as a mark that runs round its number, and the four foot contacts beside it."""

    phase: float  # radians
    contacts: tuple[float, ...]  # left foot, left toe, right foot, right toe

    def size(self) -> tuple[float, float]:
        return 190, 88

    def paint(self, canvas: Canvas, box: Box) -> None:
        x, y, radius = box[0] + 46, box[1] + 44, 40
        canvas.disc(x, y, radius, FIELD)
        for quarter in range(4):
            sine, cosine = np.sin(quarter * np.pi / 2), np.cos(quarter * np.pi / 2)
            canvas.line([(x + sine * 34, y - cosine * 34), (x + sine * 39, y - cosine * 39)], FAINT)
        sine, cosine = np.sin(self.phase), np.cos(self.phase)
        canvas.line([(x + sine * INNER, y - cosine * INNER), (x + sine * 31, y - cosine * 31)], ACCENT, 2.5)
        canvas.disc(x + sine * 31, y - cosine * 31, 5, ACCENT)
        canvas.text(f"{np.degrees(self.phase) % 360:.0f}°", x, y, INK, SMALL, align=0.5)
        for place, name in enumerate(NAMES):
            middle = box[1] + 14 + 21 * place
            canvas.disc(box[0] + 108, middle, 6, FIELD)
            if self.contacts[place] > 0.05:
                canvas.disc(box[0] + 108, middle, 6 * min(self.contacts[place], 1.0), (0.30, 0.80, 0.72))
            canvas.text(name, box[0] + 122, middle, INK, SMALL)


@dataclass(frozen=True)
class HeatMap(Untouched):
    """A table of shares as colours, from dark to light: a row for each sample of the last half second."""

    rows: tuple[tuple[float, ...], ...]
    colour: Colour

    def size(self) -> tuple[float, float]:
        return 180, 72

    def paint(self, canvas: Canvas, box: Box) -> None:
        values = np.array(self.rows)
        values = np.sqrt(values / max(values.max(), 1e-9))[..., None]
        low, high = np.array(FIELD[:3]), np.array(self.colour)
        pixels = low + (high - low) * np.minimum(2 * values, 1) + (1 - high) * np.maximum(2 * values - 1, 0)
        left = max(text_width(text, SMALL) for text in TIMES_OF_ROWS) + 6
        canvas.picture((255 * pixels).astype(np.uint8), (box[0] + left, box[1], box[2] - left, box[3]))
        for text, middle in zip(TIMES_OF_ROWS, (7, box[3] - 7), strict=True):
            canvas.text(text, box[0] + left - 6, box[1] + middle, FAINT, SMALL, align=1.0)
