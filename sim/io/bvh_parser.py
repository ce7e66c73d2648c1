"""The text of a BVH file, read forgivingly: the hierarchy of joints, and the table of numbers below MOTION.

What a file may ask for is bounded, and the bounds are checked before the work is done."""

import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Sequence

import numpy as np

ROTATION_ORDER = ("Zrotation", "Xrotation", "Yrotation")
POSITION_ORDER = ("Xposition", "Yposition", "Zposition")
MAX_JOINTS, MAX_DEPTH = 1000, 200  # a person with fingers and a face has a few hundred joints, some 20 deep
LARGEST_NUMBER = 1e9  # a kilometre in micrometres, and no angle
MAX_SECONDS = 1800  # of one motion
FRAME_RATES = (5.0, 1000.0)  # frames a second, slowest and fastest
USUAL_RATES = np.array([24, 25, 30, 48, 50, 60, 72, 90, 100, 120, 144, 200, 240])
RATE_TOLERANCE = 0.02  # share by which a rate may be off a usual one


@dataclass
class Hierarchy:
    """The joints in the file's order and unit: parents (-1 for a root), offsets (3,), channels in the order of the
    numbers, and end_sites {joint: offset (3,)}. owners: the joint of each number of a frame, -1 where it is an End
    Site's."""

    names: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[np.ndarray] = field(default_factory=list)
    channels: list[tuple[str, ...]] = field(default_factory=list)
    end_sites: dict[int, np.ndarray] = field(default_factory=dict)
    owners: list[int] = field(default_factory=list)


def read_hierarchy(path: Path, lines: list[str]) -> Hierarchy:
    """The joints in the lines above MOTION. Raises ValueError, naming file and line, where they are not BVH."""
    builder = _Builder()
    for number, line in enumerate(lines, 1):
        for statement in filter(None, map(str.strip, re.split(r"([{}])", line))):
            try:
                builder.take(*statement.split())
            except ValueError as error:
                raise ValueError(f"{path}, line {number}: {error}") from None
    if not builder.made.names:
        raise ValueError(f"{path} is not a BVH file: it has no ROOT")
    if builder.open_joints:
        raise ValueError(f"{path}, line {len(lines)}: {len(builder.open_joints)} '{{' are never closed")
    return builder.made


class _Builder:
    """A hierarchy made from one statement after another; each raises ValueError saying what is wrong with it."""

    def __init__(self) -> None:
        self.made = Hierarchy()
        self.open_joints: list[int] = []  # whose '{' is not closed yet
        self.newest, self.in_end_site = -1, False

    def take(self, keyword: str, *words: str) -> None:
        """The next statement: a brace, or a keyword with the words after it."""
        match keyword.upper():
            case "HIERARCHY":
                pass
            case "ROOT":
                self._joint(words, parent=-1)
            case "JOINT":
                self._joint(words, parent=self.open_joints[-1] if self.open_joints else -1)
            case "END":
                self.in_end_site = True
            case "{":
                if self.newest < 0:
                    raise ValueError("a '{' comes before any ROOT")
                if len(self.open_joints) == MAX_DEPTH:
                    raise ValueError(f"joints lie more than {MAX_DEPTH} deep: that is no skeleton of a person")
                self.open_joints.append(self.newest)
            case "}":
                if not self.open_joints:
                    raise ValueError("a '}' closes nothing")
                self.newest, self.in_end_site = self.open_joints.pop(), False
            case "OFFSET":
                self._offset(words)
            case "CHANNELS":
                self._channels(words)
            case _:
                raise ValueError(f"'{shorten(keyword)}' is not a BVH keyword")

    def _joint(self, words: tuple[str, ...], parent: int) -> None:
        made = self.made
        if len(made.names) == MAX_JOINTS:
            raise ValueError(f"there are more than {MAX_JOINTS} joints: export the body alone")
        self.newest, self.in_end_site = len(made.names), False
        made.names.append(" ".join(words) or f"joint{self.newest}")
        made.parents.append(parent)
        made.offsets.append(np.zeros(3))
        made.channels.append(())

    def _offset(self, words: tuple[str, ...]) -> None:
        offset = parse_numbers(words)
        if self.newest < 0 or offset is None or len(offset) != 3:
            raise ValueError("OFFSET needs three numbers inside a joint")
        if not (np.abs(offset) <= LARGEST_NUMBER).all():
            raise ValueError(f"the OFFSET of joint '{shorten(self.made.names[self.newest])}' is too long to be a bone")
        (self.made.end_sites if self.in_end_site else self.made.offsets)[self.newest] = offset

    def _channels(self, words: tuple[str, ...]) -> None:
        channels = tuple(word[:1].upper() + word[1:].lower() for word in words[1:])
        known = all(channel in POSITION_ORDER + ROTATION_ORDER for channel in channels)
        if self.newest < 0 or words[:1] != (str(len(channels)),) or not known:
            raise ValueError("CHANNELS needs its count and that many of Xposition ... Zrotation")
        turns = [channel for channel in channels if channel in ROTATION_ORDER]
        if len(turns) > 3:
            raise ValueError("a joint may have at most three rotation channels")
        if any(one == next for one, next in zip(turns, turns[1:])):
            raise ValueError("CHANNELS names the same rotation twice in a row")
        if self.in_end_site:  # nothing is there to be moved: its numbers are skipped
            self.made.owners += [-1] * len(channels)
            return
        if self.made.channels[self.newest]:
            raise ValueError(f"joint '{shorten(self.made.names[self.newest])}' has CHANNELS already")
        self.made.owners += [self.newest] * len(channels)
        self.made.channels[self.newest] = channels


