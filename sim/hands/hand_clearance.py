"""Keeps hands and forearms out of belly, thighs, shoulders, head and each other, by moving the arm that would be in
there.

Where nothing touches the body the pose comes back as it is, the same object."""

import numpy as np

from sim.body.capsules import CAPSULE_JOINT, CAPSULE_RADII, capsule_ends
from sim.body.limb_ik import ARMS
from sim.body.pose import Pose
from sim.body.skeleton import JOINTS
from sim.math import rotations as rot
from sim.math.springs import decay, spring_step
from sim.math.vectors import limit_length
from sim.motion.clip import FPS

# Balls that an arm is felt by. On the forearm: shares of its length, and radii in metres. On the hand: palm, knuckles,
# fingers, their tips, in the left hand's own axes in the T-pose, metres, and their radii.
ALONG, FOREARM_RADII = np.array([0.05, 0.35, 0.65, 0.9]), (0.036, 0.038, 0.034, 0.028)
_BALLS = np.array([(0.035, -0.004, 0.004), (0.085, -0.004, 0.0), (0.125, -0.018, 0.0), (0.155, -0.036, 0.0)])
BALLS, HAND_RADII = np.array([_BALLS, _BALLS * [-1, 1, 1]]), (0.026, 0.024, 0.020, 0.014)  # (2, balls, 3)
RADII = np.array([*FOREARM_RADII, *HAND_RADII])
FOREARM, HANDS = slice(None, len(ALONG)), slice(len(ALONG), None)  # which balls are whose
# (2, balls) how much of a ball's push elbow and wrist take: each as near as it is to it; whoever pushes a hand also
# pushes the elbow along, or a forearm that points into the body would not give way.
_NEAR = np.stack([[*(1 - ALONG), *[0.35] * len(_BALLS)], [*ALONG, *[1.0] * len(_BALLS)]])
TAKEN = _NEAR / np.square(_NEAR).sum(axis=0)
YIELD = 0.006  # metres that flesh gives way before an arm is moved as far as it goes in
ASIDE = 3.0  # of how deep it is in, that an arm is also drawn to its own side: the short way out is round the flank
LONGEST = 0.16  # metres that elbow and wrist are moved at most; past that they go through rather than drag the arm
ROUNDS = 3  # of moving out: where it is pushed out of one capsule it may come into another
RELEASE_HALFLIFE = 0.08  # seconds in which an arm that is free has gone back half of its way
SMOOTHING_HALFLIFE = 0.02  # seconds by which a touch is softened: longer lets hands sink in, shorter jolts elbows
NEGLIGIBLE, STILL = 5e-5, 0.005  # metres, and metres a second, under which an arm is back
DT = 1 / FPS

_NAMES = [JOINTS[joint] for joint in CAPSULE_JOINT]
_TRUNK = [place for place, name in enumerate(_NAMES) if name in ("Hips", "Spine", "Chest", "Neck", "Head")]
_THIGHS = [place for place, name in enumerate(_NAMES) if name.endswith("UpLeg")]
_OTHERS = ("Arm", "ForeArm", "Hand")
# (2, capsules) what the left and the right arm are kept out of: of arms only the other one.
OBSTACLES = np.array(
    [[*_TRUNK, *_THIGHS, *(_NAMES.index(other + name) for name in _OTHERS)] for other in ("Right", "Left")]
)
# Two hands or forearms that meet give way by half each.
SHARES = np.array([0.5 if _NAMES[place].endswith(("Hand", "ForeArm")) else 1.0 for place in OBSTACLES[0]])
UPPER, LOWER, HAND = ARMS


class HandClearance:
    """Moves hands and forearms out of what they are in, frame by frame. An arm that has been moved slides about the
    body with the arm that it should be, on the side that it came from, and goes back to it where that is free.

    Poses may have a leading axis, of a crowd; every array then has it."""

    def __init__(self) -> None:
        self.held = np.zeros((2, 2, 3))  # metres that each arm's elbow and wrist are held out of the body
        self.way, self.rate = np.zeros((2, 2, 3)), np.zeros((2, 2, 3))  # the same as it is drawn, without a jolt

    def step(self, pose: Pose) -> Pose:
        """The pose with its arms out of the body; where none is in there nor on its way back, the pose itself."""
        ends, palms = capsule_ends(pose)[..., OBSTACLES, :, :], _from_wrist(pose)
        joints, left = _elbow_and_wrist(pose), pose.axes[..., :, 0]
        own_side = np.stack([left, -left], axis=-2)
        held = self.held * decay(RELEASE_HALFLIFE, DT)
        for _ in range(ROUNDS):
            moved = _keep_lengths(pose, joints + held)
            held, push = moved - joints, way_out(_balls(moved, palms), ends, own_side)
            if push is None:
                break
            held = limit_length(held + push, LONGEST)
        if not (held.any() or self.way.any()):
            return pose
        self.way, self.rate = spring_step(self.way, self.rate, held, SMOOTHING_HALFLIFE, DT)
        longest, fastest = (
            rot.length(each).max(axis=-2, keepdims=True)
            for each in (np.maximum(np.abs(held), np.abs(self.way)), self.rate)
        )
        free = (longest < NEGLIGIBLE) & (fastest < STILL)
        self.held, self.way, self.rate = (np.where(free, 0.0, each) for each in (held, self.way, self.rate))
        return _move_arms(pose, self.way)


