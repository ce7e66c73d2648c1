"""Clips sent through the live path: a session whose controller plays them."""

from dataclasses import dataclass, replace
from typing import Callable, Mapping, Sequence

import numpy as np

from sim.body.pose import Pose
from sim.command import Command
from sim.ground.ground import Ground
from sim.latency import Latency
from sim.motion.clip import FPS, Clip
from sim.motion.playback_pace import OWN_PACE, Pace
from sim.session import Session
from sim.style_spec import PartLike, StyleSpec
from stylizer.runtime import catalogue
from stylizer.runtime.live import LiveStylizer
from stylizer.runtime.offline import Network, to_pose
from stylizer.styles.style_clips import StyleClips
from stylizer.systems.registry import SYSTEMS, System


@dataclass(frozen=True)
class Styles:
    """As much of a style bank as the live stylizer needs: the network and styles by name, `live.OWN` among them."""

    model: Network
    styles: Mapping[str, StyleClips]
    controller: str | None = None  # whose motion the own style is: a clip's, not a controller's

    @property
    def system(self) -> System:
        return SYSTEMS[self.model.KIND]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.styles)

    def __getitem__(self, name: str) -> StyleClips:
        return self.styles[name]


@dataclass(frozen=True)
class Playback:
    """What came out: as the stylizer gave it, after the foot lock, and the stylizer's seconds a frame."""

    styled: Clip
    locked: Clip
    seconds: float


def play_live(styles: Styles, content: Clip, style: Callable[[int], Mapping[str, PartLike]]) -> Playback:
    """A clip (60 Hz, grounded) played as if the controller made it; style(frame) is what the parts are asked to show in
    each frame."""
    stylizer, latency = _Watched(catalogue.make_stylizer(styles)), Latency()
    session = Session(_Player(content), stylizer, latency)  # type: ignore[type-var, arg-type]  # there is no crowd
    locked = [session.step(Command(style=style(frame))).styled for frame in range(len(content))]
    seconds = float(np.mean(latency.seconds["stylizer"]))
    return Playback(as_clip(stylizer.styled), as_clip(locked), seconds)


class _Player:
    """A `sim.protocols.Controller` that gives a clip's frames, one after the other, whatever the command; only how far
    its root goes with each is as far as styled legs carry it."""

    fingerprint = trajectory = None

    def __init__(self, clip: Clip) -> None:
        self.poses = to_pose(clip)
        self.restart()

    def stand_on(self, ground: Ground | None) -> None:
        """A clip walks where it was captured."""

    def restart(self) -> None:
        self.frame, self.shift = 0, np.zeros(3)

    def step(self, command: Command, pace: Pace = OWN_PACE) -> Pose:
        pose = self.poses[self.frame]
        if self.frame:
            self.shift = self.shift + (pace.stride - 1) * (
                pose.root_position - self.poses[self.frame - 1].root_position
            )
        self.frame += 1
        return replace(pose, root_position=pose.root_position + self.shift, hips=pose.hips + self.shift)


class _Watched:
    """A `sim.protocols.Stylizer` that keeps what another one makes."""

    own_of = None

    def __init__(self, stylizer: LiveStylizer) -> None:
        self.stylizer = stylizer
        self.restart()

    def restart(self) -> None:
        self.stylizer.restart()
        self.styled: list[Pose] = []

    def step(self, window: np.ndarray, neutral: Pose, style: StyleSpec, travel: float = 1.0) -> Pose:
        self.styled.append(self.stylizer.step(window, neutral, style, travel))
        return self.styled[-1]

    def leg_strengths(self) -> np.ndarray:
        return self.stylizer.leg_strengths()

    def pace(self, gaits: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        return self.stylizer.pace(gaits)


def as_clip(frames: Sequence[Pose]) -> Clip:
    return Clip(np.array([pose.hips for pose in frames]), np.array([pose.local_rotations for pose in frames]), FPS)
