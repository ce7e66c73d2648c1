"""Which joint of somebody else's skeleton is which of our 21: a table of families, detection, and map files."""

import json
import re
from pathlib import Path

from sim.skeleton import INDEX, JOINTS

# Joints another skeleton may lack; they then keep their parent's orientation.
OPTIONAL = {"Spine", "Neck", "LeftShoulder", "RightShoulder", "LeftToe", "RightToe"}

# One family a row: the two side markers, then our joint -> their names, first found taken; '#' is the side marker.
# Names are compared without case, separators and prefixes such as 'mixamorig:'. Chest stands before Spine because
# it takes the highest joint of the spine and Spine the lowest that is left.
_FAMILIES = {
    "CMU, ACCAD, SNU, Mixamo, LaFAN1, HumanIK": (("left", "right"), {
        "Hips": "hips", "Chest": "spine3 spine2 spine1 chest", "Spine": "spine", "Neck": "neck1 neck", "Head": "head",
        "#UpLeg": "#upleg", "#Leg": "#leg", "#Foot": "#foot", "#Toe": "#toebase #toe #toes",
        "#Shoulder": "#shoulder #shoulder1", "#Arm": "#arm", "#ForeArm": "#forearm", "#Hand": "#hand"}),
    "100STYLE": (("left", "right"), {
        "Hips": "hips", "Chest": "chest4 chest3 chest2 chest", "Spine": "chest2 chest spine", "Neck": "neck", "Head": "head",
        "#UpLeg": "#hip", "#Leg": "#knee", "#Foot": "#ankle", "#Toe": "#toe #toes",
        "#Shoulder": "#collar", "#Arm": "#shoulder", "#ForeArm": "#elbow", "#Hand": "#wrist"}),
    "Bandai-Namco": (("l", "r"), {
        "Hips": "hips", "Chest": "chest", "Spine": "spine", "Neck": "neck", "Head": "head",
        "#UpLeg": "upperleg#", "#Leg": "lowerleg#", "#Foot": "foot#", "#Toe": "toes# toe#",
        "#Shoulder": "shoulder#", "#Arm": "upperarm#", "#ForeArm": "lowerarm#", "#Hand": "hand#"}),
    "Unity": (("left", "right"), {
        "Hips": "hips", "Chest": "upperchest chest", "Spine": "spine", "Neck": "neck", "Head": "head",
        "#UpLeg": "#upperleg", "#Leg": "#lowerleg", "#Foot": "#foot", "#Toe": "#toes #toe",
        "#Shoulder": "#shoulder", "#Arm": "#upperarm", "#ForeArm": "#lowerarm", "#Hand": "#hand"}),
    "SMPL": (("l", "r"), {
        "Hips": "pelvis hips", "Chest": "spine3", "Spine": "spine1", "Neck": "neck", "Head": "head",
        "#UpLeg": "#hip", "#Leg": "#knee", "#Foot": "#ankle", "#Toe": "#foot #toe",
        "#Shoulder": "#collar", "#Arm": "#shoulder", "#ForeArm": "#elbow", "#Hand": "#wrist #hand"}),
    "SMPL, long names": (("left", "right"), {
        "Hips": "pelvis hips", "Chest": "spine3", "Spine": "spine1", "Neck": "neck", "Head": "head",
        "#UpLeg": "#hip", "#Leg": "#knee", "#Foot": "#ankle", "#Toe": "#foot #toe",
        "#Shoulder": "#collar", "#Arm": "#shoulder", "#ForeArm": "#elbow", "#Hand": "#wrist #hand"}),
    "3ds Max Biped": (("l", "r"), {
        "Hips": "pelvis", "Chest": "spine3 spine2 spine1", "Spine": "spine", "Neck": "neck", "Head": "head",
        "#UpLeg": "#thigh", "#Leg": "#calf", "#Foot": "#foot", "#Toe": "#toe0 #toe",
        "#Shoulder": "#clavicle", "#Arm": "#upperarm", "#ForeArm": "#forearm", "#Hand": "#hand"}),
    "Unreal": (("l", "r"), {
        "Hips": "pelvis", "Chest": "spine05 spine03", "Spine": "spine01", "Neck": "neck01", "Head": "head",
        "#UpLeg": "thigh#", "#Leg": "calf#", "#Foot": "foot#", "#Toe": "ball#",
        "#Shoulder": "clavicle#", "#Arm": "upperarm#", "#ForeArm": "lowerarm#", "#Hand": "hand#"}),
}
_PREFIX = re.compile(r"^(.*[:|])?(mixamorig\d*|bip\d+|character\d*|[mf]avg)?")


def detect(names: list[str]) -> dict[str, str]:
    """Our joint -> theirs, for the family that fits the names best; optional joints they lack are left out.

    Raises ValueError listing what is missing when none fits."""
    plain = {}
    for name in names:
        plain.setdefault(_plain(name), name)
    best = max((_match(plain, *family) for family in _FAMILIES.values()), key=len)
    missing = [joint for joint in JOINTS if joint not in best and joint not in OPTIONAL]
    if missing:
        raise ValueError(f"this skeleton is not known: no joint found for {', '.join(missing)}; say which is which in a "
                         f'JSON file {{"Hips": "their name", ...}} given with --map FILE; it has {", ".join(names)}')
    return best


def load(path) -> dict[str, str]:
    """A map file: JSON {our joint: their joint}. Raises OSError, or ValueError saying which joints are wrong or missing."""
    try:
        name_map = json.loads(Path(path).read_text(encoding="utf-8-sig"))
    except ValueError as error:
        raise ValueError(f"{path} is not a JSON file: {error}") from error
    if not isinstance(name_map, dict) or not all(isinstance(theirs, str) for theirs in name_map.values()):
        raise ValueError(f"{path} must hold one JSON object of names, {{\"Hips\": \"their name\", ...}}")
    unknown = [ours for ours in name_map if ours not in INDEX]
    if unknown:
        raise ValueError(f"{path} maps joints that Patchwalk does not have, {', '.join(unknown)}: "
                         f"use {', '.join(JOINTS)}")
    missing = [joint for joint in JOINTS if joint not in name_map and joint not in OPTIONAL]
    if missing:
        raise ValueError(f"{path} leaves out {', '.join(missing)}, which cannot be done without")
    return name_map


def _plain(name: str) -> str:
    """A name without case, separators, name space and the usual prefixes."""
    return _PREFIX.sub("", re.sub(r"[\s_.\-]", "", name.lower()), count=1)


def _match(plain: dict[str, str], sides: tuple[str, str], table: dict[str, str]) -> dict[str, str]:
    """The part of one family's table that is found among the plain names; no joint is used twice."""
    found = {}
    for ours, candidates in table.items():
        for our_side, their_side in zip(("Left", "Right"), sides, strict=True) if "#" in ours else (("", ""),):
            for candidate in candidates.replace("#", their_side).split():
                if candidate in plain and plain[candidate] not in found.values():
                    found[ours.replace("#", our_side)] = plain[candidate]
                    break
    return found
