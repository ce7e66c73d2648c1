"""Retargeting: any humanoid motion onto our 21-joint skeleton, by global rotations.

Each of our joints turns as one joint of the source does: global rotation = source's global rotation x a constant, so joints
we do not have fold in by themselves. The constant says where our T-pose axes lie in the source joint's local frame
(x the left, y up, z forward, when the body stands in a T-pose). Two kinds of skeleton are told apart:

- those whose zero pose stands upright (ACCAD, CMU, SNU, 100STYLE, Mixamo ...): our axes are the zero pose's own,
  leaned only so that limb bones coincide;
- those whose local axes follow the bones and that have no rest pose to speak of (Bandai-Namco, LaFAN1 ...): our axes
  are found from the bones, from left and right, and from the way knees and elbows bend in the motion itself.

Everything is scaled by leg length, so a file's length unit never matters."""

from pathlib import Path

import numpy as np

from sim import bvh, name_maps
from sim import rotations as rot
from sim.clip import Clip
from sim.kinematics import to_local
from sim.skeleton import BONE_OFFSETS, INDEX, JOINT_COUNT, JOINTS, PARENTS

LEFT, UP, FORWARD = np.eye(3)
SNAP = np.cos(np.radians(35.0))  # a direction this near to a local axis was meant to be that axis
SAMPLES = 400  # frames from which a skeleton's constants are measured
LEAST_BEND, LEAST_ROLL = 0.1, np.radians(10.0)  # a limb straighter on average shows no hinge; a smaller roll is posture
HEAD_LEANS, HEAD_TILT = np.radians((30.0, 30.0))  # no clip of the other archives leans over 16 degrees on average
PLANTED_SPEED = 0.25  # leg lengths a second: a foot and toe slower than this may carry the body
PLANTED_HEIGHT = 0.06  # leg lengths above the lowest they come
ENOUGH_PLANTED = 8  # frames
MOST_PITCH, MOST_ROLL = np.radians((45.0, 20.0))  # what a planted foot may be off; more is a body that lies or crawls
SIDES = ("Left", "Right")
# The child that ends each of our limb bones, and the way a limb bends: the hinge about which the lower bone turns from
# straight to bent, in our T-pose.
LIMBS = [(f"{side}{upper}", f"{side}{lower}", f"{side}{end}", hinge * (sign if upper == "Arm" else 1))
         for side, sign in zip(SIDES, (1, -1)) for upper, lower, end, hinge in
         (("UpLeg", "Leg", "Foot", LEFT), ("Arm", "ForeArm", "Hand", -UP))]


def load_clip(path, name_map: dict[str, str] | None = None) -> Clip:
    """A BVH file as a clip on our skeleton at 60 fps, standing on a floor at 0; its place and heading are kept.

    name_map: our joint -> theirs (name_maps.load), found from the names when None. Raises OSError, or ValueError in one
    sentence, for a file that cannot be read or mapped."""
    motion = bvh.read(path)
    try:
        clip = retarget(motion, name_map)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return Clip(clip.hips, clip.rotations, clip.fps, Path(path).stem).grounded().resampled()


def retarget(motion: bvh.Motion, name_map: dict[str, str] | None = None) -> Clip:
    """The motion on our skeleton, Y up, at its own frame rate. Raises ValueError if the skeleton cannot be mapped."""
    body = Body(motion, name_maps.detect(motion.names) if name_map is None else name_map)
    rotations = np.empty((len(motion), JOINT_COUNT, 4))
    constants = body.constants()
    for joint, name in enumerate(JOINTS):
        source = body.index.get(name)
        rotations[:, joint] = (rotations[:, PARENTS[joint]] if source is None  # what they lack keeps its parent's direction
                               else rot.multiply(body.rotations[:, source], constants[name]))

    # The legs carry the body: what is scaled is the point between the hip joints, by leg length, so that strides fit.
    ours = sum(np.linalg.norm(BONE_OFFSETS[INDEX[name]]) for name in ("LeftLeg", "LeftFoot"))
    between_hips = (BONE_OFFSETS[INDEX["LeftUpLeg"]] + BONE_OFFSETS[INDEX["RightUpLeg"]]) / 2
    hips = body.between_hips() * (ours / body.leg_length()) - rot.rotate(rotations[:, 0], between_hips)
    return Clip(hips, rot.continuous(to_local(rotations)), motion.fps)


