"""Whether a motion is that of a person, and how it stands in its file: which way is up, whether it is mirrored.

All is told from joint positions, ours by name -> (F, 3): a body is known by how it stands and moves, not by names."""

from typing import Mapping

import numpy as np

from sim.io.bvh_parser import shorten
from sim.math import rotations as rot

Places = Mapping[str, np.ndarray]
SIDES = ("Left", "Right")
# Distances by which a body is understood, from joint to joint of ours.
BONES = [
    *(
        (f"{side}{start}", f"{side}{end}")
        for side in SIDES
        for start, end in (("UpLeg", "Leg"), ("Leg", "Foot"), ("Arm", "ForeArm"), ("ForeArm", "Hand"))
    ),
    ("LeftUpLeg", "RightUpLeg"),
    ("LeftArm", "RightArm"),
    ("LeftUpLeg", "Head"),
]
BONE_LENGTHS = (0.02, 10.0)  # leg lengths, shortest and longest

MOSTLY, HARDLY = 0.8, 0.1  # shares of a clip's frames
ALONG = 0.8  # the cosine with an axis of a body that stands along it
TRAVEL = 1.0  # leg lengths over the floor: who goes so far upright does not lie
BENT_BACK = 0.05  # mean sine by which knees bend the wrong way in a mirrored file
SQUARE, PARALLEL, LEVEL = 0.5, 0.7, 0.35  # legs to the trunk, arms to legs (cosines); hands to feet (leg lengths)
AXES = {
    "Y": (0.0, 1.0, 0.0),
    "Z": (0.0, 0.0, 1.0),
    "-Y": (0.0, -1.0, 0.0),
    "-Z": (0.0, 0.0, -1.0),
    "X": (1.0, 0.0, 0.0),
    "-X": (-1.0, 0.0, 0.0),
}


def check_bones(places: Places, leg_length: float, theirs: Mapping[str, str]) -> None:
    """Raises ValueError, naming the file's joints, for bones that are no bones of a body."""
    for start, end in BONES:
        length = float(np.median(np.linalg.norm(places[end] - places[start], axis=-1))) / leg_length
        if not BONE_LENGTHS[0] <= length <= BONE_LENGTHS[1]:
            names = f"'{shorten(theirs[start])}' and '{shorten(theirs[end])}'"
            wrong = "lie in one place" if length < 1 else f"lie {length:.0f} leg lengths apart"
            raise ValueError(f"this is no body of a person: its joints {names} {wrong}; look at their OFFSETs")


def walks_on_four(places: Places, leg_length: float) -> bool:
    """Whether four limbs carry the body: a trunk across them, and hands as far down as the feet, nearly always."""
    hips = (places["LeftUpLeg"] + places["RightUpLeg"]) / 2
    trunk = rot.normalize((places["LeftArm"] + places["RightArm"]) / 2 - hips)
    legs = [rot.normalize(places[f"{side}Foot"] - places[f"{side}UpLeg"]) for side in SIDES]
    arms = [rot.normalize(places[f"{side}Hand"] - places[f"{side}Arm"]) for side in SIDES]
    down = rot.normalize(legs[0] + legs[1])
    across = np.abs(np.vecdot(trunk, down)) < SQUARE
    alike = np.vecdot(rot.normalize(arms[0] + arms[1]), down) > PARALLEL
    reach = sum(places[f"{side}Hand"] - places[f"{side}Foot"] for side in SIDES) / 2
    level = np.abs(np.vecdot(reach, down)) < LEVEL * leg_length
    return bool((across & alike & level).mean() > MOSTLY)


def find_up(places: Places, leg_length: float) -> tuple[str, str]:
    """The key of AXES along which the body stands, and a note where that is neither Y nor Z. Those two are believed
    from its bearing; along another one the hands have to hang under the head, and across X and -Z it has to walk, for
    else it may as well lie.

    A body that lies with its head to +Z throughout would be taken for standing: the two look the same."""
    feet = (places["LeftFoot"] + places["RightFoot"]) / 2
    upward = rot.normalize(places["Head"] - feet)
    along = {name: float((upward @ np.array(axis) > ALONG).mean()) for name, axis in AXES.items()}
    up = max(along, key=lambda name: along[name])
    if along["Y"] >= HARDLY or along[up] <= MOSTLY:
        return "Y", ""
    if up == "Z":
        return up, ""
    axis = np.array(AXES[up])
    hands = (places["LeftHand"] + places["RightHand"]) / 2
    hang = ((hands - places["Head"]) @ axis < 0).mean() > MOSTLY
    hips = places["LeftUpLeg"] * (1 - np.abs(axis))
    walks = np.ptp(hips, axis=0).max() > TRAVEL * leg_length
    if hang and (walks or up == "-Y"):
        return up, f"it stands along {up}, and was turned upright"
    bearing = "hangs head down" if up == "-Y" else f"lies along {up}"
    return "Y", f"it {bearing} throughout, and was left so; if {up} is up in the file, export it with Y up"


def is_mirrored(places: Places) -> bool:
    """Whether left and right are exchanged: knees bend forwards, and toes, where there are some, lie behind heels.

    places: turned Y up."""
    across = rot.normalize(places["LeftUpLeg"] - places["RightUpLeg"])
    bends, toes = [], []
    for side in SIDES:
        thigh = rot.normalize(places[f"{side}Leg"] - places[f"{side}UpLeg"])
        shin = rot.normalize(places[f"{side}Foot"] - places[f"{side}Leg"])
        bends.append(np.vecdot(rot.cross(thigh, shin), across))
        if f"{side}Toe" in places:
            forward = rot.cross(across, -shin)
            toes.append(np.vecdot(rot.normalize(places[f"{side}Toe"] - places[f"{side}Foot"]), forward))
    return bool(np.mean(bends) < -BENT_BACK and all(np.mean(toe) < 0 for toe in toes))
