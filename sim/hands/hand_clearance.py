"""Keeps hands out of belly, thighs, shoulders, head and each other, by moving the arm whose hand would be in there.

Where no hand touches the body the pose comes back as it is, the same object."""

import numpy as np

from sim.body.capsules import CAPSULE_JOINT, CAPSULE_RADII, capsule_ends
from sim.body.limb_ik import ARMS, ELBOWS_BACK, reach
from sim.body.pose import Pose
from sim.body.skeleton import JOINTS
from sim.math import rotations as rot
from sim.math.easing import smooth_step
from sim.math.springs import decay, spring_step
from sim.math.vectors import limit_length
from sim.motion.clip import FPS

# Balls that a hand is felt by, in the left hand's own axes in the T-pose, metres, and their radii: palm, knuckles,
# fingers, their tips.
_BALLS = np.array([(0.035, -0.004, 0.004), (0.085, -0.004, 0.0), (0.125, -0.018, 0.0), (0.155, -0.036, 0.0)])
BALLS = np.array([_BALLS, _BALLS * [-1, 1, 1]])  # (2, balls, 3)
BALL_RADII = np.array([0.026, 0.024, 0.020, 0.014])
YIELD = 0.006  # metres that flesh gives way before a hand is moved as far as it goes in
LONGEST = 0.12  # metres that a hand is moved at most; past that it goes through rather than drags the arm
FELT = 0.02  # metres of way over which the arm turns from the pose it has to that of inverse kinematics
FOLDED = 0.1  # metres from its own shoulder within which a hand is moved less: the elbow would be thrown about
ROUNDS = 3  # of moving out: where it is pushed out of one capsule it may come into another
ARM_REACH = 0.9999  # share of an arm's length that is used
RELEASE_HALFLIFE = 0.08  # seconds in which a hand that is free has gone back half of its way
SMOOTHING_HALFLIFE = 0.015  # seconds by which a touch is softened
NEGLIGIBLE, STILL = 5e-4, 0.02  # metres, and metres a second, under which a hand is back
DT = 1 / FPS

_NAMES = [JOINTS[joint] for joint in CAPSULE_JOINT]
_TRUNK = [place for place, name in enumerate(_NAMES) if name in ("Hips", "Spine", "Chest", "Neck", "Head")]
_THIGHS = [place for place, name in enumerate(_NAMES) if name.endswith("UpLeg")]
_OTHERS = ("Arm", "ForeArm", "Hand")
# (2, capsules) what the left and the right hand are kept out of: of arms only the other one.
OBSTACLES = np.array(
    [[*_TRUNK, *_THIGHS, *(_NAMES.index(other + name) for name in _OTHERS)] for other in ("Right", "Left")]
)
# Two hands that meet give way by half each.
SHARES = np.array([0.5 if _NAMES[place].endswith("Hand") else 1.0 for place in OBSTACLES[0]])
_UPPER, _LOWER, HAND = ARMS


class HandClearance:
    """Moves hands out of what they are in, frame by frame. A hand that has been moved slides about the body with the
    hand that it should be, on the side that it came from, and goes back to it where that is free.

    Poses may have a leading axis, of a crowd; every array then has it."""

    def __init__(self) -> None:
        self.held = np.zeros((2, 3))  # metres that each hand is held out of the body
        self.way, self.rate = np.zeros((2, 3)), np.zeros((2, 3))  # the same as it is drawn, without a jolt

    def step(self, pose: Pose) -> Pose:
        """The pose with its hands out of the body; where none is in there nor on its way back, the pose itself."""
        balls, ends = hand_balls(pose), capsule_ends(pose)[..., OBSTACLES, :, :]
        held = self.held * decay(RELEASE_HALFLIFE, DT)
        for _ in range(ROUNDS):
            push = way_out(balls + held[..., None, :], ends)
            if push is None:
                break
            held = limit_length(held + push, LONGEST)
        if not (held.any() or self.way.any()):
            return pose
        from_shoulder = pose.positions[..., HAND, :] + held - pose.positions[..., _UPPER, :]
        wanted = held * smooth_step(rot.length(from_shoulder), 0.0, FOLDED)
        self.way, self.rate = spring_step(self.way, self.rate, wanted, SMOOTHING_HALFLIFE, DT)
        free = (np.maximum(rot.length(held), rot.length(self.way)) < NEGLIGIBLE) & (rot.length(self.rate) < STILL)
        self.held, self.way, self.rate = (np.where(free, 0.0, each) for each in (held, self.way, self.rate))
        return _move_hands(pose, self.way)


def clear_hands(poses: Pose, shares: np.ndarray) -> Pose:
    """Many poses, one after the other, with their hands kept out of the body; shares: (2,) how much of that the left
    and the right arm take, 0 not at all."""
    clearance = HandClearance()
    ways = []
    for frame in range(len(poses.hips)):
        clearance.step(poses[frame])
        ways.append(clearance.way * shares[:, None])
    return _move_hands(poses, np.array(ways)) if np.any(ways) else poses


def _move_hands(pose: Pose, way: np.ndarray) -> Pose:
    """The pose with its hands moved by (..., 2, 3) metres; an arm that is not to be moved stays to the last bit."""
    moved = reach(pose, ARMS, pose.positions[..., HAND, :] + way, ELBOWS_BACK, ARM_REACH)
    felt = smooth_step(rot.length(way), 0.0, FELT)
    rotations = pose.rotations.copy()
    for joints in (_UPPER, _LOWER):
        turned = rot.slerp(rotations[..., joints, :], moved.rotations[..., joints, :], felt)
        rotations[..., joints, :] = np.where(felt > 0, turned, rotations[..., joints, :])
    return pose.with_body(pose.hips, rotations)


def hand_balls(pose: Pose) -> np.ndarray:
    """(..., 2, balls, 3) where the balls of both hands are, in the world."""
    turned = rot.rotate(pose.rotations[..., HAND, None, :], BALLS)
    return pose.positions[..., HAND, None, :] + turned


def depths(balls: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How deep (..., 2, balls, capsules), in metres, balls (..., 2, balls, 3) are in capsules with ends
    (..., 2, capsules, 2, 3), negative outside, and the ways (..., 2, balls, capsules, 3) to them from the capsules'
    axes."""
    start = ends[..., None, :, 0, :]
    along = ends[..., None, :, 1, :] - start
    from_start = balls[..., :, None, :] - start
    share = np.vecdot(from_start, along) / np.vecdot(along, along)
    away = from_start - np.minimum(np.maximum(share, 0.0), 1.0)[..., None] * along
    reach_of = BALL_RADII[:, None] + CAPSULE_RADII[OBSTACLES][:, None, :]
    return reach_of - rot.length(away)[..., 0], away


def way_out(balls: np.ndarray, ends: np.ndarray) -> np.ndarray | None:
    """(..., 2, 3) metres that each hand is pushed by all that it is in, what it is deepest in counting most; None where
    no hand touches anything."""
    deep, away = depths(balls, ends)
    if deep.max() <= 0:
        return None
    deep = np.maximum(deep, 0.0)
    # gently at the touch, so that a hand that comes does not jolt; then as far as it is in
    push = np.where(deep < 2 * YIELD, deep**2 / (4 * YIELD), deep - YIELD) * SHARES
    weighted = (push**2)[..., None] * rot.normalize(away)
    return weighted.sum(axis=(-3, -2)) / np.maximum(push.sum(axis=(-2, -1)), 1e-12)[..., None]
