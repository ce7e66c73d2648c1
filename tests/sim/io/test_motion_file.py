"""Motions in other formats: what our own glTF export holds and SMPL poses come back; what is none is refused."""

import json
import struct

import numpy as np
import pytest

from demo.export import gltf as gltf_export
from sim.body.skeleton import INDEX
from sim.io import gltf_file, motion_file, smpl
from sim.math import rotations as rot
from sim.retarget.retarget import load_clip
from tests.support.walker import walking_clip

GREY = np.full((5, 3), 0.5)


def glb(document: dict, blob: bytes = b"") -> bytes:
    """A .glb of a document."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.fixture
def walk(tmp_path):
    """A walk, and the .glb that the export makes of it."""
    clip, path = walking_clip(120), tmp_path / "walk.glb"
    path.write_bytes(gltf_export.encode(clip, GREY))
    return clip, path


def test_our_own_glb_comes_back(walk):
    clip, path = walk
    back = load_clip(path)
    assert back.fps == 60 and back.name == "walk" and len(back) == len(clip)
    assert np.abs(back.positions() - clip.grounded().positions()).max() < 0.04
    assert len(motion_file.read(path, fps=30)) == 60, "sampled at that rate"


def test_animations_are_named_and_the_longest_is_read_with_a_warning(walk):
    clip, path = walk
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + length])
    short = json.loads(json.dumps(document["animations"][0]))
    for sampler in short["samplers"]:
        for side in ("input", "output"):  # the first second of the other one
            document["accessors"].append({**document["accessors"][sampler[side]], "count": 61})
            sampler[side] = len(document["accessors"]) - 1
    document["animations"].append(short | {"name": "Second"})
    path.write_bytes(glb(document, data[28 + length :]))
    with pytest.warns(UserWarning, match="holds 2 animations, of which the longest, 'Patchwalk', is read"):
        assert len(motion_file.read(path)) == 120
    assert len(motion_file.read(f"{path}#Second")) == 61
    with pytest.raises(ValueError, match="has no animation 'Thrid': there are Patchwalk, Second"):
        motion_file.read(f"{path}#Thrid")


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"glTF",
        b"\0" * 100,
        b"{}",
        b"[1]",
        b"[" * 100_000,
        glb({"nodes": [{"children": [0]}]}),
        glb({"nodes": [{"children": [1]}, {"children": [0]}], "animations": [{"samplers": [], "channels": []}]}),
        glb({"nodes": [{}], "animations": [{"samplers": [{"input": 9, "output": 9}], "channels": []}]}),
        glb(
            {
                "animations": [{"samplers": [{"input": 0}], "channels": []}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 10**9, "type": "SCALAR"}],
                "bufferViews": [{"buffer": 0}],
                "buffers": [{}],
            }
        ),
        glb(
            {
                "animations": [{"samplers": [{"input": 0}], "channels": []}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 1, "type": "SCALAR"}],
                "bufferViews": [{"buffer": 0}],
                "buffers": [{"uri": "../secret.bin"}],
            }
        ),
    ],
)
def test_a_file_that_is_no_gltf_is_refused_in_a_sentence(tmp_path, data):
    path = tmp_path / "wrong.glb"
    path.write_bytes(data)
    with pytest.raises(ValueError, match="wrong.glb") as error:
        motion_file.read(path)
    assert "\n" not in str(error.value) and len(str(error.value)) < 300


def test_every_cut_of_a_glb_is_refused_or_read(walk):
    _, path = walk
    data = path.read_bytes()
    for end in range(0, len(data), len(data) // 40):
        path.write_bytes(data[:end])
        with pytest.raises(ValueError, match="walk.glb"):
            motion_file.read(path)


def amass(path, frames=60, **changes):
    """A walk as AMASS has it: Z up, hips and knees swinging."""
    t = np.arange(frames) / 30
    vectors = np.zeros((frames, 52, 3))
    vectors[:, 0] = rot.to_rotation_vector(
        rot.from_axis_angle(np.tile([1.0, 0, 0], (frames, 1)), np.full(frames, 1.5708))
    )
    for joint, shift in ((1, 0.0), (2, np.pi)):
        vectors[:, joint, 0] = -0.4 * np.sin(4 * t + shift)
        vectors[:, joint + 3, 0] = 0.4 * (1 - np.cos(4 * t + shift))
    for joint, sign in ((16, -1), (17, 1)):
        vectors[:, joint, 2] = sign * 1.2
    places = np.stack([np.zeros(frames), -1.2 * t, np.full(frames, 0.9)], axis=-1)
    arrays = {"poses": vectors.reshape(frames, -1), "trans": places, "mocap_framerate": 30.0, "gender": "neutral"}
    np.savez(path, **{name: value for name, value in (arrays | changes).items() if value is not None})
    return path


def test_amass_poses_become_an_upright_walk(tmp_path):
    clip = load_clip(amass(tmp_path / "walk.npz"))
    positions = clip.positions()
    assert clip.fps == 60 and len(clip) == 119
    assert 1.3 < positions[:, INDEX["Head"], 1].mean() < 1.7
    speed = np.linalg.norm(np.gradient(positions[:, 0], 1 / 60, axis=0), axis=-1).mean()
    assert speed == pytest.approx(1.2 * 0.83 / 0.78, rel=0.05), "by the length of the legs"
    hands = positions[:, INDEX["LeftHand"]] - positions[:, INDEX["LeftArm"]]
    assert (hands[:, 1] < -0.3).all() and (
        positions[:, INDEX["LeftHand"], 0] > positions[:, INDEX["RightHand"], 0]
    ).all()


@pytest.mark.parametrize(
    "changes, sentence",
    [
        ({"poses": None}, "holds no SMPL poses"),
        ({"poses": np.zeros((60, 12))}, "has to hold 66 numbers"),
        ({"trans": np.zeros((3, 3))}, "'trans' has to hold 3 numbers for each of the 60 frames"),
        ({"mocap_framerate": None}, "does not say its frame rate.*--fps"),
        ({"trans": np.full((60, 3), np.nan)}, "no motion's"),
        ({"poses": np.array([{"a": 1}], dtype=object)}, "walk.npz"),
    ],
)
def test_arrays_that_are_no_poses_are_refused(tmp_path, changes, sentence):
    with pytest.raises(ValueError, match=sentence):
        motion_file.read(amass(tmp_path / "walk.npz", **changes))


def test_an_archive_that_is_damaged_or_too_large_is_refused(tmp_path, monkeypatch):
    path = amass(tmp_path / "walk.npz")
    monkeypatch.setattr(smpl, "MAX_MEGABYTES", 0)
    with pytest.raises(ValueError, match="walk.npz holds more than 0 MB"):
        motion_file.read(path)
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(ValueError, match="walk.npz is no .npz of poses"):
        motion_file.read(path)


def test_a_gltf_too_large_is_refused(walk, monkeypatch):
    monkeypatch.setattr(gltf_file, "MAX_MEGABYTES", 0)
    with pytest.raises(ValueError, match="walk.glb is larger than 0 MB"):
        motion_file.read(walk[1])


def test_fbx_is_refused_with_the_way_through_blender(tmp_path):
    (tmp_path / "walk.fbx").write_bytes(b"Kaydara FBX Binary")
    with pytest.raises(ValueError, match=r"walk.fbx: FBX cannot be read: open it in Blender"):
        motion_file.read(tmp_path / "walk.fbx")
