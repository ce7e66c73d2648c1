"""glTF 2.0 binary files (.glb): the figure as one skinned mesh on its skeleton, with one animation, and the ground.

glTF's axes and units are ours (Y up, right-handed, the front is +Z, metres), so nothing is converted but the order of
quaternions. Written by hand because it is little: a JSON text and one block of numbers."""

import json
import struct
from pathlib import Path

import numpy as np

from demo.figure import body
from demo.figure.skin import Skin, make_skin
from sim.body.kinematics import to_local
from sim.body.skeleton import BONE_OFFSETS, JOINTS, PARENTS, PART_OF_JOINT
from sim.ground.ground import Ground
from sim.io.atomic_write import atomic_write
from sim.io.checks import check_finite
from sim.math import rotations as rot
from sim.motion.clip import Clip

SKIN_CELL = 0.020  # metres, as in the window
SHADED = 0.45  # share of light that reaches the deepest folds
GLOVES = 0.66  # how much darker gloves and shoes are than their part
VISOR_SHARPNESS, VISOR_COLOUR = np.array([15.0, 34.0, 15.0]), np.array([0.006, 0.008, 0.013])
GROUND_MARGIN = 2.0  # metres of uneven ground beyond where the hips go
GROUND_CELLS = 256  # of a side of it at most
COMPONENTS = {np.dtype(np.float32): 5126, np.dtype(np.uint8): 5121, np.dtype(np.uint32): 5125}
TYPES = {(): "SCALAR", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
VERTICES, INDICES = 34962, 34963  # what a buffer view feeds
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"


def write(path: str | Path, clip: Clip, part_colours: np.ndarray, ground: Ground | None = None) -> None:
    """Writes the clip as a .glb, the figure in display colours (5, 3) of the body parts, with the uneven ground under
    it, if there is one. Raises OSError, and ValueError for a clip that is not finite."""
    check_finite(path, clip.hips, clip.rotations)
    with atomic_write(path) as temporary:
        temporary.write_bytes(encode(clip, part_colours, ground))


def encode(clip: Clip, part_colours: np.ndarray, ground: Ground | None = None) -> bytes:
    """The bytes of a .glb file: JSON chunk, binary chunk (glTF 2.0, Sec. 4.4)."""
    numbers = _Numbers()
    document: dict = {
        "asset": {"version": "2.0", "generator": "Patchwalk"},
        "scene": 0,
        "scenes": [{"nodes": [0, len(JOINTS)]}],  # a skinned mesh is placed by its joints alone, so it hangs on none
        "nodes": [*_joint_nodes(), {"name": "Figure", "mesh": 0, "skin": 0}],
        "skins": [
            {
                "name": "Skeleton",
                "skeleton": 0,
                "joints": list(range(len(JOINTS))),
                "inverseBindMatrices": numbers.add(_inverse_bind_matrices()),
            }
        ],
        "materials": [{"name": "Figure", "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.8}}],
        "meshes": [{"name": "Figure", "primitives": [_primitive(numbers, part_colours)]}],
        "animations": [_animation(numbers, clip)],
    }
    if ground is not None:
        document["scenes"][0]["nodes"].append(len(document["nodes"]))
        document["nodes"].append({"name": "Ground", "mesh": len(document["meshes"])})
        document["meshes"].append(_ground_mesh(numbers, ground, clip.hips))
    document |= {
        "accessors": numbers.accessors,
        "bufferViews": numbers.views,
        "buffers": [{"byteLength": len(numbers.block)}],
    }
    chunks = _chunk(JSON_CHUNK, json.dumps(document).encode(), b" ") + _chunk(BINARY_CHUNK, bytes(numbers.block), b"\0")
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _chunk(kind: bytes, data: bytes, filler: bytes) -> bytes:
    data += filler * (-len(data) % 4)
    return struct.pack("<I4s", len(data), kind) + data


class _Numbers:
    """The binary block, and the accessors and views that say what lies where in it."""

    def __init__(self) -> None:
        self.block = bytearray()
        self.views: list[dict] = []
        self.accessors: list[dict] = []

    def add(self, values: np.ndarray, target: int | None = None, bounds: bool = False) -> int:
        """Appends (n, ...) numbers and gives their accessor; floats become single precision.

        target: VERTICES or INDICES for a mesh. bounds: with the least and greatest value."""
        values = np.ascontiguousarray(values, np.float32 if values.dtype.kind == "f" else values.dtype)
        self.views.append(
            {"buffer": 0, "byteOffset": len(self.block), "byteLength": values.nbytes}
            | ({"target": target} if target else {})
        )
        self.accessors.append(
            {
                "bufferView": len(self.views) - 1,
                "componentType": COMPONENTS[values.dtype],
                "count": len(values),
                "type": TYPES[values.shape[1:]],
            }
        )
        if bounds:
            ends = {"min": values.min(axis=0), "max": values.max(axis=0)}
            self.accessors[-1] |= {name: np.atleast_1d(end).tolist() for name, end in ends.items()}
        self.block += values.tobytes()
        self.block += bytes(-len(self.block) % 4)
        return len(self.accessors) - 1


def _joint_nodes() -> list[dict]:
    """The skeleton in the pose its skin was made in."""
    rotations = _xyzw(to_local(body.BIND.rotations)).tolist()
    nodes = [
        {"name": name, "translation": offset.tolist(), "rotation": rotation}
        for name, offset, rotation in zip(JOINTS, BONE_OFFSETS, rotations, strict=True)
    ]
    nodes[0]["translation"] = body.BIND.hips.tolist()
    for joint, parent in enumerate(PARENTS[1:], 1):
        nodes[parent].setdefault("children", []).append(joint)
    return nodes


def _inverse_bind_matrices() -> np.ndarray:
    """(21, 4, 4) from the world to each joint in the bind pose, column by column as glTF wants."""
    inverse = rot.inverse(body.BIND.rotations)
    columns = np.zeros((len(JOINTS), 4, 4))
    columns[:, :3, :3] = rot.rotate(inverse[:, None], np.eye(3))
    columns[:, 3, :3] = -rot.rotate(inverse, body.BIND.positions)
    columns[:, 3, 3] = 1.0
    return columns


def _primitive(numbers: _Numbers, part_colours: np.ndarray) -> dict:
    """The mesh: corners with their joints and weights, colours with the shade of the folds in them."""
    skin = make_skin(SKIN_CELL)
    weights = skin.weights.astype(np.float32)
    weights /= weights.sum(axis=-1, keepdims=True)
    joints = np.where(weights > 0, skin.joints, 0)  # a joint that is not followed must be 0
    attributes = {
        "NORMAL": skin.normals,
        "COLOR_0": _colours(skin, part_colours),
        "JOINTS_0": joints.astype(np.uint8),
        "WEIGHTS_0": weights,
    }
    return {
        "attributes": {
            "POSITION": numbers.add(skin.positions, VERTICES, bounds=True),
            **{name: numbers.add(values, VERTICES) for name, values in attributes.items()},
        },
        "indices": numbers.add(skin.triangles.ravel().astype(np.uint32), INDICES),
        "material": 0,
    }


def _ground_mesh(numbers: _Numbers, ground: Ground, hips: np.ndarray) -> dict:
    """The ground about the way of the hips (n, 3); without normals, so that steps have sharp edges."""
    low, high = hips[:, ::2].min(axis=0) - GROUND_MARGIN, hips[:, ::2].max(axis=0) + GROUND_MARGIN
    cell = ground.cell
    while (high - low).max() > GROUND_CELLS * cell:
        cell *= 2
    axes = [np.arange(np.floor(a / cell), np.ceil(b / cell) + 1) * cell for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*axes), axis=-1)  # (along z, along x, 2)
    positions = np.stack([places[..., 0], ground.height_at(places), places[..., 1]], axis=-1).reshape(-1, 3)
    corners = np.arange(len(positions)).reshape(places.shape[:2])
    a, b, c, d = corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:]
    triangles = np.stack([a, b, c, a, c, d], axis=-1).ravel().astype(np.uint32)
    attributes = {"POSITION": numbers.add(positions, VERTICES, bounds=True)}
    return {"name": "Ground", "primitives": [{"attributes": attributes, "indices": numbers.add(triangles, INDICES)}]}


def _colours(skin: Skin, part_colours: np.ndarray) -> np.ndarray:
    """(n, 3) linear light of each corner, as the window's shaders see it (demo/render/shaders.py): squares of display
    colours."""
    cloth = part_colours[PART_OF_JOINT] ** 2 * (1 - GLOVES * body.IS_GLOVE[:, None])
    # of the joint it follows most
    colours = cloth[skin.joints[:, 0]] * (SHADED + (1 - SHADED) * skin.openness[:, None])
    off = np.sum(((skin.positions - body.VISOR) * VISOR_SHARPNESS) ** 2, axis=-1, keepdims=True)
    return colours + (VISOR_COLOUR - colours) * np.clip(9 * (1 - off), 0, 1)


def _animation(numbers: _Numbers, clip: Clip) -> dict:
    """One channel for the way of the hips and one for the turns of each joint, a key a frame."""
    times = numbers.add(np.arange(len(clip)) / clip.fps, bounds=True)
    turns = np.moveaxis(_xyzw(rot.make_continuous(clip.rotations)), 1, 0)  # (21, frames, 4)
    tracks = [(0, "translation", clip.hips), *((joint, "rotation", turn) for joint, turn in enumerate(turns))]
    return {
        "name": "Patchwalk",
        "samplers": [{"input": times, "output": numbers.add(values)} for _, _, values in tracks],
        "channels": [
            {"sampler": sampler, "target": {"node": joint, "path": path}}
            for sampler, (joint, path, _) in enumerate(tracks)
        ],
    }


def _xyzw(q: np.ndarray) -> np.ndarray:
    """Our (w, x, y, z) in glTF's order."""
    return np.roll(q, -1, axis=-1)
