"""What is drawn of a file: corners in the bind pose, the strongest ties, colours, pictures, and props that hang on."""

import io
import warnings
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from sim.character.character import load_character
from sim.character.mesh import read_mesh
from sim.character.rig import read_rig
from sim.io.gltf_file import GltfFile
from tests.sim.character.conftest import KINDS
from tests.sim.character.test_character import edited
from tests.support.skinned import Build, encode, write


@pytest.fixture
def mesh(tmp_path):
    file = GltfFile(write(tmp_path / "hero.glb", Build()))
    return read_mesh(file, read_rig(file))


def test_materials_hold_colours_and_pictures_as_they_are_displayed(mesh):
    cloth, skin = mesh.materials
    assert cloth.picture.shape == (8, 8, 4) and cloth.picture[0, 0].tolist() == [200, 30, 30, 255]
    np.testing.assert_allclose(skin.factor, [0.9, 0.5, 0.2, 1.0])
    assert mesh.ranges[0][1] == mesh.ranges[1][0] and mesh.ranges[1][1] == len(mesh.triangles)


def test_normals_that_a_file_lacks_point_outwards(mesh):
    middle = mesh.positions.reshape(-1, 8, 3).mean(axis=1, keepdims=True)
    outwards = (mesh.positions.reshape(-1, 8, 3) - middle).reshape(-1, 3)
    assert (np.vecdot(outwards, mesh.normals) > 0).all()


@pytest.mark.parametrize("kind", ["centimetres, A-pose, backwards", "saved in a movement"])
def test_the_bind_pose_is_the_one_that_the_mesh_was_tied_in(tmp_path, kind):
    """Whatever unit or pose the nodes have, the mesh stands as tall as the same one in metres and at rest."""
    build = KINDS[kind]
    plain = load_character(write(tmp_path / "a.glb", replace(build, unit=1.0, yaw=0.0, moved=False)))
    other = load_character(write(tmp_path / "b.glb", build))
    boxes, theirs = (each.mesh.positions.reshape(-1, 8, 3).mean(axis=1) for each in (plain, other))
    np.testing.assert_allclose(theirs, boxes, atol=1e-5)
    np.testing.assert_allclose(other.rest, plain.rest, atol=1e-5)


def test_a_mesh_that_hangs_on_a_joint_follows_it_and_scenery_is_left_out(tmp_path):
    def hang(document):
        first = document["meshes"][0]["primitives"][0]
        prop = {"attributes": {"POSITION": first["attributes"]["POSITION"]}, "indices": first["indices"]}
        document["meshes"].append({"primitives": [prop]})
        document["nodes"] += [{"name": "hat", "mesh": 1, "scale": [0.1, 0.1, 0.1]}, {"name": "floor", "mesh": 1}]
        head = next(node for node in document["nodes"] if node["name"] == "Head")
        head.setdefault("children", []).append(len(document["nodes"]) - 2)
        document["nodes"][0]["children"].append(len(document["nodes"]) - 1)

    path = tmp_path / "hero.glb"
    path.write_bytes(edited(encode(Build()), hang))
    character, plain = load_character(path), load_character(write(tmp_path / "plain.glb"))
    count = len(plain.mesh.positions)
    extra = character.mesh.joints[count:, 0]
    assert len(extra) == count // 2 and (extra == character.index["Head"]).all()


def test_the_strongest_four_of_eight_ties_are_kept(tmp_path):
    def more(document):
        attributes = document["meshes"][0]["primitives"][0]["attributes"]
        attributes |= {"JOINTS_1": attributes["JOINTS_0"], "WEIGHTS_1": attributes["WEIGHTS_0"]}

    path = tmp_path / "hero.glb"
    path.write_bytes(edited(encode(Build()), more))
    mesh = load_character(path).mesh
    assert mesh.weights.shape[1] == 4
    np.testing.assert_allclose(mesh.weights.sum(axis=-1), 1.0)


def test_a_texture_s_place_is_moved_as_the_file_says(tmp_path):
    def move(document):
        base = document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
        base["extensions"] = {"KHR_texture_transform": {"offset": [0.5, 0.0], "scale": [0.5, 1.0]}}

    path = tmp_path / "hero.glb"
    path.write_bytes(edited(encode(Build()), move))
    plain = load_character(write(tmp_path / "plain.glb")).mesh.uvs
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        moved = load_character(path).mesh.uvs
    half = len(plain) // 2
    np.testing.assert_allclose(moved[:half], plain[:half] * [0.5, 1.0] + [0.5, 0.0], atol=1e-6)


def test_a_picture_of_the_test_is_one():
    from tests.support.skinned import _picture

    assert Image.open(io.BytesIO(_picture())).size == (8, 8)


@pytest.mark.parametrize("much", ["corners", "primitives"])
def test_a_mesh_that_is_too_large_is_refused_before_it_is_read(tmp_path, much, monkeypatch):
    def enlarge(document):
        primitives = document["meshes"][0]["primitives"]
        if much == "corners":
            position = document["accessors"][primitives[0]["attributes"]["POSITION"]]
            position["count"] = 80_000_000
            del position["bufferView"]
        else:
            document["meshes"][0]["primitives"] = primitives * 100_000

    monkeypatch.setattr("sim.character.mesh._read_piece", lambda *_: pytest.fail("it was read"))
    with pytest.raises(ValueError, match="hero.*its mesh has over .* triangles: reduce it to 500000"):
        path = tmp_path / "hero.glb"
        path.write_bytes(edited(encode(Build()), enlarge))
        load_character(path)
