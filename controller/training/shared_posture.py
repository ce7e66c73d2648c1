"""One posture for all actors: each actor's upper body is turned, joint by joint, so that it walks in the posture that
all share.

Actors carry their shoulders differently, and captures disagree by a quarter turn and more about how far a forearm or a
hand is rolled. A network that learns them all walks in the posture of whichever actor its last pose resembles: the same
walk then looks different after a run than after a stand. Legs keep their capture, because the planted feet depend on
them."""

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Hashable, Sequence

import numpy as np
from scipy.ndimage import gaussian_filter1d

from sim.body.kinematics import to_local
from sim.body.skeleton import BETWEEN_HIPS, MIRROR, PART_NAMES, PART_OF_JOINT
from sim.math import rotations as rot
from sim.motion.clip import FPS, MIRROR_QUATERNION, Clip, root_frame

UPPER = np.flatnonzero(PART_OF_JOINT >= PART_NAMES.index("spine"))  # the joints that are turned, the hips among them
WALK_SPEED = 0.4, 1.6  # metres a second between which an actor's posture is measured
STRAIGHT = 0.5  # radians a second of turning that such a walk has at most
# Forwards, sideways, backwards: up to how many radians the way is off the facing.
DIRECTIONS = np.radians((45, 135, 180))
CHANGE_SECONDS = 0.25  # (Gaussian sigma) over which one direction's posture becomes another's
SHORTEST_WALK = 2 * FPS  # frames of it without which an actor's posture is unknown
MEDIAN_STEPS, NEAR = 50, 0.02  # of Weiszfeld's iteration, and the distance in radians under which two rotations are one


@dataclass(frozen=True)
class Walk:
    """How a clip goes in each of DIRECTIONS: the sum of the 6-D rotations (directions, 21, 6) in the root frame over
    its frames, and their number (directions,)."""

    total: np.ndarray
    frames: np.ndarray


def measure_walk(clip: Clip) -> Walk:
    """How a clip walks, straight and at a moderate speed."""
    root = root_frame(clip.positions())
    velocity = root.local_velocity()
    speed = rot.length(velocity)[:, 0]
    steady = (speed > WALK_SPEED[0]) & (speed < WALK_SPEED[1]) & (np.abs(np.gradient(root.facing, 1 / FPS)) < STRAIGHT)
    axes = rot.to_6d(rot.multiply(rot.from_yaw(-root.facing)[:, None], clip.global_rotations()))
    goes = steady & (_direction(velocity) == np.arange(len(DIRECTIONS))[:, None])
    return Walk(np.tensordot(goes.astype(float), axes, 1), goes.sum(axis=1))


def share_posture(clips: Sequence[Clip], actors: Sequence[Hashable]) -> list[Clip]:
    """The clips, each of an actor, in the posture that the actors share while they walk straight on; and so they back
    up and side-step. An actor who never walks keeps their own."""
    walks: dict[Hashable, list[Walk]] = defaultdict(list)
    for clip, actor in zip(clips, actors, strict=True):
        walks[actor].append(measure_walk(clip))
    postures = {}
    for actor, each in walks.items():
        total, frames = (sum(getattr(walk, name) for walk in each) for name in ("total", "frames"))
        if frames[0] >= SHORTEST_WALK:
            known = np.where(frames >= SHORTEST_WALK, np.arange(len(DIRECTIONS)), 0)
            postures[actor] = rot.from_6d(total[known])
    if len(postures) < 2:
        return list(clips)
    shared = median_rotations([side for each in postures.values() for side in (each[0], _mirror_posture(each[0]))])
    turns = {actor: rot.multiply(rot.inverse(each), shared) for actor, each in postures.items()}
    return [_apply_turns(clip, turns[actor]) if actor in turns else clip for clip, actor in zip(clips, actors)]


def median_rotations(rotations: Sequence[np.ndarray]) -> np.ndarray:
    """The rotations (21, 4) whose summed angles to rotations, (21, 4) each, are smallest: the geodesic median, which a
    few odd ones do not move (Weiszfeld's iteration, started from each of them)."""
    each = np.array(rotations)
    median, least = each[0], np.full(each.shape[1], np.inf)
    for start in each:
        found = start
        for _ in range(MEDIAN_STEPS):
            turns = _turns(each, found)
            weights = 1 / np.maximum(rot.length(turns), NEAR)
            found = rot.multiply(rot.from_rotation_vector((weights * turns).sum(axis=0) / weights.sum(axis=0)), found)
        away = rot.length(_turns(each, found))[..., 0].sum(axis=0)
        median = np.where((away < least)[:, None], found, median)
        least = np.minimum(least, away)
    return median


def _turns(each: np.ndarray, one: np.ndarray) -> np.ndarray:
    """Rotation vectors (n, 21, 3) from rotations (21, 4) to each of (n, 21, 4)."""
    return rot.to_rotation_vector(rot.multiply(each, rot.inverse(one)))


def _mirror_posture(posture: np.ndarray) -> np.ndarray:
    """Rotations (21, 4) with left and right exchanged."""
    return posture[MIRROR] * MIRROR_QUATERNION


def _direction(velocity: np.ndarray) -> np.ndarray:
    """Which of DIRECTIONS (frames,) local velocities (frames, 3) take."""
    return np.digitize(np.abs(np.arctan2(velocity[:, 0], velocity[:, 2])), DIRECTIONS[:-1])


def _apply_turns(clip: Clip, turns: np.ndarray) -> Clip:
    """The clip with the global rotations of UPPER followed, in each joint's own axes, by those of turns
    (directions, 21, 4) that belong to where it goes; the point between the hip joints, and with it the legs, stay
    where they are."""
    velocity = root_frame(clip.positions()).local_velocity()
    going = np.where(rot.length(velocity)[:, 0] > WALK_SPEED[0] / 2, _direction(velocity), 0)
    shares = gaussian_filter1d(np.eye(len(DIRECTIONS))[going], CHANGE_SECONDS * FPS, axis=0, mode="nearest")
    turn = rot.from_rotation_vector(np.tensordot(shares, rot.to_rotation_vector(turns[:, UPPER]), 1))
    before = clip.global_rotations()
    after = before.copy()
    after[:, UPPER] = rot.multiply(before[:, UPPER], turn)
    hips = clip.hips + rot.rotate(before[:, 0], BETWEEN_HIPS) - rot.rotate(after[:, 0], BETWEEN_HIPS)
    return replace(clip, hips=hips, rotations=to_local(after))
