"""The skeleton of a skinned figure in a glTF file: its joints in the pose that the mesh was tied to them in.

That is the pose of the nodes, or, where these stand otherwise (a file saved in the middle of a movement), the one that
the skin's inverse bind matrices tell (glTF 2.0, sec. 3.7.3)."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.io.bvh_parser import MAX_JOINTS
from sim.io.gltf_file import GltfFile, rest_of
from sim.io.gltf_schema import AGAIN
from sim.math import rotations as rot

SAME = 1e-2  # of the skeleton's size: how far joints of one skin may differ about where its mesh lies
UNEVEN = 1.02  # by how much a joint may be scaled more along one of its axes than along another


@dataclass(frozen=True)
class Rig:
    """Joints, parents first, in the file's unit and axes.

    nodes: (J,) their numbers in the file; names, each once; parents: (J,), -1 for none; bind: (J, 4, 4) joint to world
    in the pose that the mesh was tied in; inverse_binds: for each skin of the file {joint: matrix (4, 4)}."""

    nodes: np.ndarray
    names: list[str]
    parents: np.ndarray
    bind: np.ndarray
    inverse_binds: list[dict[int, np.ndarray]]

    @property
    def positions(self) -> np.ndarray:
        """(J, 3)"""
        return self.bind[:, :3, 3]

    @property
    def scales(self) -> np.ndarray:
        """(J,) by how much joints are scaled in all."""
        return np.linalg.norm(self.bind[:, :3, :3], axis=1).mean(axis=-1)

    @property
    def rotations(self) -> np.ndarray:
        """(J, 4) of the joints' own axes."""
        return rot.from_matrix(self.bind[:, :3, :3] / np.linalg.norm(self.bind[:, :3, :3], axis=1)[:, None])


def read_rig(file: GltfFile) -> Rig:
    """The joints of all skins that meshes hang on, and all that those hang on. Raises ValueError, saying what is
    missing, where there is no skinned mesh."""
    document = file.document
    skins: list[dict[str, Any]] = document.get("skins", [])
    used = {node["skin"] for node in file.nodes if "mesh" in node and "skin" in node}
    if not document.get("meshes"):
        raise ValueError("it has no mesh: export the character's body with its skeleton")
    if not used:
        raise ValueError("its mesh is not tied to a skeleton (it has no skin): rig it, then export it again")
    depths: dict[int, int] = {}
    for skin in used:
        for node in skins[skin]["joints"]:
            above = file.above(node)
            depths |= {each: len(above) - place for place, each in enumerate(above)}
    if len(depths) > MAX_JOINTS:
        raise ValueError(f"its skeleton has {len(depths)} joints: {MAX_JOINTS} are the most")
    nodes = sorted(depths, key=lambda node: (depths[node], node))
    place = {node: joint for joint, node in enumerate(nodes)}
    parents = np.array([place.get(file.parents[node], -1) for node in nodes])
    local = np.array([node_matrix(file.nodes[node]) for node in nodes])
    inverse_binds = [_inverse_binds(file, skin, place) if number in used else {} for number, skin in enumerate(skins)]
    bind = _bind(parents, local, inverse_binds)
    lengths = np.linalg.norm(bind[:, :3, :3], axis=1)
    uneven = (lengths.max(axis=-1) > UNEVEN * lengths.min(axis=-1)) | (np.linalg.det(bind[:, :3, :3]) <= 0)
    if uneven.any():
        name = file.name(nodes[int(uneven.argmax())])
        raise ValueError(f"its joint '{name}' is scaled unevenly or mirrored: apply all scales, then export it again")
    names: list[str] = []
    for node in nodes:
        name = file.name(node)
        names.append(name if name not in names else f"{name}#{node}")
    return Rig(np.array(nodes), names, parents, bind, inverse_binds)


def node_matrix(node: dict[str, Any]) -> np.ndarray:
    """(4, 4) a node in its parent."""
    translation, rotation, scale = rest_of(node)
    result = np.eye(4)
    result[:3, :3] = rot.to_matrix(rotation) * scale
    result[:3, 3] = translation
    return result


def _inverse_binds(file: GltfFile, skin: dict[str, Any], place: dict[int, int]) -> dict[int, np.ndarray]:
    """Of each joint of a skin the matrix (4, 4) from the mesh to it."""
    joints = [place[node] for node in skin["joints"]]
    if "inverseBindMatrices" not in skin:
        return {joint: np.eye(4) for joint in joints}
    matrices = file.numbers(skin["inverseBindMatrices"], (16,)).reshape(-1, 4, 4).swapaxes(1, 2)
    if len(matrices) < len(joints) or (np.abs(np.linalg.det(matrices)) < 1e-12).any():
        raise ValueError(f"the inverse bind matrices of its skin are too few, or flat: {AGAIN}")
    return dict(zip(joints, matrices))


def _bind(parents: np.ndarray, local: np.ndarray, inverse_binds: list[dict[int, np.ndarray]]) -> np.ndarray:
    """(J, 4, 4) joint to world in the pose of the nodes, or, where the mesh of the largest skin is not one piece in
    that pose, in the one that it was tied in."""
    world = _chained(parents, local, {})
    largest = max(inverse_binds, key=len)
    joints = list(largest)
    placed = np.array([world[joint] @ largest[joint] for joint in joints])  # the mesh's place by each joint
    # Seen by the joints: where each joint stands, if the mesh lies as the first joint has it.
    binds = np.linalg.inv(np.array([largest[joint] for joint in joints]))
    first = placed[np.argmin(joints)]  # the topmost, as parents come first
    size = np.ptp(world[joints, :3, 3], axis=0).max()
    apart = np.abs((first @ binds)[:, :3, 3] - world[joints, :3, 3]).max()
    turned = np.abs(placed[:, :3, :3] - first[:3, :3]).max() / max(float(np.abs(first[:3, :3]).max()), 1e-12)
    if apart < SAME * size and turned < SAME * 10:
        return world
    return _chained(parents, local, dict(zip(joints, first @ binds)))


def _chained(parents: np.ndarray, local: np.ndarray, known: dict[int, np.ndarray]) -> np.ndarray:
    """(J, 4, 4) joint to world from joint to parent; those that are known are as they are."""
    world = local.copy()
    for joint, parent in enumerate(parents):
        if joint in known:
            world[joint] = known[joint]
        elif parent >= 0:
            world[joint] = world[parent] @ local[joint]
    return world
