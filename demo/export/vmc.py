"""Live poses over UDP as Virtual Motion Capture messages: Blender, Unity or Unreal show the character while it walks.

The protocol (protocol.vmc.info/english) is OSC: one message a bone, named as Unity's humanoid bones are, with its place
and rotation relative to its parent. Unity's axes are left-handed, Y up, the character faces +Z with its left at -X:
ours mirrored in x. A bone's rotation counts from the T-pose, which is our rest pose."""

import socket
import struct
import time
import warnings
from typing import Any, Iterable, Iterator

import numpy as np

from sim.body.skeleton import BONE_OFFSETS, JOINTS
from sim.math import rotations as rot
from sim.motion.clip import FPS, MIRROR_POSITION, MIRROR_QUATERNION
from sim.session import Frame

HOST, PORT = "127.0.0.1", 39539  # this machine only, and the port that receivers listen on by default
LARGEST_PACKET = 1400  # bytes: what a network carries in one piece
_UNITY = {"UpLeg": "UpperLeg", "Leg": "LowerLeg", "Toe": "Toes", "Arm": "UpperArm", "ForeArm": "LowerArm"}
BUNDLE = b"#bundle\0" + struct.pack(">Q", 1)  # to be carried out at once


def _bone(joint: str) -> str:
    side = next((side for side in ("Left", "Right") if joint.startswith(side)), "")
    return side + _UNITY.get(joint.removeprefix(side), joint.removeprefix(side))


BONES = tuple(map(_bone, JOINTS))


def parse_address(text: str) -> tuple[str, int]:
    """HOST:PORT, or one of the two, as (host, port). Raises ValueError."""
    if ":" in text:
        host, _, port = text.rpartition(":")
    else:
        host, port = (HOST, text) if text.isdigit() else (text, str(PORT))
    if not (port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise ValueError(f"'{text}' names no port: write HOST:PORT, such as {HOST}:{PORT}")
    return host.strip("[]") or HOST, int(port)


class Sender:
    """Sends frames to one receiver. Whether anybody listens makes no difference: UDP asks nobody."""

    def __init__(self, address: str) -> None:
        """Raises ValueError, in one sentence, for an address that does not exist."""
        host, port = parse_address(address)
        self.address: tuple[Any, ...]  # as this kind of network has them
        try:
            found = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
            family, _, _, _, self.address = found[0]
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect(self.address)  # sends nothing, and says whether there is a way there
            self._socket = socket.socket(family, socket.SOCK_DGRAM)
        except (OSError, UnicodeError) as error:  # a name may be too odd to be looked up at all
            reason = getattr(error, "strerror", None) or "it is no name of a machine"
            raise ValueError(
                f"cannot stream to '{host}': {reason}; give a name or number that this machine can reach"
            ) from None
        self._socket.setblocking(False)
        self._frames = 0
        self.lost: dict[str, int] = {}  # why packets could not be sent -> how many

    def send(self, frame: Frame) -> None:
        """The styled pose of the next frame. A network that takes nothing just now loses it."""
        for packet in packets(frame, self._frames / FPS):
            try:
                self._socket.sendto(packet, self.address)
            except (
                BlockingIOError,
                ConnectionRefusedError,
            ):  # the line is full, or nobody listens: the next is on its way
                pass
            except OSError as error:
                reason = error.strerror or str(error)
                self.lost[reason] = self.lost.get(reason, 0) + 1
        self._frames += 1

    def report(self) -> None:
        """Warns, once for each reason, of what could not be sent."""
        for reason, count in self.lost.items():
            warnings.warn(f"{count} packets could not be sent to {self.address[0]}: {reason}", stacklevel=2)


def stream(frames: Iterable[Frame], sender: Sender) -> Iterator[Frame]:
    """The frames, each sent and handed on when its time has come: 60 a second, if they are made as fast."""
    start = time.perf_counter()
    for number, frame in enumerate(frames):
        time.sleep(max(0.0, start + number / FPS - time.perf_counter()))
        sender.send(frame)
        yield frame


def packets(frame: Frame, seconds: float) -> list[bytes]:
    """One frame as OSC bundles, each small enough for one packet."""
    bundles = [BUNDLE]
    for content in messages(frame, seconds):
        element = struct.pack(">i", len(content)) + content
        if len(bundles[-1]) + len(element) > LARGEST_PACKET:
            bundles.append(BUNDLE)
        bundles[-1] += element
    return bundles


def messages(frame: Frame, seconds: float) -> list[bytes]:
    """OSC messages: that there is a character, the time, its root on the floor, and each bone in it."""
    pose = frame.styled
    places = BONE_OFFSETS.copy()
    places[0] = pose.to_character(pose.hips - pose.root_position)
    turns = pose.local_rotations
    turns[0] = rot.multiply(rot.from_yaw(-pose.root_facing), turns[0])
    root = osc("/VMC/Ext/Root/Pos", "root", *_unity(pose.root_position, rot.from_yaw(pose.root_facing)))
    bones = [
        osc("/VMC/Ext/Bone/Pos", bone, *_unity(place, turn))
        for bone, place, turn in zip(BONES, places, turns, strict=True)
    ]
    return [osc("/VMC/Ext/OK", 1), osc("/VMC/Ext/T", float(seconds)), root, *bones]


def _unity(position: np.ndarray, rotation: np.ndarray) -> list[float]:
    """x, y, z and the quaternion x, y, z, w in Unity's axes."""
    return [*(position * MIRROR_POSITION).tolist(), *np.roll(rotation * MIRROR_QUATERNION, -1).tolist()]


def osc(address: str, *arguments: str | int | float) -> bytes:
    """One message of Open Sound Control 1.0: address, types and arguments, each padded to four bytes."""
    types, data = ",", b""
    for argument in arguments:
        kind, value = {
            str: ("s", _padded),
            int: ("i", struct.Struct(">i").pack),
            float: ("f", struct.Struct(">f").pack),
        }[type(argument)]
        types, data = types + kind, data + value(argument)
    return _padded(address) + _padded(types) + data


def _padded(text: str) -> bytes:
    raw = text.encode("ascii") + b"\0"
    return raw + bytes(-len(raw) % 4)
