"""A character written again: by the validator's rules, with all that was in its file, and moved as it was drawn."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from sim.character.character import Character, load_character
from sim.character.glb import encode_still, write_glb
from sim.character.motion import fit_motion
from sim.io.gltf_file import GltfFile, rest_of
from sim.math import rotations as rot
from tests.sim.character.conftest import KINDS
from tests.support.gltf_validator import validate
from tests.support.skinned import Build, encode, write


def played(path: Path, frame: int) -> dict[str, np.ndarray]:
    """Where each named node of a file is in a frame of its animation, by the specification's own formula."""
    file = GltfFile(path)
    local = {number: list(rest_of(node)) for number, node in enumerate(file.nodes)}
    (animation,) = file.document["animations"]
    for channel in animation["channels"]:
        value = file.numbers(animation["samplers"][channel["sampler"]]["output"])[frame]
        rotation = channel["target"]["path"] == "rotation"
        local[channel["target"]["node"]][int(rotation)] = np.roll(value, 1) if rotation else value
    world: dict[int, np.ndarray] = {}
    places = {}
    for number in sorted(local, key=lambda number: len(file.above(number))):
        matrix = np.eye(4)
        translation, rotation, scale = local[number]
        matrix[:3, :3], matrix[:3, 3] = rot.to_matrix(rotation) * scale, translation
        world[number] = world[file.parents[number]] @ matrix if file.parents[number] >= 0 else matrix
        places[file.name(number)] = world[number][:3, 3]
    return places


def corners(path: Path, frame: int) -> np.ndarray:
    """(n, 3) of a file's skinned mesh in a frame, by the specification's own formula."""
    file = GltfFile(path)
    skin, mesh = file.document["skins"][0], file.document["meshes"][0]["primitives"][0]["attributes"]
    animated = {number: list(rest_of(node)) for number, node in enumerate(file.nodes)}
    (animation,) = file.document["animations"]
    for channel in animation["channels"]:
        value = file.numbers(animation["samplers"][channel["sampler"]]["output"])[frame]
        rotation = channel["target"]["path"] == "rotation"
        animated[channel["target"]["node"]][int(rotation)] = np.roll(value, 1) if rotation else value

    def world(number: int) -> np.ndarray:
        matrix = np.eye(4)
        translation, rotation, scale = animated[number]
        matrix[:3, :3], matrix[:3, 3] = rot.to_matrix(rotation) * scale, translation
        return world(file.parents[number]) @ matrix if file.parents[number] >= 0 else matrix

    inverse = file.numbers(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
    joints = np.array([world(node) @ bind for node, bind in zip(skin["joints"], inverse, strict=True)])
    positions = np.column_stack([file.numbers(mesh["POSITION"]), np.ones(len(file.numbers(mesh["POSITION"])))])
    ties, weights = file.numbers(mesh["JOINTS_0"]).astype(int), file.numbers(mesh["WEIGHTS_0"])
    return np.einsum("nt,ntij,nj->ni", weights, joints[ties], positions)[:, :3]


def document_of(path: Path) -> dict:
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])


@pytest.fixture
def character(tmp_path, build) -> Character:
    return load_character(write(tmp_path / "hero.glb", build))


def test_joints_and_mesh_are_where_they_were_drawn(tmp_path, character, walk):
    motion = fit_motion(character, walk)
    write_glb(tmp_path / "out.glb", motion)
    frame = 110
    places = played(tmp_path / "out.glb", frame)
    for joint in np.flatnonzero(character.hangs):
        np.testing.assert_allclose(places[character.joint_names[joint]], motion.positions[frame, joint], atol=1e-5)
    mesh = character.mesh
    arms = (mesh.positions[:, None] - character.rest[mesh.joints]) * character.scale
    turned = rot.rotate(motion.rotations[frame][mesh.joints], arms) + motion.positions[frame][mesh.joints]
    ours = np.sum(mesh.weights[..., None] * turned, axis=1)
    np.testing.assert_allclose(corners(tmp_path / "out.glb", frame), ours, atol=1e-5)
    assert document_of(tmp_path / "out.glb")["animations"][0]["name"] == "Patchwalk"


