"""Steady running out of short captures: single cycles closed to loops, along straight ways and curves.

Captured runs last a second or two, and hardly ever is there a second of the same running before and after a frame: what
the player asks for most would be what the network has seen least."""

from dataclasses import replace

import numpy as np

from controller.phase import label_phase
from sim import rotations as rot
from sim.clip import FPS, Clip, root_frame
from sim.contacts import foot_contacts
from sim.kinematics import to_local

CYCLE = (0.4, 1.0)  # seconds: what counts as a cycle of running
SPEED = 2.0  # metres a second that a cycle has at least
MISFIT = 0.05  # metres, mean over the joints, that a cycle's end may be away from its start
STRAIGHT = np.radians(15)  # how far a cycle's way may turn from the facing, and the facing in the cycle
SECONDS = 3.0  # how long a loop is repeated
TURN_RATES = (0.0, 0.8, -0.8)  # radians a second of the ways that it is laid along


def loops(clip: Clip) -> list[Clip]:
    """Clips of SECONDS of steady running from a grounded 60 Hz clip: its best cycle along each of TURN_RATES; none where no
    cycle closes."""
    positions = clip.positions()
    phase = label_phase(positions, foot_contacts(clip))
    turns = np.arange(np.ceil(phase[0] / (2 * np.pi)), np.floor(phase[-1] / (2 * np.pi)) + 0.5) * 2 * np.pi
    strikes = np.searchsorted(phase, turns)
    root = root_frame(positions)
    local = rot.rotate(rot.from_yaw(-root.facing)[:, None], positions - root.positions[:, None])
    candidates = []
    # A cycle may begin at any phase: where it closes best is where it is cut.
    for start, end in zip(strikes, strikes[1:]):
        for shift in range(0, max(1, len(clip) - end), 2):
            a, b = start + shift, end + shift
            misfit = np.linalg.norm(local[b] - local[a], axis=-1).mean() if b < len(clip) else np.inf
            if CYCLE[0] * FPS < b - a < CYCLE[1] * FPS and misfit < MISFIT and _is_straight_run(root, a, b):
                candidates.append((misfit, a, b))
    if not candidates:
        return []
    _, a, b = min(candidates)
    return [_repeated(clip, a, b, rate) for rate in TURN_RATES]


def _is_straight_run(root, a: int, b: int) -> bool:
    """Whether the root runs straight ahead from frame a to b."""
    way = root.positions[b] - root.positions[a]
    return (np.linalg.norm(way) * FPS / (b - a) > SPEED
            and abs(rot.wrap_angle(rot.yaw_of(way) - root.facing[a:b].mean())) < STRAIGHT
            and abs(root.facing[b] - root.facing[a]) < STRAIGHT)


def _repeated(clip: Clip, a: int, b: int, turn_rate: float) -> Clip:
    """Frames a to b over and over for SECONDS, the gap between its ends closed little by little, along a way that turns."""
    root = root_frame(clip.positions())
    to_root = rot.from_yaw(-root.facing)
    hips = rot.rotate(to_root, clip.hips - root.positions)
    rotations = rot.multiply(to_root[:, None], clip.global_rotations())
    share = np.arange(b - a) / (b - a)
    gap = rot.to_rotation_vector(rot.multiply(rotations[a], rot.inverse(rotations[b])))
    closed = rot.multiply(rot.from_rotation_vector(share[:, None, None] * gap), rotations[a:b])
    closed_hips = hips[a:b] + share[:, None] * (hips[a] - hips[b])

    way = root.positions[a + 1:b + 1] - root.positions[a:b]
    mean = way.mean(axis=0)
    steps = rot.rotate(rot.from_yaw(-rot.yaw_of(mean)), way)  # straight ahead on the whole, at the cycle's own rhythm
    swing = root.facing[a:b] - root.facing[a] - share * (root.facing[b] - root.facing[a])
    which = np.arange(round(SECONDS * FPS)) % (b - a)
    heading = turn_rate / FPS * np.arange(len(which))
    places = np.cumsum(rot.rotate(rot.from_yaw(heading), steps[which]), axis=0)
    to_world = rot.from_yaw(heading + (swing - swing.mean())[which])
    return replace(clip, hips=places + rot.rotate(to_world, closed_hips[which]),
                   rotations=to_local(rot.multiply(to_world[:, None], closed[which])))
