"""A motion on somebody else's skeleton, read as a human body: where our joints are in it, and what can be measured."""

import numpy as np

from sim.io.bvh import Motion
from sim.math import rotations as rot
from sim.math.vectors import LEFT

SIDES = ("Left", "Right")
SAMPLES = 400  # frames from which a skeleton's constants are measured
PLANTED_SPEEDS = (0.25, 0.5, 1.0)  # leg lengths a second under which a foot may be planted; the first to find enough
PLANTED_HEIGHT = 0.06  # leg lengths above the lowest a foot comes
ENOUGH_PLANTED = 8  # frames


class SourceBody:
    """World positions (F, J, 3) and rotations (F, J, 4) of the source, turned Y up; index: our joint -> theirs."""

    def __init__(self, motion: Motion, name_map: dict[str, str]) -> None:
        """name_map: our joint -> theirs. Raises ValueError where it names joints that the motion does not have."""
        absent = [theirs for theirs in name_map.values() if theirs not in motion.names]
        if absent:
            raise ValueError(f"the joint map names {', '.join(absent)}, which the file does not have")
        self.motion = motion
        self.index = {ours: motion.names.index(theirs) for ours, theirs in name_map.items()}
        self.positions, self.rotations = motion.global_transforms()
        self.turn = rot.IDENTITY  # from the file's axes to ours
        if self._stands_along_z():
            self.turn = rot.from_axis_angle(LEFT, -np.pi / 2)
            self.positions, self.rotations = (
                rot.rotate(self.turn, self.positions),
                rot.multiply(self.turn, self.rotations),
            )
        self.sample = np.unique(np.linspace(0, len(motion) - 1, SAMPLES).astype(int))
        self.rest = self._rest()

    def _stands_along_z(self) -> bool:
        """True if the file's up is +Z: the head is over the feet along Z nearly always, along Y nearly never.

        A body that lies with its head to +Z throughout would be taken for standing: the two look the same."""
        up = rot.normalize(self.at("Head") - (self.at("LeftFoot") + self.at("RightFoot")) / 2)
        return bool(np.mean(up[:, 2] > 0.8) > 0.8 and np.mean(up[:, 1] > 0.8) < 0.1)

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
