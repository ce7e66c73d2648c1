"""A user's character as it is drawn: one skin, whose colours and textures are laid side by side in one picture."""

import math

import numpy as np
from PIL import Image

from demo.figure.body import Figure
from demo.figure.skin import Model, Skin
from sim.body.pose import Pose
from sim.body.skeleton import PART_NAMES
from sim.character.character import Character
from sim.character.fit import CharacterFit, Fitted
from sim.character.mesh import Material, SkinnedMesh
from sim.ground.ground import Ground

PICTURE_PIXELS = 2048  # of a side of the picture that holds all textures
SOLID = 255  # alpha of what is drawn; 0 of what is cut out
OPEN = 0.02  # share of a surface's edges with a triangle on one side only, over which it is seen from behind


def character_model(character: Character) -> Model:
    """What the passes draw of a character, in its rest pose."""
    mesh, (picture, boxes) = character.mesh, _lay_out(character.mesh.materials)
    corners, normals, materials, triangles, count = [], [], [], [], 0
    for (start, stop), material, box in zip(mesh.ranges, mesh.materials, boxes, strict=True):
        used, uvs, faces = _within_picture(mesh.uvs, mesh.triangles[start:stop])
        colours = mesh.colours[used, :3] * np.array(material.factor[:3])
        row = np.column_stack([colours, np.ones(len(used)), box[:2] + np.clip(uvs, 0.0, 1.0) * box[2:]])
        behind = material.double_sided and _is_open(mesh, mesh.triangles[start:stop])
        for side in (1, -1) if behind else (1,):
            corners.append(used)
            normals.append(side * mesh.normals[used])
            materials.append(row)
            triangles.append(count + faces[:, ::side])
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
    return Model(skin, skin, skin, picture, _limbs(character, character.rest))


def _limbs(character: Character, joints: np.ndarray) -> np.ndarray:
    """(limbs, 2, 3) both ends of what lies between joints (J, 3) of the body."""
    return np.stack([joints[character.rig.parents], joints], axis=1)[character.hangs]


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


def _is_open(mesh: SkinnedMesh, triangles: np.ndarray) -> bool:
    """Whether a surface has borders, as a cape or a lock of hair, so that its back is seen."""
    _, place = np.unique(mesh.positions.round(5), axis=0, return_inverse=True)
    pairs = np.sort(place.ravel()[triangles][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    count = np.unique(pairs, axis=0, return_counts=True)[1]
    return bool((count == 1).mean() > OPEN)


class DrawnCharacter:
    """A character that follows our poses, frame by frame, and how it is drawn."""

    def __init__(self, character: Character) -> None:
        self.character, self.model = character, character_model(character)
        self._fit = CharacterFit(character)
        self._fitted: Fitted | None = None

    def follow(self, pose: Pose, ground: Ground | None) -> None:
        """Takes the next pose of 60 a second, on the ground that it was made on."""
        self._fitted = self._fit.step(pose, ground)

    def figure(self, plane: np.ndarray) -> Figure:
        """The body in the newest pose, on a plane as Figure has it."""
        assert self._fitted is not None, "a pose comes before a picture"
        bones, positions = self._fitted.bones(self.character), self._fitted.positions
        limbs = _limbs(self.character, positions)
        return Figure(bones, np.ones((len(PART_NAMES), 4), np.float32), plane, limbs, self.model)
