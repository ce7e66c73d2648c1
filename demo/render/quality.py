"""What a picture may cost: the steps in which it is made simpler where drawing it takes too long."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Quality:
    """shrink: pixels of the window to one of the scene, each way; smooth: outlines, by several samples a pixel where
    graphics hardware draws; shadows: those that figures throw on the ground."""

    shrink: int = 1
    smooth: bool = True
    shadows: bool = True


QUALITIES = (Quality(), Quality(smooth=False), Quality(2, False), Quality(3, False, False))  # the best one first
