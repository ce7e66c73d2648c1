"""The body's shape as a table: tapered capsules, each fixed to a joint, that demo.figure.surface melts into a skin, and
the pose in which it does."""

from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

from sim.body.pose import Pose
from sim.body.skeleton import INDEX, JOINT_COUNT, JOINTS, REST_HIPS_HEIGHT
from sim.math import rotations as rot

PROFILE = np.linspace(0, 1, 33)  # shares of a form's length at which its radius is tabled
CAP = 0.15  # share of it over which the radius becomes level towards an end


class Form(NamedTuple):
    """A capsule in its joint's own axes in the T-pose, metres: from, to, radii at even steps between them; width and
    depth stretch it across. A form of a left joint has its mirror image on the right."""

    joint: str
    start: tuple[float, float, float]
    stop: tuple[float, float, float]
    radii: tuple[float, ...]
    width: float = 1.0
    depth: float = 1.0


# Where forms meet they swell a little as they melt, so their ends are thinner than the body is there.
_BODY = [
    # pelvis, waist, rib cage, breast, shoulder girdle
    Form("Hips", (0.0, -0.050, -0.004), (0.0, 0.060, 0.0), (0.086, 0.088, 0.079), 1.23, 0.92),
    Form("Hips", (-0.060, -0.072, -0.036), (0.060, -0.072, -0.036), (0.064, 0.056, 0.064)),
    Form("Spine", (0.0, -0.04, 0.004), (0.0, 0.10, 0.002), (0.082, 0.083, 0.087), 1.30, 0.92),
    Form("Chest", (0.0, -0.04, 0.002), (0.0, 0.13, -0.010), (0.080, 0.088, 0.098, 0.100), 1.38, 0.92),
    Form("Chest", (-0.090, 0.128, 0.044), (-0.030, 0.112, 0.054), (0.026, 0.034, 0.034)),
    Form("Chest", (0.090, 0.128, 0.044), (0.030, 0.112, 0.054), (0.026, 0.034, 0.034)),
    Form("Chest", (-0.096, 0.140, -0.044), (-0.058, -0.03, -0.032), (0.046, 0.042, 0.030)),
    Form("Chest", (0.096, 0.140, -0.044), (0.058, -0.03, -0.032), (0.046, 0.042, 0.030)),
    Form("Chest", (-0.108, 0.170, -0.016), (0.108, 0.170, -0.016), (0.042, 0.050, 0.042)),
    Form("Chest", (-0.116, 0.188, -0.022), (-0.010, 0.268, -0.022), (0.026, 0.031, 0.030)),
    Form("Chest", (0.116, 0.188, -0.022), (0.010, 0.268, -0.022), (0.026, 0.031, 0.030)),
    # neck and head: skull, face, jaw
    Form("Neck", (0.0, -0.04, -0.018), (0.0, 0.09, 0.000), (0.048, 0.043, 0.044), 1.0, 1.04),
    Form("Head", (0.0, 0.114, -0.020), (0.0, 0.106, 0.000), (0.079, 0.078), 0.95, 1.0),
    Form("Head", (0.0, 0.084, 0.018), (0.0, 0.026, 0.028), (0.066, 0.060, 0.044), 0.90, 1.0),
    Form("Head", (-0.031, 0.036, 0.000), (-0.012, 0.008, 0.030), (0.022, 0.020)),
    Form("Head", (0.031, 0.036, 0.000), (0.012, 0.008, 0.030), (0.022, 0.020)),
    Form("Head", (-0.012, 0.002, 0.038), (0.012, 0.002, 0.038), (0.020, 0.021, 0.020)),
    # shoulder, upper arm, forearm
    Form("LeftShoulder", (0.03, -0.004, -0.016), (0.112, -0.010, -0.008), (0.038, 0.042)),
    Form("LeftArm", (-0.004, -0.010, 0.0), (0.272, 0.0, 0.0), (0.047, 0.048, 0.043, 0.040, 0.037, 0.030), 1.0, 1.04),
    Form("LeftArm", (0.002, 0.008, 0.0), (0.120, 0.008, 0.0), (0.042, 0.044, 0.034, 0.016), 1.0, 1.14),
    Form("LeftArm", (0.070, 0.0, 0.010), (0.230, 0.0, 0.010), (0.014, 0.032, 0.033, 0.016)),
    Form("LeftArm", (0.050, 0.0, -0.012), (0.220, 0.0, -0.010), (0.014, 0.033, 0.032, 0.016)),
    Form("LeftForeArm", (0.006, 0.0, 0.0), (0.236, 0.0, 0.0), (0.032, 0.039, 0.038, 0.032, 0.025, 0.0205), 0.96, 1.14),
    # thigh, knee, shin, calf
    Form("LeftUpLeg", (0.006, 0.0, 0.0), (0.0, -0.410, 0.002), (0.072, 0.080, 0.075, 0.065, 0.054, 0.043), 1.0, 1.04),
    Form("LeftUpLeg", (0.006, -0.10, 0.020), (0.002, -0.33, 0.020), (0.040, 0.058, 0.048, 0.026)),
    Form("LeftLeg", (0.0, -0.004, 0.020), (0.0, -0.026, 0.020), (0.030, 0.030), 1.06, 1.0),
    Form("LeftLeg", (0.0, -0.010, 0.004), (0.0, -0.390, -0.006), (0.041, 0.045, 0.044, 0.038, 0.032, 0.027), 1.0, 1.06),
    Form("LeftLeg", (0.003, -0.07, -0.018), (0.0, -0.20, -0.016), (0.026, 0.041, 0.036, 0.018), 1.16, 1.0),
    # shoe: heel, sole, instep, toes
    Form("LeftFoot", (0.0, 0.0, -0.010), (0.0, -0.036, -0.036), (0.027, 0.028)),
    Form("LeftFoot", (0.0, -0.047, -0.038), (0.005, -0.050, 0.120), (0.018, 0.018, 0.018), 1.72, 1.0),
    Form("LeftFoot", (0.0, -0.012, 0.008), (0.003, -0.038, 0.100), (0.031, 0.029, 0.022), 1.08, 1.0),
    Form("LeftToe", (0.0, 0.003, -0.010), (-0.006, -0.001, 0.058), (0.0195, 0.0185, 0.0155), 2.05, 1.0),
]

