"""The stream as a receiver finds it: python-osc reads the packets, forward kinematics rebuilds the joints from them."""

import socket
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from demo import cli
from demo.export import vmc
from demo.live.live import run_live
from sim.body.skeleton import JOINTS, PARENTS
from sim.command import Command
from sim.session import Frame
from tests.demo.live.test_live import Clock
from tests.support.fakes import fake_session

osc_packet = pytest.importorskip("pythonosc.osc_packet", reason="python-osc reads the packets a second time")
RECORDING = (
    '{"format": "patchwalk-recording", "version": 1, "fps": 60}\n'
    '{"frame": 0, "move": [0.0, 1.0]}\n{"frame": 12, "end": true}\n'
)
CHARACTER = {"left_arm": ("bent", 1.0), "spine": ("flapping", 0.7)}


@pytest.fixture
def frames() -> list[Frame]:
    """Turning towards the character's left, restyled."""
    session = fake_session()
    return [session.step(Command((0.8, 0.6), style=CHARACTER)) for _ in range(60)]


@pytest.fixture
def receiver():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(5)
        yield receiver


def received(receiver, packets: int = 2) -> dict:
    """What the messages of one frame say: address or (address, name) -> the other arguments."""
    result = {}
    for _ in range(packets):
        data = receiver.recv(65536)
        assert len(data) <= vmc.LARGEST_PACKET
        for timed in osc_packet.OscPacket(data).messages:
            key, values = timed.message.address, timed.message.params
            if isinstance(values[0], str):
                key, values = (key, values[0]), values[1:]
            assert key not in result
            result[key] = values
    return result


def in_unity(said: dict) -> dict[str, np.ndarray]:
    """Bone -> place in Unity's world, as a receiver's hierarchy of transforms gives it. Parents stand before
    children."""

    def transform(numbers) -> np.ndarray:
        result = np.eye(4)
        # with left-handed axes the same formula holds: that is why Unity's numbers are mirrored
        x, y, z, w = numbers[3:]
        result[:3, :3], result[:3, 3] = Rotation.from_quat([x, y, z, w]).as_matrix(), numbers[:3]
        return result

    world = {}
    for joint, bone in enumerate(vmc.BONES):
        above = world[vmc.BONES[PARENTS[joint]]] if joint else transform(said["/VMC/Ext/Root/Pos", "root"])
        world[bone] = above @ transform(said["/VMC/Ext/Bone/Pos", bone])
    return {bone: matrix[:3, 3] for bone, matrix in world.items()}


def test_a_receiver_rebuilds_our_joints(frames, receiver):
    sender = vmc.Sender(f"127.0.0.1:{receiver.getsockname()[1]}")
    for number, frame in enumerate(frames):
        sender.send(frame)
        said = received(receiver)
        places = np.array(list(in_unity(said).values()))
        np.testing.assert_allclose(places * [-1, 1, 1], frame.styled.positions, atol=1e-4)
        assert said["/VMC/Ext/OK"] == [1] and said["/VMC/Ext/T"] == pytest.approx([number / 60])
        assert len(said) == 3 + len(JOINTS)


def test_axes_are_unity_s(frames, receiver):
    """Left-handed: it walked to our left and ahead, so to -X and +Z; its left hand is at its own left; bones are named
    as HumanBodyBones; the T-pose is no rotation at all."""
    sender = vmc.Sender(f":{receiver.getsockname()[1]}")
    sender.send(frames[-1])
    said = received(receiver)
    x, _, z, *_ = said["/VMC/Ext/Root/Pos", "root"]
    assert x < -0.3 and z > 0.3
    places = in_unity(said)
    facing = Rotation.from_quat(said["/VMC/Ext/Root/Pos", "root"][3:])
    ahead, right = facing.apply([0, 0, 1]), facing.apply([1, 0, 0])
    assert ahead[0] < -0.5 and ahead[2] > 0.5, "it faces where it goes"
    assert np.dot(places["LeftShoulder"] - places["RightShoulder"], right) < -0.05
    assert np.dot(places["LeftToes"] - places["LeftFoot"], ahead) > 0.02
    assert {
        "Hips",
        "Spine",
        "Chest",
        "Neck",
        "Head",
        "LeftUpperLeg",
        "LeftLowerLeg",
        "LeftFoot",
        "LeftToes",
        "LeftShoulder",
        "LeftUpperArm",
        "LeftLowerArm",
        "LeftHand",
    } < set(vmc.BONES)
    rest = frames[0].styled.with_body(frames[0].styled.hips, np.tile([1.0, 0, 0, 0], (len(JOINTS), 1)))
    sender.send(Frame(Command(), rest, rest))
    said = received(receiver)
    for bone in vmc.BONES[1:]:
        np.testing.assert_allclose(said["/VMC/Ext/Bone/Pos", bone][3:], [0, 0, 0, 1], atol=1e-6)


