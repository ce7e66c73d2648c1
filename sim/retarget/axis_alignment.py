"""Where our T-pose axes (x left, y up, z forward) lie in each joint of another skeleton: the constants of retargeting.

Two kinds of skeleton are told apart:
- those whose zero pose stands upright (ACCAD's woman, CMU 16, SNU, 100STYLE, Mixamo ...): our axes are the zero pose's
  own, leaned only so that limb bones coincide;
- those whose local axes follow the bones, with no pose to speak of at zero (Bandai-Namco, CMU 69, LaFAN1 ...): our axes
  are found from the bones and from left and right. Their axes were meant: a direction close to one is taken to be it.
  Not so where a zero pose stands upright and the motion has nothing to do with it, as in what networks write.
For both, the motion says the rest: which way knees and elbows bend, and how the soles lie when they are planted."""

from itertools import permutations, product

import numpy as np

from sim.body.skeleton import BONE_OFFSETS, INDEX, JOINTS, PARENTS
from sim.math import rotations as rot
from sim.math.vectors import FORWARD, LEFT, UP
from sim.retarget.plausibility import SIDES
from sim.retarget.source_skeleton import ENOUGH_PLANTED, SourceBody

SNAP = np.cos(np.radians(35.0))  # a direction this near to a local axis was meant to be that axis
ALIKE = np.cos(np.radians(80.0))  # the left of a neck and of a head differ by less in use
# Forearms and hands that are turned over throughout a clip are off the bone before them by up to 55 degrees (in
# Bandai-Namco's and CMU's files); what is off by more has axes of its own, which differ by quarter turns.
ROLLED = np.cos(np.radians(65.0))
END_TURN = np.radians(60.0)
# Hips and chest are turned against the zero pose if left, or up, is off by more as they see it. Of captures left is by
# 3 degrees at most, and up by 18.
TURNED, BENT = np.cos(np.radians((45.0, 60.0)))
TORSO = ("Hips", "Spine", "Chest", "Neck", "Head")
# Upper joint, lower joint, end, and the hinge: the axis about which the limb bends, in our T-pose.
LIMBS = [(side + "UpLeg", side + "Leg", side + "Foot", LEFT) for side in SIDES] + [
    ("LeftArm", "LeftForeArm", "LeftHand", -UP),
    ("RightArm", "RightForeArm", "RightHand", UP),
]

# The 24 rotations that take axes to axes.
_SIGNED = [
    np.diag(signs) @ np.eye(3)[list(order)] for order in permutations(range(3)) for signs in product((1, -1), repeat=3)
]
QUARTER_TURNS = rot.from_matrix(np.array([matrix for matrix in _SIGNED if np.linalg.det(matrix) > 0]))

FIXED_AXIS = 0.98  # the mean axis about which a limb bends is so long, next to 1, if it is a hinge
LEAST_STRETCH = 0.1  # the range of a bend (a sine) that tells a hinge from an arm held still
# A limb is rolled to its hinge if it is bent by so much on average (a sine), and both bones see the hinge alike within
# this angle, and off ours by more than it.
LEAST_BEND, HINGE_ANGLE = 0.2, np.radians(9.0)
# How far a sole may be pitched (skeletons without, with an upright zero pose) or rolled from where the skeleton says
# it is; farther is a body on tiptoe, or lying.
MOST_PITCH = {"Foot": np.radians(40.0), "Toe": np.radians(55.0)}
MOST_REST_PITCH, MOST_ROLL = np.radians((30.0, 20.0))
# A head that leans farther from the neck than this, on average over a clip, has a tilted axis and is raised by so much.
# Only CMU 69's does, by 37 degrees and more; no clip of the other archives leans by more than 16.
HEAD_LEANS, HEAD_TILT = np.radians((30.0, 30.0))


def find_alignment(body: SourceBody) -> dict[str, np.ndarray]:
    """Our joint -> our T-pose axes in the source joint's local frame, quaternions (4,), where the source has it."""
    axes = _rest_axes(body)
    meant = axes is None or not _moves_otherwise(body, axes)
    axes = axes if meant else None
    if axes is not None and _rests_as_we_do(body):
        return {name: rot.IDENTITY for name in body.index}
    constants = _from_bones(body, meant) if axes is None else _from_rest(body, axes)
    for limb in LIMBS:
        _roll_to_hinge(body, constants, *limb)
    for end in ("Foot", "Toe"):
        if body.has("Left" + end, "Right" + end):
            _flatten_soles(body, constants, end, MOST_PITCH[end] if axes is None else MOST_REST_PITCH)
    return constants


