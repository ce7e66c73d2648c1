"""A character written as .glb: its own file with materials, textures and all, and one animation in place of its own.

A `root` joint carries the way over the floor; the bind pose is the character's own rest pose. Sections are those of
glTF 2.0."""

from copy import deepcopy
from pathlib import Path
from typing import Any, Mapping

import numpy as np

from sim.character.character import Character
from sim.character.motion import CharacterMotion
from sim.character.pictures import PIXEL, take_out_lost
from sim.character.rig import node_matrix
from sim.io.atomic_write import atomic_write
from sim.io.checks import check_finite
from sim.io.gltf_file import GltfFile, rest_of
from sim.io.gltf_writer import INDICES, VERTICES, Numbers, animation, encode_glb, xyzw
from sim.math import rotations as rot

ROOT = "root"
SAME = 1e-4  # share of a node's matrix by which it may be off the bind pose
MOVING = 1e-6  # of a quaternion's numbers: a joint that turns by less keeps its rest pose


Scenery = tuple[np.ndarray, np.ndarray]  # corners (n, 3) in metres, triangles (m, 3)


def write_glb(path: str | Path, motion: CharacterMotion, scenery: Scenery | None = None) -> None:
    """Writes the character with its motion. scenery: a mesh that lies there besides. Raises OSError, ValueError for a
    motion that is not finite."""
    check_finite(path, motion.positions, motion.rotations)
    with atomic_write(path) as temporary:
        temporary.write_bytes(encode_character(motion, scenery))


def encode_character(motion: CharacterMotion, scenery: Scenery | None = None) -> bytes:
    """The bytes of what `write_glb` writes."""
    character = motion.character
    numbers = Numbers()
    own, first, place = _find_root(character)
    binds = {} if own is not None else _binds_with_root(character, first, place)
    document = copy_document(character.file, numbers, binds)
    _stand_in_bind(document, character)
    _free_meshes(document)
    root = int(character.rig.nodes[own]) if own is not None else _add_root(document, character, first, place)
    document["animations"] = [animation(numbers, "Patchwalk", motion.fps, _tracks(document, motion, root))]
    document["asset"] = document.get("asset", {}) | {"version": "2.0", "generator": "Patchwalk"}
    if scenery is not None:
        add_scenery(document, numbers, *scenery)
    return encode_glb(document, numbers)


def encode_still(file: GltfFile) -> bytes:
    """The bytes of a .glb that holds all of a file but its animations, whatever files lie beside it."""
    numbers = Numbers()
    return encode_glb(copy_document(file, numbers, {}), numbers)


def copy_document(file: GltfFile, numbers: Numbers, binds: Mapping[int, np.ndarray]) -> dict[str, Any]:
    """A file's document without its animations, its numbers and pictures copied into `numbers`. binds: of some skins
    the inverse bind matrices (n, 4, 4) in place of the file's."""
    old = file.document
    document = deepcopy({key: value for key, value in old.items() if key not in ("animations", "buffers")})
    views: dict[int, int] = {}
    accessors: dict[int, int] = {}

    def view(number: int) -> int:
        if number not in views:
            entry = old["bufferViews"][number]
            properties = {key: value for key, value in entry.items() if key in ("target", "byteStride", "name")}
            views[number] = numbers.add_view(file.view(number), properties)
        return views[number]

    def accessor(number: int) -> int:
        if number not in accessors:
            entry = deepcopy(old["accessors"][number])
            sparse = entry.get("sparse", {})
            for holder in (entry, sparse.get("indices"), sparse.get("values")):
                if holder and "bufferView" in holder:
                    holder["bufferView"] = view(holder["bufferView"])
            numbers.accessors.append(entry)
            accessors[number] = len(numbers.accessors) - 1
        return accessors[number]

    for mesh in document.get("meshes", ()):
        for primitive in mesh["primitives"]:
            for attributes in (primitive["attributes"], *primitive.get("targets", ())):
                attributes.update({name: accessor(number) for name, number in attributes.items()})
            if "indices" in primitive:
                primitive["indices"] = accessor(primitive["indices"])
    for number, skin in enumerate(document.get("skins", ())):
        if number in binds:
            skin["inverseBindMatrices"] = numbers.add(binds[number].swapaxes(1, 2))
        elif "inverseBindMatrices" in skin:
            skin["inverseBindMatrices"] = accessor(skin["inverseBindMatrices"])
    for number, image in enumerate(document.get("images", ())):
        if number in file.lost_pictures:
            image.pop("uri", None)
            image |= {"mimeType": "image/png", "bufferView": numbers.add_view(PIXEL, {})}
        elif "bufferView" in image:
            image["bufferView"] = view(image["bufferView"])
        elif not image["uri"].startswith("data:"):
            data = file.resource(image.pop("uri"))
            image["mimeType"] = "image/png" if data[:4] == b"\x89PNG" else "image/jpeg"
            image["bufferView"] = numbers.add_view(data, {})
    take_out_lost(document, file.lost_pictures)
    return document


