"""Clips sent through the live path, frame by frame, as in a session: ring buffer, live stylizer, foot lock."""

import time
from dataclasses import dataclass
from typing import Callable, Mapping, Sequence

import numpy as np

from sim.clip import FPS, Clip, root_frame
from sim.contacts import foot_contacts
from sim.foot_lock import FootLock
from sim.pose import Pose
from sim.ring_buffer import RingBuffer
from sim.worn import Worn
from stylizer import catalogue
from stylizer.scaling import Scaled


@dataclass(frozen=True)
class Styles:
    """As much of a style bank as the live stylizer needs: the network and styles by name, `live.OWN` among them."""

    model: Scaled
    styles: Mapping[str, object]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.styles)

    def __getitem__(self, name: str) -> object:
        return self.styles[name]


@dataclass(frozen=True)
class Stream:
    """What came out: the network's own answers (frames, 21, 15), as the stylizer gave it, after the foot lock, and the
    stylizer's seconds a frame."""

    answers: np.ndarray
    styled: Clip
    locked: Clip
    seconds: float


def live(styles: Styles, content: Clip, worn: Callable[[int], Mapping[str, Worn]]) -> Stream:
    """A clip (60 Hz, grounded) played as if the controller made it; worn(frame) is what the parts wear in each frame."""
    stylizer, history, lock = catalogue.stylizer_of(styles), RingBuffer(), FootLock()
    answers, styled, locked, seconds = [], [], [], 0.0
    for frame, neutral in enumerate(poses(content)):
        history.push(neutral)
        window = history.window()
        start = time.perf_counter()
        styled.append(stylizer.step(window, neutral, worn(frame)))
        seconds += time.perf_counter() - start
        answers.append(window[-1] if stylizer.answer is None else stylizer.answer)
        locked.append(lock.step(styled[-1], neutral))
    return Stream(np.array(answers), as_clip(styled), as_clip(locked), seconds / len(content))


def poses(clip: Clip) -> list[Pose]:
    """The clip's frames as the controller would give them, contacts told from the feet."""
    root = root_frame(clip.positions(), clip.fps)
    frames = zip(root.positions, root.facing, clip.hips, clip.global_rotations(), foot_contacts(clip))
    return [Pose(position, float(facing), hips, rotations, contacts, 0.0)
            for position, facing, hips, rotations, contacts in frames]


def as_clip(frames: Sequence[Pose]) -> Clip:
    return Clip(np.array([pose.hips for pose in frames]), np.array([pose.local_rotations for pose in frames]), FPS)