def clear_hands(poses: Pose, shares: np.ndarray) -> Pose:
    """Many poses, one after the other, with their hands and forearms kept out of the body; shares: (2,) how much of
    that the left and the right arm take, 0 not at all."""
    clearance = HandClearance()
    ways = []
    for frame in range(len(poses.hips)):
        clearance.step(poses[frame])
        ways.append(clearance.way * shares[:, None, None])
    return _move_arms(poses, np.array(ways)) if np.any(ways) else poses


def _elbow_and_wrist(pose: Pose) -> np.ndarray:
    """(..., 2, 2, 3) where they are, of both arms, in the world."""
    return np.stack([pose.positions[..., LOWER, :], pose.positions[..., HAND, :]], axis=-2)


def _keep_lengths(pose: Pose, wanted: np.ndarray) -> np.ndarray:
    """Elbows and wrists (..., 2, 2, 3) as near to where they are wanted as bones of the pose's lengths let them be:
    each bone points where it should. Unlike inverse kinematics that has no straight arm to flip over at."""
    p = pose.positions
    shoulder, elbow, wrist = p[..., UPPER, :], p[..., LOWER, :], p[..., HAND, :]
    moved = shoulder + rot.length(elbow - shoulder) * rot.normalize(wanted[..., 0, :] - shoulder)
    end = moved + rot.length(wrist - elbow) * rot.normalize(wanted[..., 1, :] - moved)
    return np.stack([moved, end], axis=-2)


def _move_arms(pose: Pose, way: np.ndarray) -> Pose:
    """The pose with its elbows and wrists moved by (..., 2, 2, 3) metres, as far as its bones let them; an arm that is
    not to be moved stays to the last bit, and hands keep their attitude."""
    before = _elbow_and_wrist(pose)
    after = _keep_lengths(pose, before + way)
    shoulder, moves = pose.positions[..., UPPER, :], rot.length(way).max(axis=-2) > 0
    rotations = pose.rotations.copy()
    for place, joint in enumerate((UPPER, LOWER)):
        start, goal = ((shoulder if joint is UPPER else each[..., 0, :]) for each in (before, after))
        turn = rot.between(before[..., place, :] - start, after[..., place, :] - goal)
        turned = rot.multiply(turn, rotations[..., joint, :])
        rotations[..., joint, :] = np.where(moves, turned, rotations[..., joint, :])
    return pose.with_body(pose.hips, rotations)


def arm_balls(pose: Pose) -> np.ndarray:
    """(..., 2, balls, 3) where the balls of both arms are, in the world: FOREARM and HANDS."""
    return _balls(_elbow_and_wrist(pose), _from_wrist(pose))


def _from_wrist(pose: Pose) -> np.ndarray:
    """(..., 2, balls, 3) the balls of both hands as seen from the wrist, in world axes."""
    return rot.rotate(pose.rotations[..., HAND, None, :], BALLS)


def _balls(joints: np.ndarray, from_wrist: np.ndarray) -> np.ndarray:
    """arm_balls of elbows and wrists (..., 2, 2, 3) and _from_wrist."""
    elbow, wrist = joints[..., 0:1, :], joints[..., 1:2, :]
    return np.concatenate([elbow + ALONG[:, None] * (wrist - elbow), wrist + from_wrist], axis=-2)


def depths(balls: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How deep (..., 2, balls, capsules), in metres, balls (..., 2, balls, 3) are in capsules with ends
    (..., 2, capsules, 2, 3), negative outside, and the ways (..., 2, balls, capsules, 3) to them from the capsules'
    axes."""
    start = ends[..., None, :, 0, :]
    along = ends[..., None, :, 1, :] - start
    from_start = balls[..., :, None, :] - start
    share = np.vecdot(from_start, along) / np.vecdot(along, along)
    away = from_start - np.minimum(np.maximum(share, 0.0), 1.0)[..., None] * along
    reach_of = RADII[:, None] + CAPSULE_RADII[OBSTACLES][:, None, :]
    return reach_of - rot.length(away)[..., 0], away


def way_out(balls: np.ndarray, ends: np.ndarray, own_side: np.ndarray) -> np.ndarray | None:
    """(..., 2, 2, 3) metres that each arm's elbow and wrist are pushed by all that the arm is in, what it is deepest in
    counting most; None where nothing touches anything. own_side: (..., 2, 3) the direction to each arm's side."""
    deep, away = depths(balls, ends)
    if deep.max() <= 0:
        return None
    deep = np.maximum(deep, 0.0)
    # gently at the touch, so that a hand that comes does not jolt; then as far as it is in
    push = np.where(deep < 2 * YIELD, deep**2 / (4 * YIELD), deep - YIELD) * SHARES
    out = rot.normalize(away + ASIDE * push[..., None] * own_side[..., :, None, None, :])
    of_balls = ((push**2)[..., None] * out).sum(axis=-2)
    return (TAKEN @ of_balls) / np.maximum(push.sum(axis=(-2, -1)), 1e-12)[..., None, None]


def arm_depths(pose: Pose) -> tuple[np.ndarray, np.ndarray]:
    """How deep, in metres, the hands and the forearms of a pose (...) are in the body or in each other, each (...);
    negative where they touch nothing."""
    deep, _ = depths(arm_balls(pose), capsule_ends(pose)[..., OBSTACLES, :, :])
    return deep[..., HANDS, :].max(axis=(-3, -2, -1)), deep[..., FOREARM, :].max(axis=(-3, -2, -1))