class Body:
    """A source motion read as a human body: its global transforms, and where each of our joints is in it."""

    def __init__(self, motion: bvh.Motion, name_map: dict[str, str]):
        absent = [theirs for theirs in name_map.values() if theirs not in motion.names]
        if absent:
            raise ValueError(f"the joint map names {', '.join(absent)}, which the file does not have")
        self.motion = motion
        self.index = {ours: motion.names.index(theirs) for ours, theirs in name_map.items()}
        self.positions, self.rotations = motion.global_transforms()
        if self._stands_along_z():
            turn = rot.from_axis_angle(LEFT, -np.pi / 2)
            self.positions, self.rotations = rot.rotate(turn, self.positions), rot.multiply(turn, self.rotations)
        self.sample = np.unique(np.linspace(0, len(motion) - 1, SAMPLES).astype(int))

    def _stands_along_z(self) -> bool:
        """True if the file's up is +Z: head over feet along it nearly always, and along Y nearly never (lying would do that too)."""
        feet = (self.at("LeftFoot") + self.at("RightFoot")) / 2
        up = rot.normalize(self.at("Head") - feet)
        return np.mean(up[:, 2] > 0.8) > 0.8 and np.mean(up[:, 1] > 0.8) < 0.1

    def at(self, name: str) -> np.ndarray:
        """World positions (F, 3) of the joint that is ours by name."""
        return self.positions[:, self.index[name]]

    def between_hips(self) -> np.ndarray:
        """(F, 3) the point between the two hip joints."""
        return (self.at("LeftUpLeg") + self.at("RightUpLeg")) / 2

    def leg_length(self) -> float:
        """Thigh and shin, mean of both sides, in the file's unit."""
        length = sum(np.linalg.norm(self.at(side + a) - self.at(side + b), axis=-1).mean() / 2
                     for side in SIDES for a, b in (("UpLeg", "Leg"), ("Leg", "Foot")))
        if not length > 0:
            raise ValueError("the legs have no length: the OFFSETs of knees and ankles are all zero")
        return float(length)

    def in_frame(self, name: str, world: np.ndarray) -> np.ndarray:
        """The mean (3,) over the sampled frames of world directions (F, 3) as joint `name` sees them."""
        frames = self.sample
        return rot.rotate(rot.inverse(self.rotations[frames, self.index[name]]), world[frames]).mean(axis=0)

    def bone(self, name: str, child: str) -> np.ndarray:
        """The offset (3,) of one of our joints from another, in that other's frame."""
        return self.in_frame(name, self.at(child) - self.at(name))

    def constants(self) -> dict[str, np.ndarray]:
        """Our T-pose axes in each mapped joint's local frame, as quaternions (4,)."""
        rest = self._rest_axes()
        constants = self._from_bones() if rest is None else self._from_rest(rest)
        for limb in LIMBS:
            self._roll_to_hinge(constants, *limb)
        for end in ("Foot", "Toe"):
            if "Left" + end in self.index and "Right" + end in self.index:
                self._flatten_soles(constants, end)
        return constants

    def _roll_to_hinge(self, constants: dict, upper: str, lower: str, end: str, hinge: np.ndarray) -> None:
        """Rolls a limb so that it bends about our hinge: CMU's elbows, for one, bend 30 degrees off the horizontal at rest.

        The upper bone is defined by its hinge. The lower one follows only if it sees the hinge at the same angle (a pure
        hinge); else what differs is pronation, which is motion."""
        bend = self._bend(upper, lower, end)
        seen = {}
        for start, stop in ((upper, lower), (lower, end)):
            axis = rot.rotate(rot.inverse(constants[start]), self.in_frame(start, bend))
            bone = rot.normalize(BONE_OFFSETS[INDEX[stop]])
            seen[start] = np.arctan2(rot.cross(hinge, axis) @ bone, hinge @ axis)
        if np.linalg.norm(axis) < LEAST_BEND or abs(seen[upper]) < LEAST_ROLL:
            return
        follows = abs(rot.wrap_angle(seen[upper] - seen[lower])) < LEAST_ROLL
        hand = (end,) if end.endswith("Hand") else ()
        for name in (upper, lower, *hand) if follows else (upper,):
            constants[name] = rot.multiply(constants[name], rot.from_axis_angle(bone, seen[upper]))

    def _bend(self, upper: str, lower: str, end: str) -> np.ndarray:
        """(F, 3) the world axis about which a limb is bent, as long as the sine of the bend."""
        first, second = self.at(lower) - self.at(upper), self.at(end) - self.at(lower)
        return rot.cross(rot.normalize(first), rot.normalize(second))

    def _flatten_soles(self, constants: dict, end: str) -> None:
        """Pitches and rolls the feet or the toes so that they are flat, as ours are, while they are planted flat."""
        ups = [rot.rotate(rot.inverse(rot.multiply(self.rotations[planted, self.index[side + end]], constants[side + end])), UP)
               for side, planted in zip(SIDES, self._planted())]
        both = np.concatenate(ups)
        pitch = np.arctan2(both[:, 2], both[:, 1])
        if len(both) < ENOUGH_PLANTED:
            return
        for side, up in zip(SIDES, ups):
            roll = np.arctan2(-up[:, 0], up[:, 1])
            sole = rot.from_axis_angle(LEFT, np.clip(np.median(pitch), -MOST_PITCH, MOST_PITCH))
            if len(up) > ENOUGH_PLANTED / 2:
                sole = rot.multiply(sole, rot.from_axis_angle(FORWARD, np.clip(np.median(roll), -MOST_ROLL, MOST_ROLL)))
            constants[side + end] = rot.multiply(constants[side + end], sole)

    def _planted(self) -> list[np.ndarray]:
        """For the left and the right foot, the frames (F,) in which it carries the body: slow and as low as feet go in this clip."""
        if len(self.motion) < 3:
            return [np.zeros(len(self.motion), bool)] * 2
        length, joints = self.leg_length(), [name for name in ("Foot", "Toe") if "Left" + name in self.index]
        floor = {name: np.percentile([self.at(side + name)[:, 1] for side in SIDES], 5) for name in joints}
        result = []
        for side in SIDES:
            planted = np.ones(len(self.motion), bool)
            for name in joints:
                place = self.at(side + name)
                speed = np.linalg.norm(np.gradient(place, axis=0), axis=-1) * self.motion.fps
                planted &= (speed < PLANTED_SPEED * length) & (place[:, 1] < floor[name] + PLANTED_HEIGHT * length)
            result.append(planted)
        return result

    # ---- skeletons with an upright zero pose ----

    def _rest_axes(self) -> np.ndarray | None:
        """Our axes (4,) in the zero pose, None if the zero pose does not stand upright with its arms out or down."""
        place = self.motion.positions.mean(axis=0)  # not the OFFSETs: position channels replace them
        for joint, parent in enumerate(self.motion.parents):
            if parent >= 0:
                place[joint] += place[parent]
        self.rest = {name: place[joint] for name, joint in self.index.items()}
        left = _nearest_axis(self.rest["LeftUpLeg"] - self.rest["RightUpLeg"])
        up = _nearest_axis(self.rest["Head"] - self.rest["Hips"])
        if abs(left @ up) > 1e-6:
            return None
        axes = align(LEFT, UP, left, up)
        for side, sign in zip(SIDES, (1, -1)):
            leg, arm = self.rest[side + "Foot"] - self.rest[side + "UpLeg"], self.rest[side + "Hand"] - self.rest[side + "Arm"]
            if rot.normalize(leg) @ -up < 0.75 or rot.normalize(arm) @ (sign * left - up) < 0.6:
                return None
        return axes

    def _from_rest(self, axes: np.ndarray) -> dict[str, np.ndarray]:
        constants = {name: axes for name in self.index}  # the torso stands as ours does
        for upper, lower, end, _ in LIMBS:
            for start, stop in ((upper, lower), (lower, end)):
                lean = rot.between(rot.rotate(axes, BONE_OFFSETS[INDEX[stop]]), self.rest[stop] - self.rest[start])
                constants[start] = rot.multiply(lean, axes)
            constants[end] = constants[lower]  # a hand goes on straight where the forearm ends
        for side in SIDES:
            constants |= self._sole(side, rot.rotate(axes, UP), rot.rotate(axes, FORWARD))
        return constants

    def _sole(self, side: str, up: np.ndarray, forward: np.ndarray) -> dict[str, np.ndarray]:
        """Foot and toe: flat in the zero pose, square to a shin that leans outwards, pointing where the toes do."""
        shin = self.rest[side + "Leg"] - self.rest[side + "Foot"]
        sole_up = shin - forward * (shin @ forward)
        toes = self.rest[side + "Toe"] - self.rest[side + "Foot"] if side + "Toe" in self.index else forward
        foot = align(UP, FORWARD, sole_up, toes)
        return {name: foot for name in (side + "Foot", side + "Toe") if name in self.index}

    # ---- skeletons whose local axes follow the bones ----

    def _from_bones(self) -> dict[str, np.ndarray]:
        constants = {}

        # Torso: up along the spine, left from hip joint to hip joint and from shoulder to shoulder.
        shoulder = "Shoulder" if "LeftShoulder" in self.index else "Arm"
        hips_left, chest_left = self.at("LeftUpLeg") - self.at("RightUpLeg"), self.at("Left" + shoulder) - self.at("Right" + shoulder)
        torso = [name for name in ("Hips", "Spine", "Chest", "Neck", "Head") if name in self.index]
        for name, above in zip(torso, torso[1:] + [None]):
            left = self.in_frame(name, hips_left if name in ("Hips", "Spine") else chest_left)
            if name == "Hips":  # the whole trunk, since what joins hips and spine leans as the rig's maker liked
                up = _nearest_axis(self.in_frame(name, self.at("Neck" if "Neck" in torso else "Head") - self.between_hips()))
            elif above:
                up = _nearest_axis(self.bone(name, above))
            constants[name] = align(UP, LEFT, up, _nearest_axis(left))
        if "Neck" in torso:
            self._raise_head(constants)

        hips_left = rot.rotate(rot.multiply(self.rotations[:, self.index["Hips"]], constants["Hips"]), LEFT)
        chest = rot.multiply(self.rotations[:, self.index["Chest"]], constants["Chest"])
        for side, sign in zip(SIDES, (1, -1)):
            name = side + "Shoulder"
            if name in self.index:
                up = _nearest_axis(self.in_frame(name, rot.rotate(chest, UP)))
                constants[name] = align(sign * LEFT, UP, self.bone(name, side + "Arm"), up)

        # Limbs: along the bone, turned so that knees and elbows bend about our hinge.
        for upper, lower, end, hinge in LIMBS:
            along = rot.normalize(self.at(lower) - self.at(upper))
            straight = hips_left if upper.endswith("UpLeg") else rot.cross(along, rot.rotate(chest, FORWARD))
            bend = self._bend(upper, lower, end) + 0.05 * straight  # a limb that never bends still has a likely hinge
            for start, stop in ((upper, lower), (lower, end)):
                axis = _nearest_axis(self.in_frame(start, bend), across=self.bone(start, stop))
                constants[start] = align(BONE_OFFSETS[INDEX[stop]], hinge, self.bone(start, stop), axis)
            constants[end] = constants[lower]

        # Feet: the knee's hinge goes across them; how far they are pitched is seen when they stand flat.
        for side in SIDES:
            shin_left = rot.rotate(rot.multiply(self.rotations[:, self.index[side + "Leg"]], constants[side + "Leg"]), LEFT)
            forward = self.bone(side + "Foot", side + "Toe") if side + "Toe" in self.index else None
            for name, ours in ((side + "Foot", BONE_OFFSETS[INDEX[side + "Toe"]]), (side + "Toe", FORWARD)):
                if name in self.index:
                    left = _nearest_axis(self.in_frame(name, shin_left))
                    ahead = forward if forward is not None else -self.in_frame(name, shin_left)
                    constants[name] = align(LEFT, ours, left, ahead)
        return constants

    def _raise_head(self, constants: dict) -> None:
        """Tilts a head back whose axis leans farther from the neck than a posture explains (CMU 69's, from skull markers)."""
        turns = {name: rot.multiply(self.rotations[self.sample, self.index[name]], constants[name]) for name in ("Neck", "Head")}
        up = rot.rotate(rot.inverse(turns["Neck"]), rot.rotate(turns["Head"], UP)).mean(axis=0)
        if np.arctan2(up[2], up[1]) > HEAD_LEANS:
            constants["Head"] = rot.multiply(constants["Head"], rot.from_axis_angle(LEFT, -HEAD_TILT))


def align(our_first: np.ndarray, our_second: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The rotation (4,) that takes our_first exactly to the direction of first and our_second as near as can be to second."""
    turn = rot.between(our_first, first)
    axis = rot.normalize(first)
    now, wanted = (v - axis * (v @ axis) for v in (rot.rotate(turn, our_second), second))
    angle = np.arctan2(rot.cross(now, wanted) @ axis, now @ wanted)
    return rot.multiply(rot.from_axis_angle(axis, angle), turn)


def _nearest_axis(direction: np.ndarray, across: np.ndarray | None = None) -> np.ndarray:
    """The local axis (3,) that a direction comes within SNAP of (and that lies across a bone), else the direction itself."""
    direction = rot.normalize(direction)
    largest = np.abs(direction).argmax()
    axis = np.eye(3)[largest] * np.sign(direction[largest])
    if abs(direction[largest]) < SNAP or (across is not None and abs(rot.normalize(across) @ axis) > 0.5):
        return direction
    return axis
