"""The icon that is shipped is the one that is drawn."""

import numpy as np
import pygame

from demo.tools import icon


def test_the_icon_in_the_package_is_the_one_that_is_drawn():
    shipped = pygame.image.tobytes(pygame.image.load(icon.FILE), "RGBA")
    drawn, kept = (np.frombuffer(pixels, np.uint8).astype(int) for pixels in (icon.draw_icon(), shipped))
    assert len(drawn) == len(kept) == 4 * icon.PIXELS**2 and np.abs(drawn - kept).mean() < 1
    assert icon.FILE.stat().st_size < 10_000
