"""BVH files: a forgiving reader, a careful writer, and the general motion they hold."""

import os
import re
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sim import rotations as rot
from sim.clip import Clip
from sim.skeleton import BONE_OFFSETS, JOINTS, PARENTS

ROTATION_ORDER = ("Zrotation", "Xrotation", "Yrotation")
POSITION_ORDER = ("Xposition", "Yposition", "Zposition")
CENTIMETRES = 100.0
END_SITES = {"LeftToe": (0.0, 0.0, 0.07), "RightToe": (0.0, 0.0, 0.07), "Head": (0.0, 0.18, 0.0),
             "LeftHand": (0.15, 0.0, 0.0), "RightHand": (-0.15, 0.0, 0.0)}  # metres, only for other programs to draw


@dataclass
class Motion:
    """A motion on any skeleton, in the file's own length unit and axes.

    names (J), parents (J; -1 for a root), offsets (J, 3), end_sites {joint: offset (3,)}, channels (J) in file order.
    Relative to the parent: rotations (F, J, 4) and positions (F, J, 3), which are the offset unless position channels
    replace it."""

    names: list[str]
    parents: list[int]
    offsets: np.ndarray
    end_sites: dict[int, np.ndarray]
    channels: list[tuple[str, ...]]
    fps: float
    positions: np.ndarray
    rotations: np.ndarray

    def __len__(self) -> int:
        return len(self.positions)

    def global_transforms(self) -> tuple[np.ndarray, np.ndarray]:
        """World positions (F, J, 3) and rotations (F, J, 4)."""
        positions, rotations = self.positions.copy(), self.rotations.copy()
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                positions[:, joint] = positions[:, parent] + rot.rotate(rotations[:, parent], self.positions[:, joint])
                rotations[:, joint] = rot.multiply(rotations[:, parent], self.rotations[:, joint])
        return positions, rotations


def read(path) -> Motion:
    """The motion in a BVH file: any channel order, position channels on any joint, any frame rate.

    Raises OSError if it cannot be opened and ValueError, naming file and line, if it is not a BVH file. What can be
    repaired (a wrong frame count, a last frame cut short) is, with a warning."""
    path = Path(path)
    lines = path.read_bytes().decode("utf-8-sig", errors="replace").splitlines()
    motion_line = next((i for i, line in enumerate(lines) if line.strip().upper() == "MOTION"), None)
    if motion_line is None:
        raise ValueError(f"{path} is not a whole BVH file: it has no MOTION line")
    names, parents, offsets, end_sites, channels = _read_hierarchy(path, lines[:motion_line])
    width = sum(map(len, channels))
    if not width:
        raise ValueError(f"{path}: no joint has any CHANNELS, so there is no motion to read")
    fps, values = _read_frames(path, lines, motion_line + 1, width)

    offsets = np.array(offsets)
    positions = np.tile(offsets, (len(values), 1, 1))
    angles = np.zeros((len(values), len(names), 3))  # up to three rotations a joint, in file order
    axes = np.zeros((len(names), 3), int)
    column = 0
    for joint, joint_channels in enumerate(channels):
        slot = 0
        for channel in joint_channels:
            axis = "XYZ".index(channel[0])
            if channel.endswith("position"):
                positions[:, joint, axis] = values[:, column]
            else:
                angles[:, joint, slot], axes[joint, slot] = values[:, column], axis
                slot += 1
            column += 1
    rotations = rot.IDENTITY
    for slot in range(3):  # file order is intrinsic: each rotation acts inside the one before
        axis = np.broadcast_to(np.eye(3)[axes[:, slot]], positions.shape)
        turn = rot.from_axis_angle(axis, np.radians(angles[..., slot]))
        rotations = rot.multiply(rotations, turn)
    return Motion(names, parents, offsets, end_sites, channels, fps, positions, rotations)


