"""Which joint of somebody else's skeleton is which of our 21, by their names: families, detection, and map files."""

import re
from collections import Counter
from pathlib import Path
from typing import Sequence

from sim.body.skeleton import INDEX, JOINTS
from sim.io.bvh_parser import shorten
from sim.io.checks import count_names
from sim.io.text_files import read_json

# Joints another skeleton may lack; they then keep their parent's orientation.
OPTIONAL = {"Spine", "Neck", "LeftShoulder", "RightShoulder", "LeftToe", "RightToe"}
REQUIRED = tuple(joint for joint in JOINTS if joint not in OPTIONAL)

# One family a column of names: our joint (limbs without their side) -> their names as `_plain_names` leaves them (lower
# case, without separators, side and what all have in common; numbers without zeros), the first that is there is taken.
# Chest comes before Spine because it takes the highest joint of the back, and Spine the lowest that is left.
_OURS = ("Hips", "Chest", "Spine", "Neck", "Head", "UpLeg", "Leg", "Foot", "Toe", "Shoulder", "Arm", "ForeArm", "Hand")
_FAMILIES = {
    "CMU, ACCAD, SNU, Mixamo, LaFAN1, HumanIK, Rokoko, DeepMotion, O3DE": (
        "hips pelvis",
        "chest spine4 spine3 spine2 spine1 spine",
        "spine spine1",
        "neck1 neck",
        "head",
        "upleg thigh leg",
        "leg shin knee lowerleg lowleg loleg",
        "foot ankle",
        "toebase toe toes ball",
        "shoulder shoulder1 clavicle",
        "arm upperarm uparm",
        "forearm elbow lowerarm lowarm loarm",
        "hand wrist",
    ),
    "100STYLE, Xsens, Kinect, Second Life, MakeHuman": (
        "hips hip pelvis mpelvis hipcenter spinebase",
        "chest4 chest3 chest2 chest spineshoulder shouldercenter spinemid spine torso",
        "chest2 chest spinemid torso spine",
        "neck",
        "head",
        "hip",
        "knee",
        "ankle foot",
        "toe toes foot toe31",
        "collar",
        "shoulder",
        "elbow",
        "wrist hand",
    ),
    "Bandai-Namco, Unity, VRM": (
        "hips",
        "upperchest chest spine",
        "spine chest",
        "neck",
        "head",
        "upperleg",
        "lowerleg",
        "foot",
        "toes toe toebase",
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
    "3ds Max Biped, Unreal, iClone, Cascadeur": (
        "pelvis hips hip",
        "spine5 spine4 spine3 spine2 spine1 chest spine",
        "spine spine1 waist stomach",
        "neck neck1 necktwist1",
        "head",
        "thigh",
        "calf",
        "foot",
        "toe0 toe ball toebase",
        "clavicle",
        "upperarm arm",
        "forearm lowerarm",
        "hand",
    ),
    "Biovision, Poser, Daz, MocapNET, iPi": (
        "pelvis hips hip",
        "chestupper chest chestlower middlespine spine",
        "abdomen abdomenlower lowerspine lowerback spine torso",
        "necklower neck",
        "head",
        "thigh thighbend upleg",
        "shin lowleg calf",
        "foot",
        "toe toes",
        "collar clavicle",
        "shldr shldrbend uparm shoulder upperarm",
        "forearm forearmbend lowarm",
        "hand",
    ),
    "Rigify": (
        "spine hips",
        "spine3 chest",
        "spine1",
        "spine4 neck",
        "spine6 head",
        "thigh",
        "shin",
        "foot",
        "toe",
        "shoulder",
        "upperarm",
        "forearm",
        "hand",
    ),
    "SOMA": (
        "hips",
        "chest spine2",
        "spine1",
        "neck1",
        "head",
        "leg",
        "shin",
        "foot",
        "toebase toe",
        "shoulder",
        "arm",
        "forearm",
        "hand",
    ),
}
_SIDES = {"left": "Left", "l": "Left", "right": "Right", "r": "Right"}
_CENTRE = {"c", "m", "center", "centre", "mid"}
_WORDS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")
# A side that is no word of its own, as in `leftupleg` or `lthigh`.
_GLUED = re.compile(
    r"^(left|right)(?=[a-z])|^([lr])(?=(hip|thigh|shin|knee|calf|foot|ankle|toe|collar|clavicle|shoulder|shldr|arm|"
    r"forearm|upperarm|uparm|elbow|hand|wrist|upleg|leg))"
)
Place = tuple[str, str]  # side, "" on the midline, and plain name


def detect(names: Sequence[str]) -> dict[str, str]:
    """Our joint -> theirs, for the family that fits the names best; optional joints they lack are left out.

    Raises ValueError listing what is missing when none fits."""
    plain = _plain_names(names)
    best = max((_match(plain, family) for family in _FAMILIES.values()), key=len)
    missing = [joint for joint in REQUIRED if joint not in best]
    if missing:
        raise ValueError(
            f"this skeleton is not known: no joint found for {', '.join(missing)} among {count_names(names, 30)}; "
            'say which is which in a JSON file {"Hips": "their name", ...} given with --map FILE'
        )
    return best


def load(path: str | Path) -> dict[str, str]:
    """A map file: JSON {our joint: theirs}. Raises OSError, or ValueError saying which joints are wrong or missing."""
    return check(read_json(path), path)


def check(name_map: object, path: str | Path) -> dict[str, str]:
    """What a map file held, as it is. Raises ValueError, naming the file, saying which joints are wrong or missing."""
    if not isinstance(name_map, dict) or not all(isinstance(theirs, str) for theirs in name_map.values()):
        raise ValueError(f'{path} must hold one JSON object of names, {{"Hips": "their name", ...}}')
    unknown = [ours for ours in name_map if ours not in INDEX]
    if unknown:
        raise ValueError(
            f"{path} maps joints that Patchwalk does not have, {count_names(unknown)}: use {', '.join(JOINTS)}"
        )
    missing = [joint for joint in REQUIRED if joint not in name_map]
    if missing:
        raise ValueError(f"{path} leaves out {', '.join(missing)}, which cannot be done without")
    twice = [theirs for theirs, count in Counter(name_map.values()).items() if count > 1]
    if twice:
        raise ValueError(f"{path} gives '{shorten(twice[0])}' to two of our joints: each has its own")
    return name_map


def _plain_names(names: Sequence[str]) -> dict[Place, str]:
    """(side, plain name) -> name: in lower case, without what most names begin or end with, as `Model_` and `_JNT`."""
    words = [_words(name) for name in names]
    for end in (0, -1):
        while len(words) > 2:
            common, count = Counter(each[end] for each in words if each).most_common(1)[0]
            if count <= len(words) / 2 or common in _SIDES:
                break
            words = [(each[1:] if end == 0 else each[:-1]) if each and each[end] == common else each for each in words]
    plain: dict[Place, str] = {}
    for name, each in zip(names, words):
        side = ""
        if each and each[0] in _CENTRE:
            each = each[1:]
        for place in (0, -1):
            if each and not side and each[place] in _SIDES:
                side = _SIDES[each[place]]
                each = each[1:] if place == 0 else each[:-1]
        if len(each) > 1 and each[-1].isdigit() and not side and each[-2] in _SIDES:  # DEF-thigh.L.001
            side, each = _SIDES[each[-2]], [*each[:-2], each[-1]]
        text = "".join(each)
        if not side and (glued := _GLUED.match(text)):
            side, text = _SIDES[glued.group(0)], text[glued.end() :]
        if text:
            plain.setdefault((side, text), name)
    return plain


def _words(name: str) -> list[str]:
    """A name's words and numbers in lower case, without its name space."""
    found = _WORDS.findall(re.sub(r"^.*[:|]", "", name))
    return [str(int(word)) if word.isdecimal() and len(word) < 9 else word.lower() for word in found]


def _match(plain: dict[Place, str], family: tuple[str, ...]) -> dict[str, str]:
    """The part of one family that is found among the plain names; no joint is used twice. Where no head is named, as it
    is an end site, the neck is taken for it."""
    found: dict[str, str] = {}
    for ours, candidates in zip(_OURS, family, strict=True):
        for side in ("",) if ours in INDEX else ("Left", "Right"):
            places = ((side, name) for name in candidates.split())
            match = next((plain[p] for p in places if p in plain and plain[p] not in found.values()), None)
            if match is not None:
                found[side + ours] = match
    if "Head" not in found and "Neck" in found:
        found["Head"] = found.pop("Neck")
    return found
