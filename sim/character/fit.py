"""Our pose on a character: every limb in the direction of ours, planted feet where ours stand, on its own soles.

A character's thigh and shin, feet and hips are other parts of a leg than ours, so that limbs in equal directions carry
its feet elsewhere. Hence the body goes with the foot that stands: hips are placed so that the leg that carries keeps
its directions and its sole stays where it is; what is left between two planted feet is bent away by inverse
kinematics. Feet in the air follow their legs, and clear the ground as ours do."""

from dataclasses import dataclass

import numpy as np

from sim.body.kinematics import two_bone_ik
from sim.body.limb_ik import LEG_LENGTH, LEGS, height_missing
from sim.body.pose import Pose
from sim.body.skeleton import ANKLE_HEIGHT, BETWEEN_HIPS, TOE_HEIGHT
from sim.character.character import ROOT, Character
from sim.character.feet import CLEARANCE, FOOT, TOE, Feet
from sim.ground.ground import Ground
from sim.math import rotations as rot
from sim.math.easing import smooth_step
from sim.math.springs import spring_step
from sim.math.vectors import FLOOR, FORWARD, UP
from sim.motion.clip import FPS
from sim.motion.thresholds import FOOT_LOCKED
from sim.retarget.plausibility import SIDES

WEIGHT_HALFLIFE = 0.02  # seconds in which a foot that lands or lifts takes or gives half of the body's weight
SHIFT_HALFLIFE = 0.04  # seconds, for the hips' way to where the foot that carries has them
RELEASE_HALFLIFE = 0.04  # seconds in which half of what a lifted foot is off its leg is gone
# Share of the body's shift from ours that each landing foot takes back: on level floor, and on uneven ground, where
# feet have to land on what ours land on.
LEAK, UNEVEN_LEAK = 0.15, 1.0
FULL = 0.5  # of the feet's weights: with less, hips stay the more where they are; both feet are in the air
REACH = 0.9998  # share of a leg's length that is used
# A foot on its toes can raise its heel: that is how much it says of the hips' height, and how much of that fades.
TOES_VOICE, TOES_LEAK = 0.2, 0.15
SOFT = 0.001  # metres that a leg may still be stretched when the hips begin to sink for it
LEAP = 0.3  # metres in a frame: so far goes no body, it was put somewhere else
DT = 1 / FPS
UP_LEG, LOW_LEG = LEGS[:2]


@dataclass(frozen=True)
class Fitted:
    """A character in one pose, at the size at which it is drawn: rotations (J, 4) away from its rest pose, in world
    axes, and positions (J, 3) of its joints in world metres."""

    rotations: np.ndarray
    positions: np.ndarray

    def bones(self, character: Character, shift: np.ndarray | float = 0.0) -> np.ndarray:
        """(4 J, 3) float32: for each joint the transform (4, 3) of row vectors from the rest pose to this one, moved by
        `shift`."""
        result = np.empty((len(self.rotations), 4, 3), np.float32)
        result[:, :3] = rot.to_matrix(self.rotations).swapaxes(1, 2)
        result[:, 3] = self.positions + shift - rot.rotate(self.rotations, character.rest)
        return result.reshape(-1, 3)


