"""One frame of the character, as it travels from the controller to the screen."""

import math
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from typing import Any, Sequence

import numpy as np

from sim.body.kinematics import forward_kinematics, to_local
from sim.body.skeleton import JOINT_COUNT
from sim.math import rotations as rot

# The fields of one pose, in their order, and their shapes.
SHAPES = {
    "root_position": (3,),
    "root_facing": (),
    "hips": (3,),
    "rotations": (JOINT_COUNT, 4),
    "contacts": (4,),
    "phase": (),
}
_ENDS = np.cumsum([0, *(math.prod(shape) for shape in SHAPES.values())]).tolist()
PLACES = {name: slice(*ends) for name, ends in zip(SHAPES, pairwise(_ENDS))}  # of each field in `Pose.flat`
FLAT_SIZE = _ENDS[-1]


@dataclass(frozen=True)
class Pose:
    """The whole body at one instant, in world axes; with a leading axis on every field, many instants at once.

    root_position: (3,) metres on the floor; root_facing: yaw in radians (the character's own ground frame).
    hips: (3,) metres, the Hips joint. rotations: (21, 4) global quaternions (w, x, y, z).
    contacts: (4,) 0..1 for left foot, left toe, right foot, right toe. phase: radians in 0 .. 2 pi.
    """

    root_position: np.ndarray
    root_facing: np.ndarray | float
    hips: np.ndarray
    rotations: np.ndarray
    contacts: np.ndarray
    phase: np.ndarray | float

    @classmethod
    def stacked(cls, poses: Sequence["Pose"]) -> "Pose":
        """Many instants, or many characters in one, as one pose with a leading axis."""
        return cls(*(np.array([getattr(pose, field.name) for pose in poses]) for field in fields(cls)))

    def __getitem__(self, which: Any) -> "Pose":
        """One or some of many instants."""
        return Pose(*(getattr(self, field.name)[which] for field in fields(self)))

    @classmethod
    def of_flat(cls, numbers: np.ndarray) -> "Pose":
        """The pose that has these numbers (..., FLAT_SIZE)."""
        leading = numbers.shape[:-1]
        return cls(**{name: numbers[..., PLACES[name]].reshape((*leading, *shape)) for name, shape in SHAPES.items()})

    @property
    def flat(self) -> np.ndarray:
        """(..., FLAT_SIZE) all its numbers, field by field."""
        leading = self.contacts.shape[:-1]
        return np.concatenate([np.asarray(getattr(self, name)).reshape((*leading, -1)) for name in SHAPES], axis=-1)

    @cached_property
    def positions(self) -> np.ndarray:
        """(21, 3) world metres by forward kinematics: bones always keep their length."""
        return forward_kinematics(self.hips, self.rotations)

    @property
    def local_rotations(self) -> np.ndarray:
        """(21, 4) rotations relative to the parent."""
        return to_local(self.rotations)

    def is_finite(self) -> bool:
        """Whether every number of the body and of its root is finite."""
        numbers = (self.root_position, self.root_facing, self.hips, self.rotations)
        return all(bool(np.isfinite(each).all()) for each in numbers)

    def with_body(self, hips: np.ndarray, rotations: np.ndarray) -> "Pose":
        """The same instant and way with another body posture."""
        return Pose(self.root_position, self.root_facing, hips, rotations, self.contacts, self.phase)

    def to_character(self, vectors: np.ndarray) -> np.ndarray:
        """World vectors (..., n, 3) in the character's own facing."""
        return vectors @ self.axes

    def to_world(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (..., n, 3) in the character's own facing, in world axes."""
        return vectors @ self.axes.swapaxes(-1, -2)

    @cached_property
    def axes(self) -> np.ndarray:
        """(3, 3), in its columns the character's left, up and forward: world vectors times this are its own."""
        return rot.to_matrix(rot.from_yaw(self.root_facing))
