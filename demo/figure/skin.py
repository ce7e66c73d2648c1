"""A skin: triangles that follow joints. The figure's own comes in three levels from a file that `python -m
demo.tools.figure_mesh` makes."""

import hashlib
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Mapping

import numpy as np
from scipy import sparse

from demo.figure.forms import BIND
from sim.body.capsules import capsule_ends
from sim.body.skeleton import PART_NAMES, skeleton_hash
from sim.io import tensor_file

FILE = Path(__file__).with_name("mesh.safetensors")
MADE_BY = ("forms.py", "surface.py", "surface_nets.py", "simplify.py", "../tools/figure_mesh.py")  # beside this file
FINE, MEDIUM, COARSE = "fine", "medium", "coarse"  # the levels
TIES = 4  # joints a corner may follow
SLACK = 0.01  # a tie weaker than this is dropped
LIMBS = [place for place, name in enumerate(PART_NAMES) if name != "spine"]
REMEDY = "reinstall Patchwalk, or make it again with python -m demo.tools.figure_mesh"
# How each array of a skin is stored, small: its kind, and what its numbers are multiplied by.
_STORED = {
    "positions": (np.float32, 1),
    "normals": (np.int16, 32767),
    "joints": (np.uint8, 1),
    "weights": (np.uint8, 255),
    "triangles": (np.uint16, 1),
    "materials": (np.uint8, 255),
}


@dataclass(frozen=True)
class Skin:
    """A mesh in the bind pose: positions and normals (n, 3), the joints that a corner follows and their weights (n, 4),
    adding up to 1, triangles (m, 3), and six numbers of each corner for the shader (n, 6): of the figure its shares of
    the four limbs, of gloves and shoes, and how much light reaches it, 0..1."""

    positions: np.ndarray
    normals: np.ndarray
    joints: np.ndarray
    weights: np.ndarray
    triangles: np.ndarray
    materials: np.ndarray

    def posed(self, bones: np.ndarray) -> np.ndarray:
        """(2, n, 3) float32 where corners and their normals are in a pose: bones (4 joints, 3) float32 are for each
        joint the transform of row vectors from the bind pose to it, three rows of a turn and one of a shift
        (demo.figure.body.bones).

        A corner is the weighted sum of its joints' transforms of it, so all of them are one sparse product: half a
        millisecond, where a software driver's vertex shader takes several for each time the skin is drawn."""
        return (self._follow @ bones[: self._follow.shape[1]]).reshape(2, -1, 3)

    @cached_property
    def _follow(self) -> sparse.csr_matrix:
        weights, width = self.weights, 4 * (int(self.joints.max()) + 1)
        homogeneous = [
            np.column_stack([vectors, np.full(len(vectors), last)])
            for vectors, last in ((self.positions, 1.0), (self.normals, 0.0))
        ]
        columns = (self.joints[:, :, None].astype(np.int32) * 4 + np.arange(4)).ravel()
        rows = np.repeat(np.arange(len(weights)), self.joints.shape[1] * 4)
        halves = [
            sparse.csr_matrix(
                ((weights[:, :, None] * vectors[:, None]).ravel().astype(np.float32), (rows, columns)),
                (len(weights), width),
            )
            for vectors in homogeneous
        ]
        result = sparse.vstack(halves, format="csr")
        result.eliminate_zeros()
        return result

    @cached_property
    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Every edge once: its corners (e, 2), and the triangles on both sides of it (e, 2), the second -1 at a border.
        Corners at one place are one here, as along the seams of a texture."""
        _, place = np.unique(self.positions.round(5), axis=0, return_inverse=True)
        pairs = self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        keys = np.sort(place.ravel()[pairs], axis=1)
        order = np.lexsort(keys.T)
        same = (keys[order[1:]] == keys[order[:-1]]).all(axis=1)
        first = np.flatnonzero(np.concatenate([[True], ~same]))
        second = np.where(np.append(same, False)[first], order[np.minimum(first + 1, len(order) - 1)] // 3, -1)
        return pairs[order[first]], np.stack([order[first] // 3, second], axis=1)


@dataclass(frozen=True, eq=False)
class Model:
    """What a figure is drawn as: a skin for near, one for usual distances, and one for shadows and for what is not
    looked at closely; all three may be the same. With a picture, (height, width, 4) uint8, the six numbers of a corner
    are its display colour (1 for the picture's own) and its openness, and where in the picture it is, from its upper
    left corner; what has alpha 0 in the picture is cut out. limbs: (capsules, 2, 3) the ends of what keeps light from
    the skin, in its bind pose, in the order of Figure.capsules; None: nothing does, and it is drawn as one of many."""

    fine: Skin
    medium: Skin
    coarse: Skin
    picture: np.ndarray | None = None
    limbs: np.ndarray | None = None

    @property
    def of_many(self) -> bool:
        """Whether it keeps no light from itself, has no shadow but a disc, and edges as they come."""
        return self.limbs is None


@cache
def own_model() -> Model:
    """The figure's own. Raises ValueError for a damaged file."""
    return Model(load_skin(FINE), load_skin(MEDIUM), load_skin(COARSE), limbs=capsule_ends(BIND))


@cache
def crowd_model() -> Model:
    """The same for one of many, which cost little: its coarse skin. Raises ValueError for a damaged file."""
    skin = load_skin(COARSE)
    return Model(skin, skin, skin)


@cache
def load_skin(level: str) -> Skin:
    """The figure's skin at one of the levels. Raises ValueError for a damaged file."""
    _, arrays = tensor_file.read(FILE)
    with tensor_file.understanding(FILE, REMEDY):
        stored = {name: arrays[f"{level}.{name}"] for name in _STORED}
    scaled = {name: stored[name].astype(np.float32) / scale for name, (_, scale) in _STORED.items() if scale != 1}
    scaled["weights"] /= scaled["weights"].sum(axis=1, keepdims=True)
    return Skin(**(stored | scaled | {"triangles": stored["triangles"].astype(np.uint32)}))


def write(skins: Mapping[str, Skin], header: Mapping[str, str]) -> None:
    """Writes the figure's file: skins by level, and what made them. Raises OSError."""
    arrays = {
        f"{level}.{name}": (np.round(values * scale) if scale != 1 else values).astype(kind)
        for level, each in skins.items()
        for name, (kind, scale) in _STORED.items()
        for values in [getattr(each, name)]
    }
    tensor_file.write(FILE, arrays, {"what": "the figure's skin", "made_by": source_fingerprint(), **header})


def source_fingerprint() -> str:
    """Of all that the figure's file is made by: it must be made again when this is no longer what its header says."""
    texts = [(FILE.parent / name).read_text(encoding="utf-8") for name in MADE_BY]
    return hashlib.sha256("\0".join([*texts, skeleton_hash()]).encode()).hexdigest()[:16]
