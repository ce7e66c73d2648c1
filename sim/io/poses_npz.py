"""The poses file (`.npz`): what a replay produced, frame by frame, for other programs to measure."""

from pathlib import Path
from typing import Iterable, Sequence

import numpy as np

from sim.body.skeleton import BONE_OFFSETS, PARENTS
from sim.io.atomic_write import atomic_write
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.session import Frame


def to_arrays(frames: Sequence[Frame]) -> dict[str, np.ndarray]:
    """The poses file's arrays by name: metres, radians, local quaternions wxyz with signs that run on."""

    def stack(values: Iterable[np.ndarray | float]) -> np.ndarray:
        return np.array([np.asarray(value, dtype=np.float64) for value in values])

    return {
        "fps": np.array(FPS),
        "neutral_positions": stack(frame.neutral.positions for frame in frames),
        "positions": stack(frame.styled.positions for frame in frames),
        "neutral_rotations": rot.make_continuous(stack(frame.neutral.local_rotations for frame in frames)),
        "rotations": rot.make_continuous(stack(frame.styled.local_rotations for frame in frames)),
        "contacts": stack(frame.styled.contacts for frame in frames),
        "phase": stack(frame.neutral.phase for frame in frames),
        "root_position": stack(frame.neutral.root_position for frame in frames),
        "root_facing": stack(frame.neutral.root_facing for frame in frames),
        "desired_velocity": stack(frame.command.desired_velocity for frame in frames),
        "bone_offsets": BONE_OFFSETS,
        "parents": PARENTS,
    }


def write(path: str | Path, frames: Sequence[Frame]) -> None:
    """Writes the poses file; equal frames give equal bytes. Raises OSError where it cannot be written."""
    with atomic_write(path) as temporary, open(temporary, "wb") as file:  # to a bare name numpy might add its .npz
        np.savez(file, **to_arrays(frames))  # type: ignore[arg-type]  # numpy's types take an array for its allow_pickle
