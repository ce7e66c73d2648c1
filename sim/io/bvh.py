"""BVH files: a forgiving reader, a careful writer, and the general motion they hold."""

import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sim.body.skeleton import BONE_OFFSETS, JOINTS, PARENTS
from sim.io.atomic_write import atomic_write
from sim.io.bvh_parser import FRAME_RATES, POSITION_ORDER, ROTATION_ORDER, read_frames, read_hierarchy
from sim.io.checks import check_finite, count_names
from sim.io.text_files import read_text
from sim.math import euler
from sim.math import rotations as rot
from sim.motion.clip import Clip

CENTIMETRES = 100.0
SAME_ROTATION = 1e-8  # of a quaternion's numbers: a millionth of a degree, the last that is written
MOSTLY_SAME = 0.5  # share of the frames: a joint that still turns as in the file was not restyled
LOST_ANGLE = 1.0  # degrees that a joint without channels for them turns, over which that is said
MAX_MEGABYTES = 128  # of one file: more than half an hour of a hundred joints
END_SITES = {
    "LeftToe": (0.0, 0.0, 0.07),
    "RightToe": (0.0, 0.0, 0.07),
    "Head": (0.0, 0.18, 0.0),
    "LeftHand": (0.15, 0.0, 0.0),
    "RightHand": (-0.15, 0.0, 0.0),
}  # metres, only for other programs to draw


@dataclass
class Motion:
    """A motion on any skeleton, in the file's own length unit and axes.

    names (J), parents (J; -1 for a root), offsets (J, 3), end_sites {joint: offset (3,)}, channels (J) in file order.
    Relative to the parent: rotations (F, J, 4) and positions (F, J, 3), which are the offset unless position channels
    replace it. angles (F, J, 3): the file's own degrees of each rotation channel, which are written again where the
    rotations are still the same; None for a motion of no file."""

    names: list[str]
    parents: list[int]
    offsets: np.ndarray
    end_sites: dict[int, np.ndarray]
    channels: list[tuple[str, ...]]
    fps: float
    positions: np.ndarray
    rotations: np.ndarray
    angles: np.ndarray | None = None

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


def read(path: str | Path, fps: float | None = None) -> Motion:
    """The motion in a BVH file: any channel order, position channels on any joint, any frame rate.

    fps: frames a second, believed in place of the file's own. Raises OSError if it cannot be opened and ValueError,
    naming file and line, if it is not a BVH file or asks for more than a motion can. What can be repaired (a wrong
    frame count, a last frame cut short, a frame time in milliseconds) is, with a warning."""
    path = Path(path)
    check_fps(fps)
    lines = read_text(path, MAX_MEGABYTES).splitlines()
    motion_line = next((i for i, line in enumerate(lines) if line.strip().upper() == "MOTION"), None)
    if motion_line is None:
        raise ValueError(f"{path} is not a whole BVH file: it has no MOTION line")
    tree = read_hierarchy(path, lines[:motion_line])
    owned = np.array(tree.owners) >= 0
    if not owned.any():
        raise ValueError(f"{path}: no joint has any CHANNELS, so there is no motion to read")
    fps, values = read_frames(path, lines, motion_line + 1, len(owned), fps)
    values = values[:, owned]
    offsets = np.array(tree.offsets)
    positions, angles = _columns(offsets, tree.channels, values)
    rotations = _rotations(tree.channels, angles)
    return Motion(tree.names, tree.parents, offsets, tree.end_sites, tree.channels, fps, positions, rotations, angles)


def check_fps(fps: float | None) -> None:
    """Raises ValueError for a frame rate, other than None, that no motion has."""
    if fps is not None and not FRAME_RATES[0] <= fps <= FRAME_RATES[1]:
        raise ValueError(f"{fps:g} is no frame rate: give one from {FRAME_RATES[0]:g} to {FRAME_RATES[1]:g} a second")


def _columns(offsets: np.ndarray, channels: list[tuple[str, ...]], values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (F, J, 3) relative to the parents, and degrees (F, J, 3) in file order, from the file's numbers (F,
    width)."""
    positions = np.tile(offsets, (len(values), 1, 1))
    angles = np.zeros(positions.shape)
    columns = iter(values.T)
    for joint, joint_channels in enumerate(channels):
        slot = 0
        for channel, column in zip(joint_channels, columns):
            if channel in POSITION_ORDER:
                positions[:, joint, "XYZ".index(channel[0])] = column
            else:
                angles[:, joint, slot] = column
                slot += 1
    return positions, angles


def _rotations(channels: list[tuple[str, ...]], angles: np.ndarray) -> np.ndarray:
    """Rotations (F, J, 4) relative to the parents, from degrees (F, J, 3) in file order."""
    axes = np.zeros(angles.shape[1:], int)
    for joint, joint_channels in enumerate(channels):
        order = rotation_order(joint_channels)
        axes[joint, : len(order)] = ["XYZ".index(axis) for axis in order]
    rotations = rot.IDENTITY
    for slot in range(3):  # file order is intrinsic: each rotation acts inside the one before
        about = np.broadcast_to(np.eye(3)[axes[:, slot]], angles.shape)
        rotations = rot.multiply(rotations, rot.from_axis_angle(about, np.radians(angles[..., slot])))
    return rotations


def rotation_order(channels: tuple[str, ...]) -> str:
    """The axes that a joint's channels turn it about, such as `ZXY`."""
    return "".join(channel[0] for channel in channels if channel in ROTATION_ORDER)


