"""A model as the page loads it: skins, the pose that they are made in, a picture; and the bones of a user's character
that a packet carries."""

import io
import json
import struct
from functools import cache

import numpy as np
from PIL import Image

from demo.figure.forms import BIND
from demo.figure.skin import Model, Skin, own_model
from sim.body.skeleton import JOINT_COUNT
from sim.character.character import Character
from sim.character.fit import Fitted
from sim.math import rotations as rot

MOST_BONES = 72  # that the page's shader holds: three vectors each of the 256 that WebGL promises
UNIT = 32767  # of a quaternion's share that is 1
PLACE = 1e-4  # metres, of a bone's place beside the root
BONE = np.dtype([("rotation", "<i2", 4), ("place", "<i2", 3)])


@cache
def own_figure() -> bytes:
    """The figure's own model."""
    return pack_model(own_model(), np.concatenate([BIND.positions, BIND.rotations], axis=1), np.arange(JOINT_COUNT))


class Bones:
    """The bones of a character: of all joints that follow ours in the same way, as those of a hand, one."""

    def __init__(self, character: Character) -> None:
        rows = np.column_stack([character.owners, character.shares])
        _, self._first, of_joint = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        self._of_joint = of_joint.ravel()
        self._rest = character.rest[self._first]
        self.name = character.name
        if len(self._first) > MOST_BONES:
            raise ValueError(f"{self.name} has {len(self._first)} bones that move: a page draws {MOST_BONES} at most")

    def model(self, model: Model) -> bytes:
        """The character's model for the page."""
        still = np.tile(rot.IDENTITY, (len(self._rest), 1))
        return pack_model(model, np.concatenate([self._rest, still], axis=1), self._of_joint)

    def packed(self, fitted: Fitted, root: np.ndarray) -> bytes:
        """The bones of a pose: rotations away from the rest pose, and places beside the root."""
        record = np.zeros(len(self._first), BONE)
        record["rotation"] = np.round(fitted.rotations[self._first] * UNIT)
        places = np.round((fitted.positions[self._first] - root.astype(np.float32)) / PLACE)
        record["place"] = np.clip(places, -UNIT, UNIT)
        return record.tobytes()


def pack_model(model: Model, bind: np.ndarray, bone_of: np.ndarray) -> bytes:
    """A JSON line that says what lies where, and then the numbers: of each skin float32 and uint32, of the bones where
    they are in the pose that the skins are made in (bones, 7), places and rotations; a picture as PNG.

    bone_of: (joints,) the bone that each joint of the skins follows."""
    head: dict[str, dict[str, list[int]]] = {}
    block = bytearray()

    def add(part: str, name: str, values: np.ndarray) -> None:
        head.setdefault(part, {})[name] = [len(block), values.size]
        block.extend(np.ascontiguousarray(values).tobytes())

    for level, skin in (("fine", model.fine), ("coarse", model.coarse)):
        for name, values in _arrays(skin, bone_of).items():
            add(level, name, values)
    add("bind", "bones", bind.astype(np.float32))
    if model.picture is not None:
        file = io.BytesIO()
        Image.fromarray(model.picture).save(file, "PNG", compress_level=1)
        add("picture", "png", np.frombuffer(file.getvalue(), np.uint8))
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<I", len(text)) + text + bytes(block)


def _arrays(skin: Skin, bone_of: np.ndarray) -> dict[str, np.ndarray]:
    """Four bones a corner: a skin with more keeps its strongest."""
    strongest = np.argsort(-skin.weights, axis=1)[:, :4]
    weights = np.take_along_axis(skin.weights, strongest, axis=1)
    joints = bone_of[np.take_along_axis(skin.joints, strongest, axis=1)]
    short = ((0, 0), (0, 4 - weights.shape[1]))
    return {
        "position": skin.positions.astype(np.float32),
        "normal": skin.normals.astype(np.float32),
        "joints": np.pad(joints, short).astype(np.float32),
        "weights": np.pad(weights / weights.sum(axis=1, keepdims=True), short).astype(np.float32),
        "material": skin.materials.astype(np.float32),
        "triangles": skin.triangles.astype(np.uint32),
    }
