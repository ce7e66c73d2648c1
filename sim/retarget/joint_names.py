"""Which joint of somebody else's skeleton is which of our 21: a table of families, detection, and map files."""

import re
from pathlib import Path

from sim.body.skeleton import INDEX, JOINTS
from sim.io.text_files import read_json

# Joints another skeleton may lack; they then keep their parent's orientation.
OPTIONAL = {"Spine", "Neck", "LeftShoulder", "RightShoulder", "LeftToe", "RightToe"}

# One family a column of names: our joint (limbs without their side) -> their names as `_plain` leaves them (lower case,
# no separators), the first that is there is taken. Chest comes before Spine because it takes the highest joint of the
# back, and Spine the lowest that is left.
_OURS = ("Hips", "Chest", "Spine", "Neck", "Head", "UpLeg", "Leg", "Foot", "Toe", "Shoulder", "Arm", "ForeArm", "Hand")
_FAMILIES = {
    "CMU, ACCAD, SNU, Mixamo, LaFAN1, HumanIK, Rokoko": (
        "hips",
        "spine4 spine3 spine2 spine1 chest",
        "spine spine1",
        "neck1 neck",
        "head",
        "upleg thigh",
        "leg shin",
        "foot",
        "toebase toe toes",
        "shoulder shoulder1",
        "arm",
        "forearm",
        "hand",
    ),
    "100STYLE, Xsens": (
        "hips",
        "chest4 chest3 chest2 chest",
        "chest2 chest spine",
        "neck",
        "head",
        "hip",
        "knee",
        "ankle",
        "toe toes",
        "collar",
        "shoulder",
        "elbow",
        "wrist",
    ),
    "Bandai-Namco, Unity": (
        "hips",
        "upperchest chest",
        "spine chest",
        "neck",
        "head",
        "upperleg",
        "lowerleg",
        "foot",
        "toes toe",
        "shoulder",
        "upperarm",
        "lowerarm",
        "hand",
    ),
    "SMPL": (
        "pelvis hips",
        "spine3",
        "spine1",
        "neck",
        "head",
        "hip",
        "knee",
        "ankle",
        "foot toe",
        "collar",
        "shoulder",
        "elbow",
        "wrist hand",
    ),
    "3ds Max Biped, Unreal": (
        "pelvis",
        "spine05 spine03 spine3 spine2 spine1",
        "spine spine01 spine1",
        "neck neck01",
        "head",
        "thigh",
        "calf",
        "foot",
        "toe0 toe ball",
        "clavicle",
        "upperarm",
        "forearm lowerarm",
        "hand",
    ),
}
_SIDE_WORDS = (("left", "right"), ("l", "r"))  # before the name or after it
_PREFIX = re.compile(r"^(.*[:|])?(mixamorig\d*|bip\d+|character\d*|[mf]avg)?")


def detect(names: list[str]) -> dict[str, str]:
    """Our joint -> theirs, for the family that fits the names best; optional joints they lack are left out.

    Raises ValueError listing what is missing when none fits."""
    plain: dict[str, str] = {}
    for name in names:
        plain.setdefault(_plain(name), name)
    best = max((_match(plain, family, sides) for family in _FAMILIES.values() for sides in _SIDE_WORDS), key=len)
    missing = [joint for joint in JOINTS if joint not in best and joint not in OPTIONAL]
    if missing:
        raise ValueError(
            f"this skeleton is not known: no joint found for {', '.join(missing)} among {', '.join(names)}; "
            'say which is which in a JSON file {"Hips": "their name", ...} given with --map FILE'
        )
    return best


def load(path: str | Path) -> dict[str, str]:
    """A map file: JSON {our joint: theirs}. Raises OSError, or ValueError saying which joints are wrong or missing."""
    name_map = read_json(path)
    if not isinstance(name_map, dict) or not all(isinstance(theirs, str) for theirs in name_map.values()):
        raise ValueError(f'{path} must hold one JSON object of names, {{"Hips": "their name", ...}}')
    unknown = [ours for ours in name_map if ours not in INDEX]
    if unknown:
        raise ValueError(
            f"{path} maps joints that Patchwalk does not have, {', '.join(unknown)}: use {', '.join(JOINTS)}"
        )
    missing = [joint for joint in JOINTS if joint not in name_map and joint not in OPTIONAL]
    if missing:
        raise ValueError(f"{path} leaves out {', '.join(missing)}, which cannot be done without")
    return name_map


def _plain(name: str) -> str:
    """A name without case, separators, name space and the usual prefixes."""
    return _PREFIX.sub("", re.sub(r"[\s_.\-]", "", name.lower()), count=1)


def _match(plain: dict[str, str], family: tuple[str, ...], sides: tuple[str, str]) -> dict[str, str]:
    """The part of one family that is found among the plain names; no joint is used twice."""
    found: dict[str, str] = {}
    for ours, candidates in zip(_OURS, family, strict=True):
        for our_side, word in (("", ""),) if ours in INDEX else zip(("Left", "Right"), sides, strict=True):
            spelled = (s for name in candidates.split() for s in (word + name, name + word))
            match = next((plain[s] for s in spelled if s in plain and plain[s] not in found.values()), None)
            if match is not None:
                found[our_side + ours] = match
    return found
