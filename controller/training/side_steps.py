"""Side-steps in captured clips, and which of them are learned: one way of side-stepping, not two."""

import numpy as np

from sim.body.skeleton import TOES
from sim.math import rotations as rot
from sim.motion.clip import FPS, Clip, root_frame

SIDEWAYS = np.radians(45)  # from straight sideways, within which a way over the floor is a side-step
SPEED = 0.25  # metres a second that it has at least
TURNING = 0.8  # radians a second under which it keeps its facing: who turns crosses his feet
CROSSED = -0.02  # metres that the left toe is to the left of the right one where feet have crossed
BRISK = 1.35  # metres a second from which feet may cross: nobody in the captures goes that fast foot to foot
PAUSE = 0.3  # seconds between two side-steps that belong together


def find_uncrossed(clip: Clip, shortest: float) -> list[slice]:
    """The parts of a grounded 60 Hz clip, of at least `shortest` seconds, without side-steps under BRISK in which the
    feet cross.

    Some actors side-step by closing foot to foot, others by crossing them. A network that learns both at the same
    speeds does either, keeps to what it happened to begin with, and has no gait of its own for what is asked."""
    positions = clip.positions()
    root = root_frame(positions)
    velocity, turn_rate = root.local_velocity(), np.gradient(root.facing, 1 / FPS)
    toes = rot.rotate(rot.from_yaw(-root.facing)[:, None], positions[:, TOES] - root.positions[:, None])
    crossed = toes[:, 0, 0] - toes[:, 1, 0] < CROSSED
    speed = np.linalg.norm(velocity, axis=-1)
    sideways = (np.abs(velocity[:, 0]) > np.cos(SIDEWAYS) * speed) & (speed > SPEED) & (np.abs(turn_rate) < TURNING)
    learned = np.ones(len(clip), bool)
    for start, stop in _spans(sideways, round(PAUSE * FPS)):
        if (sideways & crossed)[start:stop].any():
            learned[start:stop] = speed[start:stop] > BRISK
    return [slice(start, stop) for start, stop in _spans(learned) if stop - start >= shortest * FPS]


def _spans(chosen: np.ndarray, pause: int = 0) -> list[tuple[int, int]]:
    """First frame, and the one after the last, of each run of chosen (frames,) bool; runs a `pause` apart are one."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen, [0]]))).tolist()
    spans: list[tuple[int, int]] = []
    for start, stop in zip(edges[::2], edges[1::2]):
        if spans and start - spans[-1][1] <= pause:
            spans[-1] = spans[-1][0], stop
        else:
            spans.append((start, stop))
    return spans