def _stand_in_bind(document: dict[str, Any], character: Character) -> None:
    """Puts nodes that stand otherwise into the pose that the mesh was tied in."""
    rig = character.rig
    for joint, parent in enumerate(rig.parents.tolist()):
        local = np.linalg.inv(rig.bind[parent]) @ rig.bind[joint] if parent >= 0 else rig.bind[joint]
        node = document["nodes"][int(rig.nodes[joint])]
        if np.abs(local - node_matrix(node)).max() > SAME * max(1.0, float(np.abs(local).max())) or "matrix" in node:
            node.pop("matrix", None)
            node |= _placed(local, scaled=True)


def _free_meshes(document: dict[str, Any]) -> None:
    """Skinned meshes hang on nothing: what they would hang on does not move them (sec. 3.7.3.2)."""
    roots = [scene.setdefault("nodes", []) for scene in document.get("scenes", ())]
    for parent in document["nodes"]:
        children = parent.get("children", [])
        freed = [n for n in children if "skin" in document["nodes"][n] and "children" not in document["nodes"][n]]
        if freed:
            parent["children"] = [node for node in children if node not in freed]
            if not parent["children"]:
                del parent["children"]
            for nodes in roots[:1]:
                nodes += freed


def _find_root(character: Character) -> tuple[int | None, int, np.ndarray]:
    """The character's own joint called root above its hips, None where it has none; the first joint of its skeleton;
    and where a root of ours would be in the bind pose, (4, 4) to the world: on the floor under it."""
    rig = character.rig
    skinned = {joint for skin in rig.inverse_binds for joint in skin}
    above = [character.index["Hips"]]
    while rig.parents[above[-1]] >= 0 and int(rig.parents[above[-1]]) in skinned:
        above.append(int(rig.parents[above[-1]]))
    own = next((joint for joint in above[1:] if rig.names[joint].lower() == ROOT), None)
    parent = int(rig.parents[above[-1]])
    scale = rig.scales[parent] if parent >= 0 else 1.0
    place = np.eye(4)
    place[:3, :3] = rot.to_matrix(rot.inverse(character.turn)) * scale
    place[:3, 3] = character.floor
    return own, above[-1], place


def _binds_with_root(character: Character, first: int, place: np.ndarray) -> dict[int, np.ndarray]:
    """The inverse bind matrices of each skin that has the skeleton's first joint, with those of a root after them."""
    rig = character.rig
    to_root = np.linalg.inv(place) @ rig.bind[first]
    return {
        number: np.array([*skin.values(), to_root @ skin[first]])
        for number, skin in enumerate(rig.inverse_binds)
        if first in skin
    }


def _add_root(document: dict[str, Any], character: Character, first: int, place: np.ndarray) -> int:
    """A new node above the skeleton's first joint, which is a joint of its skins as well."""
    rig, nodes = character.rig, document["nodes"]
    top, parent, new = int(rig.nodes[first]), int(rig.parents[first]), len(nodes)
    over = rig.bind[parent] if parent >= 0 else np.eye(4)
    nodes.append({"name": ROOT, "children": [top]} | _placed(np.linalg.inv(over) @ place, scaled=False))
    siblings = [scene.setdefault("nodes", []) for scene in document.get("scenes", ())]
    if parent >= 0:
        siblings = [nodes[int(rig.nodes[parent])]["children"]]
    for each in siblings:
        each[:] = [new if node == top else node for node in each]
    nodes[top] |= _placed(np.linalg.inv(place) @ rig.bind[first], scaled="scale" in nodes[top])
    for skin, inverses in zip(document["skins"], rig.inverse_binds):
        if first in inverses:
            skin["joints"].append(new)
            if skin.get("skeleton") == top:
                skin["skeleton"] = new
    return new


