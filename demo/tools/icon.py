"""The window's icon: `python -m demo.tools.icon` draws it again, a walker patched together from five styles."""

from pathlib import Path

import numpy as np
import pygame

from demo.figure.colours import OWN_STYLE, style_colour
from demo.ui.canvas import Canvas

FILE = Path(__file__).parents[1] / "icon.png"
PIXELS = 128
UNITS = 64
SQUARE = (0.09, 0.125, 0.17)
FRAME = (0.25, 0.32, 0.40)
# Of each limb, from the one farthest away to the nearest: colour, and joints (x, y, radius) from the trunk outwards.
LIMBS = (
    (style_colour("swaggering"), ((30, 24, 3.6), (21, 31, 3.0), (14, 26, 2.8))),
    (style_colour("zombie"), ((31, 38, 4.4), (24, 46, 3.6), (13, 50, 3.0), (11, 53.5, 2.4))),
    (style_colour("strutting"), ((33, 38, 4.8), (41, 45, 4.0), (42, 55, 3.2), (46.5, 56, 2.6))),
    (style_colour("sad"), ((34.5, 22.5, 5.6), (32, 37, 5.2))),
    (style_colour("childish"), ((36, 23, 3.8), (43, 31, 3.2), (51, 27, 3.0))),
)
HEAD = (36.5, 11.5, 6.2)
VISOR = ((37.6, 10.6, 1.7), (41.0, 10.6, 1.7))
RIM = 1.3  # units of dark round each limb, so that it stands off from those behind


def draw_icon() -> bytes:
    """Its pixels, four bytes each."""
    canvas = Canvas(UNITS, UNITS, PIXELS / UNITS)
    canvas.box((1, 1, UNITS - 2, UNITS - 2), (*FRAME, 1.0), 13)
    canvas.box((2.5, 2.5, UNITS - 5, UNITS - 5), (*SQUARE, 1.0), 11.5)
    for colour, joints in (*LIMBS, (OWN_STYLE, (HEAD,)), (SQUARE, VISOR)):
        for rim, paint in ((RIM * (colour != SQUARE), SQUARE), (0.0, colour)):
            for start, stop in zip(joints, (*joints[1:], joints[-1]), strict=True):
                for x, y, radius in np.linspace(start, stop, 40):
                    canvas.disc(x, y, radius + rim, (*paint, 1.0))
    return canvas.rgba()


if __name__ == "__main__":
    pygame.image.save(pygame.image.frombytes(draw_icon(), (PIXELS, PIXELS), "RGBA"), str(FILE))
