"""The surface of a skinned figure in a glTF file: corners in the bind pose, the four joints each follows, materials.

What a picture of a figure needs is read: base colours, their textures and vertex colours, and what is cut out by
alpha. Normal maps, morph targets and all else stay in the file."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.character.pictures import read_picture
from sim.character.rig import Rig, node_matrix
from sim.io.gltf_file import GltfFile
from sim.io.gltf_schema import AGAIN
from sim.math import rotations as rot

TIES = 4  # joints a corner follows
MOST_TRIANGLES = 500_000
TRIANGLES = 4  # sec. 3.7.2.1
CUT_OFF = 0.5  # alpha under which a corner of a cut-out material is not drawn
# Ways to pack numbers that are not plain glTF: what to say of them.
PACKED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")


@dataclass(frozen=True)
class Material:
    """A base colour: factor (4,) in display colours, and a picture (h, w, 4) uint8, top row first; alpha under which
    nothing is drawn (0: all is); whether it is seen from behind."""

    name: str = ""
    factor: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    picture: np.ndarray | None = None
    cut_off: float = 0.0
    double_sided: bool = False


@dataclass(frozen=True)
class SkinnedMesh:
    """Corners: positions and normals (n, 3) in the bind pose, places in the picture uvs (n, 2), display colours (n, 4),
    the joints they follow and their weights (n, 4); triangles (m, 3); materials, and for each the range of its
    triangles."""

    positions: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray
    colours: np.ndarray
    joints: np.ndarray
    weights: np.ndarray
    triangles: np.ndarray
    materials: tuple[Material, ...]
    ranges: tuple[tuple[int, int], ...]


def read_mesh(file: GltfFile, rig: Rig) -> SkinnedMesh:
    """All meshes that follow the rig: skinned ones, and those that hang on a joint. Raises ValueError where there is
    nothing to draw."""
    packed = [name for name in file.document.get("extensionsRequired", ()) if name in PACKED]
    if packed:
        raise ValueError(f"its mesh is compressed ({packed[0]}), which cannot be read: export it without compression")
    joint_of = {int(rig.nodes[joint]): joint for skin in rig.inverse_binds for joint in skin}
    wanted, corners = [], 0
    for number, node in enumerate(file.nodes):
        if "mesh" not in node:
            continue
        carrier = next((joint_of[each] for each in file.above(number) if each in joint_of), None)
        skin = rig.inverse_binds[node["skin"]] if "skin" in node else None
        if skin is None and carrier is None:
            continue  # scenery
        for primitive in file.document["meshes"][node["mesh"]]["primitives"]:
            if primitive.get("mode", TRIANGLES) == TRIANGLES and "POSITION" in primitive["attributes"]:
                places = primitive["attributes"]["POSITION"]
                accessors = places, primitive.get("indices", places)
                corners += max(int(file.document["accessors"][each]["count"]) for each in accessors)
                wanted.append((primitive, skin, number, carrier))
        if corners > 3 * MOST_TRIANGLES:  # before all these are read
            raise ValueError(f"its mesh has over {corners // 3} triangles: reduce it to {MOST_TRIANGLES} at most")
    pieces = [_read_piece(file, rig, *each) for each in wanted]
    count = sum(len(piece.triangles) for piece in pieces)
    if not count:
        raise ValueError("its mesh has no triangles: there is nothing to draw")
    if count > MOST_TRIANGLES:
        raise ValueError(f"its mesh has {count} triangles: reduce it to {MOST_TRIANGLES} at most")
    return _joined(file, pieces)


@dataclass(frozen=True)
class _Piece:
    """One primitive: its corners as SkinnedMesh has them, side by side, and its material's number, None for none."""

    corners: dict[str, np.ndarray]
    triangles: np.ndarray
    material: int | None


