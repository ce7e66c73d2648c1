"""Skeletons of many rigs are known by the names of their joints, whatever all names begin or end with."""

import pytest

from sim.body.skeleton import JOINTS
from sim.retarget.joint_names import OPTIONAL, detect

# rig: (names on the midline, names of a limb, how both make a name, the sides' words, and which joints are meant)
RIGS = {
    "Unreal mannequin": (
        "root pelvis spine_01 spine_02 spine_03 spine_04 spine_05 neck_01 neck_02 head",
        "clavicle upperarm upperarm_twist_01 lowerarm lowerarm_twist_01 hand index_01 thigh thigh_twist_01 calf foot "
        "ball",
        "{limb}_{side}",
        "l r",
        "Hips=pelvis Spine=spine_01 Chest=spine_05 LeftArm=upperarm_l LeftForeArm=lowerarm_l LeftToe=ball_l",
    ),
    "VRoid": (
        "Root J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest J_Bip_C_Neck J_Bip_C_Head J_Sec_Hair1_01",
        "UpperLeg LowerLeg Foot ToeBase Shoulder UpperArm LowerArm Hand Index1",
        "J_Bip_{side}_{limb}",
        "L R",
        "Hips=J_Bip_C_Hips Chest=J_Bip_C_UpperChest LeftUpLeg=J_Bip_L_UpperLeg LeftToe=J_Bip_L_ToeBase",
    ),
    "Rigify": (
        "DEF-spine DEF-spine.001 DEF-spine.002 DEF-spine.003 DEF-spine.004 DEF-spine.005 DEF-spine.006 DEF-thigh.L.001 "
        "DEF-forearm.R.001",
        "shoulder upper_arm forearm hand thigh shin foot toe",
        "DEF-{limb}.{side}",
        "L R",
        "Hips=DEF-spine Chest=DEF-spine.003 Neck=DEF-spine.004 Head=DEF-spine.006 LeftUpLeg=DEF-thigh.L",
    ),
    "iClone": (
        "CC_Base_BoneRoot CC_Base_Hip CC_Base_Pelvis CC_Base_Waist CC_Base_Spine01 CC_Base_Spine02 CC_Base_NeckTwist01 "
        "CC_Base_NeckTwist02 CC_Base_Head",
        "Thigh Calf CalfTwist01 Foot ToeBase Clavicle Upperarm UpperarmTwist01 Forearm Hand",
        "CC_Base_{side}_{limb}",
        "L R",
        "Hips=CC_Base_Pelvis Chest=CC_Base_Spine02 Neck=CC_Base_NeckTwist01 LeftArm=CC_Base_L_Upperarm",
    ),
    "Daz Genesis 8": (
        "hip pelvis abdomenLower abdomenUpper chestLower chestUpper neckLower neckUpper head",
        "ThighBend ThighTwist Shin Foot Metatarsals Toe Collar ShldrBend ShldrTwist ForearmBend ForearmTwist Hand",
        "{side}{limb}",
        "l r",
        "Hips=pelvis Spine=abdomenLower Chest=chestUpper LeftUpLeg=lThighBend LeftArm=lShldrBend LeftToe=lToe",
    ),
    "Daz Genesis": (
        "hip pelvis abdomen abdomen2 chest neck head",
        "Thigh Shin Foot Toe Collar Shldr ForeArm Hand",
        "{side}{limb}",
        "l r",
        "Hips=pelvis Spine=abdomen Chest=chest LeftForeArm=lForeArm",
    ),
    "Poser, MocapNET, Second Life's BVH": (
        "hip abdomen chest neck head leftEye",
        "Buttock Thigh Shin Foot Collar Shldr ForeArm Hand",
        "{side}{limb}",
        "l r",
        "Hips=hip Spine=abdomen Chest=chest LeftUpLeg=lThigh LeftArm=lShldr",
    ),
    "Biovision": (
        "Hips Chest Neck Head",
        "Collar UpArm LowArm Hand UpLeg LowLeg Foot",
        "{side}{limb}",
        "Left Right",
        "Hips=Hips Chest=Chest LeftArm=LeftUpArm LeftForeArm=LeftLowArm LeftLeg=LeftLowLeg",
    ),
    "DeepMotion": (
        "hips_JNT spine_JNT spine1_JNT spine2_JNT neck_JNT head_JNT",
        "upleg leg foot toebase shoulder arm forearm hand",
        "{side}_{limb}_JNT",
        "l r",
        "Hips=hips_JNT Chest=spine2_JNT LeftUpLeg=l_upleg_JNT LeftLeg=l_leg_JNT",
    ),
    "Cascadeur": (
        "pelvis stomach chest neck head",
        "thigh calf foot toe clavicle arm forearm hand",
        "{limb}_{side}",
        "l r",
        "Hips=pelvis Spine=stomach Chest=chest LeftArm=arm_l",
    ),
    "iPi": (
        "Hip LowerSpine MiddleSpine Chest Neck Head",
        "Thigh Shin Foot Toe Clavicle Shoulder Forearm Hand",
        "{side}{limb}",
        "L R",
        "Hips=Hip Spine=LowerSpine Chest=Chest LeftShoulder=LClavicle LeftArm=LShoulder",
    ),
    "Kinect": (
        "SpineBase SpineMid SpineShoulder Neck Head",
        "Hip Knee Ankle Foot Shoulder Elbow Wrist Hand",
        "{limb}{side}",
        "Left Right",
        "Hips=SpineBase Chest=SpineShoulder LeftFoot=AnkleLeft LeftToe=FootLeft LeftHand=WristLeft",
    ),
    "Second Life": (
        "mPelvis mTorso mChest mNeck mHead mSkull",
        "Hip Knee Ankle Foot Toe Collar Shoulder Elbow Wrist",
        "m{limb}{side}",
        "Left Right",
        "Hips=mPelvis Spine=mTorso LeftToe=mToeLeft LeftUpLeg=mHipLeft",
    ),
    "MakeHuman": (
        "hip abdomen chest neck neck1 head __jaw jaw",
        "hip knee foot collar shoulder elbow hand buttock",
        "{side}{limb}",
        "l r",
        "Hips=hip Chest=chest LeftUpLeg=lhip LeftFoot=lfoot LeftHand=lhand",
    ),
    "SOMA": (
        "Hips Spine1 Spine2 Chest Neck1 Neck2 Head Jaw",
        "Leg Shin Foot ToeBase Shoulder Arm ForeArm Hand",
        "{side}{limb}",
        "Left Right",
        "Chest=Chest LeftUpLeg=LeftLeg LeftLeg=LeftShin Neck=Neck1",
    ),
    "O3DE": (
        "C_pelvis_JNT C_spine_01_JNT C_spine_02_JNT C_spine_03_JNT C_neck_01_JNT C_head_JNT",
        "upLeg loLeg foot ball clavicle upArm loArm hand",
        "{side}_{limb}_JNT",
        "L R",
        "Hips=C_pelvis_JNT Chest=C_spine_03_JNT LeftLeg=L_loLeg_JNT LeftForeArm=L_loArm_JNT",
    ),
    "any prefix": (
        "Model_Hips Model_Spine Model_Spine1 Model_Neck Model_Head",
        "UpLeg Leg Foot ToeBase Shoulder Arm ForeArm Hand",
        "Model_{side}{limb}",
        "Left Right",
        "Hips=Model_Hips LeftLeg=Model_LeftLeg",
    ),
    "a second of Mixamo's": (
        "mixamorig1:Hips mixamorig1:Spine mixamorig1:Spine1 mixamorig1:Neck mixamorig1:Head",
        "UpLeg Leg Foot ToeBase Shoulder Arm ForeArm Hand",
        "mixamorig1:{side}{limb}",
        "Left Right",
        "Hips=mixamorig1:Hips",
    ),
    "the least there can be": (
        "Hips Spine Neck",
        "UpLeg Leg Foot Arm ForeArm Hand",
        "{side}{limb}",
        "Left Right",
        "Chest=Spine Head=Neck",
    ),
}


@pytest.mark.parametrize("rig", RIGS)
def test_rigs_are_known_by_their_names(rig):
    middle, limbs, pattern, sides, meant = RIGS[rig]
    names = middle.split() + [pattern.format(side=side, limb=limb) for side in sides.split() for limb in limbs.split()]
    found = detect(names)
    assert set(JOINTS) - set(found) <= OPTIONAL and len(set(found.values())) == len(found)
    expected = dict(pair.split("=") for pair in meant.split())
    assert {joint: found[joint] for joint in expected} == expected
    left, right = sides.split()
    for joint, theirs in found.items():
        if joint.startswith("Left"):
            limb = next(limb for limb in limbs.split() if pattern.format(side=left, limb=limb) == theirs)
            assert found[joint.replace("Left", "Right")] == pattern.format(side=right, limb=limb)


def test_an_unknown_skeleton_is_named_in_a_sentence_of_some_length():
    with pytest.raises(ValueError, match="is not known.*and 970 more.*--map FILE") as error:
        detect([f"\x1b[31mbone{number}" + "x" * 200 for number in range(1000)])
    assert len(str(error.value)) < 2000 and "\x1b" not in str(error.value)
