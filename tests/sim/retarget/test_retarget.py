"""Retargeting: a known motion dressed up as other skeletons comes back; real clips keep their shape."""

import json
import tarfile
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sim.body.skeleton import (
    ANKLE_HEIGHT,
    BONE_OFFSETS,
    INDEX,
    JOINT_COUNT,
    JOINTS,
    MIRROR,
    PARENTS,
    REST_HIPS_HEIGHT,
    TOE_HEIGHT,
)
from sim.io import bvh
from sim.math import rotations as rot
from sim.motion.clip import Clip, facing_of
from sim.retarget import joint_names
from sim.retarget.retarget import load_clip, retarget
from sim.retarget.source_skeleton import SourceBody, mirrored
from tests.support.walker import walking_clip

LEFT, UP, FORWARD = np.eye(3)
THEIR_NAMES = tuple(f"Character1_{name}" for name in JOINTS)
MOCAP = Path(__file__).parents[3].parent / "shared" / "mocap"


def set_joint(rotations: np.ndarray, name: str, axis: np.ndarray, angle: np.ndarray) -> None:
    """Turns a joint of the left or the middle; a right one does the same a little later, mirrored."""
    rotations[:, INDEX[name]] = rot.from_axis_angle(np.broadcast_to(axis, (len(angle), 3)), angle)
    if name.startswith("Left"):
        later = rot.from_axis_angle(np.broadcast_to(axis * [1, -1, -1], (len(angle), 3)), np.roll(angle, 5))
        rotations[:, MIRROR[INDEX[name]]] = later


def exercise(frames: int = 120) -> Clip:
    """Knee bends on flat, still feet with swinging arms and a swaying trunk, 30 fps: all known."""
    t = np.arange(frames) / 30
    rotations = np.tile(rot.IDENTITY, (frames, JOINT_COUNT, 1))
    bend = 0.4 - 0.3 * np.cos(3 * t)
    for side in ("Left", "Right"):  # hip -a, knee +2a, ankle -a: the sole stays level
        for name, share in (("UpLeg", -1.0), ("Leg", 2.0), ("Foot", -1.0)):
            rotations[:, INDEX[side + name]] = rot.from_axis_angle(np.tile(LEFT, (frames, 1)), share * bend)
    set_joint(rotations, "LeftArm", FORWARD, -0.9 + 0.3 * np.sin(2 * t))
    set_joint(rotations, "LeftForeArm", -UP, 0.6 + 0.4 * np.sin(3 * t))
    set_joint(rotations, "LeftHand", LEFT, 0.2 * np.sin(t))
    set_joint(rotations, "LeftShoulder", FORWARD, 0.1 * np.sin(t))
    for name, axis, size in (("Spine", LEFT, 0.15), ("Chest", UP, 0.2), ("Neck", LEFT, 0.1), ("Head", UP, 0.3)):
        set_joint(rotations, name, axis, size * np.sin(2 * t + len(name)))
    clip = Clip(np.zeros((frames, 3)), rotations, 30, "exercise")
    hips = np.array([1.0, TOE_HEIGHT, 2.0]) - clip.positions()[:, INDEX["LeftToe"]] + [0.09, 0.0, 0.13]
    yaw = rot.from_yaw(0.7)
    rotations[:, 0] = yaw
    return replace(clip, hips=rot.rotate(yaw, hips))


def dressed(clip: Clip, frames: np.ndarray, scale: float = 100.0, names=THEIR_NAMES) -> bvh.Motion:
    """The same motion on a skeleton whose joint j has local axes turned by frames[j] (21, 4), in another unit."""
    ours = clip.global_rotations()
    theirs = rot.multiply(ours, np.broadcast_to(frames, ours.shape))
    local = rot.multiply(rot.inverse(theirs[:, PARENTS]), theirs)
    local[:, 0] = theirs[:, 0]
    offsets = scale * rot.rotate(rot.inverse(frames[PARENTS]), BONE_OFFSETS)
    motion = bvh.from_clip(clip)
    positions = np.tile(offsets, (len(clip), 1, 1))
    positions[:, 0] = scale * clip.hips
    return replace(motion, names=list(names), offsets=offsets, positions=positions, rotations=local)


def plain() -> np.ndarray:
    return np.tile(rot.IDENTITY, (JOINT_COUNT, 1))


