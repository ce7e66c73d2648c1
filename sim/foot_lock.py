"""Keeps planted feet where they stand and every foot above the floor, by moving the hips a little and bending the legs."""

from dataclasses import replace

import numpy as np

from sim import rotations as rot
from sim.clip import FPS
from sim.limbs import KNEES_FORWARD, LEG_LENGTH, LEGS, height_missing, reach
from sim.pose import Pose
from sim.ramps import smooth_step
from sim.skeleton import CONTACT_JOINTS, TOE_HEIGHT
from sim.springs import decay, spring_step
from sim.vectors import FLOOR, UP, limited

RELEASE_HALFLIFE = 0.1  # seconds in which half of a lifted foot's correction is gone
HEIGHT_HALFLIFE = 0.05  # seconds, for a foot's way to the floor
RISE_HALFLIFE = 0.15  # seconds, for the height of a styled body
DROP_HALFLIFE = 0.03  # seconds, for hips that sink to let a leg reach
CLEARANCE = 0.055  # metres: a lifted foot is as high as the neutral one up to this, and a swinging one never lower
SWING_SPEEDS = (0.4, 1.2)  # metres a second over the floor between which a lifted foot counts as swinging
STANCE_HALFLIFE = 0.8  # seconds over which a styled foot's place is told from its stride
LIFTED, PLANTED = 0.2, 0.5  # contact under which a foot is free and over which it is held
ROLLING, FLAT = 0.5, 0.8  # contact of both its joints under which a planted foot may roll and over which it lies flat
STANDING_SECONDS = 0.35  # that both feet have been planted before one that is out of place takes a settling step
OUT_OF_PLACE = 0.06  # metres
SETTLING_SECONDS, SETTLING_HEIGHT = 0.35, 0.03  # how long a settling step takes, and how high in metres
LONGEST_CORRECTION = 0.25  # metres that a foot is held back at most; past that it slides rather than drags the leg
LONGEST_TURN = 0.03  # metres that its toe is held back at most, about 12 degrees; past that a flat foot pivots
LONGEST_DROP = 0.12  # metres that the hips sink at most to let a foot reach its place
REACH = 0.995  # share of the leg's length that is used

UP_LEG, _, FOOT = LEGS
DT = 1 / FPS


