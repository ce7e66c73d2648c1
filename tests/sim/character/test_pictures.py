"""Pictures that cannot be read are left out when a file is read, and so they are of what is written of it."""

import json
import warnings

import pytest

from sim.character.character import load_character
from sim.character.glb import encode_still
from sim.io.gltf_file import GltfFile
from tests.sim.character.test_character import edited
from tests.support.gltf_validator import validate
from tests.support.skinned import Build, encode

MISSING = {"uri": "skin.png"}
BROKEN = {"bufferView": 0}


def with_pictures(*images):
    """A character whose first material has the first picture as its colour, and the second as its normal map."""

    def change(document):
        document["images"] = [*images, *document["images"]]
        document["textures"] = [{"source": number} for number in range(len(document["images"]))]
        document["materials"][0]["normalTexture"] = {"index": len(images) - 1}

    return edited(encode(Build()), change)


def test_a_texture_that_cannot_be_decoded_is_left_out_with_a_warning(tmp_path):
    path = tmp_path / "hero.glb"
    path.write_bytes(with_pictures(BROKEN))
    with pytest.warns(UserWarning, match="the texture of 'cloth' is left out: it is damaged, or no picture"):
        character = load_character(path)
    assert character.mesh.materials[0].picture is None


@pytest.mark.parametrize("image", [MISSING, {"uri": "../a.png"}, {"uri": "data:image/png;base64,A"}, {"name": "a"}])
def test_a_lost_picture_is_said_once_and_neither_drawn_nor_written(tmp_path, image):
    path = tmp_path / "hero.glb"
    path.write_bytes(with_pictures(image))
    with pytest.warns(UserWarning, match="hero.glb: its picture 0 is left out") as said:
        character = load_character(path)
    assert len(said) == 1 and character.mesh.materials[0].picture is None
    (tmp_path / "out.glb").write_bytes(encode_still(character.file))
    written = GltfFile(tmp_path / "out.glb")
    cloth = written.document["materials"][0]
    assert "baseColorTexture" not in cloth["pbrMetallicRoughness"] and "normalTexture" not in cloth
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_character(tmp_path / "out.glb")
    assert len(written.document["images"]) == 2 and not written.lost_pictures, json.dumps(written.document["images"])


def test_the_official_validator_finds_no_mistake_without_it(tmp_path):
    path = tmp_path / "hero.glb"
    path.write_bytes(with_pictures(MISSING))
    with pytest.warns(UserWarning, match="left out"):
        path.write_bytes(encode_still(load_character(path).file))
    assert validate(path)["issues"]["numErrors"] == 0
