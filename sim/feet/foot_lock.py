"""Keeps planted feet where they stand and every foot above the floor, by moving the hips a little and bending the
legs."""

from dataclasses import replace

import numpy as np

from sim.body.limb_ik import KNEES_FORWARD, LEG_LENGTH, LEGS, height_missing, reach
from sim.body.pose import Pose
from sim.body.skeleton import ANKLE_HEIGHT, CONTACT_JOINTS, TOE_HEIGHT
from sim.ground.ground import Ground, sole_heights
from sim.math import rotations as rot
from sim.math.easing import smooth_step
from sim.math.springs import decay, spring_step
from sim.math.vectors import FLOOR, NOT_YET, UP, before_or_now, limit_length
from sim.motion.clip import FPS
from sim.motion.thresholds import FOOT_FLAT, FOOT_LOCKED, STANDING_FEET, SWINGING_FOOT

RELEASE_HALFLIFE = 0.1  # seconds in which half of a lifted foot's correction is gone
HEIGHT_HALFLIFE, UNEVEN_HALFLIFE = 0.05, 0.035  # seconds, for a foot's way to the floor; to uneven ground
RISE_HALFLIFE = 0.05  # seconds, for the height of a body on the feet that carry it
DROP_HALFLIFE = 0.03  # seconds, for hips that sink to let a leg reach
# Metres: a lifted foot is as high as the neutral one up to this, and a swinging one never lower; of neutral legs, of
# styled ones.
CLEARANCE, STYLED_CLEARANCE = 0.055, 0.05
WAY_HALFLIFE = 0.12  # seconds over which the root's direction is measured
STANCE_HALFLIFE = 0.8  # seconds over which a foot's mean place is measured
CARRY_HALFLIFE = 0.6  # seconds over which strides are compared
CARRY = (0.3, 1.7)  # how much shorter and longer strides may be than the neutral ones
MODERATE = (0.7, 1.3)  # the same where the speed is to be kept: the controller then makes more of them, or fewer
STANDING_SWING = 0.05**2  # square metres: feet that swing less are standing
OFF_FLOOR = (0.01, 0.03)  # metres over where a joint is on a flat foot, between which it has left the floor
FLAT_HEIGHTS = np.array([ANKLE_HEIGHT, TOE_HEIGHT])
EVEN = 0.01  # metres by which one foot may be lower than the other and both carry
STANDING_SECONDS = 0.35  # that both feet have been planted before one that is out of place takes a settling step
OUT_OF_PLACE = 0.06  # metres
SETTLING_SECONDS, SETTLING_HEIGHT = 0.35, 0.03  # how long a settling step takes, and how high in metres
LONGEST_CORRECTION = 0.25  # metres that a foot is held back at most; past that it slides rather than drags the leg
LONGEST_TURN = 0.03  # metres that its toe is held back at most, about 12 degrees; past that a flat foot pivots
LONGEST_DROP = 0.12  # metres that the hips sink at most to let a foot reach its place
LONGEST_STEP_DOWN = 0.25  # the same on uneven ground
LEAST_LEG = 0.28  # metres that an ankle is under its hip joint at least
LONGEST_RISE = 0.3  # metres that the hips rise at most for that
FORESIGHT = np.array([0.0, 0.04, 0.08])  # seconds ahead that a swinging foot looks at the ground
HIGHEST_EDGE = 0.1  # metres that it is raised at most for what it sees
TILT_HALFLIFE = 0.04  # seconds in which a foot tilts half of its way to the ground
SOFT = 0.003  # metres that a leg may still be stretched when the hips begin to sink for it: a straight knee would pop
REACH = 0.9995  # share of the leg's length that is used

UP_LEG, _, FOOT = LEGS
DT = 1 / FPS
NO_STYLE = np.zeros(2)


