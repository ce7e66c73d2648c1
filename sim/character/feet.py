"""A character's feet in our poses: pitched, and bent at their toes, so that the leg above stands as ours does.

Our foot is a bone from ankle to toe; a character's is longer or higher, with a heel behind and toes ahead. In equal
attitudes its ankle is elsewhere over the floor, and a leg that is nearly straight pays for a centimetre with ten
degrees of knee. Hence the feet give way, not the legs: a foot that stands on its toes turns about its ball and on its
toes until its ankle is where the leg has it; a heel that comes down first stays over the floor."""

import numpy as np

from sim.body.limb_ik import LEGS
from sim.body.pose import Pose
from sim.body.skeleton import ANKLE_HEIGHT, CONTACT_JOINTS, TOE_HEIGHT
from sim.character.character import Character
from sim.math import rotations as rot
from sim.math.easing import smooth_step
from sim.math.vectors import FLOOR, FORWARD, LEFT, UP

MOST_PITCH = np.radians(25.0)
PITCHINGS = 3  # times that a foot is pitched by what of it is lowest, which may be another point then
STEEPEST_TOES = np.sin(np.radians(50.0))
CLEARANCE = 0.005  # metres: a foot in the air is as high over the floor as ours up to this
LEVEL = (0.02, 0.07)  # metres over the floor, between which a foot may lean to its side
HEEL_UP = (0.0, 0.01)  # metres that our heel is over a flat foot's, between which a foot has come to stand on its toes
FOOT, TOE = LEGS[2], CONTACT_JOINTS[1::2]


