"""Which joint of a skeleton is which of ours where names say nothing, by its shape: legs, a trunk, arms, a head.

Legs and arms are the two pairs of equal chains; the pair that a third chain leads on from, to the head, are the arms.
Which side is left is told by the toes, and without toes by the knees."""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from sim.io.bvh import Motion
from sim.math import rotations as rot

SAMPLES = 60  # frames that are looked at
ALIKE = 0.12  # share by which the two chains of a pair, or their bones, may differ in length
STRAIGHT = np.cos(np.radians(4.0))  # a joint that the limb never bends at by more is a twist joint
ARMS_BY_LEGS, TRUNK_BY_LEGS = (0.35, 1.4), (0.2, 1.4)  # how long a person's arms and trunk are, in legs
LONG = 0.55  # of a limb's longest bone
TOP = 1.3  # times as long as the neck is the bone from a head to its top, which some rigs have as a joint
LEAST_LEG = 0.2  # of the way from the hips to the farthest joint: a face has pairs of chains too
LEAST_SURE = 0.6


# What the joints of a Limb are called.
LEG_NAMES, ARM_NAMES = ("UpLeg", "Leg", "Foot", "Toe", ""), ("Arm", "ForeArm", "Hand", "", "Shoulder")


class Guess(NamedTuple):
    """Our joint -> theirs, and how sure that is, 0 to 1."""

    name_map: dict[str, str]
    sure: float


class _Pair(NamedTuple):
    parent: int
    chains: tuple[list[int], list[int]]
    length: float


def guess_joints(motion: Motion) -> Guess | None:
    """The joints of a person, None where the skeleton is shaped like none."""
    sample = np.unique(np.linspace(0, len(motion) - 1, SAMPLES).astype(int))
    positions = motion.global_transforms()[0][sample]
    children: list[list[int]] = [[] for _ in motion.names]
    for joint, parent in enumerate(motion.parents):
        if parent >= 0:
            children[parent].append(joint)
    lengths = np.linalg.norm(np.median(motion.positions[sample], axis=0), axis=-1)
    pairs = sorted(_pairs(children, lengths), key=lambda pair: -pair.length)
    guesses = (
        _body(motion, positions, children, lengths, legs, arms)
        for one, other in combinations(pairs[:8], 2)
        for legs, arms in ((one, other), (other, one))
    )
    best = max((guess for guess in guesses if guess), key=lambda guess: guess.sure, default=None)
    return best if best and best.sure >= LEAST_SURE else None


def _longest(children: list[list[int]], lengths: np.ndarray, start: int) -> list[int]:
    """The joints from `start` down to the tip that is farthest along the bones."""
    reach: dict[int, float] = {}
    stack, order = [start], []
    while stack:
        joint = stack.pop()
        order.append(joint)
        stack += children[joint]
    for joint in reversed(order):
        reach[joint] = max((reach[child] + lengths[child] for child in children[joint]), default=0.0)
    path = [start]
    while children[path[-1]]:
        path.append(max(children[path[-1]], key=lambda child: reach[child] + lengths[child]))
    return path


def _pairs(children: list[list[int]], lengths: np.ndarray) -> list[_Pair]:
    """Every two chains of three joints or more, equally long, that hang on one joint."""
    found = []
    for parent, below in enumerate(children):
        chains = [chain for child in below if len(chain := _longest(children, lengths, child)) >= 3]
        for one, other in combinations(chains, 2):
            a, b = (float(lengths[chain[1:]].sum()) for chain in (one, other))
            if abs(a - b) < ALIKE * max(a, b, 1e-9):
                found.append(_Pair(parent, (one, other), (a + b) / 2))
    return found


def _body(
    motion: Motion, positions: np.ndarray, children: list[list[int]], lengths: np.ndarray, legs: _Pair, arms: _Pair
) -> Guess | None:
    """A guess with these pairs as legs and arms; None where that is no body."""
    hips, spine = _trunk(motion.parents, legs.parent, arms.parent)
    if not spine or set(legs.chains[0] + legs.chains[1]) & {arms.parent, *arms.chains[0]}:
        return None
    head = _head(children, lengths, arms, spine[-2] if len(spine) > 1 else hips)
    limbs = [limb for pair in (legs, arms) for chain in pair.chains if (limb := _limb(positions, chain))]
    if not head or len(limbs) < 4:
        return None
    at = positions.swapaxes(0, 1)  # (J, F, 3)
    if not (_alike(at, *limbs[:2]) and _alike(at, *limbs[2:])):
        return None
    up = rot.normalize(at[head[-1]] - (at[limbs[0][2]] + at[limbs[1][2]]) / 2)
    forward, sure = _forward(at, up, limbs[:2])
    left = rot.cross(up, forward)
    swapped = [np.vecdot(at[one[0]] - at[other[0]], left).mean() < 0 for one, other in (limbs[:2], limbs[2:])]
    ordered = [pair[::-1] if swap else pair for pair, swap in zip((limbs[:2], limbs[2:]), swapped)]
    found = {"Hips": hips, "Chest": spine[-1], "Head": head[-1]}
    found |= {"Spine": spine[0]} if len(spine) > 1 else {}
    found |= {"Neck": head[-2]} if len(head) > 1 else {}
    for names, pair in zip((LEG_NAMES, ARM_NAMES), ordered):
        for side, limb in zip(("Left", "Right"), pair):
            found |= {side + name: joint for name, joint in zip(names, limb) if name and joint is not None}

    leg = _length(at, limbs[0][:3])
    if leg < LEAST_LEG * np.linalg.norm(at - at[hips], axis=-1).mean(axis=1).max():
        return None
    arm, trunk = _length(at, limbs[2][:3]) / leg, _length(at, (hips, spine[-1], head[-1])) / leg
    if not (ARMS_BY_LEGS[0] < arm < ARMS_BY_LEGS[1] and TRUNK_BY_LEGS[0] < trunk < TRUNK_BY_LEGS[1]):
        return None
    stands = float((np.abs(up).max(axis=-1) > 0.8).mean())  # along some axis of the file
    sure *= 0.8 + 0.2 * stands - 0.2 * (arm > 1.0)  # legs are longer than arms
    return Guess({ours: motion.names[joint] for ours, joint in found.items()}, round(float(sure), 2))


