"""The head-up display: panels of text as small tables, drawn with pygame's own font and laid over the scene."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Iterable

import pygame

INK = (1.0, 1.0, 1.0)
FAINT = (0.68, 0.73, 0.78)
ACCENT = (1.0, 0.83, 0.42)
ALERT = (1.0, 0.55, 0.48)
BACKGROUND, LIT = (18, 24, 32, 214), (70, 86, 104, 240)

TEXT_PIXELS = 17  # at a window height of 720
PADDING, GAP, LINE, MARGIN = 11, 13, 23, 14  # round the text, between columns, from line to line, at the border
OVERSAMPLING = 2


@dataclass(frozen=True)
class Cell:
    """A piece of text; with `swatch`, a dot of that colour stands before it."""

    text: str
    colour: tuple[float, float, float] = INK
    swatch: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Panel:
    """Rows of cells in aligned columns, at one of ANCHORS. Equal panels look equal, so a panel is its own cache key."""

    rows: tuple[tuple[Cell, ...], ...]
    anchor: str = "top left"
    lit_rows: tuple[int, ...] = ()  # rows with a lighter background


ANCHORS = {  # where a panel sits: fractions of the free width and height, and which way the next one there is stacked
    "top left": (0.0, 0.0, 1), "top": (0.5, 0.0, 1), "top right": (1.0, 0.0, 1), "center": (0.5, 0.45, 1),
    "bottom left": (0.0, 1.0, -1), "bottom": (0.5, 1.0, -1), "bottom right": (1.0, 1.0, -1),
}


def scale_for(size: tuple[int, int]) -> float:
    """How much larger than at 1280 x 720 the text is, in quarters: readable in a small window and on a dense screen."""
    return max(0.75, round(4 * min(size[0] / 1280, size[1] / 720)) / 4)


@lru_cache(maxsize=8)
def _font(scale: float) -> pygame.font.Font:
    pygame.font.init()
    return pygame.font.Font(None, round(TEXT_PIXELS * 1.3 * scale))


@lru_cache(maxsize=64)
def _layout(panel: Panel, scale: float) -> tuple[tuple[int, int], tuple[int, ...]]:
    """The panel's size in pixels and the left border of each column."""
    font = _font(scale * OVERSAMPLING)
    gap = GAP * scale
    widths = [max(font.size(row[column].text)[0] / OVERSAMPLING + (gap * 1.5 if row[column].swatch else 0)
                  for row in panel.rows if column < len(row)) for column in range(max(map(len, panel.rows)))]
    lefts = [PADDING * scale + sum(widths[:column]) + gap * column for column in range(len(widths))]
    width = 2 * PADDING * scale + sum(widths) + gap * (len(widths) - 1)
    return (round(width), round((len(panel.rows) * LINE + PADDING) * scale)), tuple(map(round, lefts))


def rasterise(panel: Panel, scale: float) -> pygame.Surface:
    """The panel with premultiplied alpha: drawn large and made small, so that letters keep their distances."""
    size, lefts = ((OVERSAMPLING * number for number in numbers) for numbers in _layout(panel, scale))
    large = _draw(panel, scale * OVERSAMPLING, tuple(size), lefts)
    return pygame.transform.smoothscale(large.premul_alpha(), _layout(panel, scale)[0])


def _draw(panel: Panel, scale: float, size: tuple[int, int], lefts: Iterable[int]) -> pygame.Surface:
    font, lefts = _font(scale), tuple(lefts)
    surface = pygame.Surface(size, pygame.SRCALPHA)
    pygame.draw.rect(surface, BACKGROUND, surface.get_rect(), border_radius=round(7 * scale))
    for number, row in enumerate(panel.rows):
        top = (PADDING / 2 + number * LINE) * scale
        if number in panel.lit_rows:
            inset = round(4 * scale)
            bar = pygame.Rect(inset, round(top + scale), size[0] - 2 * inset, round((LINE - 2) * scale))
            pygame.draw.rect(surface, LIT, bar, border_radius=inset)
        for cell, left in zip(row, lefts, strict=False):  # a short row leaves columns empty
            middle = top + LINE * scale / 2
            if cell.swatch:
                radius = 0.52 * GAP * scale
                pygame.draw.circle(surface, _bytes(cell.swatch), (left + radius, middle), radius)
                left += round(1.5 * GAP * scale)
            text = font.render(cell.text, True, _bytes(cell.colour))
            surface.blit(text, (left, round(middle - text.get_height() / 2)))
    return surface


def _bytes(colour: tuple[float, float, float]) -> tuple[int, ...]:
    return tuple(round(255 * channel) for channel in colour)


def place(panels: tuple[Panel, ...], size: tuple[int, int]) -> list[tuple]:
    """For each panel (key, left, top, (width, height), function giving premultiplied RGBA bytes), in pixels."""
    scale = scale_for(size)
    margin = round(MARGIN * scale)
    used = dict.fromkeys(ANCHORS, 0)
    placed = []
    for panel in panels:
        across, down, direction = ANCHORS[panel.anchor]
        width, height = _layout(panel, scale)[0]
        left = round(margin + across * (size[0] - 2 * margin - width))
        top = round(margin + down * (size[1] - 2 * margin - height)) + direction * used[panel.anchor]
        used[panel.anchor] += height + margin // 2
        placed.append(((panel, scale), left, top, (width, height), lambda panel=panel: _rgba(rasterise(panel, scale))))
    return placed


def _rgba(surface: pygame.Surface) -> bytes:
    return pygame.image.tobytes(surface, "RGBA")