def from_clip(clip: Clip) -> Motion:
    """A clip as a motion in centimetres: our 21 joints, position channels on the root only."""
    positions = np.tile(BONE_OFFSETS, (len(clip), 1, 1))
    positions[:, 0] = clip.hips
    end_sites = {JOINTS.index(name): CENTIMETRES * np.array(offset) for name, offset in END_SITES.items()}
    channels: list[tuple[str, ...]] = [POSITION_ORDER + ROTATION_ORDER] + [ROTATION_ORDER] * (len(JOINTS) - 1)
    return Motion(
        list(JOINTS),
        PARENTS.tolist(),
        CENTIMETRES * BONE_OFFSETS,
        end_sites,
        channels,
        clip.fps,
        CENTIMETRES * positions,
        clip.rotations,
    )


def write(path: str | Path, motion: Motion | Clip) -> None:
    """Writes a BVH file, whole or not at all.

    Angles run on from frame to frame. Where a joint has fewer than three rotation channels, what turns it about other
    axes is left out, with a warning. Raises OSError if the folder cannot be written, ValueError for a motion that is
    not finite."""
    motion = _depth_first(from_clip(motion) if isinstance(motion, Clip) else motion)
    check_finite(path, motion.offsets, motion.positions, motion.rotations)
    text = "\n".join(
        [
            "HIERARCHY",
            *_hierarchy_lines(motion),
            "MOTION",
            f"Frames: {len(motion)}",
            f"Frame Time: {1.0 / motion.fps:.8f}",
            *_frame_lines(motion),
            "",
        ]
    )
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _depth_first(motion: Motion) -> Motion:
    """The same motion with its joints in the order that a BVH file has them: each followed by all that hang on it."""
    order: list[int] = []
    waiting = [joint for joint, parent in enumerate(motion.parents) if parent < 0][::-1]
    while waiting:
        order.append(waiting.pop())
        waiting += [joint for joint, parent in enumerate(motion.parents) if parent == order[-1]][::-1]
    if order == sorted(order):
        return motion
    place = {joint: number for number, joint in enumerate(order)}
    return replace(
        motion,
        names=[motion.names[joint] for joint in order],
        parents=[place.get(motion.parents[joint], -1) for joint in order],
        offsets=motion.offsets[order],
        end_sites={place[joint]: end for joint, end in motion.end_sites.items()},
        channels=[motion.channels[joint] for joint in order],
        positions=motion.positions[:, order],
        rotations=motion.rotations[:, order],
        angles=None if motion.angles is None else motion.angles[:, order],
    )


def _hierarchy_lines(motion: Motion) -> list[str]:
    children = [[j for j, parent in enumerate(motion.parents) if parent == joint] for joint in range(len(motion.names))]

    def offset_line(indent: str, offset: np.ndarray) -> str:
        return f"{indent}OFFSET {offset[0]:.6f} {offset[1]:.6f} {offset[2]:.6f}"

    def block(joint: int, indent: str) -> list[str]:
        inner = indent + "\t"
        lines = [
            f"{indent}{'ROOT' if motion.parents[joint] < 0 else 'JOINT'} {motion.names[joint]}",
            indent + "{",
            offset_line(inner, motion.offsets[joint]),
            f"{inner}CHANNELS {len(motion.channels[joint])} {' '.join(motion.channels[joint])}".rstrip(),
        ]
        for child in children[joint]:
            lines += block(child, inner)
        if joint in motion.end_sites or not children[joint]:
            end = motion.end_sites.get(joint, np.zeros(3))
            lines += [inner + "End Site", inner + "{", offset_line(inner + "\t", end), inner + "}"]
        return lines + [indent + "}"]

    return [line for joint, parent in enumerate(motion.parents) if parent < 0 for line in block(joint, "")]


def _frame_lines(motion: Motion) -> list[str]:
    angles = _angles_of(motion)
    columns, lacking = [], []
    for joint, channels in enumerate(motion.channels):
        turns = iter(angles[:, joint].T)
        for channel in channels:
            turn = channel in ROTATION_ORDER
            columns.append(next(turns) if turn else motion.positions[:, joint, "XYZ".index(channel[0])])
        if 0 < len(rotation_order(channels)) and any(np.abs(left).max() > LOST_ANGLE for left in turns):
            lacking.append(motion.names[joint])
    if lacking:
        warnings.warn(
            f"{count_names(lacking)} cannot turn every way in this file: what turns about axes without a channel is "
            "left out",
            stacklevel=3,
        )
    template = " ".join(["%.6f"] * len(columns))
    return [template % tuple(row) for row in np.stack(columns, axis=1).tolist()]


def _angles_of(motion: Motion) -> np.ndarray:
    """Degrees (F, J, 3) about the axes of each joint's channels, and about those that it has no channels for: the
    file's own where a joint turns as it did there, mostly, and else what runs on from the first."""
    own = motion.angles
    same = np.zeros(motion.rotations.shape[:2], bool)
    if own is not None:
        before = _rotations(motion.channels, own)
        apart = np.minimum(np.abs(before - motion.rotations), np.abs(before + motion.rotations))
        same = apart.max(axis=-1) < SAME_ROTATION
        same &= same.mean(axis=0) > MOSTLY_SAME
    result = np.zeros((*same.shape, 3)) if own is None else np.where(same[..., None], own, 0.0)
    for joint in np.flatnonzero(~same.all(axis=0)):
        order = euler.complete(rotation_order(motion.channels[joint]))
        angles = euler.continuous(order, motion.rotations[:, joint], None if own is None else own[0, joint])
        result[:, joint] = np.where(same[:, joint, None], result[:, joint], angles)
    return result
