"""Models for the page: what is packed is what the window draws, and a character's few bones carry all of its skin."""

import io
import json
import struct

import numpy as np
import pytest
from PIL import Image

from demo.figure import body
from demo.figure.character_model import DrawnCharacter
from demo.figure.skin import own_model
from demo.serve import model_file
from demo.serve.model_file import Bones, own_figure
from sim.character.character import load_character
from sim.command import Command
from sim.math import rotations as rot
from tests.support.fakes import fake_session
from tests.support.skinned import Build, write


def unpack(block):
    """As the page reads it: part -> name -> numbers."""
    (length,) = struct.unpack("<I", block[:4])
    kinds = {"triangles": np.uint32, "png": np.uint8}
    return {
        part: {
            name: np.frombuffer(block, kinds.get(name, np.float32), size, 4 + length + offset)
            for name, (offset, size) in arrays.items()
        }
        for part, arrays in json.loads(block[4 : 4 + length]).items()
    }


def carried(skin, bind, positions, rotations):
    """(n, 3) the skin's corners as the page's shader carries them."""
    bind = bind.reshape(-1, 7)
    turns = rot.multiply(rotations, rot.inverse(bind[:, 3:]))
    corners = skin["position"].reshape(-1, 3)
    joints, weights = skin["joints"].reshape(-1, 4).astype(int), skin["weights"].reshape(-1, 4)
    moved = rot.rotate(turns[joints], corners[:, None] - bind[joints, :3]) + positions[joints]
    return np.sum(weights[..., None] * moved, axis=1)


def walk(frames=40):
    session = fake_session()
    return [session.step(Command(move=(0.4, 0.9), style={"arms": "flapping"})) for _ in range(frames)]


def test_the_page_places_the_figure_as_the_window_does():
    model, pose = unpack(own_figure()), walk()[-1].styled
    drawn = own_model().fine.posed(body.bones(pose))[0]
    np.testing.assert_allclose(
        carried(model["fine"], model["bind"]["bones"], pose.positions, pose.rotations), drawn, atol=1e-4
    )
    assert (model["fine"]["triangles"] == own_model().fine.triangles.ravel()).all()


def test_a_characters_few_bones_carry_all_of_its_skin(tmp_path):
    fingers = {
        f"LeftHandIndex{n}": ("LeftHand" if n == 1 else f"LeftHandIndex{n - 1}", (0.03, 0, 0)) for n in (1, 2, 3)
    }
    character = load_character(write(tmp_path / "hero.glb", Build(extra=fingers)))
    own, bones = DrawnCharacter(character), Bones(character)
    model = unpack(bones.model(own.model))
    for frame in walk():
        own.follow(frame.styled, None)
    root = frame.styled.root_position
    record = np.frombuffer(bones.packed(own.newest, root), model_file.BONE)
    assert len(record) < len(character.rest), "fingers go with their hand"
    rotations = rot.normalize(record["rotation"].astype(float))
    positions = record["place"] * model_file.PLACE + root
    drawn = own.model.fine.posed(own.newest.bones(character))[0]
    np.testing.assert_allclose(
        carried(model["fine"], model["bind"]["bones"], positions, rotations), drawn, atol=3 * model_file.PLACE
    )
    picture = np.asarray(Image.open(io.BytesIO(model["picture"]["png"].tobytes())))
    assert (picture == own.model.picture).all()


def test_more_bones_than_a_page_holds_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(model_file, "MOST_BONES", 5)
    with pytest.raises(ValueError, match="hero has .* bones that move: a page draws 5 at most"):
        Bones(load_character(write(tmp_path / "hero.glb")))