class CharacterFit:
    """Takes our poses, one frame of 1/60 s after the other, and gives the character in each."""

    def __init__(self, character: Character) -> None:
        self.character = character
        rest, index = character.rest, character.index
        at = {name: rest[joint] for name, joint in index.items()}
        self._between = (at["LeftUpLeg"] + at["RightUpLeg"]) / 2 - at["Hips"]
        # Each (2, 3), left and right, in the rest pose: from between the hip joints to one of them, thigh, shin.
        self._sockets = np.array([at[side + "UpLeg"] - at["Hips"] for side in SIDES]) - self._between
        self._thighs, self._shins = (
            np.array([at[side + end] - at[side + start] for side in SIDES])
            for start, end in (("UpLeg", "Leg"), ("Leg", "Foot"))
        )
        self._feet = Feet(character)
        self._offsets = np.where(character.rig.parents[:, None] >= 0, rest - rest[character.rig.parents], rest)
        self.restart()

    def restart(self) -> None:
        """Forgets the frames before."""
        self._weights, self._rates = np.zeros(2), np.zeros(2)
        self._shift, self._pull = np.zeros(3), np.zeros(3)
        self._stands = np.zeros(2, bool)
        self._places, self._astray, self._astray_rate = np.zeros((3, 2, 3))
        self._joints: np.ndarray | None = None
        self._before: np.ndarray | None = None

    def step(self, pose: Pose, ground: Ground | None = None) -> Fitted:
        """The character in the next pose, on the ground that the pose was made on (None: level floor)."""
        own = np.concatenate([pose.rotations, rot.from_yaw(pose.root_facing)[None]])
        turned = rot.multiply(own, self.character.constants)
        weights = self._carry(pose)
        self._feet.pitch(pose, turned, weights, float(self._shift[1]), ground is None)

        middle = pose.hips + rot.rotate(pose.rotations[0], BETWEEN_HIPS) + self._feet.rise * UP
        sockets = middle + rot.rotate(turned[0], self._sockets)
        free = sockets + self._legs(turned)  # ankles as our directions have them
        on_toes = weights * self._feet.heel_up(pose)
        if ground is None:
            self._aim(pose, turned, free + self._shift, on_toes)
        heights, least = self._stand(pose, turned, weights, ground)
        standing = self._hold(pose, turned, free) + heights[:, None] * UP
        self._follow(weights, on_toes, standing - free, least - free[:, 1])
        sockets, free = sockets + self._shift, free + self._shift
        targets = free + self._stray(standing - free, LEAK if ground is None else UNEVEN_LEAK)
        targets[:, 1] = free[:, 1] + weights * (heights - free[:, 1])
        targets = targets + np.maximum(least - targets[:, 1], 0.0)[:, None] * UP

        missing = height_missing(sockets, targets, REACH * LEG_LENGTH)
        drop = SOFT * np.logaddexp(0.0, float((weights * missing - (1 - weights)).max()) / SOFT)
        sockets = sockets - drop * UP
        knees = sockets + rot.rotate(turned[UP_LEG], self._thighs)
        ankles = knees + rot.rotate(turned[LOW_LEG], self._shins)
        pole = rot.rotate(own[ROOT], FORWARD)[None]
        turns = two_bone_ik(sockets, knees, ankles, targets, pole, REACH, hinge=True)
        for joints, turn in zip((UP_LEG, LOW_LEG), turns):
            turned[joints] = rot.multiply(turn, turned[joints])
        hips = middle + self._shift - drop * UP - rot.rotate(turned[0], self._between)
        return self._whole(turned, hips, pose.root_position)

    def _carry(self, pose: Pose) -> np.ndarray:
        """(2,) how much of the body each foot carries, 0 to 1."""
        planted = smooth_step(pose.contacts.reshape(2, 2).max(axis=-1), *FOOT_LOCKED)
        root = pose.root_position
        if self._before is None or np.abs(root - self._before).max() > LEAP:
            self.restart()
            self._weights = planted
        self._before = root
        self._weights, self._rates = spring_step(self._weights, self._rates, planted, WEIGHT_HALFLIFE, DT)
        return np.minimum(np.maximum(self._weights, 0.0), 1.0)

    def _aim(self, pose: Pose, turned: np.ndarray, ankles: np.ndarray, shares: np.ndarray) -> None:
        """Feet that stand on their toes turn to where their legs have the ankles (2, 3), by shares (2,) of the way."""
        if self._joints is None:
            return
        contacts = pose.contacts.reshape(2, 2)
        balls = self._places + self._joints[2] + pose.positions[TOE] - self._joints[1]
        for side in np.flatnonzero(self._stands & (contacts[:, 0] < contacts[:, 1])).tolist():
            self._feet.aim(pose, turned, side, ankles[side], balls[side], shares[side])

    def _hold(self, pose: Pose, turned: np.ndarray, free: np.ndarray) -> np.ndarray:
        """(2, 3) over the floor, where ankles stand: where their legs, whose feet are `free` (2, 3), had them when they
        landed, and from there they go as ours do: by the ankle or by the ball of the foot, whichever is planted."""
        contacts = pose.contacts.reshape(2, 2)
        stands = contacts.max(axis=-1) > np.where(self._stands, *FOOT_LOCKED)
        landed, self._stands = stands & ~self._stands, stands
        balls = rot.rotate(turned[FOOT], self._feet.balls)
        joints = np.array([pose.positions[FOOT], pose.positions[TOE], balls])
        ankle, toe, ball = joints - (joints if self._joints is None else self._joints)
        self._joints = joints
        on_ankle = (contacts[:, 0] >= contacts[:, 1])[:, None]
        moved = self._places + np.where(on_ankle, ankle, toe - ball) * FLOOR
        self._places = np.where(landed[:, None], (free + self._shift + self._astray) * FLOOR, moved)
        return self._places

    def _stray(self, off: np.ndarray, leak: float) -> np.ndarray:
        """(2, 3) over the floor, from where a leg has its foot to where it goes: where it stands, which is `off` (2, 3)
        from there; when it lifts it goes back to its leg."""
        astray, rate = spring_step(self._astray, self._astray_rate, -leak * self._shift * FLOOR, RELEASE_HALFLIFE, DT)
        self._astray = np.where(self._stands[:, None], off * FLOOR, astray)
        self._astray_rate = np.where(self._stands[:, None], 0.0, rate)
        return self._astray

    def _follow(self, weights: np.ndarray, on_toes: np.ndarray, off: np.ndarray, under: np.ndarray) -> None:
        """The hips go with the feet that carry, weights (2,), which are off (2, 3) from where they should be; up and
        down rather with those that do not stand on their toes, as (2,) say, and up for one that comes down while the
        other does, if it would be `under` (2,) the floor."""
        voices = np.stack([weights, weights - (1 - TOES_VOICE) * on_toes, weights], axis=-1)
        off = off - on_toes[:, None] * TOES_LEAK * self._shift[1] * UP
        comes = (1 - weights) * on_toes[::-1] * (under > self._shift[1])
        comes = np.where(comes > weights, comes, 0.0)
        voices[:, 1] += comes
        off[:, 1] = np.where(comes > 0, under, off[:, 1])
        wanted = (voices * off).sum(axis=0) / np.maximum(voices.sum(axis=0), 1e-6)
        wanted = self._shift + np.minimum(1.0, weights.sum() / FULL) * (wanted - self._shift)
        self._shift, self._pull = spring_step(self._shift, self._pull, wanted, SHIFT_HALFLIFE, DT)

    def _legs(self, turned: np.ndarray) -> np.ndarray:
        """(2, 3) from hip joint to ankle."""
        return rot.rotate(turned[UP_LEG], self._thighs) + rot.rotate(turned[LOW_LEG], self._shins)

    def _stand(
        self, pose: Pose, turned: np.ndarray, weights: np.ndarray, ground: Ground | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """How high ankles are (2,) with which planted feet stand, and how high they are at least."""
        ankles, toes = pose.positions[FOOT, 1], pose.positions[TOE, 1]
        if ground is not None:  # the foot lies along the ground as ours does
            return ankles + self._feet.rise, ankles + self._feet.rise
        under = self._feet.lowest(turned)[:, 1]
        low = np.maximum(np.minimum(ankles - ANKLE_HEIGHT, toes - TOE_HEIGHT), 0.0)
        low = low * (1 - weights)
        return low - under, np.minimum(low, CLEARANCE) - under

    def _whole(self, turned: np.ndarray, hips: np.ndarray, root: np.ndarray) -> Fitted:
        """All joints, from the rotations (22, 4) of those that follow ours."""
        character = self.character
        first, second = turned[character.owners].swapaxes(0, 1)
        between = np.flatnonzero(character.shares)
        rotations = first
        rotations[between] = rot.slerp(first[between], second[between], character.shares[between, None])
        bones = rot.rotate(rotations[character.rig.parents], self._offsets)
        positions = root + rot.rotate(rotations, character.rest)  # of what does not hang on the hips
        positions = np.where(character.hangs[:, None], hips + character.under_hips @ bones, positions)
        return Fitted(rotations, positions)
