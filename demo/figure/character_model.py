"""A user's character as it is drawn: one skin, whose colours and textures are laid side by side in one picture."""

import math

import numpy as np
from PIL import Image
from scipy import sparse
from scipy.sparse import csgraph

from demo.figure.body import Figure
from demo.figure.skin import Model, Skin
from sim.body.pose import Pose
from sim.body.skeleton import INDEX, PART_NAMES
from sim.character.character import Character
from sim.character.fit import CharacterFit, Fitted
from sim.character.mesh import Material, SkinnedMesh
from sim.ground.ground import Ground
from sim.math import rotations as rot

PICTURE_PIXELS = 2048  # of a side of the picture that holds all textures
SOLID = 255  # alpha of what is drawn; 0 of what is cut out
COARSE_CELL = 0.03  # metres within which corners are one where a shadow is cast
FEWER = 0.7  # share of the corners over which a coarse skin would be no gain
OPEN = 0.01  # share of a piece's edges with nothing beyond them, over which its back can be seen


def character_model(character: Character) -> Model:
    """What the passes draw of a character, in its rest pose."""
    mesh, (picture, boxes) = character.mesh, _lay_out(character.mesh.materials)
    is_open = _is_open(mesh)
    corners, normals, materials, triangles, count = [], [], [], [], 0
    for (start, stop), material, box in zip(mesh.ranges, mesh.materials, boxes, strict=True):
        used, uvs, faces = _within_picture(mesh.uvs, mesh.triangles[start:stop])
        colours = mesh.colours[used, :3] * np.array(material.factor[:3])
        row = np.column_stack([colours, np.ones(len(used)), box[:2] + np.clip(uvs, 0.0, 1.0) * box[2:]])
        behind = faces[is_open[start:stop] & material.double_sided, ::-1]
        for side, shown in ((1, faces), (-1, behind)):
            if len(shown):
                corners.append(used)
                normals.append(side * mesh.normals[used])
                materials.append(row)
                triangles.append(count + shown)
                count += len(used)
    which = np.concatenate(corners)
    skin = Skin(
        mesh.positions[which].astype(np.float32),
        np.concatenate(normals).astype(np.float32),
        mesh.joints[which],
        mesh.weights[which].astype(np.float32),
        np.concatenate(triangles).astype(np.uint32),
        np.concatenate(materials).astype(np.float32),
    )
    return Model(skin, skin, _coarse(skin), picture)


def _coarse(skin: Skin) -> Skin:
    """The skin for shadows, where corners that lie close together and follow one joint most are one (Rossignac and
    Borrel 1993)."""
    strongest = skin.joints[np.arange(len(skin.joints)), skin.weights.argmax(axis=-1)]
    cells = np.column_stack([np.round(skin.positions / COARSE_CELL), strongest])
    _, first, cell, count = np.unique(cells, axis=0, return_index=True, return_inverse=True, return_counts=True)
    cell = cell.ravel()
    if len(first) > FEWER * len(cell):
        return skin
    places = np.zeros((len(first), 3))
    np.add.at(places, cell, skin.positions)
    triangles = cell[skin.triangles]
    kept = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles = np.unique(triangles[kept], axis=0)
    return Skin(
        (places / count[:, None]).astype(np.float32),
        skin.normals[first],
        skin.joints[first],
        skin.weights[first],
        triangles.astype(np.uint32),
        skin.materials[first],
    )


def _lay_out(materials: tuple[Material, ...]) -> tuple[np.ndarray, np.ndarray]:
    """All materials' pictures in one (h, w, 4), and of each the box (n, 4) that it takes: left, top, width and height
    as shares of the whole, from the middle of its first pixel to the middle of its last."""
    pictures = [_solid_or_cut(material) for material in materials]
    different = {id(picture): picture for picture in pictures}
    columns = math.ceil(math.sqrt(len(different)))
    cell = PICTURE_PIXELS // columns
    shrunk = {key: _shrunk(picture, cell) for key, picture in different.items()}
    width = max(picture.shape[1] for picture in shrunk.values())
    height = max(picture.shape[0] for picture in shrunk.values())
    rows = math.ceil(len(different) / columns)
    whole = np.full((rows * height, columns * width, 4), SOLID, np.uint8)
    boxes = {}
    for number, (key, picture) in enumerate(shrunk.items()):
        top, left = number // columns * height, number % columns * width
        h, w = picture.shape[:2]
        whole[top : top + h, left : left + w] = picture
        size = np.array([whole.shape[1], whole.shape[0]])
        boxes[key] = np.concatenate([(np.array([left, top]) + 0.5) / size, (np.array([w, h]) - 1) / size])
    return whole, np.array([boxes[id(picture)] for picture in pictures])


