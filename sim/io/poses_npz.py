"""The poses file (`.npz`): what a replay produced, frame by frame, for other programs to measure.

Frames go to the disk as they come, so that a replay of a day needs no more memory than one of a minute."""

import shutil
import zipfile
from contextlib import contextmanager
from pathlib import Path
from typing import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from sim.body.skeleton import BONE_OFFSETS, JOINTS, PARENTS
from sim.io.atomic_write import atomic_write
from sim.io.checks import check_finite
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.session import Frame

CHUNK = 600  # frames that are kept in memory before they are written
CONSTANTS = {
    "fps": np.array(FPS),
    "bone_offsets": BONE_OFFSETS,
    "parents": PARENTS,
    "joint_names": np.array(JOINTS),
}
Rows = Callable[[Sequence[Frame]], dict[str, np.ndarray]]
TURNS = ("neutral_rotations", "rotations")  # quaternions, whose signs run on


def to_arrays(frames: Sequence[Frame]) -> dict[str, np.ndarray]:
    """The arrays by name that have a row for each frame: metres, radians, local quaternions wxyz."""

    def stack(values: Iterable[np.ndarray | float]) -> np.ndarray:
        return np.array([np.asarray(value, dtype=np.float64) for value in values])

    return {
        "neutral_positions": stack(frame.neutral.positions for frame in frames),
        "positions": stack(frame.styled.positions for frame in frames),
        "neutral_rotations": stack(frame.neutral.local_rotations for frame in frames),
        "rotations": stack(frame.styled.local_rotations for frame in frames),
        "contacts": stack(frame.styled.contacts for frame in frames),
        "phase": stack(frame.neutral.phase for frame in frames),
        "root_position": stack(frame.neutral.root_position for frame in frames),
        "root_facing": stack(frame.neutral.root_facing for frame in frames),
        "desired_velocity": stack(frame.command.desired_velocity for frame in frames),
    }


@contextmanager
def writer(
    path: str | Path, rows: Rows | None = None, constants: Mapping[str, np.ndarray] = CONSTANTS
) -> Iterator[Callable[[Frame], None]]:
    """Gives a function that takes one frame after the other; the file is there, whole, when the block has ended without
    error. Equal frames give equal bytes.

    rows, constants: what is written of frames (None: `to_arrays`), and of their skeleton: ours, or a character's
    (sim.character.files).
    Raises OSError where it cannot be written, ValueError for frames that are not finite."""
    with atomic_write(path) as temporary:
        parts = _Parts(Path(path), temporary.parent, rows or to_arrays, constants)
        yield parts.add
        parts.save(temporary)


class _Parts:
    """The rows of each array in a file of its own, in a temporary folder."""

    def __init__(self, path: Path, folder: Path, rows: Rows, constants: Mapping[str, np.ndarray]) -> None:
        self._path, self._folder = path, folder
        self._rows, self._constants = rows, constants
        self._waiting: list[Frame] = []
        self._shapes: dict[str, tuple[int, ...]] = {}
        self._last: dict[str, np.ndarray] = {}  # the rotations of the last frame

    def add(self, frame: Frame) -> None:
        self._waiting.append(frame)
        if len(self._waiting) == CHUNK:
            self._flush()

    def save(self, file: Path) -> None:
        """Puts all that came into an .npz file."""
        self._flush()
        with zipfile.ZipFile(file, "w") as archive:
            for name, values in self._constants.items():
                with archive.open(f"{name}.npy", "w") as entry:
                    np.lib.format.write_array(entry, values)
            for name, shape in self._shapes.items():
                header = {"descr": "<f8", "fortran_order": False, "shape": shape}
                with archive.open(f"{name}.npy", "w", force_zip64=True) as entry, open(self._part(name), "rb") as rows:
                    np.lib.format.write_array_header_1_0(entry, header)
                    shutil.copyfileobj(rows, entry)

    def _flush(self) -> None:
        if not self._waiting:
            return
        arrays = self._rows(self._waiting)
        self._waiting = []
        check_finite(self._path, *arrays.values())
        for name, values in arrays.items():
            if name in TURNS:
                before = self._last.get(name, values[:1])
                values = rot.make_continuous(np.concatenate([before, values]))[1:]
                self._last[name] = values[-1:]
            with open(self._part(name), "ab") as rows:
                rows.write(np.ascontiguousarray(values, "<f8").tobytes())
            count = self._shapes.get(name, (0,))[0] + len(values)
            self._shapes[name] = (count, *values.shape[1:])

    def _part(self, name: str) -> Path:
        return self._folder / f"{name}.rows"


def write(path: str | Path, frames: Iterable[Frame]) -> None:
    """Writes the poses file of frames that there are already: see `writer`."""
    with writer(path) as add:
        for frame in frames:
            add(frame)
