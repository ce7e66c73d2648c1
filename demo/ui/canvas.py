"""A canvas for panels: text and simple shapes in units of a pixel at a window height of 720, drawn large and made
small."""

from functools import lru_cache
from typing import Iterable

import numpy as np
import pygame

Colour = tuple[float, ...]  # display red, green, blue and perhaps alpha, 0..1
Box = tuple[float, float, float, float]  # left, top, width, height

INK = (1.0, 1.0, 1.0)
FAINT = (0.66, 0.71, 0.77)
ACCENT = (1.0, 0.83, 0.42)
ALERT = (1.0, 0.55, 0.48)
BACKGROUND = (0.07, 0.094, 0.125, 0.86)
FIELD = (0.135, 0.165, 0.205, 0.92)  # what can be touched
LIT = (0.275, 0.34, 0.41, 0.96)  # what is chosen

TEXT, SMALL = 16, 13.5  # heights of letters and the room about them
OVERSAMPLING = 2  # so that letters keep their distances and outlines are smooth


class Canvas:
    """A transparent picture of (width, height) units at `scale` pixels a unit."""

    def __init__(self, width: float, height: float, scale: float) -> None:
        self._size = round(width * scale), round(height * scale)
        self._k = scale * OVERSAMPLING
        self._surface = pygame.Surface([OVERSAMPLING * side for side in self._size], pygame.SRCALPHA)

    def box(self, box: Box, colour: Colour, radius: float = 4) -> None:
        """A filled rectangle with round corners."""
        left, top = round(box[0] * self._k), round(box[1] * self._k)
        right, bottom = round((box[0] + box[2]) * self._k), round((box[1] + box[3]) * self._k)
        pygame.draw.rect(
            self._surface,
            _bytes(colour),
            (left, top, right - left, bottom - top),
            border_radius=round(radius * self._k),
        )

    def frame(self, box: Box, colour: Colour, radius: float = 4) -> None:
        """Its outline."""
        rect = pygame.Rect(*(round(side * self._k) for side in box))
        pygame.draw.rect(self._surface, _bytes(colour), rect, round(1.5 * self._k), round(radius * self._k))

    def disc(self, x: float, y: float, radius: float, colour: Colour) -> None:
        """A filled circle."""
        pygame.draw.circle(self._surface, _bytes(colour), (x * self._k, y * self._k), radius * self._k)

    def polygon(self, points: Iterable[tuple[float, float]], colour: Colour) -> None:
        """A filled polygon."""
        pygame.draw.polygon(self._surface, _bytes(colour), [(x * self._k, y * self._k) for x, y in points])

    def line(self, points: Iterable[tuple[float, float]], colour: Colour, width: float = 1.5) -> None:
        """Straight lines from point to point."""
        pygame.draw.lines(
            self._surface,
            _bytes(colour),
            False,
            [(x * self._k, y * self._k) for x, y in points],
            max(1, round(width * self._k)),
        )

    def text(
        self, text: str, x: float, middle: float, colour: Colour = INK, size: float = TEXT, align: float = 0.0
    ) -> None:
        """A line of text about the height `middle`; `x` is its left border for align 0, its right one for 1."""
        letters = _font(size * self._k).render(text, True, _bytes(colour))
        left = x * self._k - align * letters.get_width()
        self._surface.blit(letters, (round(left), round(middle * self._k - letters.get_height() / 2)))

    def picture(self, pixels: np.ndarray, box: Box, smooth: bool = False) -> None:
        """A picture (height, width, 3) uint8 stretched over a box."""
        image = pygame.surfarray.make_surface(pixels.swapaxes(0, 1))
        place = [round(side * self._k) for side in box]
        stretch = pygame.transform.smoothscale if smooth else pygame.transform.scale
        self._surface.blit(stretch(image, place[2:]), place[:2])

    def rgba(self) -> bytes:
        """The pixels, four bytes each, with premultiplied alpha."""
        small = pygame.transform.smoothscale(self._surface.premul_alpha(), self._size)
        return pygame.image.tobytes(small, "RGBA")


def text_width(text: str, size: float = TEXT) -> float:
    """In units, whatever the scale."""
    return _font(4 * size).size(text)[0] / 4


def shorten(text: str, width: float, size: float = TEXT) -> str:
    """The text, or as much of it as fits in `width` units with an ellipsis."""
    while text and text_width(text, size) > width:
        text = text[:-2].rstrip() + "…" if not text.endswith("…") else text[:-2] + "…"
        if text == "…":
            break
    return text


def wrap(text: str, width: float, size: float = TEXT) -> list[str]:
    """The text in lines of `width` units at most: from word to word, and where one is longer, within it, after a
    hyphen if there is one."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer, size) <= width:
            lines[-1] = longer
            continue
        lines.append(word)
        while text_width(lines[-1], size) > width and len(lines[-1]) > 1:
            word = lines.pop()
            fits = next(end for end in range(len(word) - 1, 0, -1) if end == 1 or text_width(word[:end], size) <= width)
            parted = 1 + max(word.rfind(mark, 0, fits) for mark in "-_/")
            lines += [word[: parted or fits], word[parted or fits :]]
    return lines


def fitting(text: str, width: float) -> float:
    """The height of letters in which a text fits in `width` units, or the smallest."""
    return TEXT if text_width(text) <= width else SMALL


@lru_cache(maxsize=32)
def _font(pixels: float) -> pygame.font.Font:
    pygame.font.init()
    return pygame.font.Font(None, max(6, round(1.3 * pixels)))


@lru_cache(maxsize=256)
def _bytes(colour: Colour) -> tuple[int, ...]:
    return tuple(round(255 * channel) for channel in colour)