# The hand, palm down and thumb forward in the T-pose: for each finger the place of its knuckle, the lengths of its
# bones, its radius at knuckle and tip, and by how many degrees it is spread and its joints are bent, at rest.
_FINGERS = [
    ((0.091, 0.001, 0.0290), (0.043, 0.026, 0.018), (0.0088, 0.0068), 7.5, (15, 20, 12)),
    ((0.095, 0.003, 0.0085), (0.048, 0.029, 0.019), (0.0090, 0.0070), 1.5, (19, 24, 14)),
    ((0.090, 0.001, -0.0115), (0.044, 0.027, 0.019), (0.0086, 0.0066), -4.5, (23, 26, 16)),
    ((0.082, -0.002, -0.0300), (0.034, 0.021, 0.017), (0.0078, 0.0060), -11.0, (25, 26, 16)),
]
BONE_SHARES = np.linspace(0, 1, 5)
KNUCKLE = 0.0012  # metres that a finger's bones are thinner where two meet, and melt
_WRIST = (0.004, 0.0, 0.012)  # where the bones of the palm begin, the last number times -1 .. 1 across it
_THUMB = [
    ((0.018, -0.004, 0.020), (0.050, -0.017, 0.045), (0.0150, 0.0135)),
    ((0.050, -0.017, 0.045), (0.081, -0.028, 0.057), (0.0118, 0.0102)),
    ((0.081, -0.028, 0.057), (0.105, -0.038, 0.060), (0.0104, 0.0082)),
]


