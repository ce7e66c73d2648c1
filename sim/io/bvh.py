"""BVH files: a forgiving reader, a careful writer, and the general motion they hold."""

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sim.body.skeleton import BONE_OFFSETS, JOINTS, PARENTS
from sim.io.atomic_write import atomic_write
from sim.io.bvh_parser import POSITION_ORDER, ROTATION_ORDER, read_frames, read_hierarchy
from sim.math import rotations as rot
from sim.motion.clip import Clip

CENTIMETRES = 100.0
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


def read(path: str | Path) -> Motion:
    """The motion in a BVH file: any channel order, position channels on any joint, any frame rate.

    Raises OSError if it cannot be opened and ValueError, naming file and line, if it is not a BVH file. What can be
    repaired (a wrong frame count, a last frame cut short) is, with a warning."""
    path = Path(path)
    lines = path.read_bytes().decode("utf-8-sig", errors="replace").splitlines()
    motion_line = next((i for i, line in enumerate(lines) if line.strip().upper() == "MOTION"), None)
    if motion_line is None:
        raise ValueError(f"{path} is not a whole BVH file: it has no MOTION line")
    tree = read_hierarchy(path, lines[:motion_line])
    width = sum(map(len, tree.channels))
    if not width:
        raise ValueError(f"{path}: no joint has any CHANNELS, so there is no motion to read")
    fps, values = read_frames(path, lines, motion_line + 1, width)
    offsets = np.array(tree.offsets)
    positions, rotations = _decoded(offsets, tree.channels, values)
    return Motion(tree.names, tree.parents, offsets, tree.end_sites, tree.channels, fps, positions, rotations)


def _decoded(offsets: np.ndarray, channels: list[tuple[str, ...]], values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (F, J, 3) and rotations (F, J, 4) relative to the parents, from the file's numbers (F, width)."""
    positions = np.tile(offsets, (len(values), 1, 1))
    angles = np.zeros((len(values), len(offsets), 3))  # up to three rotations a joint, in file order
    axes = np.zeros((len(offsets), 3), int)
    columns = iter(values.T)
    for joint, joint_channels in enumerate(channels):
        slot = 0
        for channel, column in zip(joint_channels, columns):
            axis = "XYZ".index(channel[0])
            if channel in POSITION_ORDER:
                positions[:, joint, axis] = column
            else:
                angles[:, joint, slot], axes[joint, slot] = column, axis
                slot += 1
    rotations = rot.IDENTITY
    for slot in range(3):  # file order is intrinsic: each rotation acts inside the one before
        about = np.broadcast_to(np.eye(3)[axes[:, slot]], positions.shape)
        rotations = rot.multiply(rotations, rot.from_axis_angle(about, np.radians(angles[..., slot])))
    return positions, rotations


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

    Raises OSError if the folder cannot be written, ValueError for a joint with one or two rotation channels."""
    motion = from_clip(motion) if isinstance(motion, Clip) else motion
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
    columns = []
    for joint, channels in enumerate(motion.channels):
        order = "".join(channel[0] for channel in channels if channel in ROTATION_ORDER)
        if len(order) not in (0, 3):
            raise ValueError(
                f"joint '{motion.names[joint]}' cannot be written: it has {len(order)} rotation channels, "
                "not three or none"
            )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # gimbal lock: scipy warns, the angles it gives are right
            turns = rot.to_euler(order, motion.rotations[:, joint]) if order else np.empty((len(motion), 0))
            angles = np.unwrap(turns, axis=0, period=360.0)
        for channel in channels:
            if channel in POSITION_ORDER:
                columns.append(motion.positions[:, joint, "XYZ".index(channel[0])])
            else:
                columns.append(angles[:, order.index(channel[0])])
    template = " ".join(["%.6f"] * len(columns))
    return [template % tuple(row) for row in np.stack(columns, axis=1).tolist()]
