"""Steady running out of short captures: single cycles closed to loops, along straight lines and curves.

Captured runs last a second or two, and hardly ever is there a second of the same running before and after a frame: what
the player asks for most would be what the network has seen least."""

from dataclasses import dataclass, replace

import numpy as np

from controller.model.gait_phase import label_phase
from sim.body.kinematics import to_local
from sim.math import rotations as rot
from sim.motion.clip import FPS, Clip, RootFrame, root_frame
from sim.motion.contacts import foot_contacts

CYCLE = (0.4, 1.0)  # seconds: what counts as a cycle of running
SPEED = 2.0  # metres a second that a cycle has at least
MISFIT = 0.05  # metres, mean over the joints, that a cycle's end may be away from its start
STRAIGHT = np.radians(15)  # how far a cycle's path may turn from the facing, and the facing in the cycle
SECONDS = 3.0  # how long a loop is repeated
TURN_RATES = (0.0, 0.8, -0.8)  # radians a second of the paths that it is laid along


@dataclass(frozen=True)
class _Cycle:
    """A cycle of n frames whose end meets its start. In the root frame: hips (n, 3), global rotations (n, 21, 4). The
    root's path: steps (n, 3), straight ahead on the whole, and swing (n,), how far its facing is off the mean."""

    hips: np.ndarray
    rotations: np.ndarray
    steps: np.ndarray
    swing: np.ndarray

    def along(self, turn_rate: float) -> tuple[np.ndarray, np.ndarray]:
        """Over and over for SECONDS along a path that turns by so many radians a second: hips (frames, 3) and local
        rotations (frames, 21, 4) in the world."""
        which = np.arange(round(SECONDS * FPS)) % len(self.hips)
        heading = turn_rate / FPS * np.arange(len(which))
        places = np.cumsum(rot.rotate(rot.from_yaw(heading), self.steps[which]), axis=0)
        to_world = rot.from_yaw(heading + self.swing[which])
        return (
            places + rot.rotate(to_world, self.hips[which]),
            to_local(rot.multiply(to_world[:, None], self.rotations[which])),
        )


def find_loops(clip: Clip) -> list[Clip]:
    """Clips of SECONDS of steady running from a grounded 60 Hz clip: its best cycle along each of TURN_RATES; none
    where no cycle closes."""
    positions = clip.positions()
    root = root_frame(positions)
    found = _best_cycle(positions, label_phase(positions, foot_contacts(clip)), root)
    if found is None:
        return []
    cycle = _close(clip, root, *found)
    return [replace(clip, hips=hips, rotations=rotations) for hips, rotations in map(cycle.along, TURN_RATES)]


def _best_cycle(positions: np.ndarray, phase: np.ndarray, root: RootFrame) -> tuple[int, int] | None:
    """First frame, and last, which is the first again, of the cycle of steady running that closes best; None without
    one."""
    turns = np.arange(np.ceil(phase[0] / (2 * np.pi)), np.floor(phase[-1] / (2 * np.pi)) + 0.5) * 2 * np.pi
    strikes = np.searchsorted(phase, turns)
    local = rot.rotate(rot.from_yaw(-root.facing)[:, None], positions - root.positions[:, None])
    candidates = []
    # A cycle may begin at any phase: where it closes best is where it is cut.
    for start, end in zip(strikes, strikes[1:]):
        for shift in range(0, max(1, len(positions) - end), 2):
            a, b = start + shift, end + shift
            misfit = np.linalg.norm(local[b] - local[a], axis=-1).mean() if b < len(positions) else np.inf
            if CYCLE[0] * FPS < b - a < CYCLE[1] * FPS and misfit < MISFIT and _is_straight_run(root, a, b):
                candidates.append((misfit, a, b))
    return min(candidates)[1:] if candidates else None


def _is_straight_run(root: RootFrame, a: int, b: int) -> bool:
    """Whether the root runs straight ahead from frame a to b."""
    displacement = root.positions[b] - root.positions[a]
    return bool(
        np.linalg.norm(displacement) * FPS / (b - a) > SPEED
        and abs(rot.wrap_angle(rot.yaw_of(displacement) - root.facing[a:b].mean())) < STRAIGHT
        and abs(root.facing[b] - root.facing[a]) < STRAIGHT
    )


def _close(clip: Clip, root: RootFrame, a: int, b: int) -> _Cycle:
    """Frames a to b, the gap between them closed little by little along the way."""
    to_root = rot.from_yaw(-root.facing[a : b + 1])
    hips = rot.rotate(to_root, clip.hips[a : b + 1] - root.positions[a : b + 1])
    rotations = rot.multiply(to_root[:, None], clip[a : b + 1].global_rotations())
    share = np.arange(b - a) / (b - a)
    closing_turn = rot.to_rotation_vector(rot.multiply(rotations[0], rot.inverse(rotations[-1])))
    displacement = np.diff(root.positions[a : b + 1], axis=0)
    swing = root.facing[a:b] - root.facing[a] - share * (root.facing[b] - root.facing[a])
    return _Cycle(
        hips=hips[:-1] + share[:, None] * (hips[0] - hips[-1]),
        rotations=rot.multiply(rot.from_rotation_vector(share[:, None, None] * closing_turn), rotations[:-1]),
        steps=rot.rotate(
            rot.from_yaw(-rot.yaw_of(displacement.mean(axis=0))), displacement
        ),  # in the cycle's own rhythm
        swing=swing - swing.mean(),
    )
