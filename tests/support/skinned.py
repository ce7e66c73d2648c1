"""Small skinned characters made in code: boxes along bones, whatever the names, proportions, rest pose and axes."""

import io
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from sim.body.skeleton import BONE_OFFSETS, INDEX, JOINT_COUNT, JOINTS, PARENTS
from sim.io.gltf_writer import INDICES, VERTICES, Numbers, encode_glb, xyzw
from sim.math import rotations as rot

VRM_BONES = {
    "Hips": "hips",
    "Spine": "spine",
    "Chest": "chest",
    "Neck": "neck",
    "Head": "head",
    **{
        side + ours: side.lower() + theirs
        for side in ("Left", "Right")
        for ours, theirs in (
            ("UpLeg", "UpperLeg"),
            ("Leg", "LowerLeg"),
            ("Foot", "Foot"),
            ("Toe", "Toes"),
            ("Shoulder", "Shoulder"),
            ("Arm", "UpperArm"),
            ("ForeArm", "LowerArm"),
            ("Hand", "Hand"),
        )
    },
}
HALF, LOW = 0.03, 0.12  # metres: half of a box's width, and where feet are
FOOT = 0.15  # metres ahead of the ankle, of a foot without toes
T_POSE = np.tile(rot.IDENTITY, (JOINT_COUNT, 1))
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def a_pose(degrees: float = 45.0) -> np.ndarray:
    """(21, 4) world rotations of the T-pose with its arms lowered."""
    result = T_POSE.copy()
    for side, sign in (("Left", -1.0), ("Right", 1.0)):
        turn = rot.from_axis_angle(np.array([0.0, 0.0, sign]), np.radians(degrees))
        for name in ("Arm", "ForeArm", "Hand"):
            result[INDEX[side + name]] = turn
    return result


@dataclass
class Build:
    """What a character is made of: names (ours -> theirs; those that are left out are left out), how long its bones are
    beside ours, its rest pose (21, 4), the unit of its nodes in metres, where its front points (yaw), joints that we do
    not drive (name -> (our parent, offset in metres)), VRM's version, whether nodes stand in the bind pose, and the
    seed of its joints' axes."""

    names: dict[str, str] = field(default_factory=lambda: {name: name for name in JOINTS})
    longer: dict[str, float] = field(default_factory=dict)
    rest: np.ndarray = field(default_factory=lambda: T_POSE)
    unit: float = 1.0
    yaw: float = 0.0
    extra: dict[str, tuple[str, tuple[float, float, float]]] = field(default_factory=dict)
    vrm: int | None = None
    moved: bool = False
    seed: int = 0
    root: str | None = None

    def positions(self) -> np.ndarray:
        """(21, 3) joints of the rest pose, metres, before it is turned; it stands on a floor at 0."""
        plain = [name.removeprefix("Left").removeprefix("Right") for name in JOINTS]
        offsets = BONE_OFFSETS * np.array([self.longer.get(name, 1.0) for name in plain])[:, None]
        places = np.zeros((JOINT_COUNT, 3))
        for joint, parent in enumerate(PARENTS[1:], 1):
            places[joint] = places[parent] + rot.rotate(self.rest[parent], offsets[joint])
        return places - [0.0, places[INDEX["LeftToe"], 1] - 0.02, 0.0]


def write(path: Path, build: Build | None = None) -> Path:
    """Writes the character as .glb."""
    path.write_bytes(encode(build or Build()))
    return path


