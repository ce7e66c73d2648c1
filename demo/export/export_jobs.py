"""F9: the last ten seconds as BVH, glTF and video, written by another process while the character walks on.

Drawing a video takes longer than walking it did, and pictures need a context of their own: both are had for nothing in
a process of its own, which also leaves the walk's processor alone where there is a second."""

import multiprocessing
import os
import pickle
import threading
from collections import deque
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path
from typing import TYPE_CHECKING, Sequence

from demo.export import export, video
from sim.character.character import Character
from sim.ground.ground import Ground
from sim.io import poses_npz
from sim.latency import Latency
from sim.motion.clip import FPS
from sim.session import Frame

if TYPE_CHECKING:
    from multiprocessing.sharedctypes import Synchronized

KINDS = ("bvh", "glb", "video")  # that are written unless others are asked for
ENDINGS = ("bvh", "glb", "mp4", "gif", "npz")  # of all files that these may be
NICENESS = 10  # the walk goes first
_SPAWN = multiprocessing.get_context("spawn")
_WRITING = threading.Lock()  # held, in the other process, while it writes
_done: "Synchronized[float] | None" = None  # in the other process: how much it has written


@dataclass(frozen=True)
class Written:
    """What came of an export: the files, and a sentence for each that could not be written."""

    files: tuple[Path, ...]
    problems: tuple[str, ...]


class ExportJobs:
    """Keeps the frames of the last SECONDS and exports them, one export at a time."""

    SECONDS = 10

    def __init__(self) -> None:
        self.frames: deque[Frame] = deque(maxlen=round(self.SECONDS * FPS))
        self._thread = ThreadPoolExecutor(1, "export")
        self._export: Future[Written] | None = None
        self._done = _SPAWN.Value("d", 0.0)  # how much of it, 0 .. 1, as the other process says

    @property
    def busy(self) -> bool:
        """Whether an export runs."""
        return self._export is not None

    @property
    def progress(self) -> float | None:
        """How much of the export is done, 0 .. 1; None where none runs."""
        return self._done.value if self.busy else None

    def export(
        self,
        stem: Path,
        ground: Ground | None = None,
        character: Character | None = None,
        kinds: Sequence[str] = KINDS,
    ) -> None:
        """Begins to write the frames kept so far, which were made on a ground, to `stem` with each kind's ending; on
        the figure, or on a character."""
        self._done.value = 0.0
        self._export = self._thread.submit(
            _write_elsewhere, list(self.frames), stem, ground, character, kinds, self._done
        )

    def finished(self, wait: bool = False) -> Written | None:
        """What came of the export, once, as soon as it is over; None before. `wait` waits for it."""
        if self._export is None or not (wait or self._export.done()):
            return None
        export, self._export = self._export, None
        return export.result()


def _write_elsewhere(
    frames: Sequence[Frame],
    stem: Path,
    ground: Ground | None,
    character: Character | None,
    kinds: Sequence[str],
    done: "Synchronized[float]",
) -> Written:
    """write_all in a process of its own, begun and waited for in a thread."""
    try:
        packed = [pickle.dumps(frame) for frame in frames]  # one by one: in between the walk gets Python's lock
        with ProcessPoolExecutor(1, _SPAWN, initializer=_start_writing, initargs=(done,)) as process:
            return process.submit(_write_packed, packed, stem, ground, character, kinds).result()
    except Exception as error:  # the other process died, whatever of: the walk goes on
        return Written((), (f"the export stopped: {error}",))


def _start_writing(done: "Synchronized[float] | None" = None) -> None:
    """Begins the other process: it gives way to the walk, and does not outlive the window but to end what it writes.

    done: where it says how much that is, 0 .. 1."""
    global _done
    _done = done
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent:
        wait([parent.sentinel])
        with _WRITING:
            os._exit(0)  # the pool would wait for the window's next word for ever


def _write_packed(
    packed: Sequence[bytes], stem: Path, ground: Ground | None, character: Character | None, kinds: Sequence[str]
) -> Written:
    with _WRITING:
        return write_all([pickle.loads(frame) for frame in packed], stem, ground, character, kinds, _say_done)


def _say_done(share: float) -> None:
    if _done:
        _done.value = share


def write_all(
    frames: Sequence[Frame],
    stem: Path,
    ground: Ground | None = None,
    character: Character | None = None,
    kinds: Sequence[str] = KINDS,
    progress: export.Progress = export.ignore,
) -> Written:
    """Writes every kind that this machine can; the video as MP4, or as GIF where there is no ffmpeg.

    progress: told how much is done, which is how much of the video is drawn, for the others take no time."""
    result = export.Result(frames, Latency(), 0.0, ground, export.Takeaway(character), progress)
    files, problems = [], []
    writers = export.WRITERS | {"poses": _write_poses}
    endings = {"poses": "npz", "video": "mp4" if video.has_ffmpeg() else "gif"}
    for kind in kinds:
        path = stem.with_name(f"{stem.name}.{endings.get(kind, kind)}")
        try:
            writers[kind](path, result)
            files.append(path)
        except OSError as error:
            problems.append(f"no {kind}: {error.filename or path}: {error.strerror or error}")
        except Exception as error:  # whatever it is: the other kinds are written
            problems.append(f"no {kind}: {error or type(error).__name__}")
    return Written(tuple(files), tuple(problems))


def _write_poses(path: Path, result: export.Result) -> None:
    from sim.character.files import CharacterRows

    character = result.takeaway.character
    rows = CharacterRows(character, result.ground) if character else None
    with poses_npz.writer(path, rows, rows.constants if rows else poses_npz.CONSTANTS) as add:
        for frame in result.frames:
            add(frame)