class FootLock:
    """Contacts come from the controller. While a foot is planted its motion over the floor is cancelled; in the air
    what has been cancelled fades out. So nothing ever jumps: not at touch-down, not when the weight rolls from heel to
    toe.

    Poses may have a leading axis, of a crowd; every array then has it."""

    def __init__(self, ground: Ground | None = None) -> None:
        """ground: None for level floor."""
        self.ground = ground
        # (..., 2, 2, 3): left and right, ankle and toe, as they came in the last frame
        self.joints = NOT_YET
        # (..., 2, 2): the ground under a foot's sole, ankle and toe; a planted foot keeps what it landed on
        self.soles = NOT_YET
        self.landed = np.zeros(2)  # how far each foot was down in the last frame
        self.slip = _HeldBack(LONGEST_CORRECTION)  # the horizontal correction of each foot
        self.height, self.height_rate = np.zeros(2), np.zeros(2)  # the vertical one
        self.rise = self.rise_rate = np.zeros(())  # of the whole body
        self.drop = self.drop_rate = np.zeros(())  # of the hips, as a leg asks that cannot reach
        self.settling = _SettlingStep()
        self.attitude = _Attitude()
        self.stride = StrideScale()

    def step(self, styled: Pose, neutral: Pose, legs: np.ndarray = NO_STYLE, pace: np.ndarray | bool = False) -> Pose:
        """The styled pose with its feet in order. Joints keep their bones' length; arms and spine ride along unturned.

        legs: (..., 2) how far the left and the right leg are styled; pace: (...) whether they set the pace, so that the
        body goes as far as they carry it; otherwise their strides are as long as the speed that is asked for needs,
        within MODERATE."""
        contacts, raised = self.settling.step(_by_foot(neutral.contacts), self.slip.vectors)
        legs = np.minimum(legs, 1.0)
        stride = self.stride.step(styled, neutral, legs.max(axis=-1), pace)
        neutral_feet = _by_foot(neutral.positions[..., CONTACT_JOINTS, :], 3)
        feet = _by_foot(styled.positions[..., CONTACT_JOINTS, :], 3) + stride[..., None, :]
        soles = self._land(self._under(feet), contacts)
        edge = self._edge_ahead(feet, soles)
        neutral_low = (neutral_feet[..., 1] - sole_heights(self._under(neutral_feet))).min(axis=-1)
        rise = self._rise(feet[..., 1] - soles, neutral_low, contacts, legs)
        feet = feet + rise[..., None, :]
        lifting = np.zeros(2) if self.ground is None else 1 - smooth_step(contacts.min(axis=-1), *FOOT_LOCKED)
        contacts = contacts * _on_floor(feet[..., 1] - soles, np.maximum(legs, lifting))
        feet, turns = self.attitude.step(feet, contacts, None if self.ground is None else soles)
        self.landed = self._landed(feet[..., 1] - soles)
        targets = feet[..., 0, :] + self._plant(feet, soles, edge, contacts, neutral_low + raised, legs)
        drop = self._drop(styled.positions[..., UP_LEG, :] + rise, targets)
        rotations = styled.rotations.copy()
        turned = rot.multiply(turns[..., None, :], _by_foot(rotations[..., CONTACT_JOINTS, :], 4))
        rotations[..., CONTACT_JOINTS, :] = turned.reshape(*turned.shape[:-3], 4, 4)
        body = styled.with_body(styled.hips + rise[..., 0, :] - drop[..., None] * UP, rotations)
        contacts = contacts * self.landed[..., None]
        return replace(
            reach(body, LEGS, targets, KNEES_FORWARD, REACH), contacts=contacts.reshape(neutral.contacts.shape)
        )

    def _under(self, feet: np.ndarray) -> np.ndarray:
        """How high (..., 2, 2) the ground is under ankles and toes (..., 2, 2, 3), where they are held."""
        if self.ground is None:
            return np.zeros(feet.shape[:-1])
        return self.ground.height_at((feet + self.slip.vectors[..., None, :])[..., ::2])

    def _land(self, under: np.ndarray, contacts: np.ndarray) -> np.ndarray:
        """The soles (..., 2, 2) that count on ground so high (..., 2, 2): of a foot that has landed, by its contacts
        (..., 2, 2), those that it landed on, since on the edge of a step a hair's breadth decides."""
        soles = sole_heights(under)
        if self.ground is not None:
            landed = (smooth_step(contacts.max(axis=-1), *FOOT_LOCKED) * self.landed)[..., None]
            soles = soles + landed * (np.maximum(before_or_now(self.soles, soles), under) - soles)
        self.soles = soles
        return soles

    def _edge_ahead(self, feet: np.ndarray, soles: np.ndarray) -> np.ndarray:
        """How much higher (..., 2) than its soles (..., 2, 2) the ground is that a foot is about to pass over."""
        if self.ground is None:
            return np.zeros(soles.shape[:-1])
        velocity = (feet - before_or_now(self.joints, feet)) * FPS
        path = feet[..., None, :] + velocity[..., None, :] * FORESIGHT[:, None]
        edge = (self.ground.height_at(path[..., ::2]).max(axis=-1) - soles).max(axis=-1)
        return np.minimum(np.maximum(edge, 0.0), HIGHEST_EDGE)

    def _rise(self, heights: np.ndarray, neutral_low: np.ndarray, contacts: np.ndarray, legs: np.ndarray) -> np.ndarray:
        """What the body rises by (..., 1, 3) so that it stands on the feet that carry it, ankles and toes so high
        (..., 2, 2) over the ground, with their contacts (..., 2, 2): the legs keep their bend, and the hips go up and
        down as the styled legs carry them. Legs without a style, strengths (..., 2), leave it where the neutral one
        is, whose feet are so high (..., 2)."""
        error = neutral_low + legs * (TOE_HEIGHT - neutral_low) - heights.min(axis=-1) - self.rise[..., None]
        # A foot that pushes off leaves the floor by itself: only one that is flat on it draws the body down.
        bearing = smooth_step(np.where(error > 0, contacts.max(axis=-1), contacts.min(axis=-1)), *FOOT_LOCKED)
        lowest = error.max(axis=-1, keepdims=True)  # of two feet on the floor the one that is lower carries more
        bearing = bearing * np.exp((error - lowest) / EVEN)
        wanted = self.rise + (bearing * error).sum(axis=-1) / np.maximum(bearing.sum(axis=-1), 1.0)
        self.rise, self.rise_rate = spring_step(self.rise, self.rise_rate, wanted, RISE_HALFLIFE, DT)
        return self.rise[..., None, None] * UP

    def _landed(self, heights: np.ndarray) -> np.ndarray:
        """How far (..., 2) each foot is down, whose ankle and toe are so high (..., 2, 2) over its sole: the ground may
        be lower than where the neutral foot stands, and a foot in the air is not held."""
        if self.ground is None:
            return np.ones(heights.shape[:-1])
        return _on_floor(heights + self.height[..., None], np.ones(2)).max(axis=-1)

    def _plant(
        self,
        feet: np.ndarray,
        soles: np.ndarray,
        edge: np.ndarray,
        contacts: np.ndarray,
        neutral_low: np.ndarray,
        legs: np.ndarray,
    ) -> np.ndarray:
        """What to add to each foot (..., 2, 3), for ankles and toes (..., 2, 2, 3), the ground under them (..., 2, 2)
        and how much higher its next edge is (..., 2), their contacts (..., 2, 2), the neutral feet's height (..., 2)
        over the ground and how far the legs are styled (..., 2)."""
        moved = feet - before_or_now(self.joints, feet)
        self.joints = feet
        on_ankle = contacts[..., :1] >= contacts[..., 1:]  # which joint carries the weight: ankle or toe
        planted = smooth_step(contacts.max(axis=-1), *FOOT_LOCKED)
        against = -np.where(on_ankle, moved[..., 0, :], moved[..., 1, :]) * FLOOR
        slip = self.slip.step(against, planted * self.landed)

        low = (feet[..., 1] - soles).min(axis=-1)
        to_floor = TOE_HEIGHT - low
        swinging = smooth_step(rot.length(against)[..., 0] / DT, *SWINGING_FOOT)
        clearance = CLEARANCE + legs * (STYLED_CLEARANCE - CLEARANCE)
        as_neutral = np.minimum(np.maximum(neutral_low, TOE_HEIGHT), clearance)
        to_clear = np.maximum(as_neutral, TOE_HEIGHT + swinging * (clearance - TOE_HEIGHT + edge)) - low
        flat = smooth_step(contacts.min(axis=-1), *FOOT_LOCKED)
        wanted = (
            np.maximum(to_clear, 0.0) * (1 - planted) + np.maximum(to_floor, 0.0) * (planted - flat) + to_floor * flat
        )
        halflife = HEIGHT_HALFLIFE if self.ground is None else UNEVEN_HALFLIFE
        self.height, self.height_rate = spring_step(self.height, self.height_rate, wanted, halflife, DT)
        # The spring may lag, the floor may not be pierced; on a step's edge, that a foot comes to all at once, it may.
        least = to_floor - 0.5 * TOE_HEIGHT
        up = np.maximum(self.height, least if self.ground is None else least * planted)
        return slip + up[..., None] * UP

    def _drop(self, hips: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """How far (...) the hips sink so that legs from (..., 2, 3) reach ankles at (..., 2, 3); less than 0 where they
        rise, because a leg would be folded altogether."""
        missing = height_missing(hips, targets, REACH * LEG_LENGTH).max(axis=-1)
        longest = LONGEST_DROP if self.ground is None else LONGEST_STEP_DOWN
        wanted = np.minimum(SOFT * np.logaddexp(0.0, missing / SOFT), longest)
        folded = (LEAST_LEG - (hips - targets)[..., 1]).max(axis=-1)
        wanted = wanted - np.minimum(np.maximum(folded, 0.0), LONGEST_RISE)
        self.drop, self.drop_rate = spring_step(self.drop, self.drop_rate, wanted, DROP_HALFLIFE, DT)
        return self.drop


class StrideScale:
    """Feet that stride with the neutral ones, whose planted feet stand still, as far as the body goes, about the
    style's own stance.

    How far the styled legs would carry the body, `carry`, is how long their strides are beside the neutral ones: the
    slope of the styled feet's way forwards over the neutral feet's, since both step together."""

    def __init__(self) -> None:
        self.carry = np.ones(())  # (...) of the styled legs
        self.scale = np.ones(())  # (...) of the strides that are made
        self._before = NOT_YET  # (..., 3) the root's place in the last frame
        self._velocity = np.zeros(3)  # (..., 3) of the root in the character's frame
        # (2, ..., 2 feet): styled and neutral, where they are on the average along the way
        self._mean = np.zeros(())
        self._products = np.zeros(())  # (2, ...): of styled and neutral, of neutral and neutral

    def step(self, styled: Pose, neutral: Pose, carried: np.ndarray, pace: np.ndarray | bool) -> np.ndarray:
        """What to add to each foot (..., 2, 3). carried: (...) how far the styled legs carry the body, 0 not at all;
        pace: (...) whether they set the pace."""
        root = neutral.root_position
        moved = (root - before_or_now(self._before, root)) * FLOOR
        moved = neutral.to_character(moved[..., None, :])[..., 0, :]
        self._before = root
        self._velocity = self._velocity + (moved / DT - self._velocity) * (1 - decay(WAY_HALFLIFE, DT))
        speed = rot.length(self._velocity)
        direction = self._velocity / np.maximum(speed, 1e-6)
        feet = np.array([pose.positions[..., FOOT, :] - root[..., None, :] for pose in (styled, neutral)])
        along = np.vecdot(neutral.to_character(feet), direction[..., None, :])
        self._mean = self._mean + (along - self._mean) * (1 - decay(STANCE_HALFLIFE, DT))
        swing = along - self._mean
        products = (swing * swing[1]).sum(axis=-1)
        self._products = self._products + (products - self._products) * (1 - decay(CARRY_HALFLIFE, DT))
        carry = (self._products[0] + STANDING_SWING) / (self._products[1] + STANDING_SWING)
        shortest, longest = (np.where(pace, *bounds) for bounds in zip(CARRY, MODERATE))
        self.carry = np.minimum(np.maximum(carry, shortest), longest)
        self.scale = 1 + carried * (self.carry - 1)
        going = smooth_step(speed[..., 0], *STANDING_FEET)
        missing = self.scale[..., None] * swing[1] - swing[0]
        return neutral.to_world((going[..., None] * missing)[..., None] * direction[..., None, :])


class _HeldBack:
    """What each foot is held back from going: it grows against the motion while the foot is held, and fades out when
    not."""

    def __init__(self, longest: float) -> None:
        self.vectors, self.rates = np.zeros((2, 3)), np.zeros((2, 3))
        self.longest = longest  # metres; past that the foot goes along

    def step(self, against: np.ndarray, firmly: np.ndarray) -> np.ndarray:
        """(..., 2, 3) metres, after a frame whose motion would be undone by (..., 2, 3); how firmly (..., 2) in 0..1
        each foot is held."""
        firmly = firmly[..., None]
        free, free_rates = spring_step(self.vectors, self.rates, 0.0, RELEASE_HALFLIFE, DT)
        self.rates = free_rates + (against / DT - free_rates) * firmly
        self.vectors = limit_length(free + (self.vectors + against - free) * firmly, self.longest)
        return self.vectors


class _Attitude:
    """A foot whose ankle and toe are both planted does not pivot on the floor; when one lifts, what was held back fades
    out. Its heel rises as it comes: who holds it down pulls a leg that is straight."""

    def __init__(self) -> None:
        self.foot = NOT_YET  # (..., 2, 3), from ankle to toe, as it came in the last frame
        self.turned = _HeldBack(LONGEST_TURN)  # what the toe of each foot is held back
        self.tilt, self.tilt_rate = np.zeros(2), np.zeros(2)  # metres that each toe is raised to lie on the ground

    def step(self, feet: np.ndarray, contacts: np.ndarray, soles: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Ankles and toes (..., 2, 2, 3) with the toes put back, and the turn of each foot (..., 2, 4) that does it;
        soles: the uneven ground (..., 2, 2) under them, which a flat foot is tilted to."""
        foot = feet[..., 1, :] - feet[..., 0, :]
        against = (before_or_now(self.foot, foot) - foot) * FLOOR
        self.foot = foot
        held = self.turned.step(against, smooth_step(contacts.min(axis=-1), *FOOT_FLAT))
        if soles is not None:
            level = FLAT_HEIGHTS[1] - FLAT_HEIGHTS[0]
            wanted = (soles[..., 1] - soles[..., 0] + level - foot[..., 1]) * smooth_step(
                contacts.min(axis=-1), *FOOT_LOCKED
            )
            self.tilt, self.tilt_rate = spring_step(self.tilt, self.tilt_rate, wanted, TILT_HALFLIFE, DT)
            held = held + self.tilt[..., None] * UP
        turns = rot.between(foot, foot + held)
        feet = feet.copy()
        feet[..., 1, :] = feet[..., 0, :] + rot.rotate(turns, foot)
        return feet, turns


class _SettlingStep:
    """People who stop with a foot out of place shift it. After standing a moment, one foot at a time takes a small
    step."""

    def __init__(self) -> None:
        self.standing = np.zeros(())  # seconds
        self.left = np.zeros(2)  # seconds that each foot's step still takes

    def step(self, contacts: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Contacts (..., 2, 2) without those of a stepping foot, and how high (..., 2) it is; slip (..., 2, 3) tells
        what is out of place."""
        self.standing = (self.standing + DT) * (contacts.max(axis=-1).min(axis=-1) > 0.9)
        self.left = np.maximum(self.left - DT, 0.0)
        out = rot.length(slip)[..., 0]
        farthest = out.max(axis=-1)
        # half a frame aside, so that rounding does not decide in which frame a time is over
        landed = self.left < DT / 2
        due = (self.standing > STANDING_SECONDS + DT / 2) & (farthest > OUT_OF_PLACE) & landed.all(axis=-1)
        if due.any():
            self.left = np.where(due[..., None] & (out == farthest[..., None]), SETTLING_SECONDS, self.left)
        raised = SETTLING_HEIGHT * np.sin(np.pi * self.left / SETTLING_SECONDS)
        return contacts * (self.left < DT / 2)[..., None], raised


def _by_foot(values: np.ndarray, size: int | None = None) -> np.ndarray:
    """Values of the contact joints, (..., 4) or (..., 4, size), as left and right, ankle and toe: (..., 2, 2) or with
    size."""
    own = () if size is None else (size,)
    return values.reshape(*values.shape[: values.ndim - 1 - len(own)], 2, 2, *own)


def _on_floor(heights: np.ndarray, legs: np.ndarray) -> np.ndarray:
    """How far (..., 2, 2) ankles and toes at heights (..., 2, 2) may be on the floor at all: contacts are the neutral
    feet's, and a styled foot, of legs styled as far as (..., 2), may be lifted where the neutral one stands; so may one
    that pushes off uphill."""
    lifted = smooth_step(heights - FLAT_HEIGHTS, *OFF_FLOOR)
    return 1 - legs[..., None] * lifted
