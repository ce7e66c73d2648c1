"""Recorded input: a JSON line for each frame whose command changes, written as it happens."""

import json
import math
import warnings
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Callable, Iterator

from sim.command import Command, check_gait, check_length
from sim.motion.clip import FPS
from sim.style_spec import StyleSpec, abbreviate, is_number

HEADER = {"format": "patchwalk-recording", "version": 1, "fps": FPS}
KNOWN = (*HEADER, "stylizer", "pace", "ground", "seed")  # what a header may say
MAX_FRAMES = 24 * 3600 * FPS  # a frame number beyond a day is a mistake, not a recording
MAX_SEED = 2**31
# by which a recorded full stick may be too long: it is left as it is, for the same pose to the last bit
LAST_BITS = 1e-12
SMALLEST_FACE = 1e-6  # the length of a facing under which it is no direction


class Recorder:
    """Writes commands to a new file, one `write` a frame; used in a `with` block, or ended by `close`.

    A line goes out at once when something changes, and once a second when nothing does: a line that names only its
    frame says how long the stretch before it has lasted, so that a crash loses less than a second of input.
    Raises FileExistsError rather than write over a recording."""

    def __init__(
        self,
        path: str | Path,
        stylizer: str | None = None,
        pace: bool = False,
        ground: str | None = None,
        seed: int | None = None,
    ) -> None:
        """stylizer: the name of the one in use, for whoever plays it; None: the one that is used unless another is
        named. pace: whether the styles of the legs set the pace at the start; a command that says otherwise is written
        as a change. ground: the name of what it walks on; None for level floor. seed: by which the stylizer's styles
        are drawn, None where it draws none."""
        self.path = Path(path)
        self.frames = 0
        self._file = open(self.path, "x", encoding="ascii")
        self._last: dict[str, Any] = {"pace": pace}  # what the lines so far say
        self._silent = 0  # frames since the last line
        extras = {"stylizer": stylizer, "pace": pace, "ground": ground, "seed": seed}
        self._line(HEADER | {name: value for name, value in extras.items() if value})

    def write(self, command: Command) -> None:
        """Records the command of the next frame."""
        now = _encode(command)
        changed = {name: value for name, value in now.items() if self._last.get(name, ...) != value}
        if "style" in changed:
            before = self._last.get("style", {})
            changed["style"] = {
                part: now["style"].get(part)
                for part in {**before, **now["style"]}
                if before.get(part) != now["style"].get(part)
            }
        if command.jump:
            changed["jump"] = True
        self._silent += 1
        if changed or self._silent == FPS:
            self._line({"frame": self.frames, **changed})
            self._silent = 0
        self._last = now
        self.frames += 1

    def close(self) -> None:
        """Writes the last line. Nothing can be recorded afterwards."""
        if not self._file.closed:
            self._line({"frame": self.frames, "end": True})
            self._file.close()

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _line(self, content: dict[str, Any]) -> None:
        try:
            self._file.write(json.dumps(content) + "\n")
            self._file.flush()
        except OSError as error:  # a full disk does not say of which file
            raise type(error)(error.errno, error.strerror, str(self.path)) from error


@dataclass(frozen=True)
class Recording:
    """Recorded commands: iterating yields one a frame. `changes` holds (frame, the command from then on); stylizer is
    the name of the one that it was made with, None where it does not say; ground that of what it walks on, None for
    level floor; seed: by which the stylizer's styles were drawn, None for the one it starts with."""

    changes: tuple[tuple[int, Command], ...]
    frames: int
    stylizer: str | None = None
    ground: str | None = None
    seed: int | None = None

    def __len__(self) -> int:
        return self.frames

    def __iter__(self) -> Iterator[Command]:
        starts = [start for start, _ in self.changes]
        for (start, command), stop in zip(self.changes, [*starts[1:], self.frames], strict=True):
            for _ in range(start, stop):
                yield command

    def first(self, frames: int) -> "Recording":
        """No more than so many frames of it."""
        changes = tuple(change for change in self.changes if change[0] < frames)
        return replace(self, changes=changes, frames=min(self.frames, frames))

    @property
    def styles(self) -> tuple[str, ...]:
        """The names of the styles it asks for, each once, in the order they appear."""
        return tuple(dict.fromkeys(name for _, command in self.changes for name in command.style.names))


def read(path: str | Path) -> Recording:
    """Reads a recording. One that was cut short plays up to and with the frame of its last whole line, with a warning.

    Raises OSError for a file that cannot be read, ValueError naming the line for anything that is not a recording."""
    *lines, tail = Path(path).read_bytes().split(b"\n")
    if _is_whole(tail):
        lines.append(tail)
    frame, ended, number = -1, False, 1
    try:
        header = _header_of(lines[0] if lines else tail)
        if unknown := [name for name in header if name not in KNOWN]:
            near = get_close_matches(unknown[0], KNOWN, 1)
            hint = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(KNOWN)}"
            warnings.warn(
                f"{path}, line 1: {', '.join(map(abbreviate, unknown))} counts for nothing: {hint}", stacklevel=2
            )
        command = Command(pace=_read_pace(header.get("pace", False)))
        changes = {0: command}
        for number, line in enumerate(lines[1:], 2):  # noqa: B007 - the error message below needs it
            if not line.strip():
                continue
            if ended:
                raise ValueError("the recording ended on an earlier line; remove what follows")
            entry = _parse(line)
            frame, ended = _frame_of(entry, after=frame), _is_end(entry)
            if ended and "jump" in entry:
                raise ValueError("jump stands in the last line, in which no frame is played; give it a line of its own")
            command = replace(command, **_fields_of(entry, command))
            if not ended:
                changes[frame] = command
            if command.jump:  # pressed in this frame alone
                command = replace(command, jump=False)
                changes[frame + 1] = command
    except ValueError as error:
        raise ValueError(f"{path}, line {number}: {error}") from None
    frames = frame if ended else frame + 1
    if frames == 0:
        raise ValueError(f"{path}: the recording holds no frames")
    if not ended:
        warnings.warn(f"{path} was cut short: it plays up to its last whole line, {frames / FPS:.1f} s", stacklevel=2)
    return Recording(tuple(changes.items()), frames, header.get("stylizer"), header.get("ground"), header.get("seed"))


