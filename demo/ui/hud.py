"""The head-up display: panels of widgets stacked at the borders of the window, and what lies under the mouse."""

from dataclasses import dataclass, replace
from functools import lru_cache

from demo.ui.canvas import ACCENT, BACKGROUND, Box, Canvas
from demo.ui.widgets import Region, Widget

PADDING, SPACE, MARGIN = 10, 3, 14  # round the widgets, between them, at the window's border

ANCHORS = {  # where a panel sits: fractions of the free width and height, and which way the next one there is stacked
    "top left": (0.0, 0.0, 1),
    "top": (0.5, 0.0, 1),
    "top right": (1.0, 0.0, 1),
    "center": (0.5, 0.45, 1),
    "bottom left": (0.0, 1.0, -1),
    "bottom": (0.5, 1.0, -1),
    "bottom right": (1.0, 1.0, -1),
}


@dataclass(frozen=True)
class Panel:
    """Widgets under each other, at one of ANCHORS. Equal panels look equal, so a panel is its own cache key."""

    widgets: tuple[Widget, ...]
    anchor: str = "top left"
    width: float = 0  # the least width of the widgets, in units
    lift: float = 0  # units that it, and what is stacked on it, lies farther from its border


@dataclass(frozen=True)
class Highlight:
    """The frame about what lies under the mouse, in units."""

    width: float
    height: float


@dataclass(frozen=True)
class Placed:
    """A panel in the window: `box` left, top, width, height in pixels, `scale` pixels a unit."""

    panel: Panel | Highlight
    box: tuple[int, int, int, int]
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
        canvas.box((0, 0, width, height), BACKGROUND, 7)
        for widget, box in zip(self.panel.widgets, boxes, strict=True):
            widget.paint(canvas, box)
        return canvas.rgba()

    def regions(self) -> list[Region]:
        """Where it can be touched, in pixels of the window."""
        if isinstance(self.panel, Highlight):
            return []
        left, top = self.box[:2]
        regions = [
            region
            for widget, box in zip(self.panel.widgets, _layout(self.panel)[1], strict=True)
            for region in widget.regions(box)
        ]
        return [
            replace(
                region,
                box=(
                    left + region.box[0] * self.scale,
                    top + region.box[1] * self.scale,
                    region.box[2] * self.scale,
                    region.box[3] * self.scale,
                ),
            )
            for region in regions
        ]


def scale_for(size: tuple[int, int]) -> float:
    """Pixels a unit, in quarters: readable in a small window and on a dense screen."""
    return max(0.75, round(4 * min(size[0] / 1280, size[1] / 720)) / 4)


@lru_cache(maxsize=64)
def _layout(panel: Panel) -> tuple[tuple[float, float], tuple]:
    """The panel's size in units and the box of each widget in it."""
    sizes = [widget.size() for widget in panel.widgets]
    width = max(panel.width, *(size[0] for size in sizes))
    boxes: list[Box] = []
    top: float = PADDING
    for _, height in sizes:
        boxes.append((PADDING, top, width, height))
        top += height + SPACE
    return (width + 2 * PADDING, top - SPACE + PADDING), tuple(boxes)


def place(panels: tuple[Panel, ...], size: tuple[int, int]) -> list[Placed]:
    """Where the panels go in a window of that size in pixels; those at one anchor are stacked in their order."""
    scale = scale_for(size)
    margin = round(MARGIN * scale)
    used = dict.fromkeys(ANCHORS, 0)
    placed = []
    for panel in panels:
        across, down, direction = ANCHORS[panel.anchor]
        width, height = (round(side * scale) for side in _layout(panel)[0])
        left = round(margin + across * (size[0] - 2 * margin - width))
        used[panel.anchor] = max(used[panel.anchor], round(panel.lift * scale))
        top = round(margin + down * (size[1] - 2 * margin - height)) + direction * used[panel.anchor]
        used[panel.anchor] += height + margin // 2
        placed.append(Placed(panel, (left, top, width, height), scale))
    return placed


def highlight(region: Region, size: tuple[int, int]) -> Placed:
    """The frame about a region of a window of that size."""
    scale = scale_for(size)
    left, top, width, height = (round(side) for side in region.box)
    return Placed(Highlight(width / scale, height / scale), (left, top, width, height), scale)
