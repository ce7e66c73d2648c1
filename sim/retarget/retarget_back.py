"""A restyled clip back on the skeleton it came from: the file's own joints, bones, channels, unit and frame rate.

Only the difference travels back: each of their joints turns as ours was turned by the restyling, so joints that we lack
(fingers, more of a spine) ride along, and where nothing was restyled the file's own motion comes out unchanged."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from sim.body.kinematics import two_bone_ik
from sim.body.limb_ik import LEG_LENGTH
from sim.body.skeleton import INDEX
from sim.io.bvh import Motion
from sim.io.bvh_parser import POSITION_ORDER
from sim.math import rotations as rot
from sim.math.vectors import UP
from sim.motion.clip import Clip
from sim.retarget.plausibility import SIDES
from sim.retarget.source_skeleton import SourceBody, mirrored

UNCHANGED = 1e-9  # metres: a leg that moved less was not restyled
REACH = 0.9999  # share of a leg's length that is used


def retarget_back(motion: Motion, content: Clip, styled: Clip, name_map: dict[str, str] | None = None) -> Motion:
    """`motion` as restyled: content and styled are its clip on our skeleton before and after, at any frame rate.

    Hips and feet move as far as ours do, by leg length, whatever the proportions. Raises ValueError for an unknown
    skeleton."""
    body = SourceBody(motion, name_map)
    motion = body.motion
    turns = rot.multiply(styled.global_rotations(), rot.inverse(content.global_rotations()))
    turns = rot.normalize(_at_their_rate(rot.make_continuous(turns), content.fps, motion))
    moved = _at_their_rate(styled.positions() - content.positions(), content.fps, motion)
    shifts = {name: moved[:, joint] * body.leg_length() / LEG_LENGTH for name, joint in INDEX.items()}

    owners = _owners(body)
    rotations = body.rotations.copy()
    for joint, owner in enumerate(owners):
        if owner:
            rotations[:, joint] = rot.multiply(turns[:, INDEX[owner]], rotations[:, joint])
    positions = _chained(body, rotations, shifts["Hips"])
    if max(np.abs(shifts[name]).max() for name in ("Hips", "LeftFoot", "RightFoot", "LeftLeg", "RightLeg")) > UNCHANGED:
        for side in SIDES:
            _foot_down(body, owners, rotations, positions, side, shifts[side + "Foot"])
        positions = _chained(body, rotations, shifts["Hips"])
    return _as_motion(body, rotations, positions)


def _at_their_rate(values: np.ndarray, fps: float, motion: Motion) -> np.ndarray:
    """Values of our frames (F, ...) at the file's frames; past our last frame the last value stays."""
    if len(values) < 2:
        return values[:1].repeat(len(motion), axis=0)
    wanted = np.minimum(np.arange(len(motion)) * fps / motion.fps, len(values) - 1)
    return CubicSpline(np.arange(len(values)), values)(wanted)


def _owners(body: SourceBody) -> list[str | None]:
    """For each of their joints that of ours whose turn it takes: its own, or its nearest mapped ancestor's."""
    owners: list[str | None] = [None] * len(body.motion.names)
    for ours, theirs in body.index.items():
        owners[theirs] = ours
    for joint, parent in enumerate(body.motion.parents):
        if owners[joint] is None and parent >= 0:
            owners[joint] = owners[parent]
    return owners


def _carrier(body: SourceBody) -> int | None:
    """The joint whose position channels carry the body: the hips, or the nearest above them that has some."""
    joint = body.index["Hips"]
    while joint >= 0:
        if set(POSITION_ORDER) <= set(body.motion.channels[joint]):
            return joint
        joint = body.motion.parents[joint]
    return None


def _chained(body: SourceBody, rotations: np.ndarray, hips_shift: np.ndarray) -> np.ndarray:
    """World positions (F, J, 3) from world rotations (F, J, 4), the body shifted by (F, 3)."""
    positions, carrier = body.positions.copy(), _carrier(body)
    for joint, parent in enumerate(body.motion.parents):
        if parent >= 0 and joint != carrier:
            positions[:, joint] = positions[:, parent] + rot.rotate(
                rotations[:, parent], body.motion.positions[:, joint]
            )
        if joint == carrier:
            positions[:, joint] += hips_shift
    return positions


def _foot_down(
    body: SourceBody, owners: list, rotations: np.ndarray, positions: np.ndarray, side: str, shift: np.ndarray
) -> None:
    """Turns a leg in `rotations` so that its ankle is where the content's was, shifted by (F, 3)."""
    hip, knee, ankle = (positions[:, body.index[side + name]] for name in ("UpLeg", "Leg", "Foot"))
    forward = rot.normalize(rot.cross(body.at("LeftUpLeg") - body.at("RightUpLeg"), UP))
    for name, turn in zip(
        ("UpLeg", "Leg"), two_bone_ik(hip, knee, ankle, body.at(side + "Foot") + shift, forward, REACH)
    ):
        for joint, owner in enumerate(owners):
            if owner == side + name:
                rotations[:, joint] = rot.multiply(turn, rotations[:, joint])


def _as_motion(body: SourceBody, rotations: np.ndarray, positions: np.ndarray) -> Motion:
    """Back into the file's axes, relative to the parents."""
    back, motion, carrier = rot.inverse(body.turn), body.motion, _carrier(body)
    local_rotations, local_positions = motion.rotations.copy(), motion.positions.copy()
    for joint, parent in enumerate(motion.parents):
        above = rot.inverse(rotations[:, parent]) if parent >= 0 else back
        local_rotations[:, joint] = rot.multiply(above, rotations[:, joint])
        if joint == carrier:
            origin = positions[:, parent] if parent >= 0 else 0.0
            local_positions[:, joint] = rot.rotate(above, positions[:, joint] - origin)
    result = replace(motion, rotations=local_rotations, positions=local_positions)
    return mirrored(result) if body.mirrored else result
