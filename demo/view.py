"""What the picture shows besides the frame itself: camera, twin, marks on the ground, panels of text."""

from dataclasses import dataclass, field

import numpy as np

from demo.camera import Camera
from demo.hud import Panel
from sim.session import Frame

TWIN_DISTANCE = 1.15  # metres between the character and its neutral twin


@dataclass
class View:
    """One picture's settings. Only the camera remembers anything: call `follow` once a picture."""

    camera: Camera = field(default_factory=Camera)
    twin: bool = False
    arrow: bool = True
    contacts: bool = True
    glow: dict[str, float] = field(default_factory=dict)  # body part -> 0..1, brightened
    panels: tuple[Panel, ...] = ()

    @property
    def twin_shift(self) -> np.ndarray:
        """(3,) from the character to its twin: always beside it in the picture."""
        return -self.camera.right * TWIN_DISTANCE

    def follow(self, frame: Frame, seconds: float) -> None:
        """Moves the camera with the character (with what lies between it and its twin) for `seconds`."""
        position = frame.styled.root_position
        self.camera.follow(position + self.twin_shift / 2 if self.twin else position, seconds)
