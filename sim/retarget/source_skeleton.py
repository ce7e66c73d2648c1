"""A motion on somebody else's skeleton, read as a human body: where our joints are in it, and what can be measured."""

from dataclasses import replace

import numpy as np

from sim.io.bvh import Motion
from sim.io.bvh_parser import shorten
from sim.math import rotations as rot
from sim.math.vectors import UP
from sim.motion.clip import MIRROR_POSITION, MIRROR_QUATERNION
from sim.retarget import joint_names, joint_shape
from sim.retarget.outliers import describe, find_outliers, leave_out
from sim.retarget.plausibility import AXES, SIDES, check_bones, find_up, is_mirrored, walks_on_four

SAID = ("Hips", "Chest", "Head", "LeftUpLeg", "LeftArm")  # of the joints that were found by shape
SAMPLES = 400  # frames from which a skeleton's constants are measured
PLANTED_SPEEDS = (0.25, 0.5, 1.0)  # leg lengths a second under which a foot may be planted; the first to find enough
PLANTED_HEIGHT = 0.06  # leg lengths above the lowest a foot comes
ENOUGH_PLANTED = 8  # frames


def mirrored(motion: Motion) -> Motion:
    """The motion as a mirror shows it that stands across the X axis; done twice it is itself again."""
    return replace(
        motion,
        offsets=motion.offsets * MIRROR_POSITION,
        end_sites={joint: offset * MIRROR_POSITION for joint, offset in motion.end_sites.items()},
        positions=motion.positions * MIRROR_POSITION,
        rotations=motion.rotations * MIRROR_QUATERNION,
    )


