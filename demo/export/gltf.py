"""glTF 2.0 binary files (.glb): the figure as one skinned mesh on its skeleton, with one animation, and the ground.

glTF's axes and units are ours (Y up, right-handed, the front is +Z, metres), so nothing is converted but the order of
quaternions. Above the hips is a `root`, which carries the way over the floor, as engines want it; the bind pose is the
T-pose."""

from pathlib import Path

import numpy as np

from demo.figure.forms import BIND, VISOR
from demo.figure.skin import FINE, LIMBS, Skin, load_skin
from sim.body.pose import Pose
from sim.body.skeleton import BONE_OFFSETS, JOINT_COUNT, JOINTS, PARENTS, PART_NAMES, REST_HIPS_HEIGHT
from sim.character.glb import ROOT, add_scenery
from sim.ground.ground import Ground
from sim.io.atomic_write import atomic_write
from sim.io.checks import check_finite
from sim.io.gltf_writer import INDICES, VERTICES, Numbers, animation, encode_glb, xyzw
from sim.math import rotations as rot
from sim.math.vectors import FLOOR, UP
from sim.motion.clip import FPS, Clip, RootFrame, root_frame

SHADED = 0.40  # share of light that reaches the deepest folds
GLOVES = 0.66  # how much darker gloves and shoes are than their part
VISOR_SHARPNESS, VISOR_COLOUR = np.array([15.0, 34.0, 15.0]), np.array([0.006, 0.008, 0.013])
GROUND_MARGIN = 2.0  # metres of uneven ground beyond where the hips go
GROUND_CELLS = 256  # of a side of it at most
T_POSE = Pose(
    np.zeros(3),
    0.0,
    np.array([0.0, REST_HIPS_HEIGHT, 0.0]),
    np.tile(rot.IDENTITY, (JOINT_COUNT, 1)),
    np.zeros(4),
    0.0,
)


def write(
    path: str | Path,
    clip: Clip,
    part_colours: np.ndarray,
    ground: Ground | None = None,
    fps: int = FPS,
    in_place: bool = False,
    root: RootFrame | None = None,
) -> None:
    """Writes the clip as a .glb, the figure in display colours (5, 3) of the body parts, with the uneven ground under
    it, if there is one, at 30 or 60 frames a second.

    in_place: without its way over the floor; root: where its ground frame goes (None: as the hips say). Raises OSError,
    and ValueError for a clip that is not finite."""
    check_finite(path, clip.hips, clip.rotations)
    with atomic_write(path) as temporary:
        temporary.write_bytes(encode(clip, part_colours, ground, fps, in_place, root))