def test_nobody_listening_disturbs_nothing(frames):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gone:
        gone.bind(("127.0.0.1", 0))
        port = gone.getsockname()[1]
    sender = vmc.Sender(str(port))
    for frame in frames:
        sender.send(frame)
    sender.address = ("255.255.255.255", port)  # not allowed without asking: as a network that has gone
    sender.send(frames[0])


@pytest.mark.parametrize(
    "text, address",
    [
        ("", ("127.0.0.1", 39539)),
        ("192.168.0.7", ("192.168.0.7", 39539)),
        ("39540", ("127.0.0.1", 39540)),
        (":39540", ("127.0.0.1", 39540)),
        ("studio:1", ("studio", 1)),
        ("[::1]:5", ("::1", 5)),
    ],
)
def test_addresses(text, address):
    assert vmc.parse_address(text) == address


@pytest.mark.parametrize(
    "text", ["localhost:0", "localhost:70000", "localhost:port", "no.such.host.invalid", "a..b:9", "x" * 300]
)
@pytest.mark.parametrize("command", ["", "replay good.jsonl --headless"])
def test_a_bad_address_is_one_sentence(text, command, tmp_path, monkeypatch, capsys, fake_models):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.jsonl").write_text(RECORDING)
    assert cli.main([*command.split(), "--vmc", text]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("patchwalk: ") and err.count("\n") == 1
    assert "write HOST:PORT" in err or "cannot stream to" in err


def test_a_replay_streams_in_real_time(tmp_path, monkeypatch, receiver, fake_models):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "walk.jsonl").write_text(RECORDING)
    port = str(receiver.getsockname()[1])
    clock = Clock()
    monkeypatch.setattr(vmc, "time", SimpleNamespace(perf_counter=clock, sleep=lambda s: s and clock.sleep(s)))
    assert cli.main(["replay", "walk.jsonl", "--headless", "--vmc", port]) == 0
    assert clock.now == pytest.approx(100.0 + 11 / 60), "it waits for each frame's time"
    times = [received(receiver)["/VMC/Ext/T"][0] for _ in range(12)]
    np.testing.assert_allclose(times, np.arange(12) / 60, atol=1e-6)


def test_the_window_streams_what_it_shows(screen, receiver):
    clock, sender = Clock(), vmc.Sender(str(receiver.getsockname()[1]))
    session = fake_session()
    frames, step = [], session.step
    session.step = lambda command: frames.append(step(command)) or frames[-1]
    run_live(session, (), seconds=0.1, window=screen, clock=clock, sleep=clock.sleep, stream=sender)
    for frame in frames:
        places = np.array(list(in_unity(received(receiver)).values()))
        np.testing.assert_allclose(places * [-1, 1, 1], frame.styled.positions, atol=1e-4)
    assert len(frames) == 6


def test_an_address_that_nothing_can_be_sent_to_is_refused_at_once():
    with pytest.raises(ValueError, match="cannot stream to '255.255.255.255'"):
        vmc.Sender("255.255.255.255")


def test_packets_that_cannot_be_sent_are_counted_and_said_once(monkeypatch):
    sender = vmc.Sender("127.0.0.1")

    def unreachable(*_):
        raise OSError(101, "Network is unreachable")

    monkeypatch.setattr(sender, "_socket", SimpleNamespace(sendto=unreachable))
    session = fake_session()
    for _ in range(3):
        sender.send(session.step(Command()))
    with pytest.warns(
        UserWarning, match=r"\d+ packets could not be sent to 127.0.0.1: Network is unreachable"
    ) as caught:
        sender.report()
    assert len(caught) == 1