def _hand() -> list[Form]:
    forms = [Form("LeftHand", *bone) for bone in _THUMB]
    for finger, (knuckle, lengths, thick, spread, bends) in enumerate(_FINGERS):
        root = (_WRIST[0], _WRIST[1], _WRIST[2] * (1 - 2 * finger / (len(_FINGERS) - 1)))
        forms.append(Form("LeftHand", root, knuckle, (0.0155, 0.0150, 0.0122)))
        place, sideways = np.array(knuckle), np.radians(spread)
        ends = np.cumsum([0.0, *lengths]) / sum(lengths)
        thickness = thick[0] + (thick[1] - thick[0]) * ends
        for bone, length in enumerate(lengths):
            down = np.radians(sum(bends[: bone + 1]))
            along = np.array([np.cos(down) * np.cos(sideways), -np.sin(down), np.cos(down) * np.sin(sideways)])
            after = place + length * along
            radii = np.interp(BONE_SHARES, [0, 1], thickness[bone : bone + 2]) - KNUCKLE * np.array(
                [1, 0, 0, 0, bone < 2]
            )
            forms.append(Form("LeftHand", tuple(place), tuple(after), tuple(radii)))
            place = after
    return forms


def _profile(radii: tuple[float, ...]) -> np.ndarray:
    """(33,) a form's radius along it: as given, but level at both ends, where the round caps begin, and without bends
    that the light would show."""
    pace = np.minimum(1.0, np.minimum(PROFILE, 1 - PROFILE) / CAP)  # slow at both ends
    along = cumulative_trapezoid(pace, initial=0)
    along /= along[-1]
    return gaussian_filter1d(PchipInterpolator(np.linspace(0, 1, len(radii)), radii)(along), 1.5, mode="nearest")


def _mirrored(form: Form) -> Form:
    (x, y, z), (u, v, w) = form.start, form.stop
    return form._replace(joint=form.joint.replace("Left", "Right"), start=(-x, y, z), stop=(-u, v, w))


_LEFT_AND_MIDDLE = [*_BODY, *_hand()]
FORMS = _LEFT_AND_MIDDLE + [_mirrored(form) for form in _LEFT_AND_MIDDLE if form.joint.startswith("Left")]
FORM_JOINT = np.array([INDEX[form.joint] for form in FORMS])
FORM_START = np.array([form.start for form in FORMS])  # (forms, 3)
_AXIS = np.array([form.stop for form in FORMS]) - FORM_START
FORM_LENGTH = np.linalg.norm(_AXIS, axis=-1)
FORM_RADII = np.array([_profile(form.radii) for form in FORMS])  # (forms, 33)
FORM_STRETCH = np.array([(form.width, 1.0, form.depth) for form in FORMS])
IS_HAND = np.array([form.joint.endswith("Hand") for form in FORMS])


# Gloves and shoes: joints whose skin is a darker tone of their part's colour.
IS_GLOVE = np.array([name.endswith(("Hand", "Foot", "Toe")) for name in JOINTS], float)

# The pose the skin is made in: arms half lowered and legs apart, so that no motion bends it far. Degrees about Z, left.
_BIND_DEGREES = {"Shoulder": -4.0, "Arm": -44.0, "ForeArm": -44.0, "Hand": -44.0, "UpLeg": 9.0, "Leg": 9.0}


def _bind_pose() -> Pose:
    angles = np.zeros(JOINT_COUNT)
    for name, degrees in _BIND_DEGREES.items():
        angles[INDEX[f"Left{name}"]], angles[INDEX[f"Right{name}"]] = np.radians(degrees), -np.radians(degrees)
    rotations = rot.from_axis_angle(np.array([0.0, 0.0, 1.0]), angles)
    return Pose(np.zeros(3), 0.0, np.array([0.0, REST_HIPS_HEIGHT, 0.0]), rotations, np.zeros(4), 0.0)


BIND = _bind_pose()


VISOR = BIND.positions[INDEX["Head"]] + [0.0, 0.074, 0.090]  # the dark glass that shows where the head looks


def form_frames() -> np.ndarray:
    """(forms, 3, 3): rows are a form's width, length and depth directions in its joint's axes."""
    along = _AXIS / FORM_LENGTH[:, None]
    # Arms lie along x: their depth is the body's depth. The width of all others is the body's width.
    across_is_x = np.abs(along[:, :1]) < 0.7
    guide = np.where(across_is_x, [1.0, 0, 0], [0, 0, 1.0])
    guide = rot.normalize(guide - along * np.sum(guide * along, axis=-1, keepdims=True))
    width = np.where(across_is_x, guide, rot.cross(along, guide))
    depth = np.where(across_is_x, rot.cross(guide, along), guide)
    return np.stack([width, along, depth], axis=1)