def _read_hierarchy(path: Path, lines: list[str]):
    """Names, parents, offsets, end sites and channels from the lines above MOTION."""
    names, parents, offsets, end_sites, channels = [], [], [], {}, []
    open_joints, newest, in_end_site = [], -1, False

    def fail(number: int, what: str):
        raise ValueError(f"{path}, line {number}: {what}")

    for number, line in enumerate(lines, 1):
        for statement in filter(None, map(str.strip, re.split(r"([{}])", line))):
            keyword, *words = statement.split()
            match keyword.upper():
                case "HIERARCHY":
                    pass
                case "ROOT" | "JOINT":
                    newest, in_end_site = len(names), False
                    names.append(" ".join(words) or f"joint{newest}")
                    parents.append(open_joints[-1] if open_joints and keyword.upper() == "JOINT" else -1)
                    offsets.append(np.zeros(3))
                    channels.append(())
                case "END":
                    in_end_site = True
                case "{":
                    if newest < 0:
                        fail(number, "a '{' comes before any ROOT")
                    open_joints.append(newest)
                case "}":
                    if not open_joints:
                        fail(number, "a '}' closes nothing")
                    newest, in_end_site = open_joints.pop(), False
                case "OFFSET":
                    offset = _numbers(words)
                    if newest < 0 or offset is None or len(offset) != 3:
                        fail(number, "OFFSET needs three numbers inside a joint")
                    if in_end_site:
                        end_sites[newest] = offset
                    else:
                        offsets[newest] = offset
                case "CHANNELS":
                    parsed = tuple(word[:1].upper() + word[1:].lower() for word in words[1:])
                    known = all(channel in POSITION_ORDER + ROTATION_ORDER for channel in parsed)
                    if newest < 0 or words[:1] != [str(len(parsed))] or not known:
                        fail(number, "CHANNELS needs its count and that many of Xposition ... Zrotation")
                    if sum(c in ROTATION_ORDER for c in parsed) > 3:
                        fail(number, "a joint may have at most three rotation channels")
                    channels[newest] = parsed
                case _:
                    fail(number, f"'{keyword}' is not a BVH keyword")
    if not names:
        raise ValueError(f"{path} is not a BVH file: it has no ROOT")
    if open_joints:
        fail(len(lines), f"{len(open_joints)} '{{' are never closed")
    return names, parents, offsets, end_sites, channels


def _read_frames(path: Path, lines: list[str], start: int, width: int) -> tuple[float, np.ndarray]:
    """Frames a second and the values (F, width) below MOTION, which stands on line `start` (counted from 1)."""
    declared, seconds, first = None, None, start
    for first in range(start, len(lines)):
        key, colon, value = lines[first].partition(":")
        if colon:
            number = _numbers(value.split())
            if number is None or len(number) != 1:
                raise ValueError(f"{path}, line {first + 1}: '{key.strip()}:' needs one number")
            if key.strip().lower() == "frames":
                declared = int(number[0])
            else:
                seconds = number[0]
        elif lines[first].strip():
            break
    else:
        first = len(lines)
    if not seconds or seconds < 0:
        raise ValueError(f"{path}, line {min(first, start) + 1}: a 'Frame Time:' above zero is missing")

    rows = [(number, line) for number, line in enumerate(lines[first:], first + 1) if line.strip()]
    counts = np.array([len(line.split()) for _, line in rows], int)
    odd = np.flatnonzero(counts != width)
    wrapped = len(rows) != declared and counts.sum() == (declared or 0) * width  # frames broken over several lines
    if len(odd) and not wrapped:
        if odd[0] < len(rows) - 1 or counts[-1] > width:
            raise ValueError(f"{path}, line {rows[odd[0]][0]}: {counts[odd[0]]} numbers where each frame has {width}")
        warnings.warn(f"{path}: the last frame is cut short and was left out", stacklevel=3)
        rows, declared = rows[:-1], None
    values = _numbers([line for _, line in rows])
    if values is None or not np.isfinite(values).all():
        number = next(n for n, line in rows if (v := _numbers([line])) is None or not np.isfinite(v).all())
        raise ValueError(f"{path}, line {number}: a frame holds something that is not a number")
    values = values.reshape(-1, width)
    if not len(values):
        raise ValueError(f"{path} holds no frames")
    if declared not in (None, len(values)):
        warnings.warn(f"{path}: {declared} frames announced, {len(values)} found and used", stacklevel=3)
    fps = 1.0 / seconds
    return (round(fps) if abs(fps - round(fps)) < 2e-4 * fps else fps), values


