"""Whose joints are whose, whatever they are called, and in which pose they were tied."""

import json
import struct

import numpy as np
import pytest

from sim.body.limb_ik import LEG_LENGTH
from sim.body.skeleton import INDEX, JOINTS
from sim.character.character import load_character
from sim.math import rotations as rot
from tests.sim.character.conftest import KINDS, NAMELESS, UNREAL
from tests.support.skinned import Build, encode, write


def edited(data: bytes, change) -> bytes:
    """A .glb whose document was changed in place."""
    length = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + length])
    change(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest


def test_every_joint_is_found_and_the_rest_pose_stands_as_ours(tmp_path, build):
    character = load_character(write(tmp_path / "hero.glb", build))
    assert {ours: character.joint_names[joint] for ours, joint in character.index.items()} == build.names
    rest = {name: character.rest[joint] for name, joint in character.index.items()}
    assert rest["LeftUpLeg"][0] > 0.05 and abs(rest["LeftUpLeg"] + rest["RightUpLeg"])[0] < 1e-6, "it faces +Z"
    legs = sum(np.linalg.norm(rest[f"Left{a}"] - rest[f"Left{b}"]) for a, b in (("UpLeg", "Leg"), ("Leg", "Foot")))
    assert abs(legs - LEG_LENGTH) < 1e-6, "its legs are as long as ours"
    assert abs(character.mesh.positions[:, 1].min()) < 1e-6, "it stands on the floor"


def test_in_our_t_pose_every_limb_points_where_ours_does(tmp_path, build):
    character = load_character(write(tmp_path / "hero.glb", build))
    for side, outwards in (("Left", 1.0), ("Right", -1.0)):
        for first, last, ours in (
            ("UpLeg", "Leg", (0.0, -1.0, 0.0)),
            ("Leg", "Foot", (0.0, -1.0, 0.0)),
            ("Arm", "ForeArm", (outwards, 0.0, 0.0)),
            ("ForeArm", "Hand", (outwards, 0.0, 0.0)),
        ):
            bone = character.rest[character.index[side + last]] - character.rest[character.index[side + first]]
            turned = rot.rotate(character.constants[INDEX[side + first]], rot.normalize(bone))
            np.testing.assert_allclose(turned, ours, atol=1e-6)


def test_a_guess_by_shape_is_said(tmp_path):
    assert "told by the skeleton's shape" in load_character(write(tmp_path / "a.glb", KINDS["by shape"])).notes[0]
    assert load_character(write(tmp_path / "b.glb", KINDS["VRM 0"])).notes == (), "VRM says which is which"


def test_a_map_says_which_joint_is_which(tmp_path):
    path = write(tmp_path / "hero.glb", Build(names=NAMELESS))
    swapped = NAMELESS | {"LeftArm": "b18", "RightArm": "b14"}
    assert load_character(path, swapped).index["LeftArm"] != load_character(path, NAMELESS).index["LeftArm"]


def test_joints_between_ours_turn_by_their_share_and_others_ride(tmp_path):
    build = Build(
        names=UNREAL,
        extra={
            "spine_02": ("Spine", (0.0, 0.07, 0.0)),
            "hair": ("Head", (0.0, 0.1, 0.0)),
            "twist": ("LeftArm", (0.1, 0, 0)),
        },
    )
    data = edited(encode(build), lambda document: _hang(document, "spine_03", "spine_02"))
    (tmp_path / "hero.glb").write_bytes(data)
    character = load_character(tmp_path / "hero.glb")
    at = {name: joint for joint, name in enumerate(character.joint_names)}
    assert character.shares[at["spine_02"]] == 0.5
    assert character.owners[at["spine_02"]].tolist() == [INDEX["Spine"], INDEX["Chest"]]
    assert character.owners[at["hair"], 0] == INDEX["Head"] and character.owners[at["twist"], 0] == INDEX["LeftArm"]
    assert not character.shares[[at["hair"], at["twist"]]].any()


def _hang(document: dict, child: str, parent: str) -> None:
    """Moves a node under another one."""
    nodes = document["nodes"]
    number = next(n for n, node in enumerate(nodes) if node["name"] == child)
    for node in nodes:
        if number in node.get("children", []):
            node["children"].remove(number)
        if node["name"] == parent:
            node.setdefault("children", []).append(number)


def _unhang(document: dict, number: int) -> None:
    """Takes a node, and all that hang on it, off its parent."""
    for node in document["nodes"]:
        if number in node.get("children", []):
            node["children"].remove(number)


@pytest.mark.parametrize(
    "change, sentence",
    [
        (lambda d: d.pop("meshes") and d["nodes"][-1].pop("mesh"), "it has no mesh"),
        (lambda d: d["nodes"][-1].pop("skin"), "not tied to a skeleton"),
        (lambda d: d["meshes"][0]["primitives"][0]["attributes"].pop("JOINTS_0"), "follow no joints"),
        (lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"]), "without compression"),
        (lambda d: d["nodes"][0].update(scale=[1.0, 2.0, 1.0]), "scaled unevenly"),
        (lambda d: d["accessors"][0].update(count=10**9), "reaches beyond|more than any file|over 666666666 triangles"),
        (lambda d: d["nodes"][1].update(children=[0]), "hangs on two others|in a circle"),
        (lambda d: d["nodes"][0].update(scale=[1e6] * 3), "legs are 8.*e.05 m long: glTF counts in metres"),
        (lambda d: d["nodes"][0].update(scale=[1e-9] * 3), "legs are 8.*e-10 m long: glTF counts in metres"),
        (lambda d: d["skins"][0]["joints"].__setitem__(3, 99), r"skins\[0\].joints\[3\] is 99, but there are 23 nodes"),
        (lambda d: d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"].pop("index"), "has no 'index'"),
        (lambda d: d.pop("textures"), r"baseColorTexture.index is 0, but there are 0 textures"),
        (lambda d: d["bufferViews"][-1].update(byteLength=10**8), "reaches beyond its buffer"),
        (lambda d: [node.update(name="a") for node in d["nodes"]] and _unhang(d, 2), "not known"),
    ],
)
def test_what_is_missing_is_said_in_one_sentence_that_names_the_file(tmp_path, change, sentence):
    path = tmp_path / "hero.glb"
    path.write_bytes(edited(encode(Build()), change))
    with pytest.raises(ValueError, match=sentence) as error:
        load_character(path)
    assert str(error.value).startswith(str(path))


@pytest.mark.parametrize(
    "name, data", [("a.glb", b"glTF" + bytes(40)), ("a.vrm", b"{}"), ("a.fbx", b""), ("a.glb", b"[1")]
)
def test_what_is_no_character_is_refused(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(ValueError, match=f"{name}"):
        load_character(tmp_path / name)


def test_a_vrm_table_that_leaves_out_a_limb_is_refused(tmp_path):
    build = Build(names={ours: name for ours, name in NAMELESS.items() if ours != "LeftForeArm"}, vrm=1)
    with pytest.raises(ValueError, match="VRM's table of its bones is not whole"):
        load_character(write(tmp_path / "hero.vrm", build))


def test_a_joint_that_lies_absurdly_far_away_is_named(tmp_path):
    path = write(tmp_path / "hero.glb", Build(extra={"hair": ("Head", (0.0, 1e6, 0.0))}))
    with pytest.raises(ValueError, match="its joint 'hair' lies 1[0-9]{6} leg lengths from its hips"):
        load_character(path)


def test_every_one_of_ours_has_a_constant(tmp_path):
    character = load_character(write(tmp_path / "hero.glb", KINDS["few joints"]))
    assert character.constants.shape == (len(JOINTS) + 1, 4)
    np.testing.assert_allclose(np.linalg.norm(character.constants, axis=-1), 1.0)
