"""Packets: small, and drawn where the pose is."""

import numpy as np

from demo.serve import packet
from sim.body.kinematics import forward_kinematics
from sim.command import Command
from sim.ground.catalogue import load_ground
from sim.motion.clip import FPS
from tests.support.fakes import fake_session

MOST = 60_000  # bytes a second
HAIR = 1e-4  # metres


def frames(count, ground=None):
    session = fake_session(ground)
    script = Command(move=(0.6, 0.8), gait="run", style={"arms": ("flapping", 1.0), "spine": ("bent", 0.5)})
    return [session.step(script) for _ in range(count)]


def read(record, kind):
    return np.frombuffer(record, kind, 1)[0]


def test_a_second_is_small_with_all_that_can_be_seen():
    frame = frames(1)[0]
    paths = np.zeros((5, 2)), np.zeros((5, 2))
    assert FPS * len(packet.pack(frame, 1)) < MOST / 3
    assert FPS * len(packet.pack(frame, 1, twin=True, paths=paths)) < MOST


def test_joints_are_drawn_within_a_hair_of_where_they_are():
    for frame in frames(90):
        record = read(packet.pack(frame, 7), packet.FRAME)
        drawn = forward_kinematics(record["hips"], packet.unpack_pose(record["rotations"]))
        assert np.abs(drawn - frame.styled.positions).max() < HAIR


def test_all_fields_arrive():
    ground = load_ground("hills")
    frame = frames(60, ground)[-1]
    desired, predicted = np.arange(10.0).reshape(5, 2), -np.arange(10.0).reshape(5, 2)
    block = packet.pack(frame, 60, 12, playing=True, twin=True, paths=(desired, predicted), ground=ground)
    record = read(block, packet.FRAME)
    assert (record["number"], record["answers"]) == (60, 12)
    assert record["flags"] == sum(packet.FLAGS[name] for name in ("playing", "twin", "paths"))
    x, z = record["root"][[0, 2]]
    height = record["plane"] @ [1, x, z]
    np.testing.assert_allclose(height, ground.smooth_height_at(frame.styled.root_position[[0, 2]]), atol=1e-4)
    np.testing.assert_allclose(record["contacts"] / 255, frame.styled.contacts, atol=1 / 255)
    twin = read(block[packet.FRAME.itemsize :], packet.TWIN)
    np.testing.assert_allclose(twin["hips"], frame.neutral.hips, atol=1e-4)
    ways = read(block[packet.FRAME.itemsize + packet.TWIN.itemsize :], packet.PATHS)
    assert (ways["desired"] == desired).all() and (ways["predicted"] == predicted).all()


def test_the_layout_tells_where_every_byte_is():
    told = packet.layout()["records"]
    for name, kind in (("frame", packet.FRAME), ("twin", packet.TWIN), ("paths", packet.PATHS)):
        fields = told[name]["fields"].values()
        assert told[name]["size"] == kind.itemsize == sum(int(of[1:]) // 8 * count for _, of, count in fields)