def align(our_first: np.ndarray, our_second: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The rotation (4,) that takes our_first exactly to first's direction and our_second as near second's as can be."""
    turn = rot.between(our_first, first)
    axis = rot.normalize(first)
    now, wanted = (v - axis * (v @ axis) for v in (rot.rotate(turn, our_second), second))
    angle = np.arctan2(rot.cross(now, wanted) @ axis, now @ wanted)
    return rot.multiply(rot.from_axis_angle(axis, angle), turn)


def _nearest_axis(direction: np.ndarray, meant: bool = True) -> np.ndarray:
    """The local axis (3,) that a direction comes within SNAP of, where one is meant, else the direction itself, at unit
    length."""
    direction = rot.normalize(direction)
    if not meant:
        return direction
    largest = np.abs(direction).argmax()
    return np.eye(3)[largest] * np.sign(direction[largest]) if abs(direction[largest]) > SNAP else direction


def _across(bone: np.ndarray, direction: np.ndarray, meant: bool) -> np.ndarray:
    """The nearest to a direction (3,) of the local axes that lie across a bone; itself, if the bone lies along none."""
    along = np.abs(_nearest_axis(bone, meant))
    return _nearest_axis(direction * (1.0 - along), meant) if along.max() == 1.0 else rot.normalize(direction)


# ---- skeletons with an upright zero pose ----


def _rest_axes(body: SourceBody) -> np.ndarray | None:
    """Our axes (4,) in the zero pose; None if it does not stand upright, legs down and arms out or down."""
    rest = body.rest
    left, up = _nearest_axis(rest["LeftUpLeg"] - rest["RightUpLeg"]), _nearest_axis(rest["Head"] - rest["Hips"])
    if abs(left @ up) > 1e-6:
        return None
    for side, outward in zip(SIDES, (left, -left), strict=True):
        leg, arm = rest[side + "Foot"] - rest[side + "UpLeg"], rest[side + "Hand"] - rest[side + "Arm"]
        if rot.normalize(leg) @ -up < 0.75 or rot.normalize(arm) @ (outward - up) < 0.6:
            return None
    return align(LEFT, UP, left, up)


def _moves_otherwise(body: SourceBody, axes: np.ndarray) -> bool:
    """Whether hips or chest are turned, in the motion, against the zero pose in which our axes are `axes` (4,)."""
    neck = body.at("Neck" if body.has("Neck") else "Head")
    for name, ends, up in (("Hips", "UpLeg", neck - body.between_hips()), ("Chest", "Arm", neck - body.at("Chest"))):
        left = body.at("Left" + ends) - body.at("Right" + ends)
        for ours, direction, bound in ((LEFT, left, TURNED), (UP, up, BENT)):
            seen = body.seen_from(name, rot.normalize(direction))
            if rot.normalize(seen) @ rot.rotate(axes, ours) < bound:
                return True
    return False


def _rests_as_we_do(body: SourceBody) -> bool:
    """True for our own skeleton, in files that Patchwalk wrote: they come back unchanged."""
    if [body.motion.names[body.index[name]] for name in JOINTS if body.has(name)] != list(JOINTS):
        return False
    theirs = np.array([body.rest[name] - body.rest[JOINTS[PARENTS[INDEX[name]]]] for name in JOINTS[1:]])
    scale = np.linalg.norm(BONE_OFFSETS[1:]) / max(float(np.linalg.norm(theirs)), 1e-9)
    return bool(np.abs(theirs * scale - BONE_OFFSETS[1:]).max() < 1e-3)


def _from_rest(body: SourceBody, axes: np.ndarray) -> dict[str, np.ndarray]:
    """Torso and clavicles stand as ours do; limbs lean onto their bones."""
    constants = {name: axes for name in body.index}
    for upper, lower, end, _ in LIMBS:
        for start, stop in ((upper, lower), (lower, end)):
            ours, theirs = rot.rotate(axes, BONE_OFFSETS[INDEX[stop]]), body.rest[stop] - body.rest[start]
            constants[start] = rot.multiply(rot.between(ours, theirs), axes)
        constants[end] = constants[lower]  # a hand goes on straight where the forearm ends
    forward = rot.rotate(axes, FORWARD)
    for side in SIDES:  # soles: flat in the zero pose, but square to a shin that leans outwards, as CMU's do
        shin = body.rest[side + "Leg"] - body.rest[side + "Foot"]
        toes = body.rest[side + "Toe"] - body.rest[side + "Foot"] if body.has(side + "Toe") else forward
        constants[side + "Foot"] = align(UP, FORWARD, shin - forward * (shin @ forward), toes)
        if body.has(side + "Toe"):
            constants[side + "Toe"] = constants[side + "Foot"]
    return constants


# ---- skeletons whose local axes follow the bones ----


def _from_bones(body: SourceBody, meant: bool) -> dict[str, np.ndarray]:
    """Each joint from the direction of its bone and, across it, from left and right or the hinge of its limb.

    meant: whether a local axis near to what a joint sees was meant to be that."""
    constants = _torso_from_bones(body, meant)
    hips_left = _in_world(body, constants, "Hips", LEFT)
    chest_up, chest_forward = (_in_world(body, constants, "Chest", axis) for axis in (UP, FORWARD))
    for side, outward in zip(SIDES, (LEFT, -LEFT), strict=True):
        shoulder = side + "Shoulder"
        if body.has(shoulder):
            up = _nearest_axis(body.seen_from(shoulder, chest_up), meant)
            constants[shoulder] = align(outward, UP, body.bone(shoulder, side + "Arm"), up)
    for limb in LIMBS:
        upper, lower, *_ = limb
        along = rot.normalize(body.at(lower) - body.at(upper))
        constants |= _limb_from_bones(
            body, *limb, hips_left if upper.endswith("UpLeg") else rot.cross(along, chest_forward), meant
        )
    for side in SIDES:
        _turn_end(body, constants, side + "ForeArm", side + "Hand")
    for side in SIDES:  # feet: the knee's hinge goes across them; a toe's axes are like its foot's
        foot, toe = side + "Foot", side + "Toe"
        if body.has(toe):
            shin_left = _in_world(body, constants, side + "Leg", LEFT)
            for name, ours in ((foot, BONE_OFFSETS[INDEX[toe]]), (toe, FORWARD)):
                across = _nearest_axis(body.seen_from(name, shin_left), meant)
                constants[name] = align(LEFT, ours, across, body.bone(foot, toe))
            _turn_end(body, constants, foot, toe)
    return constants


def _in_world(body: SourceBody, constants: dict[str, np.ndarray], name: str, axis: np.ndarray) -> np.ndarray:
    """(F, 3) where one of our axes (3,) of a joint whose constant is known points throughout the motion."""
    return rot.rotate(rot.multiply(body.rotations[:, body.index[name]], constants[name]), axis)


def _limb_from_bones(
    body: SourceBody, upper: str, lower: str, end: str, hinge: np.ndarray, likely: np.ndarray, meant: bool
) -> dict[str, np.ndarray]:
    """The constants of one of LIMBS; likely (F, 3) is the world axis about which such a limb bends if it bends at
    all."""
    bend = body.bend(upper, lower, end)
    amount = np.linalg.norm(bend, axis=-1, keepdims=True)
    if np.ptp(np.percentile(amount, (5, 95))) < LEAST_STRETCH or not _is_hinge(body, upper, bend):
        bend = bend * amount + 0.1 * likely  # trust it where it bends far and, where it never does, what is likely
    bones = rot.normalize(np.array([body.bone(upper, lower), body.bone(lower, end)]))
    axis = _across(bones[0], body.seen_from(upper, bend), meant)
    of_upper = align(BONE_OFFSETS[INDEX[lower]], hinge, bones[0], axis)
    # The lower bone has the upper one's axes unless it clearly has not.
    seen = rot.normalize(body.seen_from(lower, bend))
    if bones[0] @ bones[1] < 0.9 or (axis @ seen < ROLLED and _is_hinge(body, lower, bend)):
        axis = _across(bones[1], seen, meant)
    of_lower = align(BONE_OFFSETS[INDEX[end]], hinge, bones[1], axis)
    return {upper: of_upper, lower: of_lower, end: of_lower}


def _torso_from_bones(body: SourceBody, meant: bool) -> dict[str, np.ndarray]:
    """Up along the spine, left from hip joint to hip joint and from shoulder to shoulder."""
    constants = {}
    torso = [name for name in TORSO if body.has(name)]
    girdle = "Shoulder" if body.has("LeftShoulder", "RightShoulder") else "Arm"
    hips_left = body.at("LeftUpLeg") - body.at("RightUpLeg")
    chest_left = body.at("Left" + girdle) - body.at("Right" + girdle)
    left = np.zeros(3)  # of the joint before
    for name, above in zip(torso, [*torso[1:], None], strict=True):
        if name == "Hips":  # the whole trunk, since what joins hips and spine leans as the rig's maker liked
            trunk = body.at("Neck" if body.has("Neck") else "Head") - body.between_hips()
            up = _nearest_axis(body.seen_from(name, trunk), meant)
        elif above:
            up = _nearest_axis(body.bone(name, above), meant)
        # The head, with nothing above, has the neck's axes; both may be turned aside throughout a clip.
        seen = rot.normalize(body.seen_from(name, hips_left if name in ("Hips", "Spine") else chest_left))
        alike = meant and name in ("Neck", "Head") and left @ seen > ALIKE
        left = left if alike else _across(up, seen, meant)
        constants[name] = align(UP, LEFT, up, left)

    before = "Neck" if body.has("Neck") else torso[-2]
    _turn_end(body, constants, before, "Head")
    if body.has("Neck"):
        neck, head = (
            rot.multiply(body.rotations[body.sample, body.index[name]], constants[name]) for name in ("Neck", "Head")
        )
        seen = rot.rotate(rot.inverse(neck), rot.rotate(head, UP)).mean(axis=0)
        if np.arctan2(seen[2], seen[1]) > HEAD_LEANS:
            constants["Head"] = rot.multiply(constants["Head"], rot.from_axis_angle(LEFT, -HEAD_TILT))
    return constants


def _turn_end(body: SourceBody, constants: dict[str, np.ndarray], before: str, end: str) -> None:
    """Turns the axes of a joint with no bone to follow, which were taken to be those of the joint before it, where the
    motion says that they are others: a face looks where the body goes, mostly, and a hand goes on where the forearm
    ends."""
    first, last = (
        rot.multiply(body.rotations[body.sample, body.index[name]], constants[name]) for name in (before, end)
    )
    turn = rot.mean(rot.multiply(rot.inverse(first), last))
    if np.linalg.norm(rot.to_rotation_vector(turn)) > END_TURN:
        nearest = QUARTER_TURNS[np.abs(QUARTER_TURNS @ turn).argmax()]
        meant = np.abs(nearest @ turn) > np.cos(np.arccos(SNAP) / 2)
        constants[end] = rot.multiply(constants[end], rot.inverse(nearest if meant else turn))


# ---- what the motion says ----


def _roll_to_hinge(
    body: SourceBody, constants: dict[str, np.ndarray], upper: str, lower: str, end: str, hinge: np.ndarray
) -> None:
    """Rolls a limb whose hinge lies otherwise than ours: CMU's elbows bend 30 degrees off the horizontal at rest.

    Only where it plainly is a hinge; what both bones do not see alike is a twist of the arm, which is motion."""
    bend, bone = body.bend(upper, lower, end), rot.normalize(BONE_OFFSETS[INDEX[lower]])
    if not all(_is_hinge(body, name, bend) for name in (upper, lower)):
        return
    axes = [rot.rotate(rot.inverse(constants[name]), body.seen_from(name, bend)) for name in (upper, lower)]
    rolls = [np.arctan2(rot.cross(hinge, axis) @ bone, hinge @ axis) for axis in axes]
    bent = np.linalg.norm(bend, axis=-1).mean() > LEAST_BEND
    if bent and abs(rolls[0] - rolls[1]) < HINGE_ANGLE < min(map(abs, rolls)):
        turn = rot.from_axis_angle(bone, np.mean(rolls))
        for name in (upper, lower, end) if end.endswith("Hand") else (upper, lower):
            constants[name] = rot.multiply(constants[name], turn)


def _is_hinge(body: SourceBody, name: str, bend: np.ndarray) -> bool:
    """True if a limb bends about one axis of its joint `name`: bend (F, 3) is SourceBody.bend."""
    return np.linalg.norm(body.seen_from(name, bend)) > FIXED_AXIS * np.linalg.norm(bend[body.sample], axis=-1).mean()


def _flatten_soles(body: SourceBody, constants: dict[str, np.ndarray], end: str, most_pitch: float) -> None:
    """Pitches and rolls the feet or the toes so that they are flat, as ours are, while they are planted flat."""
    ups = []
    for side, planted in zip(SIDES, body.planted(), strict=True):
        sole = rot.multiply(body.rotations[planted, body.index[side + end]], constants[side + end])
        ups.append(rot.rotate(rot.inverse(sole), UP))  # the world's up as the sole sees it
    both = np.concatenate(ups)
    if len(both) < ENOUGH_PLANTED:
        return
    for side, up in zip(SIDES, ups, strict=True):
        seen = up if len(up) >= ENOUGH_PLANTED else both * [0.0, 1.0, 1.0]  # the other foot's pitch, but not its roll
        # Not the middle but the flatter half's: a heel leaves the floor while the toes still stand.
        pitch = np.percentile(np.arctan2(seen[:, 2], seen[:, 1]), 75)
        if abs(pitch) > most_pitch:
            continue
        roll = np.clip(np.median(np.arctan2(-seen[:, 0], seen[:, 1])), -MOST_ROLL, MOST_ROLL)
        roll = rot.from_axis_angle(FORWARD, roll)
        turned = rot.multiply(constants[side + end], rot.multiply(rot.from_axis_angle(LEFT, pitch), roll))
        if end == "Foot" and body.has(side + "Toe"):  # it points where the toes are, still
            turned = align(UP, FORWARD, rot.rotate(turned, UP), body.bone(side + "Foot", side + "Toe"))
        constants[side + end] = turned