class SourceBody:
    """World positions (F, J, 3) and rotations (F, J, 4) of the source, turned Y up; index: our joint -> theirs.

    motion: what was read, with frames replaced that do not belong to it, and mirrored back where it was mirrored;
    notes: a sentence for each of these."""

    def __init__(self, motion: Motion, name_map: dict[str, str] | None = None) -> None:
        """name_map: our joint -> theirs; None: found by their names, or else by the skeleton's shape. Raises ValueError
        where it names joints that the motion does not have, where none are found, and where the motion is none of a
        person."""
        self.notes: list[str] = []
        name_map = name_map or self._find_joints(motion)
        absent = [theirs for theirs in name_map.values() if theirs not in motion.names]
        if absent:
            raise ValueError(f"the joint map names {', '.join(absent)}, which the file does not have")
        self.index = {ours: motion.names.index(theirs) for ours, theirs in name_map.items()}
        self._take(motion)
        leg_length = self.leg_length()
        outliers = find_outliers(self.positions[:, list(self.index.values())], leg_length, motion.fps)
        if outliers.any():
            self.notes.append(describe(outliers))
            self._take(leave_out(motion, outliers))
        check_bones(self._places(), leg_length, name_map)
        if walks_on_four(self._places(), leg_length):
            raise ValueError("four feet carry this body: it is an animal's, and only people can be restyled")
        up, note = find_up(self._places(), leg_length)
        self.turn = rot.between(np.array(AXES[up]), UP)  # from the file's axes to ours
        self.notes += [note] if note else []
        self._turn_up()
        self.mirrored = is_mirrored(self._places())
        if self.mirrored:
            self.notes.append("its knees bend forwards: it is mirrored (left-handed), and was mirrored back")
            self._take(mirrored(self.motion))
            self.turn = self.turn * MIRROR_QUATERNION
            self._turn_up()
        self.sample = np.unique(np.linspace(0, len(self.motion) - 1, SAMPLES).astype(int))
        self.rest = self._rest()

    def _find_joints(self, motion: Motion) -> dict[str, str]:
        try:
            return joint_names.detect(motion.names)
        except ValueError:
            guess = joint_shape.guess_joints(motion)
            if guess is None:
                raise
        known = ", ".join(f"{ours} is {shorten(guess.name_map[ours])}" for ours in SAID if ours in guess.name_map)
        self.notes.append(
            f"its joints were told by the skeleton's shape, {guess.sure:.0%} sure: {known}; "
            "if that is wrong, say which is which with --map FILE"
        )
        return guess.name_map

    def _take(self, motion: Motion) -> None:
        self.motion = motion
        self.positions, self.rotations = motion.global_transforms()

    def _turn_up(self) -> None:
        self.positions = rot.rotate(self.turn, self.positions)
        self.rotations = rot.multiply(self.turn, self.rotations)

    def _places(self) -> dict[str, np.ndarray]:
        """Our joint -> world positions (F, 3)."""
        return {name: self.at(name) for name in self.index}

    def _rest(self) -> dict[str, np.ndarray]:
        """The zero pose: our joint -> place (3,), from mean translations (position channels replace offsets)."""
        place = self.motion.positions.mean(axis=0)
        for joint, parent in enumerate(self.motion.parents):
            if parent >= 0:
                place[joint] += place[parent]
        return {name: place[joint] for name, joint in self.index.items()}

    def has(self, *names: str) -> bool:
        """True if the source has every one of these joints of ours."""
        return all(name in self.index for name in names)

    def at(self, name: str) -> np.ndarray:
        """World positions (F, 3) of the joint that is ours by name."""
        return self.positions[:, self.index[name]]

    def between_hips(self) -> np.ndarray:
        """(F, 3) the point between the two hip joints."""
        return (self.at("LeftUpLeg") + self.at("RightUpLeg")) / 2

    def leg_length(self) -> float:
        """Thigh and shin, the mean of both sides, in the file's unit. Raises ValueError where they have no length."""
        length = sum(
            np.linalg.norm(self.at(side + a) - self.at(side + b), axis=-1).mean() / 2
            for side in SIDES
            for a, b in (("UpLeg", "Leg"), ("Leg", "Foot"))
        )
        if not length > 0:
            raise ValueError("the legs have no length: hips, knees and ankles are all in one place")
        return float(length)

    def seen_from(self, name: str, world: np.ndarray) -> np.ndarray:
        """The mean (3,), over a sample of frames, of world directions (F, 3) as joint `name` sees them."""
        turned = rot.inverse(self.rotations[self.sample, self.index[name]])
        return rot.rotate(turned, np.broadcast_to(world, (len(self.motion), 3))[self.sample]).mean(axis=0)

    def bone(self, name: str, child: str) -> np.ndarray:
        """The offset (3,) of one of our joints from another, in that other's frame."""
        return self.seen_from(name, self.at(child) - self.at(name))

    def bend(self, upper: str, lower: str, end: str) -> np.ndarray:
        """(F, 3) the world axis about which a limb is bent, as long as the sine of the bend."""
        first, second = self.at(lower) - self.at(upper), self.at(end) - self.at(lower)
        return rot.cross(rot.normalize(first), rot.normalize(second))

    def planted(self) -> np.ndarray:
        """(2, F) the frames in which the left and the right foot carry the body: slow, and as low as feet get."""
        if len(self.motion) < 3:
            return np.zeros((2, len(self.motion)), bool)
        joints = ("Foot", "Toe") if self.has("LeftToe", "RightToe") else ("Foot",)
        places = np.array([[self.at(side + name) for name in joints] for side in SIDES]) / self.leg_length()
        speeds = np.linalg.norm(np.gradient(places, axis=2), axis=-1).max(axis=1) * self.motion.fps  # (2, F)
        floors = np.percentile(places[..., 1], 5, axis=(0, 2))[:, None]  # (joints, 1)
        low = (places[..., 1] < floors + PLANTED_HEIGHT).all(axis=1)
        for limit in PLANTED_SPEEDS:
            planted = low & (speeds < limit)
            if planted.sum() >= ENOUGH_PLANTED:
                break
        return planted