def _numbers(words: list[str]) -> np.ndarray | None:
    """The numbers in whitespace-separated text, None if anything else is there."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # the parser warns where it stops early
        try:
            return np.fromstring(" ".join(words), sep=" ") if words else np.empty(0)
        except (ValueError, DeprecationWarning):
            return None


def from_clip(clip: Clip) -> Motion:
    """A clip as a motion in centimetres: our 21 joints, position channels on the root only."""
    positions = np.tile(BONE_OFFSETS, (len(clip), 1, 1))
    positions[:, 0] = clip.hips
    end_sites = {JOINTS.index(name): CENTIMETRES * np.array(offset) for name, offset in END_SITES.items()}
    channels = [POSITION_ORDER + ROTATION_ORDER] + [ROTATION_ORDER] * (len(JOINTS) - 1)
    return Motion(list(JOINTS), PARENTS.tolist(), CENTIMETRES * BONE_OFFSETS, end_sites, channels, clip.fps,
                  CENTIMETRES * positions, clip.rotations)


def write(path, motion: Motion | Clip) -> None:
    """Writes a BVH file. It appears whole or not at all: the text goes to a temporary file that is then renamed.

    Raises OSError if the folder cannot be written, ValueError for a joint with one or two rotation channels."""
    motion = from_clip(motion) if isinstance(motion, Clip) else motion
    path = Path(path)
    text = "\n".join(["HIERARCHY", *_hierarchy_lines(motion), "MOTION", f"Frames: {len(motion)}",
                      f"Frame Time: {1.0 / motion.fps:.8f}", *_frame_lines(motion), ""])
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(temporary, 0o644)  # mkstemp makes files that only their owner may read
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def _hierarchy_lines(motion: Motion) -> list[str]:
    children = [[j for j, parent in enumerate(motion.parents) if parent == joint] for joint in range(len(motion.names))]

    def offset_line(indent: str, offset: np.ndarray) -> str:
        return f"{indent}OFFSET {offset[0]:.6f} {offset[1]:.6f} {offset[2]:.6f}"

    def block(joint: int, indent: str) -> list[str]:
        inner = indent + "\t"
        lines = [f"{indent}{'ROOT' if motion.parents[joint] < 0 else 'JOINT'} {motion.names[joint]}", indent + "{",
                 offset_line(inner, motion.offsets[joint]),
                 f"{inner}CHANNELS {len(motion.channels[joint])} {' '.join(motion.channels[joint])}".rstrip()]
        for child in children[joint]:
            lines += block(child, inner)
        if joint in motion.end_sites or not children[joint]:
            end = motion.end_sites.get(joint, np.zeros(3))
            lines += [inner + "End Site", inner + "{", offset_line(inner + "\t", end), inner + "}"]
        return lines + [indent + "}"]

    return [line for joint, parent in enumerate(motion.parents) if parent < 0 for line in block(joint, "")]


def _frame_lines(motion: Motion) -> list[str]:
    columns = []
    for joint, channels in enumerate(motion.channels):
        order = "".join(channel[0] for channel in channels if channel in ROTATION_ORDER)
        if len(order) not in (0, 3):
            raise ValueError(f"joint '{motion.names[joint]}' cannot be written: it has {len(order)} rotation channels, "
                             "not three or none")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # gimbal lock: scipy warns, the angles it gives are right
            angles = np.unwrap(rot.to_euler(order, motion.rotations[:, joint]), axis=0, period=360.0) if order else None
        for channel in channels:
            if channel in POSITION_ORDER:
                columns.append(motion.positions[:, joint, "XYZ".index(channel[0])])
            else:
                columns.append(angles[:, order.index(channel[0])])
    template = " ".join(["%.6f"] * len(columns))
    return [template % tuple(row) for row in np.stack(columns, axis=1).tolist()]