def along_bones() -> np.ndarray:
    """Local X along left limbs and spine, -X along right limbs; feet too: as Bandai-Namco's."""
    frames = plain()
    child = {PARENTS[j]: j for j in range(JOINT_COUNT - 1, 0, -1)} | {0: INDEX["Spine"], INDEX["Chest"]: INDEX["Neck"]}
    for joint, name in enumerate(JOINTS):
        bone = BONE_OFFSETS[child[joint]] if joint in child else rot.rotate(frames[PARENTS[joint]], LEFT)
        if name.endswith("Toe"):
            bone = FORWARD
        elif name == "Neck":
            bone = UP  # the convention is that axes mean something: ours leans to the head by 6 degrees
        elif joint not in child and name.startswith("Right"):
            bone = -bone
        across = UP if any(part in name for part in ("Shoulder", "Arm", "Hand")) else LEFT
        x = rot.normalize(bone) * (-1 if name.startswith("Right") else 1)
        y = rot.normalize(np.cross(across, x))
        frames[joint] = rot.from_matrix(np.stack([x, y, np.cross(x, y)], axis=-1))
    return frames


def rolled_elbows() -> np.ndarray:
    """CMU's: in the T-pose the elbows bend 30 degrees off the horizontal."""
    frames = plain()
    for name in ("LeftArm", "LeftForeArm", "LeftHand", "RightArm", "RightForeArm", "RightHand"):
        frames[INDEX[name]] = rot.from_axis_angle(LEFT, 0.52)
    return frames


def splayed() -> np.ndarray:
    """CMU's: the zero pose has its legs 20 degrees apart."""
    frames = plain()
    for name in ("UpLeg", "Leg", "Foot", "Toe"):
        frames[INDEX["Left" + name]] = rot.from_axis_angle(FORWARD, -0.35)
        frames[INDEX["Right" + name]] = rot.from_axis_angle(FORWARD, 0.35)
    return frames


def toes_down() -> np.ndarray:
    """The zero pose stands with its toes pointing down by 17 degrees."""
    frames = plain()
    for name in ("LeftFoot", "LeftToe", "RightFoot", "RightToe"):
        frames[INDEX[name]] = rot.from_axis_angle(LEFT, -0.3)
    return frames


def a_pose() -> np.ndarray:
    """The zero pose has its arms 45 degrees down, and stands facing -Z."""
    frames = np.tile(rot.from_yaw(np.pi), (JOINT_COUNT, 1))
    for side, sign in (("Left", 1), ("Right", -1)):
        for name in ("Arm", "ForeArm", "Hand"):
            frames[INDEX[side + name]] = rot.multiply(rot.from_axis_angle(FORWARD, sign * 0.8), frames[0])
    return frames


