"""Where panels go in a window so that none covers another, and the area that they leave to the figure."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from demo.ui.hud import Panel, Pixels, Placed, scale_for

MARGIN, GAP = 14, 7  # units at the window's border, and between panels

ANCHORS = {  # where a panel sits: at which side, and which way the next one there is stacked, down or up
    "top left": ("left", 1),
    "bottom left": ("left", -1),
    "top right": ("right", 1),
    "bottom right": ("right", -1),
    "top": ("middle", 1),
    "bottom": ("middle", -1),
}
ASIDE = 0.5  # a figure at the border of the picture has to be larger by a quarter than one in the middle
MOST_OF_HEIGHT = 0.4  # that panels above or below the figure may take


@lru_cache(maxsize=16)
def place(panels: tuple[Panel, ...], size: tuple[int, int]) -> tuple[Placed, ...]:
    """The panels in a window of that size in pixels, the first ones first: those for which there is no room are left
    out. Lists become shorter, sentences go on in the next line, and the last of several are left out, where they
    must."""
    arranger = _Arranger(size)
    for side in ("left", "right"):
        arranger.stack([panel for panel in panels if ANCHORS[panel.anchor][0] == side])
    for panel in panels:
        if ANCHORS[panel.anchor][0] == "middle":
            arranger.put_between(panel)
    return tuple(arranger.placed)


class _Arranger:
    """Takes one panel after another; all lengths are units but those of `placed`, which are pixels."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.scale = scale_for(size)
        self.width, self.height = size[0] / self.scale, size[1] / self.scale
        self.placed: list[Placed] = []
        self._boxes: list[tuple[float, float, float, float]] = []  # left, top, right, bottom of what is placed
        self._used = dict.fromkeys(ANCHORS, 0.0)  # of the height, from its end, at each anchor

    def stack(self, panels: list[Panel]) -> None:
        """Puts panels at one side, some from above, some from below."""
        room, used = self.height - 2 * MARGIN, 0.0
        kept: list[Panel] = []
        for panel in panels:
            height = panel.size()[1]
            over = used + height - room
            if over > 0:
                shorter = [each.shortened(over) for each in (*kept, panel)]
                total = sum(each.size()[1] + GAP for each in shorter)
                if total - GAP > room:
                    continue
                kept, used = shorter, total
            else:
                kept.append(panel)
                used += height + GAP
        for panel in kept:
            width, height = panel.size()
            side, way = ANCHORS[panel.anchor]
            left = MARGIN if side == "left" else self.width - MARGIN - width
            top = MARGIN + self._used[panel.anchor]
            if way < 0:
                top = self.height - top - height
            self._put(panel, left, top)

    def put_between(self, panel: Panel) -> None:
        """Puts a panel between the sides, as wide as these let it be at its height."""
        _, way = ANCHORS[panel.anchor]
        used = self._used[panel.anchor]
        wrapped = panel
        for _ in range(3):  # narrower is higher, where the sides may come nearer
            height = wrapped.size()[1]
            top = MARGIN + used if way > 0 else self.height - MARGIN - used - height
            left, right = self._between(top, top + height)
            wrapped = panel.wrapped(right - left)
        width, height = wrapped.size()
        left = _near_middle(left, right, width, self.width)
        fits = used + height <= MOST_OF_HEIGHT * (self.height - 2 * MARGIN)
        if fits and not self._covers(left, top, width, height):
            self._put(wrapped, left, top)
        elif len(panel.widgets) > 1:
            self.put_between(replace(panel, widgets=panel.widgets[:-1]))

    def _between(self, top: float, bottom: float) -> tuple[float, float]:
        """From where to where there is room between the sides, from one height to another."""
        left, right = float(MARGIN), self.width - MARGIN
        for placed, box in zip(self.placed, self._boxes, strict=True):
            side = ANCHORS[placed.panel.anchor][0] if isinstance(placed.panel, Panel) else ""
            if box[1] < bottom + GAP and top < box[3] + GAP:
                if side == "left":
                    left = max(left, box[2] + GAP)
                elif side == "right":
                    right = min(right, box[0] - GAP)
        return left, right

    def _covers(self, left: float, top: float, width: float, height: float) -> bool:
        """Whether a panel there would cover another, or the window's border."""
        inside = top >= 0 and top + height <= self.height and left >= 0 and left + width <= self.width
        return not inside or any(
            left < box[2] and box[0] < left + width and top < box[3] and box[1] < top + height for box in self._boxes
        )

    def _put(self, panel: Panel, left: float, top: float) -> None:
        width, height = panel.size()
        self._used[panel.anchor] += height + GAP
        self._boxes.append((left, top, left + width, top + height))
        box = [round(side * self.scale) for side in (left, top, width, height)]
        self.placed.append(Placed(panel, (box[0], box[1], box[2], box[3]), self.scale))


def _near_middle(low: float, high: float, length: float, whole: float) -> float:
    """Where something begins that lies between two places, as near to the middle of the whole as they let it."""
    return min(max((whole - length) / 2, low), max(high - length, low))


def with_gap(placed: Placed) -> Pixels:
    """A panel's box with the gap round it that the figure keeps away too."""
    gap = round(GAP * placed.scale)
    left, top, width, height = placed.box
    return left - gap, top - gap, width + 2 * gap, height + 2 * gap


def within(area: Pixels, size: tuple[int, int], breadth: float) -> Pixels:
    """The part of an area in which something `breadth` times as wide as high is as large as it can be, as near to the
    middle of a picture of that size as the area lets it."""
    left, top, width, height = area
    high = min(height, width / breadth)
    across = _near_middle(left, left + width, high * breadth, size[0])
    return round(across), round(_near_middle(top, top + height, high, size[1])), round(high * breadth), round(high)


@lru_cache(maxsize=64)
def free_area(boxes: tuple[Pixels, ...], size: tuple[int, int], breadth: float) -> Pixels:
    """The rectangle of a picture, in pixels, that boxes leave free, in which something `breadth` times as wide as high
    is largest, though rather in the middle, and of several the one with the most room about it. The whole picture where
    they leave none."""
    width, height = size
    if not boxes:
        return 0, 0, width, height
    taken = np.array(boxes)
    low, high = taken[:, :2], taken[:, :2] + taken[:, 2:]
    left, top, right, bottom = (
        corner.ravel()
        for corner in np.meshgrid(
            np.unique([0, *high[:, 0]]),
            np.unique([0, *high[:, 1]]),
            np.unique([width, *low[:, 0]]),
            np.unique([height, *low[:, 1]]),
        )
    )
    free = (left < right) & (top < bottom)
    left, top, right, bottom = (side[free] for side in (left, top, right, bottom))
    free = np.ones(len(left), bool)
    for (x, y), (to_x, to_y) in zip(low, high, strict=True):
        free &= (right <= x) | (left >= to_x) | (bottom <= y) | (top >= to_y)
    left, top, right, bottom = (side[free] for side in (left, top, right, bottom))
    if not len(left):
        return 0, 0, width, height
    across, down = right - left, bottom - top
    high = np.minimum(down, across / breadth)
    middle = np.clip(width / 2, left + high * breadth / 2, right - high * breadth / 2)
    best = np.lexsort((across * down, high * (1 - ASIDE * np.abs(middle / width - 0.5))))[-1]
    return int(left[best]), int(top[best]), int(across[best]), int(down[best])