def test_a_root_carries_the_way_and_nothing_does_in_place(tmp_path, character, walk):
    for name, in_place in (("way", False), ("still", True)):
        write_glb(tmp_path / f"{name}.glb", fit_motion(character, walk, fps=30, in_place=in_place))
    way, still = (played(tmp_path / f"{name}.glb", 55) for name in ("way", "still"))
    np.testing.assert_allclose(way["root"][::2], walk[110].root_position[::2] * character.scale, atol=1e-4)
    np.testing.assert_allclose(still["root"], way["root"] * [0.0, 1.0, 0.0], atol=1e-4)
    hips = character.joint_names[character.index["Hips"]]
    np.testing.assert_allclose(way[hips] - still[hips], way["root"] - still["root"], atol=1e-4)
    document = document_of(tmp_path / "way.glb")
    root = next(number for number, node in enumerate(document["nodes"]) if node["name"] == "root")
    assert root in document["skins"][0]["joints"], "engines take it for a bone"


@pytest.mark.parametrize(
    "kind", ["our names", "centimetres, A-pose, backwards", "VRM 0", "VRM 1", "saved in a movement"]
)
def test_the_official_validator_finds_no_mistake(tmp_path, walk, kind):
    path = write(tmp_path / "hero.glb", KINDS[kind])
    write_glb(tmp_path / "out.glb", fit_motion(load_character(path), walk[:30]))
    issues = validate(tmp_path / "out.glb")["issues"]
    assert issues["numErrors"] == 0 and issues["numWarnings"] <= validate(path)["issues"]["numWarnings"], issues


def test_materials_textures_and_tables_stay_and_old_animations_go(tmp_path, walk):
    path = write(tmp_path / "hero.vrm", KINDS["VRM 1"])
    before = document_of(path)
    for _ in range(2):  # what was written is read and written again
        character = load_character(path)
        path = tmp_path / "out.glb"
        write_glb(path, fit_motion(character, walk[:10]))
        after = document_of(path)
        for key in ("materials", "textures", "extensions", "extensionsUsed"):
            assert after[key] == before[key]
        assert len(after["animations"]) == 1 and len(after["images"]) == len(before["images"])
        assert sum(node["name"] == "root" for node in after["nodes"]) == 1, "the one that is there is used again"


def test_what_lies_beside_a_file_comes_into_the_copy(tmp_path):
    """A .gltf with its numbers and its picture in files beside it becomes one .glb."""
    data = encode(Build())
    length = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + length])
    numbers = data[28 + length :]
    view = document["bufferViews"][document["images"][0].pop("bufferView")]
    (tmp_path / "a.png").write_bytes(numbers[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
    (tmp_path / "a.bin").write_bytes(numbers)
    document["images"][0]["uri"], document["buffers"][0]["uri"] = "a.png", "a.bin"
    (tmp_path / "hero.gltf").write_text(json.dumps(document))
    original = load_character(tmp_path / "hero.gltf")
    (tmp_path / "elsewhere").mkdir()
    copy = tmp_path / "elsewhere" / "hero.glb"
    copy.write_bytes(encode_still(original.file))
    again = load_character(copy)
    np.testing.assert_array_equal(again.mesh.positions, original.mesh.positions)
    np.testing.assert_array_equal(again.mesh.materials[0].picture, original.mesh.materials[0].picture)


def test_a_motion_that_is_not_finite_is_not_written(tmp_path, walk):
    motion = fit_motion(load_character(write(tmp_path / "hero.glb", Build())), walk[:5])
    motion.positions[2, 3] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        write_glb(tmp_path / "out.glb", motion)
    assert not (tmp_path / "out.glb").exists()