def angle_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Degrees between rotations (..., 4)."""
    return np.degrees(2 * np.arccos(np.clip(np.abs(np.sum(a * b, axis=-1)), 0, 1)))


@pytest.mark.parametrize("scale", [100.0, 1.0, 39.37, 1000.0], ids=["cm", "m", "inches", "mm"])
@pytest.mark.parametrize("frames", [plain, along_bones, rolled_elbows, splayed, toes_down, a_pose])
def test_a_known_motion_comes_back_from_other_skeletons(frames, scale):
    clip = exercise()
    back = retarget(dressed(clip, frames(), scale))
    assert angle_between(back.global_rotations(), clip.global_rotations()).max() < 2.0
    np.testing.assert_allclose(back.positions(), clip.positions(), atol=0.01)


def test_a_z_up_file_is_turned():
    clip = exercise()
    motion = dressed(clip, along_bones())
    tilt = rot.from_axis_angle(LEFT, np.pi / 2)  # Y becomes Z
    motion.positions[:, 0] = rot.rotate(tilt, motion.positions[:, 0])
    motion.rotations[:, 0] = rot.multiply(tilt, motion.rotations[:, 0])
    np.testing.assert_allclose(retarget(motion).positions(), clip.positions(), atol=0.01)


def test_our_own_files_come_back_unchanged(tmp_path):
    clip = exercise()
    tiptoe = rot.from_axis_angle(LEFT, 0.4)  # which is not to be flattened
    clip.rotations[:, INDEX["LeftFoot"]] = rot.multiply(clip.rotations[:, INDEX["LeftFoot"]], tiptoe)
    bvh.write(tmp_path / "ours.bvh", clip)
    back = load_clip(tmp_path / "ours.bvh")
    expected = clip.grounded().resampled()
    assert back.fps == 60 and back.name == "ours"
    np.testing.assert_allclose(back.positions(), expected.positions(), atol=1e-4)


def test_joints_they_lack_keep_their_parents_direction():
    clip = exercise()
    lacking = {"Neck", "LeftShoulder", "RightShoulder", "LeftToe", "RightToe", "Spine"}
    for name in lacking:
        clip.rotations[:, INDEX[name]] = rot.IDENTITY
    name_map = {ours: theirs for ours, theirs in zip(JOINTS, THEIR_NAMES, strict=True) if ours not in lacking}
    back = retarget(dressed(clip, plain()), name_map)
    limbs = [INDEX[name] for name in JOINTS if name not in lacking]
    assert angle_between(back.global_rotations(), clip.global_rotations())[:, limbs].max() < 2.0
    np.testing.assert_allclose(back.rotations[:, INDEX["Neck"]], clip.rotations[:, INDEX["Neck"]], atol=1e-6)


def test_one_frame_is_enough():
    assert len(retarget(dressed(exercise()[:1], along_bones()))) == 1


# ---- axes that differ from those of the bone before ----


def turned_ends(turns: dict[str, np.ndarray]) -> np.ndarray:
    """`along_bones`, but for joints that are turned in it by quaternions."""
    frames = along_bones()
    for name, turn in turns.items():
        frames[INDEX[name]] = rot.multiply(frames[INDEX[name]], turn)
    return frames


QUARTER = {axis: rot.from_axis_angle(direction, np.pi / 2) for axis, direction in zip("xyz", np.eye(3))}
ROLLED = {
    "head axes permuted": {"Head": rot.multiply(QUARTER["x"], QUARTER["y"])},
    "head turned": {"Head": QUARTER["z"]},
    "hands rolled": {"LeftHand": QUARTER["x"], "RightHand": rot.inverse(QUARTER["x"])},
    "forearms and hands rolled": {
        side + name: QUARTER["x"] for side in ("Left", "Right") for name in ("ForeArm", "Hand")
    },
    "hands rolled over": {"LeftHand": rot.multiply(QUARTER["x"], QUARTER["x"])},
    "shins rolled": {side + "Leg": QUARTER["x"] for side in ("Left", "Right")},
    "toes turned": {side + "Toe": QUARTER["y"] for side in ("Left", "Right")},
}


@pytest.mark.parametrize("turns", ROLLED.values(), ids=ROLLED.keys())
def test_joints_whose_axes_differ_from_the_bone_before_come_back(turns):
    clip = exercise()
    back = retarget(dressed(clip, turned_ends(turns)))
    assert angle_between(back.global_rotations(), clip.global_rotations()).max() < 20.0
    assert angle_between(back.global_rotations(), clip.global_rotations()).mean() < 3.0


# ---- files that are not as they should be ----


def with_turned_trunk(motion: bvh.Motion, turn: np.ndarray) -> bvh.Motion:
    """The same motion with hips and chest turned (4,) within themselves, which joints without length undo below."""
    names, parents, places, channels = [], [], [], []
    offsets, positions, rotations = [], [], []
    trunk = INDEX["Hips"], INDEX["Chest"]
    for joint, parent in enumerate(motion.parents):
        if parent in trunk:
            names.append(f"{motion.names[joint]}_root")
            parents.append(places[parent])
            offsets.append(np.zeros(3))
            positions.append(np.zeros((len(motion), 3)))
            rotations.append(np.tile(rot.inverse(turn), (len(motion), 1)))
            channels.append(motion.channels[joint])
        parents.append(-1 if parent < 0 else len(names) - 1 if parent in trunk else places[parent])
        places.append(len(names))
        names.append(motion.names[joint])
        offsets.append(motion.offsets[joint])
        positions.append(motion.positions[:, joint])
        own = motion.rotations[:, joint]
        rotations.append(rot.multiply(own, turn) if joint in trunk else own)
        channels.append(motion.channels[joint])
    return replace(
        motion,
        names=names,
        parents=parents,
        offsets=np.array(offsets),
        end_sites={places[joint]: offset for joint, offset in motion.end_sites.items()},
        channels=channels,
        positions=np.stack(positions, axis=1),
        rotations=np.stack(rotations, axis=1),
        angles=None,
    )


@pytest.mark.parametrize("axis", [UP, LEFT, FORWARD, rot.normalize(LEFT + UP)])
def test_a_motion_that_has_nothing_to_do_with_its_zero_pose_comes_back(axis):
    clip = exercise()
    back = retarget(with_turned_trunk(dressed(clip, splayed()), rot.from_axis_angle(axis, 2.0)))
    assert angle_between(back.global_rotations(), clip.global_rotations()).max() < 15.0
    np.testing.assert_allclose(facing_of(back.positions()), facing_of(clip.positions()), atol=0.05)


def turned(motion: bvh.Motion, turn: np.ndarray) -> bvh.Motion:
    """The motion in other axes."""
    positions, rotations = motion.positions.copy(), motion.rotations.copy()
    positions[:, 0], rotations[:, 0] = rot.rotate(turn, positions[:, 0]), rot.multiply(turn, rotations[:, 0])
    return replace(motion, positions=positions, rotations=rotations)


@pytest.mark.parametrize(
    "up, turn", [("-Y", (LEFT, np.pi)), ("X", (FORWARD, -np.pi / 2)), ("-Z", (LEFT, -np.pi / 2))], ids=["-y", "x", "-z"]
)
def test_a_body_along_another_axis_is_turned_upright_with_a_warning(up, turn):
    walk = replace(walking_clip(240), fps=60)
    motion = turned(bvh.from_clip(walk), rot.from_axis_angle(*turn))
    with pytest.warns(UserWarning, match=f"stands along {up}"):
        back = retarget(motion)
    assert np.abs(back.positions()[..., 1] - walk.positions()[..., 1]).max() < 0.01


def test_who_stands_on_the_hands_or_lies_is_left_as_it_is_and_that_is_said():
    clip = exercise()
    motion = turned(bvh.from_clip(clip), rot.from_axis_angle(FORWARD, np.pi / 2))  # lies still, head to -X
    with pytest.warns(UserWarning, match="it lies along -X throughout, and was left so; if -X is up in the file"):
        assert np.median(retarget(motion).positions()[:, INDEX["Head"], 0]) < -0.4
    raised = clip.rotations.copy()
    for side, sign in (("Left", 1), ("Right", -1)):
        raised[:, INDEX[side + "Arm"]] = rot.from_axis_angle(FORWARD, sign * 1.5)
        raised[:, INDEX[side + "ForeArm"]] = rot.IDENTITY
    handstand = turned(bvh.from_clip(replace(clip, rotations=raised)), rot.from_axis_angle(LEFT, np.pi))
    with pytest.warns(UserWarning, match="it hangs head down throughout"):
        head, feet = retarget(handstand).positions()[:, [INDEX["Head"], INDEX["LeftFoot"]], 1].T
    assert (head < feet).all()


@pytest.mark.parametrize("frames", [plain, along_bones])
def test_a_mirrored_file_is_mirrored_back_with_a_warning(frames):
    clip = exercise()
    with pytest.warns(UserWarning, match="mirrored"):
        back = retarget(mirrored(dressed(clip, frames())))
    assert angle_between(back.rotations[:, 1:], clip.rotations[:, 1:]).max() < 2.0


ARMS_DOWN = {"LeftArm": -1.3, "RightArm": 1.3}


def spoiled(frames: int = 60) -> tuple[Clip, bvh.Motion]:
    """A walk whose arms hang, and its motion of its own to be spoiled."""
    clip = walking_clip(frames)
    for name, angle in ARMS_DOWN.items():
        clip.rotations[:, INDEX[name]] = rot.from_axis_angle(FORWARD, angle)
    return clip, bvh.from_clip(replace(clip, rotations=clip.rotations.copy()))


@pytest.mark.parametrize(
    "where, named, left",
    [
        (slice(0, 1), "frame 1 jumps", slice(1, None)),
        (slice(0, 4), "frames 1 to 4 jump", slice(4, None)),
        (slice(-1, None), "frame 60 jumps", slice(0, -1)),
        (slice(20, 22), "frames 21 to 22 jump", slice(None)),
    ],
)
def test_zeroed_frames_are_left_out_with_a_warning_that_names_them(where, named, left):
    clip, motion = spoiled()
    motion.positions[where, 0], motion.rotations[where] = 0.0, rot.IDENTITY
    with pytest.warns(UserWarning, match=named):
        back = retarget(motion)
    assert np.abs(back.positions() - clip[left].positions()).max() < 0.01


def test_spikes_of_the_root_are_left_out():
    clip, motion = spoiled()
    motion.positions[[10, 30, 31, 50], 0] += np.array([[1e5], [3e3], [-9e3], [1e6]])
    with pytest.warns(UserWarning, match="frames 11, 31 to 32, 51 jump"):
        assert np.abs(retarget(motion).positions() - clip.positions()).max() < 0.01


def test_quick_movement_is_no_outlier(recwarn):
    clip, motion = spoiled()
    punch = 0.9 * np.sin(np.linspace(0, np.pi, 14))  # there and back within a quarter of a second
    motion.rotations[20:34, INDEX["LeftArm"]] = rot.from_axis_angle(np.tile(FORWARD, (14, 1)), -1.3 + 1.6 * punch)
    assert len(retarget(motion)) == len(clip) and not recwarn.list


def test_a_leap_that_no_outlier_explains_is_refused():
    clip, motion = spoiled()
    motion.positions[30:, 0] += 1e5
    with pytest.raises(ValueError, match="leaps 1.* m within a frame at 0.48 s"):
        retarget(motion)


def test_four_feet_are_refused():
    clip, motion = spoiled()
    motion.rotations[:, 0] = rot.from_axis_angle(LEFT, np.pi / 2)  # the trunk lies, limbs stand
    for side, sign in (("Left", 1), ("Right", -1)):
        motion.rotations[:, INDEX[side + "UpLeg"]] = rot.from_axis_angle(LEFT, -np.pi / 2)
        motion.rotations[:, INDEX[side + "Arm"]] = rot.from_axis_angle(UP, -sign * np.pi / 2)
        motion.positions[:, INDEX[side + "Hand"]] *= 2.0
    with pytest.raises(ValueError, match="four feet"):
        retarget(motion)


@pytest.mark.parametrize(
    "name, sentence",
    [
        ("LeftLeg", "joints 'LeftUpLeg' and 'LeftLeg' lie in one place"),
        ("RightHand", "joints 'RightForeArm' and 'RightHand' lie in one place"),
    ],
)
def test_bones_without_length_are_refused_by_name(name, sentence):
    _, motion = spoiled()
    motion.positions[:, INDEX[name]] = 0.0
    with pytest.raises(ValueError, match=sentence):
        retarget(motion)


# ---- names ----

LIMBS = {
    "mixamo": (
        "UpLeg Leg Foot ToeBase Shoulder Arm ForeArm Hand",
        "mixamorig:{side}{limb}",
        "Left Right",
        "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2 mixamorig:Neck mixamorig:Head",
    ),
    "lafan1": (
        "UpLeg Leg Foot Toe Shoulder Arm ForeArm Hand",
        "{side}{limb}",
        "Left Right",
        "Hips Spine Spine1 Spine2 Neck Head",
    ),
    "humanik": (
        "UpLeg Leg Foot ToeBase Shoulder Arm ForeArm Hand",
        "Character1_{side}{limb}",
        "Left Right",
        "Character1_Hips Character1_Spine Character1_Spine1 Character1_Neck Character1_Head",
    ),
    "smpl": (
        "Hip Knee Ankle Foot Collar Shoulder Elbow Wrist",
        "{side}_{limb}",
        "L R",
        "Pelvis Spine1 Spine2 Spine3 Neck Head L_Hand R_Hand",
    ),
    "smpl_long": (
        "hip knee ankle foot collar shoulder elbow wrist",
        "{side}_{limb}",
        "left right",
        "pelvis spine1 spine2 spine3 neck head",
    ),
    "100style": (
        "Hip Knee Ankle Toe Collar Shoulder Elbow Wrist",
        "{side}{limb}",
        "Left Right",
        "Hips Chest Chest2 Chest3 Chest4 Neck Head",
    ),
    "bandai": (
        "UpperLeg LowerLeg Foot Toes Shoulder UpperArm LowerArm Hand",
        "{limb}_{side}",
        "L R",
        "joint_Root Hips Spine Chest Neck Head",
    ),
    "biped": (
        "Thigh Calf Foot Toe0 Clavicle UpperArm Forearm Hand",
        "Bip01 {side} {limb}",
        "L R",
        "Bip01|Bip01 Pelvis|Bip01 Spine|Bip01 Spine1|Bip01 Neck|Bip01 Head",
    ),
    "unreal": (
        "thigh calf foot ball clavicle upperarm lowerarm hand",
        "{limb}_{side}",
        "l r",
        "root pelvis spine_01 spine_02 spine_03 neck_01 head",
    ),
}
CHESTS = {
    "mixamo": "mixamorig:Spine2",
    "lafan1": "Spine2",
    "humanik": "Character1_Spine1",
    "smpl": "Spine3",
    "smpl_long": "spine3",
    "100style": "Chest4",
    "bandai": "Chest",
    "biped": "Bip01 Spine1",
    "unreal": "spine_03",
}


@pytest.mark.parametrize("family", LIMBS)
def test_families_of_names_are_known(family):
    limbs, pattern, sides, middle = LIMBS[family]
    names = middle.split("|" if "|" in middle else " ")
    names += [pattern.format(side=side, limb=limb) for side in sides.split() for limb in limbs.split()]
    found = joint_names.detect([*names, "LeftHandIndex1", "LThumb"])
    assert set(found) == set(JOINTS)
    assert len(set(found.values())) == JOINT_COUNT
    assert found["Chest"] == CHESTS[family]
    ours = ("UpLeg", "Leg", "Foot", "Toe", "Shoulder", "Arm", "ForeArm", "Hand")
    for our_side, side in zip(("Left", "Right"), sides.split(), strict=True):
        for name, limb in zip(ours, limbs.split(), strict=True):
            assert found[our_side + name] == pattern.format(side=side, limb=limb)


def test_an_unknown_skeleton_is_refused_with_what_is_missing():
    names = [
        "Hips",
        "Spine",
        "Spine1",
        "Head",
        *(side + limb for side in ("Left", "Right") for limb in ("UpLeg", "Leg", "Arm", "ForeArm", "Hand")),
    ]
    with pytest.raises(ValueError, match="no joint found for LeftFoot, RightFoot.*--map FILE"):
        joint_names.detect(names)


@pytest.mark.parametrize(
    "text, sentence",
    [
        ("{", "not a JSON file"),
        ("[1]", "one JSON object"),
        ('{"Hips": 3}', "one JSON object"),
        ('{"Tail": "t"}', "does not have, Tail"),
        ('{"Hips": "h"}', "leaves out LeftUpLeg"),
    ],
)
def test_a_bad_map_file_is_refused(tmp_path, text, sentence):
    (tmp_path / "map.json").write_text(text)
    with pytest.raises(ValueError, match=sentence):
        joint_names.load(tmp_path / "map.json")


def test_a_map_file_serves_where_the_names_are_unknown(tmp_path):
    clip, names = exercise(), [f"bone{j}" for j in range(JOINT_COUNT)]
    bvh.write(tmp_path / "odd.bvh", dressed(clip, along_bones(), names=names))
    with pytest.warns(UserWarning, match="odd.bvh: its joints were told by the skeleton's shape"):
        load_clip(tmp_path / "odd.bvh")
    (tmp_path / "map.json").write_text(json.dumps(dict(zip(JOINTS, names, strict=True))))
    mapped = load_clip(tmp_path / "odd.bvh", joint_names.load(tmp_path / "map.json"))
    np.testing.assert_allclose(mapped.positions(), clip.resampled().positions(), atol=0.01)
    with pytest.raises(ValueError, match="names nose"):
        retarget(dressed(clip, plain()), dict(zip(JOINTS, THEIR_NAMES, strict=True)) | {"Head": "nose"})


# ---- real clips ----

WALKS = {  # archive: a clip that walks forward, and how fast its planted toes may slide (median m/s)
    "accad": ("accad/Female1_B03_Walk1.bvh", 0.09),
    "cmu16": ("cmu16/16_11_1.bvh", 0.15),
    "cmu69": ("cmu69/69_05_1.bvh", 0.11),
    "snu-biped": ("snu-biped/woddy2_low_walk.bvh", 0.04),
    "snu-styles": ("snu-styles/VideoMotion_inches/wd2_cross_walk_0d_01.bvh", 0.03),
    "100style-neutral": ("100style-neutral/Neutral_FW.bvh", 0.09),
    "bandai-namco": ("bandai-namco/dataset-1_walk_normal_001.bvh", 0.12),
}


@pytest.fixture(scope="module", params=WALKS)
def walk(request, tmp_path_factory):
    """(source body, clip at the source's rate, allowed slide)"""
    archive, (member, slide) = MOCAP / f"{request.param}.tar.xz", WALKS[request.param]
    if not archive.exists():
        pytest.skip(f"{archive} is not there")
    path = tmp_path_factory.mktemp("walk") / "walk.bvh"
    with tarfile.open(archive, "r|xz") as tar:
        path.write_bytes(next(tar.extractfile(entry).read() for entry in tar if entry.name == member))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        motion = bvh.read(path)
    return SourceBody(motion, joint_names.detect(motion.names)), retarget(motion).grounded(), slide


def test_real_limbs_keep_their_directions(walk):
    body, clip, _ = walk
    positions = clip.positions()
    for side in ("Left", "Right"):
        for chain in (("UpLeg", "Leg", "Foot"), ("Arm", "ForeArm", "Hand")):
            for a, b in zip(chain, chain[1:], strict=False):
                theirs = rot.normalize(body.at(side + b) - body.at(side + a))
                ours = rot.normalize(positions[:, INDEX[side + b]] - positions[:, INDEX[side + a]])
                assert np.degrees(np.arccos(np.clip(np.sum(theirs * ours, axis=-1), -1, 1))).max() < 1.0
    assert clip.fps == body.motion.fps


def test_a_real_walk_is_upright_and_goes_where_it_faces(walk):
    _, clip, _ = walk
    positions = clip.positions()
    assert 1.4 < np.median(positions[:, INDEX["Head"], 1]) < 1.62
    facing = facing_of(positions)
    forward = np.stack([np.sin(facing), np.zeros_like(facing), np.cos(facing)], axis=-1)
    left = rot.cross(np.tile(UP, (len(clip), 1)), forward)
    velocity = np.gradient(positions[:, 0], axis=0) * clip.fps
    speed = np.linalg.norm(velocity, axis=-1)
    assert 0.2 < speed.mean() < 2.0
    assert np.median(np.sum(velocity * forward, axis=-1) / np.maximum(speed, 0.1)) > 0.8
    rotations = clip.global_rotations()
    for side, sign, elbow in (("Left", 1, -UP), ("Right", -1, UP)):
        hand = positions[:, INDEX[side + "Hand"]] - positions[:, 0]
        assert sign * np.sum(hand * left, axis=-1).mean() > 0.05  # left and right are not swapped
        knee = _hinge(positions, side, "UpLeg", "Leg", "Foot")
        assert np.average(np.sum(rot.normalize(knee) * left, axis=-1), weights=np.linalg.norm(knee, axis=-1)) > 0.9
        hinge = _hinge(positions, side, "Arm", "ForeArm", "Hand")
        bend = np.linalg.norm(hinge, axis=-1).mean() / (0.28 * 0.25)  # the sine: arm and forearm are so long
        hinge = rot.rotate(rot.inverse(rotations[:, INDEX[side + "Arm"]]), hinge).mean(axis=0)
        assert rot.normalize(hinge) @ elbow > 0.6 or bend < 0.35  # as in our T-pose, give or take SNU's twisted arms
    for name in ("Hips", "Chest", "Head"):
        up = rot.rotate(rotations[:, INDEX[name]], UP)
        assert up[:, 1].mean() > (0.89 if name == "Head" else 0.85)
        assert np.sum(rot.rotate(rotations[:, INDEX[name]], FORWARD) * forward, axis=-1).mean() > 0.8


def _hinge(positions: np.ndarray, side: str, upper: str, lower: str, end: str) -> np.ndarray:
    joints = [positions[:, INDEX[side + name]] for name in (upper, lower, end)]
    return rot.cross(joints[1] - joints[0], joints[2] - joints[1])


def test_real_feet_stand_flat_and_hardly_slide(walk):
    body, clip, slide = walk
    positions = clip.positions()
    for side, planted in zip(("Left", "Right"), body.planted(), strict=True):
        toe, ankle = positions[:, INDEX[side + "Toe"]], positions[:, INDEX[side + "Foot"]]
        speed = np.linalg.norm(np.gradient(toe, axis=0), axis=-1) * clip.fps
        assert np.median(speed[planted]) < slide
        assert abs(np.median(toe[planted, 1]) - TOE_HEIGHT) < 0.025
        assert abs(np.median(ankle[planted, 1]) - ANKLE_HEIGHT) < 0.035
        sole = rot.rotate(clip.global_rotations()[planted, INDEX[side + "Foot"]], UP)
        assert np.median(sole[:, 1]) > 0.98
    assert abs(positions[:, 0, 1].mean() - REST_HIPS_HEIGHT) < 0.12
