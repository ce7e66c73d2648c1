"""The glTF file as others read it: the official validator, and a second library whose joints and skin must be ours."""

from pathlib import Path

import numpy as np
import pytest

from demo.export import gltf
from demo.figure.forms import BIND
from demo.figure.skin import FINE, load_skin
from sim.body.pose import Pose
from sim.body.skeleton import JOINTS, PART_NAMES
from sim.ground.catalogue import load_ground
from sim.math import rotations as rot
from sim.motion.clip import Clip, root_frame
from tests.support.gltf_validator import validate
from tests.support.walker import walking_clip

FRAMES = 40
COLOURS = np.linspace(0.2, 0.9, 3 * len(PART_NAMES)).reshape(-1, 3)


@pytest.fixture(scope="module")
def clip() -> Clip:
    return walking_clip(FRAMES)


@pytest.fixture(scope="module")
def path(clip, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("gltf") / "walk.glb"
    gltf.write(path, clip, COLOURS, load_ground("stairs"))
    return path


def test_the_official_validator_finds_nothing(path):
    report = validate(path)
    assert report["issues"]["messages"] == []
    assert report["info"]["hasSkins"] and report["info"]["animationCount"] == 1


class Reader:
    """Joints and skin of each frame as a glTF viewer finds them, by pygltflib and the specification's own formulas."""

    def __init__(self, path: Path) -> None:
        self.file = pytest.importorskip("pygltflib", reason="pygltflib reads the file a second time").GLTF2().load(path)
        (self.animation,), (self.skin,) = self.file.animations, self.file.skins
        self.parent = {child: node for node, n in enumerate(self.file.nodes) for child in n.children or ()}

    def numbers(self, accessor: int) -> np.ndarray:
        entry = self.file.accessors[accessor]
        view = self.file.bufferViews[entry.bufferView]
        kind = {5126: np.float32, 5125: np.uint32, 5121: np.uint8}[entry.componentType]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[entry.type]
        return np.frombuffer(self.file.binary_blob(), kind, entry.count * width, view.byteOffset).reshape(-1, width)

    def matrices(self, frame: int) -> np.ndarray:
        """(joints, 4, 4) joint to world."""
        local = [(np.array(node.translation or [0.0, 0, 0]), node.rotation) for node in self.file.nodes]
        for channel in self.animation.channels:
            value = self.numbers(self.animation.samplers[channel.sampler].output)[frame]
            translation, rotation = local[channel.target.node]
            local[channel.target.node] = (
                (value, rotation) if channel.target.path == "translation" else (translation, value)
            )

        def world(node: int) -> np.ndarray:
            translation, turn = local[node]
            x, y, z, w = turn if turn is not None else (0.0, 0.0, 0.0, 1.0)
            own = np.eye(4)
            own[:3, :3] = [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
            own[:3, 3] = translation
            return world(self.parent[node]) @ own if node in self.parent else own

        return np.array([world(node) for node in self.skin.joints])


@pytest.fixture(scope="module")
def reader(path) -> Reader:
    return Reader(path)


def test_joints_are_ours_in_every_frame(reader, clip):
    assert [reader.file.nodes[joint].name for joint in reader.skin.joints] == ["root", *JOINTS]
    times = reader.numbers(reader.animation.samplers[0].input).ravel()
    np.testing.assert_allclose(times, np.arange(FRAMES) / 60, atol=1e-6)
    positions = np.array([reader.matrices(frame)[1:, :3, 3] for frame in range(FRAMES)])
    np.testing.assert_allclose(positions, clip.positions(), atol=1e-5)


def test_the_skin_follows_as_in_the_window(reader, clip):
    attributes = reader.file.meshes[0].primitives[0].attributes
    bind = reader.numbers(reader.skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
    weights, joints = reader.numbers(attributes.WEIGHTS_0), reader.numbers(attributes.JOINTS_0)
    corners = np.column_stack([reader.numbers(attributes.POSITION), np.ones(len(joints))])
    frame = FRAMES // 2
    moved = np.einsum("nk,nkij,nj->ni", weights, (reader.matrices(frame) @ bind)[joints], corners)[:, :3]
    pose = Pose(np.zeros(3), 0.0, clip.hips[frame], clip.global_rotations()[frame], np.zeros(4), 0.0)
    skin, turns = load_skin(FINE), rot.multiply(pose.rotations, rot.inverse(BIND.rotations))
    arms = skin.positions[:, None] - BIND.positions[skin.joints]
    ours = np.sum(
        skin.weights[..., None] * (rot.rotate(turns[skin.joints], arms) + pose.positions[skin.joints]), axis=1
    )
    # Tied in the T-pose, the window's in another one: what follows several joints is not quite the same.
    np.testing.assert_allclose(moved, ours, atol=0.02)
    assert np.abs(moved - ours).mean() < 1e-3


def test_the_bind_pose_is_the_t_pose_and_the_root_carries_the_way(reader, clip, tmp_path):
    nodes = [reader.file.nodes[joint] for joint in reader.skin.joints]
    assert all(node.rotation is None for node in nodes)
    bind = reader.numbers(reader.skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
    np.testing.assert_allclose(-bind[1:, :3, 3], gltf.T_POSE.positions, atol=1e-6)
    track = {
        (channel.target.node, channel.target.path): reader.numbers(reader.animation.samplers[channel.sampler].output)
        for channel in reader.animation.channels
    }
    root = root_frame(clip.positions())
    np.testing.assert_allclose(track[0, "translation"][:, ::2], root.positions[:, ::2], atol=1e-5)
    gltf.write(tmp_path / "still.glb", clip, COLOURS, fps=30, in_place=True)
    still = Reader(tmp_path / "still.glb")
    positions = np.array([still.matrices(frame)[1:, :3, 3] for frame in range(FRAMES // 2)])
    way = root.positions[::2, None] * [1.0, 0.0, 1.0]
    np.testing.assert_allclose(positions, clip.positions()[::2] - way, atol=1e-5)


def test_the_ground_is_there_about_the_way_and_faces_up(reader, clip):
    (primitive,) = next(mesh for mesh in reader.file.meshes if mesh.name == "Ground").primitives
    positions, triangles = (
        reader.numbers(primitive.attributes.POSITION),
        reader.numbers(primitive.indices).reshape(-1, 3),
    )
    np.testing.assert_allclose(positions[:, 1], load_ground("stairs").height_at(positions[:, ::2]), atol=1e-5)
    way = clip.hips[:, ::2]
    assert (positions[:, ::2].min(0) < way.min(0) - 1.9).all() and (positions[:, ::2].max(0) > way.max(0) + 1.9).all()
    a, b, c = positions[triangles].swapaxes(0, 1)
    assert (np.cross(b - a, c - a)[:, 1] > 0).all() and len(positions) < 30_000


def test_colours_are_those_of_the_parts(reader, clip, tmp_path):
    """A part's colour reaches its own corners: the left hand's differ between two colourings, the right hand's do
    not."""
    other = COLOURS.copy()
    other[PART_NAMES.index("left_arm")] = 0.0
    gltf.write(tmp_path / "other.glb", clip, other)
    colours = [
        r.numbers(r.file.meshes[0].primitives[0].attributes.COLOR_0) for r in (reader, Reader(tmp_path / "other.glb"))
    ]
    x = load_skin(FINE).positions[:, 0]
    assert np.all(colours[0] >= 0) and np.all(colours[0] <= 1)
    assert np.all(colours[1][x > 0.5] < 1e-3) and np.array_equal(colours[0][x < -0.5], colours[1][x < -0.5])
