"""A character's motion in files of its own skeleton: BVH and the poses file (`.npz`)."""

from typing import Sequence

import numpy as np

from sim.character.character import Character
from sim.character.fit import CharacterFit
from sim.character.motion import CharacterMotion
from sim.ground.ground import Ground
from sim.io import poses_npz
from sim.io.bvh import CENTIMETRES, Motion
from sim.io.bvh_parser import POSITION_ORDER, ROTATION_ORDER
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.session import Frame


def to_bvh(motion: CharacterMotion) -> Motion:
    """The motion from the hips on, in centimetres: its names and proportions; the zero pose is its rest pose."""
    character, rig = motion.character, motion.character.rig
    kept = np.flatnonzero(character.hangs)
    place = {joint: number for number, joint in enumerate(kept.tolist())}
    parents = [place.get(int(rig.parents[joint]), -1) for joint in kept]
    above = np.maximum(parents, 0)
    rest = character.rest[kept] * character.scale * CENTIMETRES
    offsets = np.where(np.array(parents)[:, None] >= 0, rest - rest[above], rest)
    world = motion.rotations[:, kept]
    below = rot.multiply(rot.inverse(world[:, above]), world)
    positions = np.tile(offsets, (len(motion), 1, 1))
    hips = parents.index(-1)
    below[:, hips] = world[:, hips]
    positions[:, hips] = motion.positions[:, kept[hips]] * CENTIMETRES
    channels: list[tuple[str, ...]] = [ROTATION_ORDER] * len(kept)
    channels[hips] = POSITION_ORDER + ROTATION_ORDER
    names = [rig.names[joint].replace(" ", "_") for joint in kept]
    return Motion(names, parents, offsets, {}, channels, motion.fps, positions, below)


class CharacterRows:
    """What the poses file holds of frames, in the character's skeleton: see sim.io.poses_npz.writer."""

    def __init__(self, character: Character, ground: Ground | None = None) -> None:
        self._character, self._ground = character, ground
        self._fits = {prefix: CharacterFit(character) for prefix in ("neutral_", "")}
        rig = character.rig
        self._axes = rot.multiply(character.turn, rig.rotations)  # (J, 4) of the joints in the rest pose
        self._parents = rig.parents
        rest = character.rest * character.scale
        bones = np.where(rig.parents[:, None] >= 0, rest - rest[rig.parents], rest)
        seen = rot.rotate(rot.inverse(self._axes[rig.parents]), bones)
        self.constants = {
            "fps": np.array(FPS),
            "bone_offsets": np.where(rig.parents[:, None] >= 0, seen, rest),
            "parents": rig.parents.astype(np.int64),
            "joint_names": np.array(rig.names),
        }

    def __call__(self, frames: Sequence[Frame]) -> dict[str, np.ndarray]:
        scale = self._character.scale
        arrays = poses_npz.to_arrays(frames)
        for name in ("root_position", "desired_velocity"):
            arrays[name] = arrays[name] * scale
        for prefix, poses in (
            ("neutral_", [frame.neutral for frame in frames]),
            ("", [frame.styled for frame in frames]),
        ):
            fitted = [self._fits[prefix].step(pose, self._ground) for pose in poses]
            world = rot.multiply(np.array([each.rotations for each in fitted]), self._axes)
            above = rot.multiply(rot.inverse(world[:, self._parents]), world)
            arrays[prefix + "positions"] = np.array([each.positions for each in fitted]) * scale
            arrays[prefix + "rotations"] = np.where(self._parents[:, None] >= 0, above, world)
        return arrays