def _placed(matrix: np.ndarray, scaled: bool) -> dict[str, Any]:
    """A node's place in its parent, (4, 4), as glTF has it."""
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    turn = rot.from_matrix(matrix[:3, :3] / scale)
    return {"translation": matrix[:3, 3].tolist(), "rotation": xyzw(turn).tolist()} | (
        {"scale": scale.tolist()} if scaled else {}
    )


def _tracks(document: dict[str, Any], motion: CharacterMotion, root: int) -> list[tuple[int, str, np.ndarray]]:
    """What turns and what goes somewhere: values in the nodes' parents, quaternions as glTF has them."""
    character, rig = motion.character, motion.character.rig
    joint_of = {int(node): joint for joint, node in enumerate(rig.nodes)}
    parents = {child: node for node, entry in enumerate(document["nodes"]) for child in entry.get("children", ())}
    # World matrix of what lies still above the root.
    still, scale = _still(document, parents, parents.get(root, -1))
    inverse = rot.inverse(still[1])
    if root in joint_of:
        place, turn = motion.positions[:, joint_of[root]], motion.node_rotations[:, joint_of[root]]
    else:
        place, turn = motion.roots, rot.from_yaw(motion.facing)
    tracks = [
        (root, "translation", rot.rotate(inverse, place - still[0]) / scale),
        (root, "rotation", rot.multiply(inverse, turn)),
    ]
    places, turns, scales = {root: place}, {root: turn}, {root: scale * _scale(document["nodes"][root])}
    for joint, node in enumerate(rig.nodes.tolist()):
        parent = parents.get(node, -1)
        if node == root or parent not in turns:
            continue
        places[node], turns[node] = motion.positions[:, joint], motion.node_rotations[:, joint]
        scales[node] = scales[parent] * _scale(document["nodes"][node])
        local = rot.multiply(rot.inverse(turns[parent]), turns[node])
        _, rest, _ = rest_of(document["nodes"][node])
        if min(np.abs(local - rest).max(), np.abs(local + rest).max()) > MOVING:
            tracks.append((node, "rotation", local))
        if joint == character.index["Hips"]:
            moved = rot.rotate(rot.inverse(turns[parent]), places[node] - places[parent]) / scales[parent]
            tracks.append((node, "translation", moved))
    return [(node, path, xyzw(rot.make_continuous(v)) if path == "rotation" else v) for node, path, v in tracks]


def _still(document: dict[str, Any], parents: dict[int, int], node: int) -> tuple[tuple[np.ndarray, np.ndarray], float]:
    """Place (3,) and rotation (4,) of a node in the world, and by how much it is scaled."""
    place, turn, scale = np.zeros(3), rot.IDENTITY, 1.0
    chain = []
    while node >= 0:
        chain.append(node)
        node = parents.get(node, -1)
    for each in reversed(chain):
        translation, rotation, _ = rest_of(document["nodes"][each])
        place = place + rot.rotate(turn, translation * scale)
        turn, scale = rot.multiply(turn, rotation), scale * _scale(document["nodes"][each])
    return (place, turn), scale


def _scale(node: dict[str, Any]) -> float:
    return float(np.abs(rest_of(node)[2]).mean())


def add_scenery(document: dict[str, Any], numbers: Numbers, positions: np.ndarray, triangles: np.ndarray) -> None:
    """A mesh that stands still: the ground; without normals, so that its edges are sharp."""
    document.setdefault("meshes", []).append(
        {
            "name": "Ground",
            "primitives": [
                {
                    "attributes": {"POSITION": numbers.add(positions, VERTICES, bounds=True)},
                    "indices": numbers.add(triangles.ravel().astype(np.uint32), INDICES),
                }
            ],
        }
    )
    document["nodes"].append({"name": "Ground", "mesh": len(document["meshes"]) - 1})
    document["scenes"][document.get("scene", 0)].setdefault("nodes", []).append(len(document["nodes"]) - 1)
