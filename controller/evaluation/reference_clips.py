"""The real clips that the controller's motion is measured beside: the neutral ones that training held out."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from controller.evaluation.metrics import joint_angles, spells
from controller.evaluation.suite import Motion
from controller.training.dataset import is_held_out, kind_of, load_clips
from controller.training.labelled_clip import label
from sim.motion.thresholds import STILL_ROOT

IDLE_SECONDS = 2.0  # the shortest stand that counts as idling
IDLE_TURN = 0.3  # radians a second over which a standing character is turning


@dataclass(frozen=True)
class RealClips:
    """Held-out clips of walking and running; the stands of all clips, for hardly one is held out; all clips that
    crouch; and the range of each joint angle in the training clips, low and high (21, 3) radians, mirrored as in
    training."""

    held_out: list[Motion]
    idle: list[Motion]
    crouching: list[Motion]
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def load(cls, folder: Path) -> "RealClips":
        """Every clip under a folder of BVH files that training learns from, in the posture that it is learned in.
        Raises ValueError where that leaves nothing to measure against."""
        held_out, idle, crouching, ranges = [], [], [], []
        for path, clip in zip(*load_clips(folder)):
            motion, kind = Motion.of_clip(clip), kind_of(path, clip)
            if kind == "crouch":
                crouching.append(replace(motion, crouch=label(clip, crouches=True).crouch))
            elif kind != "jump":
                idle += [motion[stretch] for stretch in spells(is_idle(motion), IDLE_SECONDS)]
                if is_held_out(path.stem):
                    held_out.append(motion)
                    continue
            for side in (clip, clip.mirrored()):
                angles = joint_angles(side.rotations, Motion.of_clip(side).root.facing)
                ranges.append((angles.min(axis=0), angles.max(axis=0)))
        if not held_out or not ranges:
            raise ValueError(
                f"'{folder}' holds too few usable BVH files to measure against: unpack the archives of "
                "motion capture there, or leave --data out"
            )
        lows, highs = zip(*ranges)
        return cls(held_out, idle, crouching, np.min(lows, axis=0), np.max(highs, axis=0))


def is_idle(motion: Motion) -> np.ndarray:
    """Whether the root neither goes nor turns: (frames,)."""
    return (np.linalg.norm(motion.velocity, axis=1) < STILL_ROOT) & (np.abs(motion.turn_rate) < IDLE_TURN)