def _trunk(parents: list[int], legs: int, arms: int) -> tuple[int, list[int]]:
    """Where the trunk begins, the joint that both legs and arms hang under, and its joints above up to the arms'."""
    above = [legs]
    while parents[above[-1]] >= 0:
        above.append(parents[above[-1]])
    spine = [arms]
    while spine[-1] not in above and parents[spine[-1]] >= 0:
        spine.append(parents[spine[-1]])
    return spine[-1], spine[-2::-1]


def _head(children: list[list[int]], lengths: np.ndarray, arms: _Pair, below: int) -> list[int]:
    """The joints from the arms' on to the head, the longest chain that is neither arm; a face is left out."""
    others = [child for child in children[arms.parent] if child not in (arms.chains[0][0], arms.chains[1][0])]
    chains = [_longest(children, lengths, child) for child in others]
    if not chains:
        return []
    path = max(chains, key=lambda chain: float(lengths[chain].sum()))
    fork = next((place for place, joint in enumerate(path) if len(children[joint]) > 1), len(path) - 1)
    path = path[: fork + 1]
    return path[:-1] if len(path) > 2 and lengths[path[-1]] > TOP * lengths[path[-2]] else path


Limb = tuple[int, int, int, int | None, int | None]


def _limb(positions: np.ndarray, chain: list[int]) -> Limb | None:
    """Upper joint, middle joint and end of a limb, what comes after the end, and what comes before the upper joint."""
    kept = [chain[0]]
    for joint, after in zip(chain[1:], [*chain[2:], None]):
        first = positions[:, joint] - positions[:, kept[-1]]
        if np.linalg.norm(first, axis=-1).mean() < 1e-6:
            continue
        if after is not None and len(positions) > 1:  # a single pose does not tell what bends
            second = positions[:, after] - positions[:, joint]
            if (np.vecdot(rot.normalize(first), rot.normalize(second)) > STRAIGHT).all():
                continue
        kept.append(joint)
    if len(kept) < 3:
        return None
    bones = np.linalg.norm(np.diff(positions[:, kept], axis=1), axis=-1).mean(axis=0)
    long = bones > LONG * bones.max()  # a clavicle may be one too, fingers and toes are not
    both = np.flatnonzero(long[:-1] & long[1:])
    if not len(both):
        return None
    upper = int(both[-1])
    after = kept[upper + 3] if upper + 3 < len(kept) else None
    return kept[upper], kept[upper + 1], kept[upper + 2], after, kept[upper - 1] if upper else None


def _forward(at: np.ndarray, up: np.ndarray, legs: list[Limb]) -> tuple[np.ndarray, float]:
    """(F, 3) where the body faces, from its toes or else its knees, and how sure that is."""
    toes = [at[leg[3]] - at[leg[2]] for leg in legs if leg[3] is not None]
    knees = [at[leg[1]] - (at[leg[0]] + at[leg[2]]) / 2 for leg in legs]
    ways = [sum(way - up * np.vecdot(way, up)[:, None] for way in kind) for kind in (toes, knees) if kind]
    if len(ways) < 2:
        return rot.normalize(ways[0]), 0.75
    agree = np.vecdot(ways[0], ways[1]).mean() > 0
    return rot.normalize(ways[0]), 0.95 if agree else 0.7


def _alike(at: np.ndarray, one: Limb, other: Limb) -> bool:
    """Whether two limbs have bones of the same lengths, the upper and the lower ones."""
    bones = [(_length(at, limb[:2]), _length(at, limb[1:3])) for limb in (one, other)]
    return all(abs(a - b) < ALIKE * max(a, b) for a, b in zip(*bones))


def _length(at: np.ndarray, joints: tuple[int, ...]) -> float:
    """How long the bones between joints are together, on average."""
    return float(sum(np.linalg.norm(at[a] - at[b], axis=-1).mean() for a, b in zip(joints, joints[1:])))