def _encode(command: Command) -> dict[str, Any]:
    """A whole command in the format's terms. Floats keep every bit: Python writes text that reads back the same."""
    return {
        "move": [float(v) for v in command.move],
        "face": None if command.face is None else [float(v) for v in command.face],
        "gait": command.gait,
        "style": command.style.to_json(),
        "pace": bool(command.pace),
    }


def _parse(line: bytes) -> dict[str, Any]:
    """One line as a JSON object."""
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):
        raise ValueError("this is not a line of JSON") from None
    if not isinstance(entry, dict):
        raise ValueError('a line must be an object such as {"frame": 0, "move": [0.0, 1.0]}')
    return entry


def _is_whole(line: bytes) -> bool:
    """Whether a last line without its newline is complete all the same: an object cut anywhere is no JSON."""
    try:
        _parse(line)
    except ValueError:
        return False
    return True


def _header_of(line: bytes) -> dict[str, Any]:
    """The header. Raises ValueError for a line that is none, or that names no stylizer where it should."""
    try:
        header = _parse(line)
    except ValueError:
        header = {}
    if header.get("format") != HEADER["format"]:
        raise ValueError(f"this is no recording; one starts with {json.dumps(HEADER)}")
    for name in ("version", "fps"):
        if header.get(name) != HEADER[name]:
            raise ValueError(f"{name} is {abbreviate(header.get(name))}, but only {HEADER[name]} can be played")
    for name in ("stylizer", "ground"):
        if not isinstance(value := header.get(name), str | None):
            raise ValueError(f"{name} is {abbreviate(value)}, but must be a name")
        if value is not None and not value.isprintable():
            raise ValueError(f"{name} is {abbreviate(value)}, but a name holds no such characters")
    if (seed := header.get("seed")) is not None and (type(seed) is not int or not 0 <= seed < MAX_SEED):
        raise ValueError(f"seed is {abbreviate(seed)}, but must be a whole number from 0 on")
    return header


def _frame_of(entry: dict[str, Any], after: int) -> int:
    """The frame number of a line; the line before it was at frame `after`."""
    frame = entry.get("frame")
    if type(frame) is not int or not 0 <= frame <= MAX_FRAMES:
        raise ValueError(f"frame is {abbreviate(frame)}, but must be a whole number from 0 to {MAX_FRAMES}")
    if frame <= after:
        raise ValueError(f"frame {frame} does not come after frame {after}; frames must increase from line to line")
    return frame


def _is_end(entry: dict[str, Any]) -> bool:
    if entry.get("end", True) is not True:
        raise ValueError(f"end is {abbreviate(entry['end'])}, but can only be true")
    return "end" in entry


def _fields_of(entry: dict[str, Any], command: Command) -> dict[str, Any]:
    """The command fields that a line sets, checked, with `style` merged into that of `command`."""
    result = {}
    for name, value in entry.items():
        if name in _READERS:
            result[name] = _READERS[name](value, command)
        elif name not in ("frame", "end"):
            near = get_close_matches(name, _READERS, 1)
            hint = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(_READERS)}"
            raise ValueError(f"unknown field {abbreviate(name)}: {hint}")
    return result


def _read_move(value: Any, _: Command) -> tuple[float, float]:
    move = _pair("move", value)
    check_length(value)
    length = math.hypot(*move)
    return (move[0] / length, move[1] / length) if length > 1 + LAST_BITS else move


def _read_face(value: Any, _: Command) -> tuple[float, float] | None:
    if value is None:
        return None
    face = _pair("face", value)
    if math.hypot(*face) < SMALLEST_FACE:
        raise ValueError("face is [0, 0], which is no direction; use null to face where it goes")
    return face


def _read_gait(value: Any, _: Command) -> str:
    check_gait(value)
    return value


def _read_style(value: Any, command: Command) -> StyleSpec:
    return command.style.updated(value)


def _read_pace(value: Any, _: Command | None = None) -> bool:
    return _boolean("pace", value)


def _read_jump(value: Any, _: Command) -> bool:
    return _boolean("jump", value)


_READERS: dict[str, Callable[[Any, Command], object]] = {
    "move": _read_move,
    "face": _read_face,
    "gait": _read_gait,
    "style": _read_style,
    "pace": _read_pace,
    "jump": _read_jump,
}


def _boolean(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{name} is {abbreviate(value)}, but must be true or false")
    return value


def _pair(name: str, value: Any) -> tuple[float, float]:
    """A list of two finite numbers."""
    if not (isinstance(value, list) and len(value) == 2 and all(map(is_number, value))):
        raise ValueError(f"{name} is {abbreviate(value)}, but must be two numbers [x, z]")
    return float(value[0]), float(value[1])
