"""The head-up display: panels of widgets, how large they are and how they look, and what lies under the mouse."""

from dataclasses import dataclass, replace
from functools import lru_cache

from demo.ui.canvas import ACCENT, BACKGROUND, Box, Canvas, Colour
from demo.ui.text import Flow, Sentence
from demo.ui.widgets import Choices, Region, Widget

PADDING, SPACE = 10, 3  # units round the widgets of a panel and between them
LEAST_SCALE = 0.94  # pixels a unit at which the smallest letters are 11 pixels high, in windows of the size below
LEAST_SIZE = (800, 600)
TINY_SCALE = 0.75  # of still smaller pictures

Pixels = tuple[int, int, int, int]  # left, top, width, height


@dataclass(frozen=True)
class Panel:
    """Widgets under each other, at one of demo.ui.layout.ANCHORS. Equal panels look equal, so a panel is its own cache
    key."""

    widgets: tuple[Widget, ...]
    anchor: str = "top left"
    width: float = 0  # the least width of the widgets, in units
    padding: float = PADDING  # units round them
    colour: Colour = BACKGROUND

    def __post_init__(self) -> None:
        # Once: a panel may hold hundreds of numbers, and is looked up many times in a picture.
        content = self.widgets, self.anchor, self.width, self.padding, self.colour
        object.__setattr__(self, "_hash", hash(content))

    def __hash__(self) -> int:
        return self._hash  # type: ignore[attr-defined]

    def size(self) -> tuple[float, float]:
        """Its width and height in units."""
        return _layout(self)[0]

    def wrapped(self, width: float) -> "Panel":
        """The same, not wider than `width` units where its words can go on in another line."""
        room = width - 2 * self.padding
        return replace(
            self,
            widgets=tuple(
                widget.wrapped(room) if isinstance(widget, Sentence | Flow) else widget for widget in self.widgets
            ),
        )

    def shortened(self, units: float) -> "Panel":
        """The same, lower by that much where it holds a list that can show fewer lines."""
        return replace(
            self,
            widgets=tuple(
                widget.shortened(units) if isinstance(widget, Choices) else widget for widget in self.widgets
            ),
        )


@dataclass(frozen=True)
class Highlight:
    """The frame about what lies under the mouse, in units."""

    width: float
    height: float


@dataclass(frozen=True)
class Placed:
    """A panel in the window: `box` in pixels, `scale` pixels a unit."""

    panel: Panel | Highlight
    box: Pixels
    scale: float

    @property
    def key(self) -> tuple:
        """What its look depends on."""
        return self.panel, self.scale

    def pixels(self) -> bytes:
        """RGBA with premultiplied alpha."""
        if isinstance(self.panel, Highlight):
            canvas = Canvas(self.panel.width, self.panel.height, self.scale)
            canvas.frame((0, 0, self.panel.width, self.panel.height), ACCENT)
            return canvas.rgba()
        (width, height), boxes = _layout(self.panel)
        canvas = Canvas(width, height, self.scale)
        canvas.box((0, 0, width, height), self.panel.colour, 7)
        for widget, box in zip(self.panel.widgets, boxes, strict=True):
            widget.paint(canvas, box)
        return canvas.rgba()

    def regions(self) -> list[Region]:
        """Where it can be touched, in pixels of the window."""
        if isinstance(self.panel, Highlight):
            return []
        return [
            replace(region, box=self._in_pixels(region.box))
            for widget, box in zip(self.panel.widgets, _layout(self.panel)[1], strict=True)
            for region in widget.regions(box)
        ]

    def box_of(self, kind: type[Widget]) -> Pixels | None:
        """Where its first widget of a kind lies, in whole pixels of the window."""
        if isinstance(self.panel, Panel):
            for widget, box in zip(self.panel.widgets, _layout(self.panel)[1], strict=True):
                if isinstance(widget, kind):
                    left, top, width, height = (round(side) for side in self._in_pixels(box))
                    return left, top, width, height
        return None

    def _in_pixels(self, box: Box) -> Box:
        left, top, width, height = (side * self.scale for side in box)
        return self.box[0] + left, self.box[1] + top, width, height


def scale_for(size: tuple[int, int]) -> float:
    """Pixels a unit: in quarters, so that a window of 1280 x 720 has one; in smaller ones as many as keep letters
    readable."""
    quarters = round(4 * min(size[0] / 1280, size[1] / 720)) / 4
    return max(quarters, TINY_SCALE, LEAST_SCALE * min(1.0, size[0] / LEAST_SIZE[0], size[1] / LEAST_SIZE[1]))


@lru_cache(maxsize=64)
def _layout(panel: Panel) -> tuple[tuple[float, float], tuple]:
    """The panel's size in units and the box of each widget in it."""
    sizes = [widget.size() for widget in panel.widgets]
    width = max(panel.width, *(size[0] for size in sizes))
    boxes: list[Box] = []
    top = panel.padding
    for _, height in sizes:
        boxes.append((panel.padding, top, width, height))
        top += height + SPACE
    return (width + 2 * panel.padding, top - SPACE + panel.padding), tuple(boxes)


def highlight(region: Region, size: tuple[int, int]) -> Placed:
    """The frame about a region of a window of that size."""
    scale = scale_for(size)
    left, top, width, height = (round(side) for side in region.box)
    return Placed(Highlight(width / scale, height / scale), (left, top, width, height), scale)
