"""Files dropped on the window: each BVH clip becomes a style, learned in a thread while the character walks on.

Learning is some 0.1 s of numpy and one pass of the encoder for a clip of ten seconds: too long for a frame, too short to
pay for a process that would first have to import everything. The thread and the walk share Python's lock, so the walk
misses a frame or two; each has its own core for the arithmetic."""

import textwrap
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Iterable

import pygame

from sim.clip import Clip

LONGEST = 110  # letters of what is wrong; a list of all the file's joints fits on no screen
Learn = Callable[[Path], tuple[str, Clip]]  # as stylizer.live.LiveStylizer.learn


@dataclass(frozen=True)
class Learned:
    """A new style and the clip it was learned from."""

    style: str
    clip: Clip


@dataclass(frozen=True)
class Refused:
    """Why a file is no style, in a sentence."""

    reason: str


class Dropped:
    """Takes DROPFILE events and gives what came of the files, in the order they were dropped."""

    def __init__(self, learn: Learn) -> None:
        self._learn = learn
        self._thread = ThreadPoolExecutor(1, "learn a style")
        self._waiting: list[Future[Learned | Refused]] = []

    def take(self, events: Iterable[pygame.event.Event]) -> list[Path]:
        """Begins to learn the files among a turn's events; their paths."""
        paths = [Path(event.file) for event in events if event.type == pygame.DROPFILE]
        self._waiting += [self._thread.submit(self._try, path) for path in paths]
        return paths

    def finished(self) -> list[Learned | Refused]:
        """What has come of files since it was last asked."""
        done = []
        while self._waiting and self._waiting[0].done():
            done.append(self._waiting.pop(0).result())
        return done

    def _try(self, path: Path) -> Learned | Refused:
        if path.suffix.lower() != ".bvh":
            return Refused(f"{path.name} cannot be a style: drop a motion as a .bvh file")
        try:
            return Learned(*self._learn(path))
        except OSError as error:
            return Refused(f"{path.name} cannot be used: {error.strerror or error}")
        except ValueError as error:
            return Refused(_short(str(error).replace(str(path), path.name)))
        except Exception as error:  # whatever a file does to us, the walk goes on
            return Refused(f"{path.name} cannot be used: {type(error).__name__}, {error}")


def _short(sentence: str) -> str:
    """What is wrong, cut where it is long, and what to do, whole: the two are parted by a semicolon."""
    wrong, parted, remedy = sentence.replace("given with --map", "given to `patchwalk styles add` with --map").rpartition("; ")
    if not parted:
        wrong, remedy = sentence, ""
    return textwrap.shorten(wrong, LONGEST, placeholder=" ...") + parted + remedy