class Feet:
    """Both feet of a character; arrays have left and right as first axis. `turned` are the rotations (22, 4) of the
    joints that follow ours, and are changed in place."""

    def __init__(self, character: Character) -> None:
        self._soles = character.soles
        self.balls = np.array([sole.ball for sole in self._soles])  # (2, 3) from the ankle, in the rest pose
        self._ahead = [sole.on_toe | (sole.points[:, 2] > 0) for sole in self._soles]  # of the ankle
        toes = [sole.points[sole.on_toe] for sole in self._soles]
        self._toe_lengths = np.array([points[:, 2].max(initial=0.0) for points in toes])  # metres, 0 for no toes
        self._toe_heights = np.array([-points[:, 1].min(initial=0.0) for points in toes])  # of the joint, lying flat
        self.rise = -float(self.lowest(character.constants)[:, 1].mean()) - ANKLE_HEIGHT  # of its ankles over ours

    def lowest(self, turned: np.ndarray) -> np.ndarray:
        """(2, 3) from the ankles to what is lowest of the feet."""
        return np.array([self._lowest(turned, side) for side in range(2)])

    def _lowest(self, turned: np.ndarray, side: int, which: np.ndarray | slice = slice(None)) -> np.ndarray:
        """(3,) of one foot; `which` of its points are looked at."""
        sole = self._soles[side]
        on_toe, points = sole.on_toe[which, None], sole.points[which]
        points = rot.rotate(turned[FOOT[side]], np.where(on_toe, sole.ball, points)) + rot.rotate(
            turned[TOE[side]], np.where(on_toe, points, 0.0)
        )
        lowest: np.ndarray = points[points[:, 1].argmin()]
        return lowest

    def heel_up(self, pose: Pose) -> np.ndarray:
        """(2,) whether our feet stand on their toes, 0 to 1."""
        ankles, toes = _heights(pose)
        return smooth_step(ankles - toes, *HEEL_UP)

    def pitch(self, pose: Pose, turned: np.ndarray, weights: np.ndarray, up: float, level: bool) -> None:
        """Pitches feet so that an ankle is as high over the lowest of its foot as ours is. weights: (2,) how much each
        carries; up: metres that the body is over ours; level: on level floor, where soles lie on it."""
        ankles, toes = _heights(pose)
        low = np.maximum(np.minimum(ankles, toes), 0.0)
        on_toes = ankles - np.minimum(ankles, toes)
        axes = _axes(pose)
        pitches = np.arcsin(np.clip(rot.rotate(pose.rotations[FOOT], FORWARD)[:, 1], -1.0, 1.0))  # toes upwards
        if level:
            on_toes = np.maximum(on_toes + weights * (low + up), 0.0)
            self._lie(pose, turned, low, pitches, axes)
        over = self.rise + ANKLE_HEIGHT + np.where(pitches > 0, np.maximum(low - CLEARANCE, 0.0), on_toes)
        for side in range(2):
            which = self._ahead[side] if pitches[side] < 0 else ~self._ahead[side]  # of its points may come down first
            if which.any() and (level or pitches[side] < 0):
                self._pitch(turned, side, which, axes[side], over[side], pitches[side])

    def _lie(self, pose: Pose, turned: np.ndarray, low: np.ndarray, pitches: np.ndarray, axes: np.ndarray) -> None:
        """Feet near the floor do not lean to their side, and toes reach no farther down than to the floor."""
        near = 1 - smooth_step(low, *LEVEL)
        roll = np.arcsin(np.clip(rot.rotate(pose.rotations[FOOT], LEFT)[:, 1], -1.0, 1.0))
        upright = rot.from_axis_angle(rot.cross(axes, UP), -near * roll)
        reach = np.arcsin(np.minimum(low / np.maximum(self._toe_lengths, 1e-6), 1.0))
        bent = rot.from_axis_angle(axes, -np.maximum(-pitches - reach, 0.0))
        turned[FOOT] = rot.multiply(upright, turned[FOOT])
        turned[TOE] = rot.multiply(bent, rot.multiply(upright, turned[TOE]))

    def _pitch(
        self, turned: np.ndarray, side: int, which: np.ndarray, axis: np.ndarray, over: float, pitch: float
    ) -> None:
        """Turns a foot about its ankle until that is `over` metres over the lowest of it; no farther than to lie flat,
        and one that comes down with its heel first only as far as it must."""
        least, most = np.clip((pitch, MOST_PITCH) if pitch < 0 else (-MOST_PITCH, pitch), -MOST_PITCH, MOST_PITCH)
        foot, total = turned[FOOT[side]].copy(), 0.0
        for _ in range(PITCHINGS):
            point = self._lowest(turned, side, which)
            down, ahead = -float(point[1]), float(rot.cross(axis, UP) @ point)
            if pitch > 0 and down <= over:
                break
            angle = np.arctan2(ahead, down)
            turn = angle + np.copysign(np.arccos(min(over / np.hypot(ahead, down), 1.0)), pitch)
            total = float(np.clip(total + turn, least, most))
            turned[FOOT[side]] = rot.multiply(rot.from_axis_angle(axis, total), foot)

    def aim(self, pose: Pose, turned: np.ndarray, side: int, ankle: np.ndarray, ball: np.ndarray, share: float) -> None:
        """Turns a foot that stands on its toes about its ball, which is at `ball` (3,) over the floor, a share of the
        way to an ankle (3,). Where the foot is too short for that, its toes take the ball up."""
        axis = _axes(pose)[side]
        back = -rot.rotate(turned[FOOT[side]], self.balls[side])
        height = -back[1] - self._lowest(turned, side)[1]
        wanted = ankle - ball * FLOOR - height * UP
        square = float(back @ back) - float(wanted[0] ** 2 + wanted[2] ** 2)
        missing = float(wanted[1]) - np.sqrt(max(square, 0.0))
        if missing > 0 and self._toe_lengths[side]:
            stands = height - self._toe_heights[side]
            steep = np.array([stands, stands + share * missing]) / self._toe_lengths[side]
            steep = np.clip(steep, 0.0, STEEPEST_TOES)
            before, after = np.arcsin(steep)
            turned[TOE[side]] = rot.multiply(rot.from_axis_angle(axis, after - before), turned[TOE[side]])
            wanted = wanted - (steep[1] - steep[0]) * self._toe_lengths[side] * UP
        turn = np.arctan2(rot.cross(back, wanted) @ axis, back @ wanted)
        turn = rot.from_axis_angle(axis, share * np.clip(turn, -MOST_PITCH, MOST_PITCH))
        turned[FOOT[side]] = rot.multiply(turn, turned[FOOT[side]])


def _heights(pose: Pose) -> tuple[np.ndarray, np.ndarray]:
    """How high our ankles and our toes (2,) are over where they are on a flat foot."""
    return pose.positions[FOOT, 1] - ANKLE_HEIGHT, pose.positions[TOE, 1] - TOE_HEIGHT


def _axes(pose: Pose) -> np.ndarray:
    """(2, 3) about which our feet are pitched, level: turned about them, toes go down."""
    return rot.normalize(rot.rotate(pose.rotations[FOOT], LEFT) * FLOOR)