class FootLock:
    """Contacts come from the controller. While a foot is planted its motion over the floor is cancelled; in the air what has
    been cancelled fades out. So nothing ever jumps: not at touch-down, not when the weight rolls from heel to toe.

    Poses may have a leading axis, of a crowd; every array then has it."""

    def __init__(self) -> None:
        self.joints: np.ndarray | None = None  # (..., 2, 2, 3): left and right, ankle and toe, as they came in the last frame
        self.slip = _HeldBack(LONGEST_CORRECTION)  # the horizontal correction of each foot
        self.height, self.height_rate = np.zeros(2), np.zeros(2)  # the vertical one
        self.rise = self.rise_rate = np.zeros(())  # of the whole body, as the style's crouch or tiptoe asks
        self.drop = self.drop_rate = np.zeros(())  # of the hips, as a leg asks that cannot reach
        self.settling = _SettlingStep()
        self.attitude = _Attitude()
        self.stance = np.zeros((2, 3))  # where the style puts each foot beside the neutral one, in the character's facing

    def step(self, styled: Pose, neutral: Pose) -> Pose:
        """The styled pose with its feet in order. Joints keep their bones' length; arms and spine ride along unturned."""
        contacts, raised = self.settling.step(_by_foot(neutral.contacts), self.slip.vectors)
        rise = self._rise(styled, neutral)
        shift = self._stride(styled, neutral) + rise
        feet, turns = self.attitude.step(_by_foot(styled.positions[..., CONTACT_JOINTS, :], 3) + shift[..., None, :], contacts)
        neutral_low = _by_foot(neutral.positions[..., CONTACT_JOINTS, 1]).min(axis=-1)
        targets = feet[..., 0, :] + self._plant(feet, contacts, neutral_low + raised)
        drop = self._drop(styled.positions[..., UP_LEG, :] + rise, targets)
        rotations = styled.rotations.copy()
        turned = rot.multiply(turns[..., None, :], _by_foot(rotations[..., CONTACT_JOINTS, :], 4))
        rotations[..., CONTACT_JOINTS, :] = turned.reshape(*turned.shape[:-3], 4, 4)
        body = styled.with_body(styled.hips + rise[..., 0, :] - drop[..., None] * UP, rotations)
        return replace(reach(body, LEGS, targets, KNEES_FORWARD, REACH), contacts=contacts.reshape(neutral.contacts.shape))

    def _rise(self, styled: Pose, neutral: Pose) -> np.ndarray:
        """What the body rises by (..., 1, 3) so that its lowest foot is as high over the floor as the neutral one's: crouch or
        tiptoe."""
        wanted = _lowest(neutral) - _lowest(styled)
        self.rise, self.rise_rate = spring_step(self.rise, self.rise_rate, wanted, RISE_HALFLIFE, DT)
        return self.rise[..., None, None] * UP

    def _stride(self, styled: Pose, neutral: Pose) -> np.ndarray:
        """What to add to each foot (..., 2, 3) so that it strides as the neutral one does, about the style's own stance.

        The root goes the content's way at the content's speed: another stride under it could only slide."""
        apart = neutral.to_character(styled.positions[..., FOOT, :] - neutral.positions[..., FOOT, :]) * FLOOR
        self.stance = self.stance + (apart - self.stance) * (1 - decay(STANCE_HALFLIFE, DT))
        return neutral.to_world(self.stance - apart)

    def _plant(self, feet: np.ndarray, contacts: np.ndarray, neutral_low: np.ndarray) -> np.ndarray:
        """What to add to each foot (..., 2, 3), for ankles and toes (..., 2, 2, 3), their contacts (..., 2, 2) and the neutral
        feet's height (..., 2)."""
        moved = feet - (feet if self.joints is None else self.joints)
        self.joints = feet
        on_ankle = contacts[..., :1] >= contacts[..., 1:]  # which joint carries the weight: ankle or toe
        planted = smooth_step(contacts.max(axis=-1), LIFTED, PLANTED)
        against = -np.where(on_ankle, moved[..., 0, :], moved[..., 1, :]) * FLOOR
        slip = self.slip.step(against, planted)

        low = feet[..., 1].min(axis=-1)
        to_floor = TOE_HEIGHT - low
        swinging = smooth_step(rot.length(against)[..., 0] / DT, *SWING_SPEEDS)
        as_neutral = np.minimum(np.maximum(neutral_low, TOE_HEIGHT), CLEARANCE)
        to_clear = np.maximum(as_neutral, TOE_HEIGHT + swinging * (CLEARANCE - TOE_HEIGHT)) - low
        wanted = np.maximum(to_clear, 0.0) * (1 - planted) + to_floor * planted
        self.height, self.height_rate = spring_step(self.height, self.height_rate, wanted, HEIGHT_HALFLIFE, DT)
        up = np.maximum(self.height, to_floor - 0.5 * TOE_HEIGHT)  # the spring may lag, the floor may not be pierced
        return slip + up[..., None] * UP

    def _drop(self, hips: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """How far (...) the hips sink so that legs from (..., 2, 3) reach ankles at (..., 2, 3)."""
        missing = height_missing(hips, targets, REACH * LEG_LENGTH).max(axis=-1)
        wanted = np.minimum(np.maximum(missing, 0.0), LONGEST_DROP)
        self.drop, self.drop_rate = spring_step(self.drop, self.drop_rate, wanted, DROP_HALFLIFE, DT)
        return self.drop


class _HeldBack:
    """What each foot is held back from going: it grows against the motion while the foot is held, and fades out when not."""

    def __init__(self, longest: float) -> None:
        self.vectors, self.rates = np.zeros((2, 3)), np.zeros((2, 3))
        self.longest = longest  # metres; past that the foot goes along

    def step(self, against: np.ndarray, firmly: np.ndarray) -> np.ndarray:
        """(..., 2, 3) metres, after a frame whose motion would be undone by (..., 2, 3); how firmly (..., 2) in 0..1 each foot
        is held."""
        firmly = firmly[..., None]
        free, free_rates = spring_step(self.vectors, self.rates, 0.0, RELEASE_HALFLIFE, DT)
        self.rates = free_rates + (against / DT - free_rates) * firmly
        self.vectors = limited(free + (self.vectors + against - free) * firmly, self.longest)
        return self.vectors


class _Attitude:
    """A foot whose ankle and toe are both planted does not turn on the floor; when one lifts, what was held back fades out."""

    def __init__(self) -> None:
        self.foot: np.ndarray | None = None  # (..., 2, 3), from ankle to toe, as it came in the last frame
        self.turned = _HeldBack(LONGEST_TURN)  # what the toe of each foot is held back

    def step(self, feet: np.ndarray, contacts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ankles and toes (..., 2, 2, 3) with the toes put back, and the turn of each foot (..., 2, 4) that does it."""
        foot = feet[..., 1, :] - feet[..., 0, :]
        against = (foot if self.foot is None else self.foot) - foot
        self.foot = foot
        held = self.turned.step(against, smooth_step(contacts.min(axis=-1), ROLLING, FLAT))
        turns = rot.between(foot, foot + held)
        feet = feet.copy()
        feet[..., 1, :] = feet[..., 0, :] + rot.rotate(turns, foot)
        return feet, turns


class _SettlingStep:
    """People who stop with a foot out of place shift it. After standing a moment, one foot at a time takes a small step."""

    def __init__(self) -> None:
        self.standing = np.zeros(())  # seconds
        self.left = np.zeros(2)  # seconds that each foot's step still takes

    def step(self, contacts: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Contacts (..., 2, 2) without those of a stepping foot, and how high (..., 2) it is; slip (..., 2, 3) tells what is out
        of place."""
        self.standing = (self.standing + DT) * (contacts.max(axis=-1).min(axis=-1) > 0.9)
        self.left = np.maximum(self.left - DT, 0.0)
        out = rot.length(slip)[..., 0]
        farthest = out.max(axis=-1)
        due = (self.standing > STANDING_SECONDS) & (farthest > OUT_OF_PLACE) & ~self.left.any(axis=-1)
        if due.any():
            self.left = np.where(due[..., None] & (out == farthest[..., None]), SETTLING_SECONDS, self.left)
        raised = SETTLING_HEIGHT * np.sin(np.pi * self.left / SETTLING_SECONDS)
        return contacts * (self.left == 0)[..., None], raised


def _by_foot(values: np.ndarray, size: int | None = None) -> np.ndarray:
    """Values of the contact joints, (..., 4) or (..., 4, size), as left and right, ankle and toe: (..., 2, 2) or with size."""
    own = () if size is None else (size,)
    return values.reshape(*values.shape[:values.ndim - 1 - len(own)], 2, 2, *own)


def _lowest(pose: Pose) -> np.ndarray:
    return pose.positions[..., CONTACT_JOINTS, 1].min(axis=-1)
