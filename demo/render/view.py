"""What the picture shows besides the frame itself: camera, twin, what is seen inside, panels."""

from dataclasses import dataclass, field

import numpy as np

from demo.render.camera import Camera
from demo.ui.hud import Panel, Placed
from sim.body.pose import Pose
from sim.ground.ground import Ground
from sim.math.vectors import UP
from sim.session import Frame

TWIN_DISTANCE = 1.15  # metres between the character and its neutral twin
TWINS = ("", "beside", "ghost")


@dataclass(frozen=True)
class Paths:
    """The root's way on the floor, each (n, 2) world x, z: what was gone, what is asked, what the network expects."""

    past: np.ndarray
    desired: np.ndarray
    predicted: np.ndarray


@dataclass
class View:
    """One picture's settings. Only the camera remembers anything: call `follow` once a picture."""

    camera: Camera = field(default_factory=Camera)
    ground: Ground | None = None  # what it stands on; None: level floor
    twin: str = ""  # one of TWINS: the neutral motion beside the character, or about it as a ghost
    arrow: bool = True
    contacts: bool = True
    skeleton: bool = False
    paths: Paths | None = None
    past: tuple[Pose, ...] = ()  # earlier poses drawn as ghosts, the oldest first
    glow: dict[str, float] = field(default_factory=dict)  # body part -> 0..1, brightened
    panels: tuple[Panel, ...] = ()
    over: tuple[Placed, ...] = ()  # what lies over the panels at a place of its own

    def twin_shift(self, frame: Frame) -> np.ndarray:
        """(3,) from the character to its twin: always beside it in the picture, as high over the ground; or where the
        character is."""
        shift = -self.camera.right * (TWIN_DISTANCE if self.twin == "beside" else 0.0)
        place = frame.styled.root_position
        return shift + UP * (self._height(place + shift) - self._height(place))

    def follow(self, frame: Frame, seconds: float) -> None:
        """Moves the camera with the character (with what lies between it and its twin) for `seconds`."""
        self.camera.follow(self._aim(frame), seconds, self.ground)

    def jump_to(self, frame: Frame) -> None:
        """Aims the camera at the character, and its twin, at once."""
        self.camera.jump(self._aim(frame), self.ground)

    def _aim(self, frame: Frame) -> np.ndarray:
        """(3,) the place on the ground that the camera looks at: it stays there while the character jumps."""
        place = frame.styled.root_position + self.twin_shift(frame) / 2
        return place + UP * (self._height(place) - place[1])

    def _height(self, place: np.ndarray) -> float:
        """Of the ground, blurred, at a place (3,)."""
        return 0.0 if self.ground is None else float(self.ground.smooth_height_at(place[[0, 2]]))