def encode(
    clip: Clip,
    part_colours: np.ndarray,
    ground: Ground | None = None,
    fps: int = FPS,
    in_place: bool = False,
    root: RootFrame | None = None,
) -> bytes:
    """The bytes of what `write` writes."""
    numbers = Numbers()
    joints = list(range(JOINT_COUNT + 1))
    document: dict = {
        "asset": {"version": "2.0", "generator": "Patchwalk"},
        "scene": 0,
        "scenes": [{"nodes": [0, JOINT_COUNT + 1]}],  # a skinned mesh is placed by its joints alone: it hangs on none
        "nodes": [*_joint_nodes(), {"name": "Figure", "mesh": 0, "skin": 0}],
        "skins": [
            {
                "name": "Skeleton",
                "skeleton": 0,
                "joints": joints,
                "inverseBindMatrices": numbers.add(_inverse_bind_matrices()),
            }
        ],
        "materials": [{"name": "Figure", "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.8}}],
        "meshes": [{"name": "Figure", "primitives": [_primitive(numbers, part_colours)]}],
        "animations": [animation(numbers, "Patchwalk", fps, _tracks(clip, ground, fps, in_place, root))],
    }
    if ground is not None:
        add_scenery(document, numbers, *ground_around(ground, clip.hips))
    return encode_glb(document, numbers)


def _joint_nodes() -> list[dict]:
    """The root and the skeleton in the T-pose."""
    nodes: list[dict] = [{"name": ROOT, "children": [1]}]
    nodes += [{"name": name, "translation": offset.tolist()} for name, offset in zip(JOINTS, BONE_OFFSETS, strict=True)]
    nodes[1]["translation"] = T_POSE.hips.tolist()
    for joint, parent in enumerate(PARENTS[1:], 1):
        nodes[1 + parent].setdefault("children", []).append(1 + joint)
    return nodes


def _inverse_bind_matrices() -> np.ndarray:
    """(22, 4, 4) from the world to root and joints in the T-pose, column by column as glTF wants."""
    columns = np.tile(np.eye(4), (JOINT_COUNT + 1, 1, 1))
    columns[1:, 3, :3] = -T_POSE.positions
    return columns


def _tracks(
    clip: Clip, ground: Ground | None, fps: int, in_place: bool, root: RootFrame | None
) -> list[tuple[int, str, np.ndarray]]:
    """The way of the root, that of the hips about it, and the turns of each joint."""
    root = root or root_frame(clip.positions(), clip.fps)
    every = slice(None, None, FPS // fps)
    heights = 0.0 if ground is None else ground.smooth_height_at(root.positions[:, ::2])[:, None]
    way = (root.positions * FLOOR + heights * UP)[every]
    facing = rot.from_yaw(root.facing[every])
    turns = clip.rotations[every].copy()
    turns[:, 0] = rot.multiply(rot.inverse(facing), turns[:, 0])
    tracks = [
        (0, "translation", way * UP if in_place else way),
        (0, "rotation", facing),
        (1, "translation", rot.rotate(rot.inverse(facing), clip.hips[every] - way)),
        *((1 + joint, "rotation", turn) for joint, turn in enumerate(np.moveaxis(turns, 1, 0))),
    ]
    return [(node, path, xyzw(rot.make_continuous(v)) if path == "rotation" else v) for node, path, v in tracks]


def _primitive(numbers: Numbers, part_colours: np.ndarray) -> dict:
    """The mesh: corners with their joints and weights, colours with the shade of the folds in them."""
    skin = load_skin(FINE)
    positions, normals = in_t_pose(skin)
    weights = skin.weights.astype(np.float32)
    weights /= weights.sum(axis=-1, keepdims=True)
    joints = np.where(weights > 0, 1 + skin.joints, 0)  # a joint that is not followed must be 0
    attributes = {
        "NORMAL": normals,
        "COLOR_0": _colours(skin, part_colours),
        "JOINTS_0": joints.astype(np.uint8),
        "WEIGHTS_0": weights,
    }
    return {
        "attributes": {
            "POSITION": numbers.add(positions, VERTICES, bounds=True),
            **{name: numbers.add(values, VERTICES) for name, values in attributes.items()},
        },
        "indices": numbers.add(skin.triangles.ravel().astype(np.uint32), INDICES),
        "material": 0,
    }


def in_t_pose(skin: Skin) -> tuple[np.ndarray, np.ndarray]:
    """Corners and normals (n, 3) that, tied to the joints in the T-pose, give the skin where it was made: arms hang
    near there, and there it has no creases."""
    to_bind = BIND.rotations  # each joint's from the T-pose, in which none is turned
    weights = skin.weights
    weights = weights / weights.sum(-1, keepdims=True)
    turns = np.einsum("nt,ntij->nij", weights, rot.to_matrix(to_bind)[skin.joints])
    shifts = BIND.positions - rot.rotate(to_bind, T_POSE.positions)
    back = np.linalg.inv(turns)
    moved = skin.positions - np.einsum("nt,ntj->nj", weights, shifts[skin.joints])
    return (back @ moved[..., None])[..., 0], rot.normalize((back @ skin.normals[..., None])[..., 0])


def ground_around(ground: Ground, hips: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ground about the way of the hips (n, 3): corners (m, 3) and triangles (k, 3)."""
    low, high = hips[:, ::2].min(axis=0) - GROUND_MARGIN, hips[:, ::2].max(axis=0) + GROUND_MARGIN
    cell = ground.cell
    while (high - low).max() > GROUND_CELLS * cell:
        cell *= 2
    axes = [np.arange(np.floor(a / cell), np.ceil(b / cell) + 1) * cell for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*axes), axis=-1)  # (along z, along x, 2)
    positions = np.stack([places[..., 0], ground.height_at(places), places[..., 1]], axis=-1).reshape(-1, 3)
    corners = np.arange(len(positions)).reshape(places.shape[:2])
    a, b, c, d = corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:]
    return positions, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def _colours(skin: Skin, part_colours: np.ndarray) -> np.ndarray:
    """(n, 3) linear light of each corner, as the window's shaders see it (demo/render/body_shaders.py): squares of
    display colours."""
    limbs, gloves, openness = skin.materials[:, :4], skin.materials[:, 4:5], skin.materials[:, 5:]
    part = np.where(limbs.sum(axis=1) > 0.5, np.array(LIMBS)[limbs.argmax(axis=1)], PART_NAMES.index("spine"))
    colours = part_colours[part] ** 2 * (1 - GLOVES * (gloves > 0.5)) * (SHADED + (1 - SHADED) * openness)
    off = np.sum(((skin.positions - VISOR) * VISOR_SHARPNESS) ** 2, axis=-1, keepdims=True)
    return colours + (VISOR_COLOUR - colours) * np.clip(9 * (1 - off), 0, 1)
