"""Frames that do not belong to the motion around them: a zeroed first frame, a T-pose, a spike of a tracker.

Each would spoil far more than itself: speeds, the floor and the ways that joints bend are measured over all frames."""

from dataclasses import replace

import numpy as np

from sim.io.bvh import Motion
from sim.math import rotations as rot

LONGEST = 0.25  # seconds that a run of outliers may last; longer ones are motion, cut in
JUMP = 0.25  # leg lengths that some joint moves into an outlier within a frame, at least
UNUSUAL = 5.0  # times as far as joints move within most frames of the clip
MOST_FRAMES = 0.8  # share of all
FEWEST = 6  # frames in which an outlier can be told


def find_outliers(positions: np.ndarray, leg_length: float, fps: float) -> np.ndarray:
    """(F,) of bool: frames that jump away from the motion beside them, from joint positions (F, J, 3).

    Jumps part a clip into stretches. From the longest on, outwards, a short one that lies off the way from the last
    good frame is left out."""
    result = np.zeros(len(positions), bool)
    if len(positions) < FEWEST:
        return result
    steps = _distance(positions[1:], positions[:-1]) / leg_length
    limit = max(JUMP, UNUSUAL * np.quantile(steps, MOST_FRAMES, method="lower"))
    ends = [0, *(np.flatnonzero(steps > limit) + 1), len(positions)]
    stretches = [(start, stop - 1) for start, stop in zip(ends, ends[1:])]  # the first and the last frame of each
    longest = max(range(len(stretches)), key=lambda place: stretches[place][1] - stretches[place][0])
    onward, back = stretches[longest + 1 :], stretches[:longest][::-1]
    for edge, others in ((stretches[longest][1], onward), (stretches[longest][0], [each[::-1] for each in back])):
        for near, far in others:
            apart = float(_distance(positions[near], positions[edge])) / leg_length
            if abs(far - near) < max(1, round(LONGEST * fps)) and apart > limit * abs(near - edge):
                result[min(near, far) : max(near, far) + 1] = True
            else:
                edge = far
    return result


def _distance(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(...) how far apart the joints (..., J, 3) are that are farthest apart."""
    return np.linalg.norm(one - other, axis=-1).max(axis=-1)


def leave_out(motion: Motion, outliers: np.ndarray) -> Motion:
    """The motion without its outliers (F,): cut off at its ends, interpolated from the frames beside them elsewhere."""
    good = np.flatnonzero(~outliers)
    inside = slice(good[0], good[-1] + 1)
    bad = np.flatnonzero(outliers[inside]) + inside.start
    after = np.searchsorted(good, bad)
    first, last = good[after - 1], good[after]
    share = ((bad - first) / (last - first))[:, None, None]
    positions, rotations = motion.positions.copy(), motion.rotations.copy()
    positions[bad] = positions[first] + share * (positions[last] - positions[first])
    rotations[bad] = rot.slerp(rotations[first], rotations[last], share)
    angles = None if motion.angles is None else motion.angles[inside]
    return replace(motion, positions=positions[inside], rotations=rotations[inside], angles=angles)


def describe(outliers: np.ndarray) -> str:
    """A sentence that names the frames, counted from 1."""
    frames = np.flatnonzero(outliers) + 1
    runs = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
    names = [str(run[0]) if len(run) == 1 else f"{run[0]} to {run[-1]}" for run in runs]
    more = f" and {len(names) - 5} more" * (len(names) > 5)
    which = f"{', '.join(names[:5])}{more}"
    if len(frames) == 1:
        return f"frame {which} jumps away from the motion beside it and was left out"
    return f"frames {which} jump away from the motion beside them and were left out"