WHITE = np.full((1, 1, 4), SOLID, np.uint8)


def _solid_or_cut(material: Material) -> np.ndarray:
    """A material's picture (h, w, 4) with what is cut out at alpha 0 and all else at SOLID; white where it has none."""
    picture = WHITE if material.picture is None else material.picture
    if material.picture is None or (material.cut_off == 0.0 and (picture[..., 3] == SOLID).all()):
        return picture
    picture = picture.copy()
    drawn = picture[..., 3] * material.factor[3] >= material.cut_off * SOLID
    picture[..., 3] = np.where(drawn, SOLID, 0)
    return picture


def _shrunk(picture: np.ndarray, pixels: int) -> np.ndarray:
    """A picture of at most so many pixels a side."""
    if max(picture.shape[:2]) <= pixels:
        return picture
    image = Image.fromarray(picture)
    image.thumbnail((pixels, pixels))
    return np.asarray(image)


def _within_picture(uvs: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The corners that triangles (m, 3) have, as numbers (k,) of corners of the mesh, their places (k, 2) in a picture
    that is not repeated, and the triangles of those: one that lies in a repetition is moved into the picture."""
    shift = np.floor(uvs[triangles].mean(axis=1) + 1e-6)  # (m, 2)
    rows = np.column_stack([triangles.reshape(-1, 1), shift.repeat(3, axis=0)])
    used, number = np.unique(rows, axis=0, return_inverse=True)
    corners = used[:, 0].astype(int)
    return corners, uvs[corners] - used[:, 1:], number.reshape(-1, 3)


def _is_open(mesh: SkinnedMesh) -> np.ndarray:
    """(m,) whether a triangle belongs to a surface that has borders, as a cape, a lock of hair, a plate of armour: its
    back can be seen."""
    _, place = np.unique(mesh.positions.round(5), axis=0, return_inverse=True)
    corners = place.ravel()[mesh.triangles]
    pairs = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    pairs, count = np.unique(pairs, axis=0, return_counts=True)
    size = int(corners.max()) + 1
    joined = sparse.coo_matrix((np.ones(len(pairs)), pairs.T), (size, size))
    _, piece = csgraph.connected_components(joined, directed=False)
    pieces = piece.max() + 1
    borders = np.bincount(piece[pairs[count == 1, 0]], minlength=pieces)
    edges = np.bincount(piece[pairs[:, 0]], minlength=pieces)
    return (borders > OPEN * edges)[piece[corners[:, 0]]]


class DrawnCharacter:
    """A character that follows our poses, frame by frame, and how it is drawn."""

    def __init__(self, character: Character) -> None:
        self.character, self.model = character, character_model(character)
        self._fit = CharacterFit(character)
        self._fitted: Fitted | None = None
        mesh = character.mesh
        rides = character.owners[mesh.joints[np.arange(len(mesh.joints)), mesh.weights.argmax(axis=-1)], 0]
        crown = mesh.positions[rides == INDEX["Head"]]
        if not len(crown):
            crown = character.rest[[character.index["Head"]]]
        low, high = crown.min(axis=0), crown.max(axis=0)
        # (4, 3) of what the head carries, in the rest pose
        self._tips = np.array([low, [low[0], high[1], low[2]], [high[0], high[1], low[2]], high])

    def follow(self, pose: Pose, ground: Ground | None) -> None:
        """Takes the next pose of 60 a second, on the ground that it was made on."""
        self._fitted = self._fit.step(pose, ground)

    def figure(self, plane: np.ndarray) -> Figure:
        """The body in the newest pose, on a plane as Figure has it."""
        fitted = self.newest
        limbs = np.stack([fitted.positions[self.character.rig.parents], fitted.positions], axis=1)
        limbs = np.concatenate([limbs[self.character.hangs], self.points[None, -2:]])
        tints = np.ones((len(PART_NAMES), 4), np.float32)
        return Figure(fitted.bones(self.character), tints, plane, limbs, self.model)

    @property
    def points(self) -> np.ndarray:
        """(n, 3) its joints, and what of its mesh is farthest above the head's and beside it."""
        fitted, head = self.newest, self.character.index["Head"]
        tips = fitted.positions[head] + rot.rotate(fitted.rotations[head], self._tips - self.character.rest[head])
        return np.concatenate([fitted.positions[self.character.hangs], tips])

    @property
    def newest(self) -> Fitted:
        """The pose that was taken last, on the character."""
        assert self._fitted is not None, "a pose comes before a picture"
        return self._fitted