def _read_piece(
    file: GltfFile,
    rig: Rig,
    primitive: dict[str, Any],
    skin: dict[int, np.ndarray] | None,
    node: int,
    carrier: int | None,
) -> _Piece:
    attributes = primitive["attributes"]
    positions = file.numbers(attributes["POSITION"], (3,))
    count = len(positions)
    if "indices" in primitive:
        triangles = file.numbers(primitive["indices"], (1,), shares=False)[:, 0].astype(np.int64)
    else:
        triangles = np.arange(count)
    triangles = triangles[: len(triangles) // 3 * 3].reshape(-1, 3)
    if len(triangles) and not 0 <= triangles.min() <= triangles.max() < count:
        raise ValueError(f"the triangles of its mesh have corners that there are not: {AGAIN}")
    if skin is None:
        assert carrier is not None
        joints, weights = np.full((count, TIES), carrier), np.eye(TIES)[np.zeros(count, int)]
        places = np.array([_below(file, rig, node, carrier)])
        matrices = np.broadcast_to(places, (count, 4, 4))
    else:
        order = np.array(list(skin))
        slots, weights = _ties(file, attributes, count, len(order))
        joints = order[slots]
        binds = rig.bind[order] @ np.array([skin[joint] for joint in order.tolist()])
        matrices = np.einsum("nt,ntij->nij", weights, binds[slots])
    if "NORMAL" in attributes:
        normals = file.numbers(attributes["NORMAL"], (3,), count)
    else:
        normals = _normals(positions, triangles)
    turned = np.linalg.inv(matrices[:, :3, :3]).swapaxes(1, 2) @ normals[:, :, None]
    corners = {
        "positions": (matrices[:, :3, :3] @ positions[:, :, None])[..., 0] + matrices[:, :3, 3],
        "normals": rot.normalize(turned[..., 0]),
        "uvs": _uvs(file, primitive, count),
        "colours": _colours(file, attributes, count),
        "joints": joints,
        "weights": weights,
    }
    used, triangles = np.unique(triangles, return_inverse=True)  # primitives may share their corners
    return _Piece(
        {name: each[used] for name, each in corners.items()}, triangles.reshape(-1, 3), primitive.get("material")
    )


def _below(file: GltfFile, rig: Rig, node: int, carrier: int) -> np.ndarray:
    """(4, 4) from a node that hangs under a joint to the world in the bind pose."""
    result = np.eye(4)
    for each in file.above(node):
        if each == rig.nodes[carrier]:
            break
        result = node_matrix(file.nodes[each]) @ result
    return rig.bind[carrier] @ result


def _ties(file: GltfFile, attributes: dict[str, int], count: int, joints: int) -> tuple[np.ndarray, np.ndarray]:
    """The slots of a skin (n, 4) that corners follow and their weights (n, 4), adding up to 1: the strongest of those
    that the file has."""
    sets = [number for number in range(4) if f"JOINTS_{number}" in attributes and f"WEIGHTS_{number}" in attributes]
    if not sets:
        raise ValueError("the corners of its mesh follow no joints: rig it, then export it again")
    slots, weights = (
        np.concatenate([file.numbers(attributes[f"{name}_{n}"], (TIES,), count, shares) for n in sets], axis=-1)
        for name, shares in (("JOINTS", False), ("WEIGHTS", None))
    )
    slots = slots.astype(int)
    if slots.min() < 0 or slots[weights > 0].max(initial=0) >= joints:
        raise ValueError(f"the corners of its mesh follow joints that there are not: {AGAIN}")
    slots = np.where(weights > 0, slots, 0)
    strongest = np.argsort(-weights, axis=-1, kind="stable")[:, :TIES]
    slots, weights = (np.take_along_axis(each, strongest, axis=-1) for each in (slots, weights))
    weights = np.maximum(weights, 0.0)
    weights[weights.sum(axis=-1) < 1e-9] = np.eye(TIES)[0]
    return slots, weights / weights.sum(axis=-1, keepdims=True)


def _normals(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n, 3) of corners whose file has none: the sum of the triangles that meet there."""
    a, b, c = positions[triangles].swapaxes(0, 1)
    faces = np.cross(b - a, c - a)
    result = np.zeros_like(positions)
    for corner in triangles.T:
        np.add.at(result, corner, faces)
    return rot.normalize(result)


def _uvs(file: GltfFile, primitive: dict[str, Any], count: int) -> np.ndarray:
    """(n, 2) places in the picture of the base colour, its transform (KHR_texture_transform) included."""
    texture = _base(file, primitive.get("material")).get("baseColorTexture", {})
    transform = texture.get("extensions", {}).get("KHR_texture_transform", {})
    name = f"TEXCOORD_{transform.get('texCoord', texture.get('texCoord', 0))}"
    if name not in primitive["attributes"]:
        return np.zeros((count, 2))
    uvs = file.numbers(primitive["attributes"][name], (2,), count)
    angle = transform.get("rotation", 0.0)
    cosine, sine = np.cos(angle), np.sin(angle)
    scaled = uvs * np.array(transform.get("scale", (1.0, 1.0)))
    turned = scaled @ np.array([[cosine, -sine], [sine, cosine]])
    return turned + np.array(transform.get("offset", (0.0, 0.0)))


def _colours(file: GltfFile, attributes: dict[str, int], count: int) -> np.ndarray:
    """(n, 4) display colours."""
    result = np.ones((count, 4))
    if "COLOR_0" in attributes:
        given = file.numbers(attributes["COLOR_0"], (3, 4), count)
        result[:, : given.shape[1]] = given
    result[:, :3] = np.sqrt(np.clip(result[:, :3], 0.0, 1.0))
    return result


def _base(file: GltfFile, material: int | None) -> dict[str, Any]:
    if material is None:
        return {}
    return file.document["materials"][material].get("pbrMetallicRoughness", {})


def _material(file: GltfFile, number: int | None, pictures: dict[int, np.ndarray | None]) -> Material:
    """A material by its number; pictures: those that were read before, by texture."""
    if number is None:
        return Material()
    entry, base = file.document["materials"][number], _base(file, number)
    factor = np.clip(np.array(base.get("baseColorFactor", (1.0,) * 4), dtype=float), 0.0, 1.0)
    factor[:3] = np.sqrt(factor[:3])
    cut_off = {"MASK": entry.get("alphaCutoff", CUT_OFF), "BLEND": CUT_OFF}.get(entry.get("alphaMode", "OPAQUE"), 0.0)
    name = str(entry.get("name") or f"material {number}")
    picture = None
    if "baseColorTexture" in base:
        texture = base["baseColorTexture"]["index"]
        if texture not in pictures:
            pictures[texture] = read_picture(file, texture, name)
        picture = pictures[texture]
    return Material(name, tuple(factor.tolist()), picture, float(cut_off), bool(entry.get("doubleSided", False)))


def _joined(file: GltfFile, pieces: list[_Piece]) -> SkinnedMesh:
    """All pieces as one, those of one material together."""
    order = list(dict.fromkeys(piece.material for piece in pieces))
    pieces = sorted(pieces, key=lambda piece: order.index(piece.material))
    starts = np.cumsum([0, *(len(piece.corners["positions"]) for piece in pieces)])
    triangles = [piece.triangles + start for piece, start in zip(pieces, starts)]
    counts = [sum(len(piece.triangles) for piece in pieces if piece.material == each) for each in order]
    ends = np.cumsum(counts).tolist()
    pictures: dict[int, np.ndarray | None] = {}
    corners = {name: np.concatenate([piece.corners[name] for piece in pieces]) for name in pieces[0].corners}
    return SkinnedMesh(
        **corners,
        triangles=np.concatenate(triangles).astype(np.uint32),
        materials=tuple(_material(file, each, pictures) for each in order),
        ranges=tuple(zip([0, *ends[:-1]], ends)),
    )
