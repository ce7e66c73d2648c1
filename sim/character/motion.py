"""A character's motion, whole: all its joints in each frame, at its own size, as files need it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Iterable

import numpy as np

from sim.body.pose import Pose
from sim.character.character import Character
from sim.character.fit import CharacterFit
from sim.ground.ground import Ground
from sim.math import rotations as rot
from sim.math.vectors import FLOOR, UP
from sim.motion.clip import FPS, Clip, root_frame
from sim.motion.contacts import foot_contacts

FRAME_RATES = (30, 60)  # that are written


@dataclass(frozen=True)
class CharacterMotion:
    """rotations (F, J, 4), away from the rest pose in world axes, and positions (F, J, 3), metres; roots (F, 3) on the
    ground, and their facing (F,); at `fps` frames a second."""

    character: Character
    fps: float
    rotations: np.ndarray
    positions: np.ndarray
    roots: np.ndarray
    facing: np.ndarray

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def node_rotations(self) -> np.ndarray:
        """(F, J, 4) of the joints' own axes, as the file has them, in the world."""
        character = self.character
        return rot.multiply(self.rotations, rot.multiply(character.turn, character.rig.rotations))

    @cached_property
    def local_rotations(self) -> np.ndarray:
        """(F, J, 4) of the joints' own axes in their parents'; of those without a parent in the world."""
        world, parents = self.node_rotations, self.character.rig.parents
        return np.where(parents[:, None] >= 0, rot.multiply(rot.inverse(world[:, parents]), world), world)


def fit_motion(
    character: Character,
    poses: Iterable[Pose],
    ground: Ground | None = None,
    fps: int = FPS,
    in_place: bool = False,
) -> CharacterMotion:
    """The character in poses of 60 frames a second, on the ground that they were made on. in_place: without its way
    over the floor. Raises ValueError for a frame rate that is not written, or for no pose at all."""
    if fps not in FRAME_RATES:
        raise ValueError(f"{fps:g} frames a second are not written: choose {' or '.join(map(str, FRAME_RATES))}")
    fit = CharacterFit(character)
    kept, roots, facing = [], [], []
    for frame, pose in enumerate(poses):
        fitted = fit.step(pose, ground)
        if frame % (FPS // fps) == 0:
            kept.append(fitted)
            height = 0.0 if ground is None else float(ground.smooth_height_at(pose.root_position[[0, 2]]))
            roots.append(pose.root_position * FLOOR + height * UP)
            facing.append(float(pose.root_facing))
    if not kept:
        raise ValueError("there is no frame to write")
    positions, rotations = (np.array([getattr(each, name) for each in kept]) for name in ("positions", "rotations"))
    way, yaw = np.array(roots), np.unwrap(np.array(facing))
    above = ~character.hangs
    positions[:, above] = way[:, None] + rot.rotate(rot.from_yaw(yaw)[:, None], character.rest[above])
    if in_place:
        positions -= (way * FLOOR)[:, None]
        way = way * UP
    scale = character.scale
    return CharacterMotion(character, fps, rot.make_continuous(rotations), positions * scale, way * scale, yaw)


def poses_of(clip: Clip) -> list[Pose]:
    """The poses of a clip at 60 frames a second, with its root frame, and its contacts as its feet show them."""
    root, contacts = root_frame(clip.positions()), foot_contacts(clip)
    rotations = clip.global_rotations()
    return [
        Pose(place, float(facing), hips, turns, touching, 0.0)
        for place, facing, hips, turns, touching in zip(root.positions, root.facing, clip.hips, rotations, contacts)
    ]