def encode(build: Build) -> bytes:
    """The bytes of what `write` writes."""
    random = np.random.default_rng(build.seed)
    turn, numbers = rot.from_yaw(build.yaw), Numbers()
    kept = [joint for joint, name in enumerate(JOINTS) if name in build.names]
    names = [build.names[JOINTS[joint]] for joint in kept]
    ours = build.positions()
    places = [ours[joint] for joint in kept]
    parents = []
    for joint in kept:
        above = PARENTS[joint]
        while above >= 0 and above not in kept:
            above = PARENTS[above]
        parents.append(kept.index(above) if above >= 0 else -1)
    for name, (parent, offset) in build.extra.items():
        above = names.index(build.names[parent]) if parent in build.names else names.index(parent)
        names.append(name)
        parents.append(above)
        places.append(places[above] + np.array(offset))
    world = rot.rotate(turn, np.array(places)) / build.unit
    axes = rot.normalize(random.normal(size=(len(names), 4)))  # of the joints: anything

    # Nodes: armature (which scales), [root], joints, mesh.
    first = 2 if build.root else 1
    nodes: list[dict[str, Any]] = [{"name": "Armature", "scale": [build.unit] * 3, "children": [1]}]
    if build.root:
        nodes.append({"name": build.root, "children": [first]})
    for joint, parent in enumerate(parents):
        place, local = world[joint], axes[joint]
        if parent >= 0:
            place = rot.rotate(rot.inverse(axes[parent]), place - world[parent])
            local = rot.multiply(rot.inverse(axes[parent]), local)
            nodes[first + parent].setdefault("children", []).append(first + joint)
        if build.moved and joint:  # the nodes stand in the middle of a movement
            local = rot.multiply(local, rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), 0.3))
        nodes.append({"name": names[joint], "translation": place.tolist(), "rotation": xyzw(local).tolist()})
    inverses = np.tile(np.eye(4), (len(names), 1, 1))
    inverses[:, :3, :3] = rot.to_matrix(rot.inverse(axes))
    inverses[:, :3, 3] = -rot.rotate(rot.inverse(axes), world)
    joints = list(range(first, first + len(names)))
    if build.root:
        joints, inverses = [*joints, 1], np.concatenate([inverses, np.eye(4)[None]])
    feet = [names.index(build.names[side + "Foot"]) for side in ("Left", "Right")]
    ahead = rot.rotate(turn, np.array([0.0, 0.0, FOOT])) / build.unit
    mesh, image = _mesh(numbers, world, parents, build.unit, {foot: world[foot] + ahead for foot in feet}), _picture()
    nodes.append({"name": "Body", "mesh": 0, "skin": 0})
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "a test"},
        "scene": 0,
        "scenes": [{"nodes": [0, len(nodes) - 1]}],
        "nodes": nodes,
        "skins": [{"joints": joints, "inverseBindMatrices": numbers.add(inverses.swapaxes(1, 2))}],
        "meshes": [mesh],
        "materials": [
            {"name": "cloth", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0}},
            {"name": "skin", "pbrMetallicRoughness": {"baseColorFactor": [0.81, 0.25, 0.04, 1.0]}},
        ],
        "textures": [{"source": 0}],
        "images": [{"mimeType": "image/png", "bufferView": numbers.add_view(image, {})}],
    }
    table = {bone: first + names.index(build.names[our]) for our, bone in VRM_BONES.items() if our in build.names}
    if build.vrm == 0:
        bones = [{"bone": bone, "node": node} for bone, node in table.items()]
        document |= {"extensionsUsed": ["VRM"], "extensions": {"VRM": {"humanoid": {"humanBones": bones}}}}
    if build.vrm == 1:
        humanoid = {"humanBones": {bone: {"node": node} for bone, node in table.items()}}
        vrm = {"specVersion": "1.0", "humanoid": humanoid}
        document |= {"extensionsUsed": ["VRMC_vrm"], "extensions": {"VRMC_vrm": vrm}}
    return encode_glb(document, numbers)


def _mesh(
    numbers: Numbers, world: np.ndarray, parents: list[int], unit: float, tips: dict[int, np.ndarray]
) -> dict[str, Any]:
    """A box about each bone, tied to the joint that it hangs on, and one at each end, up to its tip if it has one; two
    materials."""
    positions, joints = [], []
    ends = [joint for joint in range(len(parents)) if joint not in parents]
    bones = [(joint, max(parent, 0)) for joint, parent in enumerate(parents)] + [(joint, joint) for joint in ends]
    for joint, parent in bones:
        start = tips.get(joint, world[joint]) if joint == parent else world[joint]
        low, high = np.minimum(start, world[parent]), np.maximum(start, world[parent])
        half = HALF / unit
        box = low - half + CUBE * (high - low + 2 * half)
        if low[1] * unit < LOW:  # a foot: it stands on the floor
            box[:, 1] = np.where(CUBE[:, 1] == 0, 0.0, box[:, 1])
        positions.append(box)
        joints.append(np.full(8, parent))
    corners = np.concatenate(positions)
    ties = np.zeros((len(corners), 4), np.uint8)
    ties[:, 0] = np.concatenate(joints)
    weights = np.tile([1.0, 0.0, 0.0, 0.0], (len(corners), 1))
    boxes = 8 * np.arange(len(bones))[:, None, None] + FACES
    triangles = np.concatenate([boxes[..., [0, 1, 2]], boxes[..., [0, 2, 3]]], axis=1).reshape(len(bones), -1)
    attributes = {
        "POSITION": numbers.add(corners, VERTICES, bounds=True),
        "TEXCOORD_0": numbers.add(np.tile(CUBE[:, :2], (len(bones), 1)), VERTICES),
        "JOINTS_0": numbers.add(ties, VERTICES),
        "WEIGHTS_0": numbers.add(weights, VERTICES),
    }
    halves = np.array_split(triangles.astype(np.uint32), 2)
    return {
        "name": "Body",
        "primitives": [
            {"attributes": attributes, "indices": numbers.add(half.ravel(), INDICES), "material": number}
            for number, half in enumerate(halves)
        ],
    }


def _picture() -> bytes:
    file = io.BytesIO()
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:, :4] = (200, 30, 30)
    pixels[:, 4:] = (30, 30, 200)
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()