def read_frames(
    path: Path, lines: list[str], start: int, width: int, fps: float | None = None
) -> tuple[float, np.ndarray]:
    """Frames a second and the values (F, width) below MOTION, which stands on line `start` (counted from 1).

    fps: believed in place of the file's own. Raises ValueError, naming file and line; warns of a wrong frame count, of
    a last frame cut short, and of a frame time that is no number of seconds."""
    declared, fps, first = _headings(path, lines, start, fps)
    rows = [(number, line) for number, line in enumerate(lines[first:], first + 1) if line.strip()]
    counts = np.array([len(line.split()) for _, line in rows], int)
    odd = np.flatnonzero(counts != width)
    wrapped = len(rows) != declared and counts.sum() == (declared or 0) * width  # frames broken over several lines
    if len(odd) and not wrapped:
        if odd[0] < len(rows) - 1 or counts[-1] > width:
            raise ValueError(f"{path}, line {rows[odd[0]][0]}: {counts[odd[0]]} numbers where each frame has {width}")
        warnings.warn(f"{path}: the last frame is cut short and was left out", stacklevel=3)
        rows, declared = rows[:-1], None
    values = parse_numbers([line for _, line in rows])
    if values is None or not _are_possible(values):
        number = next(n for n, line in rows if (v := parse_numbers([line])) is None or not _are_possible(v))
        raise ValueError(f"{path}, line {number}: a frame holds something that is not a number of a motion")
    values = values.reshape(-1, width)
    if not len(values):
        raise ValueError(f"{path} holds no frames")
    if len(values) > MAX_SECONDS * fps:
        raise ValueError(
            f"{path} holds {len(values)} frames, {len(values) / fps / 60:.0f} minutes of motion: "
            f"cut it into files of {MAX_SECONDS // 60} minutes at most"
        )
    if declared not in (None, len(values)):
        warnings.warn(f"{path}: {declared} frames announced, {len(values)} found and used", stacklevel=3)
    return fps, values


def _are_possible(values: np.ndarray) -> bool:
    """Whether numbers are finite, and small enough to be lengths or angles."""
    return bool((np.abs(values) <= LARGEST_NUMBER).all())


def _headings(path: Path, lines: list[str], start: int, fps: float | None) -> tuple[int | None, float, int]:
    """From the lines below MOTION: the number of frames where it is given, frames a second, and how many lines lie
    above the first frame."""
    declared, stated, first = None, None, start
    for first in range(start, len(lines)):
        key, colon, value = lines[first].partition(":")
        if colon:
            given = parse_numbers(value.split())
            if given is None or len(given) != 1:
                raise ValueError(f"{path}, line {first + 1}: '{shorten(key.strip())}:' needs one number")
            if key.strip().lower() == "frames":
                if not abs(given[0]) < LARGEST_NUMBER:
                    raise ValueError(f"{path}, line {first + 1}: 'Frames:' is {given[0]:g}, which is no count")
                declared = int(given[0])
            else:
                stated = given[0], first + 1
        elif lines[first].strip():
            break
    else:
        first = len(lines)
    if fps is not None:
        return declared, fps, first
    if stated is None or not stated[0] > 0:
        raise ValueError(f"{path}, line {min(first, start) + 1}: a 'Frame Time:' above zero is missing")
    return declared, _frame_rate(path, *stated), first


def _frame_rate(path: Path, stated: float, line: int) -> float:
    """Frames a second of a frame time above zero. One that cannot be seconds is read as milliseconds or as a rate,
    with a warning, where that makes a usual rate. Raises ValueError where it does not."""
    fps = 1.0 / max(stated, 1e-9)
    if FRAME_RATES[0] <= fps <= FRAME_RATES[1]:
        whole = round(fps)  # files round the time of a frame: 0.0333333 s means 30 a second
        return whole if abs(fps - whole) < 2e-4 * fps else fps
    for rate, meaning in ((stated, "frames a second"), (1000.0 / max(stated, 1e-9), "milliseconds")):
        if (np.abs(rate - USUAL_RATES) < RATE_TOLERANCE * USUAL_RATES).any():
            rate = float(round(rate)) if abs(rate - round(rate)) < 0.01 else rate
            warnings.warn(
                f"{path}, line {line}: 'Frame Time: {stated:g}' was read as {meaning}: {rate:.4g} frames a second; "
                "if that is wrong, say how many with --fps",
                stacklevel=5,
            )
            return rate
    raise ValueError(
        f"{path}, line {line}: 'Frame Time: {stated:g}' is no time of a frame in seconds; "
        "say how many frames a second with --fps"
    )


def parse_numbers(words: Sequence[str]) -> np.ndarray | None:
    """The numbers (n,) in whitespace-separated words or lines, None if anything else is there."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # the parser warns where it stops early
        try:
            return np.fromstring(" ".join(words), sep=" ") if words else np.empty(0)
        except (ValueError, DeprecationWarning):
            return None


def shorten(text: str) -> str:
    """A name out of a file as a sentence can hold it: of some forty letters, none of which steers a terminal."""
    text = "".join(letter if letter.isprintable() else "?" for letter in text)
    return text if len(text) <= 40 else text[:37] + "..."
