"""Widgets that draw numbers: time by stage of the last frames, the phase dial, a heat map."""

from dataclasses import dataclass

import numpy as np

from demo.figure.colours import oklch
from demo.ui.canvas import ACCENT, ALERT, BACKGROUND, FAINT, FIELD, INK, SMALL, Box, Canvas, Colour, shorten
from demo.ui.widgets import Untouched
from sim.latency import BUDGET_MS, Latency

STAGES = ("controller", "features", "stylizer", "foot_lock", "render")  # of a picture, in the order they happen
STAGE_COLOURS = tuple(oklch(0.74, 0.12, hue) for hue in (2.5, 1.6, 4.6, 0.6, 5.8))
FRAMES = 120  # two seconds
GRAPH, TOP_MS = 68, 40.0  # height of the graph in units and in milliseconds
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
        return 2 * FRAMES, GRAPH + 10 + 17 * ((len(STAGES) + 1) // 2)

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
        canvas.box((box[0] + 2, line - 16, 54, 14), BACKGROUND, 3)
        canvas.text(f"{BUDGET_MS:.1f} ms", box[0] + 6, line - 9, ALERT, SMALL)
        means = np.array(self.columns[-30:]).mean(0)
        for place, (stage, mean) in enumerate(zip(STAGES, means, strict=True)):
            left, middle = box[0] + place % 2 * (box[2] / 2 + 5), box[1] + height + 16 + 17 * (place // 2)
            canvas.disc(left + 6, middle, 4.5, STAGE_COLOURS[place])
            canvas.text("drawing" if stage == "render" else stage.replace("_", " "), left + 17, middle, INK, SMALL)
            canvas.text(f"{mean:.1f}", left + box[2] / 2 - 5, middle, INK, SMALL, align=1.0)


@dataclass(frozen=True)
class Dial(Untouched):
    """The phase as a clock's hand, and the four foot contacts beside it."""

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
        tip = x + np.sin(self.phase) * 31, y - np.cos(self.phase) * 31
        canvas.line([(x, y), tip], ACCENT, 2.5)
        canvas.disc(*tip, 5, ACCENT)
        canvas.text(f"{np.degrees(self.phase):.0f}°", x, y + 16, FAINT, SMALL, align=0.5)
        for place, name in enumerate(NAMES):
            middle = box[1] + 14 + 21 * place
            canvas.disc(box[0] + 108, middle, 6, FIELD)
            if self.contacts[place] > 0.05:
                canvas.disc(box[0] + 108, middle, 6 * min(self.contacts[place], 1.0), (0.30, 0.80, 0.72))
            canvas.text(name, box[0] + 122, middle, INK, SMALL)


@dataclass(frozen=True)
class HeatMap(Untouched):
    """A table of shares as colours, from dark to light."""

    rows: tuple[tuple[float, ...], ...]
    below: str
    colour: Colour

    def size(self) -> tuple[float, float]:
        return 250, 90

    def paint(self, canvas: Canvas, box: Box) -> None:
        values = np.array(self.rows)
        values = np.sqrt(values / max(values.max(), 1e-9))[..., None]
        low, high = np.array(FIELD[:3]), np.array(self.colour)
        pixels = low + (high - low) * np.minimum(2 * values, 1) + (1 - high) * np.maximum(2 * values - 1, 0)
        place = (box[0], box[1], box[2], 72)
        canvas.picture((255 * pixels).astype(np.uint8), place)
        canvas.text(shorten(self.below, box[2], SMALL), box[0], box[1] + 82, FAINT, SMALL)
