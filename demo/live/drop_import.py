"""Files dropped on the window: the clips of one drop become one style, and a skinned figure the character, both in a
thread while the character walks on.

Learning is some 0.1 s of numpy and one pass of the encoder for a clip of ten seconds: too long for a frame, too short
to pay for a process that would first have to import everything. The thread and the walk share Python's lock, so the
walk misses a frame or two; each has its own core for the arithmetic."""

import textwrap
import warnings
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Iterable, Sequence

import pygame

from demo.figure.character_model import DrawnCharacter
from demo.state import characters
from demo.state.style_names import movement_names
from sim.character.character import load_character
from sim.io import gltf_file
from sim.io.motion_file import is_motion
from sim.motion.clip import Clip
from sim.protocols import NamedStylizer

LONGEST = 110  # letters of what is wrong; a list of all the file's joints fits on no screen
PATIENCE = 60  # turns without news after which a drop counts as whole though its end was never reported


@dataclass(frozen=True)
class Learned:
    """A new style, the first of the clips it was learned from, the movements that they show, and what had to be mended
    in them."""

    style: str
    clip: Clip
    movements: tuple[str, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Arrived:
    """The user's own character, and what was guessed or mended."""

    character: DrawnCharacter
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Refused:
    """Why files are no style and no character, in a sentence."""

    reason: str


class DropImport:
    """Takes the events of drops and gives what came of their files, in the order they were dropped."""

    def __init__(self, stylizer: Callable[[], NamedStylizer]) -> None:
        """stylizer: gives the one in use, which learns."""
        self._stylizer = stylizer
        self._thread = ThreadPoolExecutor(1, "learn a style")
        self._waiting: list[Future[Learned | Arrived | Refused]] = []
        self._files: list[Path] = []  # of a drop that is being reported
        self._reporting = False  # whether its beginning was reported, and its end is to come
        self._quiet = 0  # turns since its last event

    def take(self, events: Iterable[pygame.event.Event]) -> list[list[Path]]:
        """Takes a turn's events; the files of each drop that is whole now and begun to be learned, as one style.

        SDL reports a drop's beginning, its files and its end, maybe in several turns; where a platform reports the
        files alone, those of one turn belong together."""
        whole = []
        self._quiet += 1
        for event in events:
            if event.type in (pygame.DROPBEGIN, pygame.DROPCOMPLETE):
                whole.append(self._end())
                self._reporting = event.type == pygame.DROPBEGIN
            elif event.type == pygame.DROPFILE:
                self._files.append(Path(event.file))
            else:
                continue
            self._quiet = 0
        if not self._reporting or self._quiet >= PATIENCE:
            whole.append(self._end())
            self._reporting = False
        whole = [paths for paths in whole if paths]
        for paths in whole:
            self.learn(paths)
        return whole

    def learn(self, paths: Sequence[Path]) -> None:
        """Begins to learn a style of the files of a drop, or to read a character."""
        self._waiting.append(self._thread.submit(self._try, paths))

    def finished(self) -> list[Learned | Arrived | Refused]:
        """What has come of drops since it was last asked."""
        done = []
        while self._waiting and self._waiting[0].done():
            done.append(self._waiting.pop(0).result())
        return done

    def _end(self) -> list[Path]:
        """The files of the drop that is over."""
        files, self._files = self._files, []
        return files

    def _try(self, paths: Sequence[Path]) -> Learned | Arrived | Refused:
        own = next((path for path in paths if characters.is_character(path)), None)
        wrong = next((path for path in paths if not is_motion(path)), None)
        if wrong and not own:
            return Refused(
                f"{wrong.name} cannot be used: drop a motion as a .bvh, .glb or SMPL .npz file, "
                "or a character as a .glb or .vrm file"
            )
        try:
            if own:
                return self._arrive(own)
            stylizer = self._stylizer()
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                style, clip = stylizer.learn(*paths)
            notes = tuple(_short(_without_folders(str(each.message), paths)) for each in caught)
            return Learned(style, clip, movement_names(stylizer.movements(style)), notes)
        except OSError as error:
            return Refused(f"{Path(error.filename or paths[0]).name} cannot be used: {error.strerror or error}")
        except ValueError as error:
            return Refused(_short(_without_folders(str(error), paths)))
        except Exception as error:  # whatever a file does to us, the walk goes on
            return Refused(f"{describe_file(paths)} cannot be used: {type(error).__name__}, {error}")

    def _arrive(self, path: Path) -> Arrived:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            character = load_character(path)
            drawn = DrawnCharacter(character)
            characters.keep(character)
        notes = (*character.notes, *(str(each.message) for each in caught))
        return Arrived(drawn, tuple(_short(_without_folders(note, [path])) for note in notes))


def describe_file(paths: Sequence[Path]) -> str:
    """The files of a drop, as a message names them."""
    names = [path.name for path in paths]
    return " and ".join(names) if len(names) < 3 else f"{names[0]} and {len(names) - 1} more files"


def is_clip(path: Path) -> bool:
    """Whether a file's name says that it holds a motion and no character."""
    return path.suffix.lower() not in gltf_file.ENDINGS


def _without_folders(sentence: str, paths: Sequence[Path]) -> str:
    """A sentence that names files by their names alone."""
    for path in paths:
        sentence = sentence.replace(str(path), path.name)
    return sentence


def _short(sentence: str) -> str:
    """What is wrong, cut where it is long, and what to do, whole: the two are parted by a semicolon."""
    for option in ("--map", "--fps"):
        sentence = sentence.replace(f"with {option}", f"to `patchwalk styles add` with {option}")
    wrong, parted, remedy = sentence.rpartition("; ")
    if not parted:
        wrong, remedy = sentence, ""
    return textwrap.shorten(wrong, LONGEST, placeholder=" ...") + parted + remedy
