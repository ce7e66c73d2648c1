"""What a picture may cost: the steps in which it is made simpler where drawing it takes too long."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Quality:
    """shrink: pixels of the window to one of the scene, each way, magnified smoothly; smooth: outlines, by several
    samples a pixel where graphics hardware draws; shadows: those that figures throw on the ground."""

    shrink: int = 1
    smooth: bool = True
    shadows: bool = True


# The best one first. A processor that draws takes 29, 27, 24 and 22 ms for them at 1920 x 1080: to magnify a picture
# costs it nearly as much as to draw a large one, so that comes last.
QUALITIES = (
    Quality(),
    Quality(shadows=False),
    Quality(smooth=False, shadows=False),
    Quality(3, shadows=False),
)
