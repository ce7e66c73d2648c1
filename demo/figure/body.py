"""The figure: a table of capsules fixed to the joints, the pose they are melted in, and how they follow a pose."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from sim.body.pose import Pose
from sim.body.skeleton import INDEX, JOINT_COUNT, JOINTS, PART_NAMES, REST_HIPS_HEIGHT
from sim.math import rotations as rot

# (joint, from, to, radii at even steps between them, width, depth): metres in the joint's own axes in the T-pose.
# Width and depth stretch the form across; a form of a left joint has its mirror image on the right. Where forms meet
# they swell a little as they melt, so their ends are thinner than the body is there.
_FORMS = [
    # pelvis, waist, rib cage, shoulder girdle
    ("Hips", (0.0, -0.050, -0.004), (0.0, 0.060, 0.0), (0.084, 0.090, 0.082), 1.24, 0.94),
    ("Hips", (-0.056, -0.066, -0.030), (0.056, -0.066, -0.030), (0.060, 0.056, 0.060), 1.0, 1.0),
    ("Spine", (0.0, -0.03, 0.0), (0.0, 0.09, 0.0), (0.080, 0.086, 0.080), 1.32, 0.94),
    ("Chest", (0.0, -0.03, 0.0), (0.0, 0.13, -0.006), (0.078, 0.086, 0.100, 0.106), 1.40, 0.94),
    ("Chest", (-0.068, 0.118, 0.046), (0.068, 0.118, 0.046), (0.040, 0.040, 0.040), 1.0, 1.0),
    ("Chest", (-0.125, 0.170, -0.018), (0.125, 0.170, -0.018), (0.048, 0.048, 0.048), 1.0, 1.0),
    ("Chest", (-0.110, 0.190, -0.020), (-0.012, 0.272, -0.020), (0.032, 0.034, 0.030), 1.0, 1.0),
    ("Chest", (0.110, 0.190, -0.020), (0.012, 0.272, -0.020), (0.032, 0.034, 0.030), 1.0, 1.0),
    # neck and head
    ("Neck", (0.0, -0.04, -0.016), (0.0, 0.09, 0.004), (0.048, 0.047, 0.046), 1.0, 1.06),
    ("Head", (0.0, 0.098, -0.016), (0.0, 0.088, 0.018), (0.080, 0.078), 0.92, 1.0),
    ("Head", (0.0, 0.074, 0.022), (0.0, 0.010, 0.040), (0.068, 0.062, 0.050), 0.92, 1.0),
    # shoulder, arm, hand
    ("LeftShoulder", (0.03, -0.004, -0.014), (0.115, -0.010, -0.006), (0.036, 0.042), 1.0, 1.0),
    ("LeftArm", (-0.005, -0.010, 0.0), (0.272, 0.0, 0.0), (0.054, 0.054, 0.048, 0.044, 0.039, 0.031), 1.0, 1.06),
    ("LeftForeArm", (0.010, 0.0, 0.0), (0.240, 0.0, 0.0), (0.032, 0.040, 0.039, 0.033, 0.026, 0.021), 1.0, 1.1),
    ("LeftHand", (0.012, 0.0, 0.0), (0.158, -0.014, 0.0), (0.020, 0.027, 0.030, 0.027, 0.022), 0.80, 1.18),
    ("LeftHand", (0.030, -0.004, 0.020), (0.088, -0.014, 0.056), (0.014, 0.014, 0.011), 1.0, 1.0),
    # thigh, shin, foot
    ("LeftUpLeg", (0.008, 0.0, 0.0), (0.0, -0.410, 0.004), (0.072, 0.082, 0.076, 0.067, 0.056, 0.043), 1.0, 1.06),
    ("LeftLeg", (0.0, -0.010, 0.006), (0.0, -0.390, -0.004), (0.042, 0.048, 0.050, 0.044, 0.036, 0.028), 1.0, 1.06),
    ("LeftLeg", (0.002, -0.09, -0.022), (0.0, -0.17, -0.020), (0.030, 0.032, 0.030), 1.1, 1.0),
    ("LeftFoot", (0.0, 0.0, -0.008), (0.0, -0.040, -0.034), (0.026, 0.025), 1.0, 1.0),
    ("LeftFoot", (0.0, -0.042, -0.030), (0.004, -0.046, 0.120), (0.022, 0.020, 0.019), 1.40, 1.0),
    ("LeftFoot", (0.0, -0.012, 0.010), (0.003, -0.038, 0.096), (0.030, 0.028, 0.023), 1.05, 1.0),
    ("LeftToe", (0.0, 0.005, -0.006), (-0.006, 0.001, 0.064), (0.020, 0.018, 0.013), 2.0, 1.0),
]


def _mirrored(form: tuple) -> tuple:
    joint, start, end, *rest = form
    return (joint.replace("Left", "Right"), *((-x, y, z) for x, y, z in (start, end)), *rest)


FORMS = _FORMS + [_mirrored(form) for form in _FORMS if form[0].startswith("Left")]
FORM_JOINT = np.array([INDEX[form[0]] for form in FORMS])
FORM_START = np.array([form[1] for form in FORMS])  # (forms, 3)
_AXIS = np.array([form[2] for form in FORMS]) - FORM_START
FORM_LENGTH = np.linalg.norm(_AXIS, axis=-1)
PROFILE = np.linspace(0, 1, 33)  # shares of a form's length at which its radius is tabled
FORM_RADII = np.array(
    [
        PchipInterpolator(np.linspace(0, 1, len(form[3])), form[3])(PROFILE)  # (forms, 33)
        for form in FORMS
    ]
)
FORM_STRETCH = np.array([(form[4], 1.0, form[5]) for form in FORMS])

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


VISOR = BIND.positions[INDEX["Head"]] + [0.0, 0.074, 0.090]  # the dark glass that shows where the head looks


@dataclass(frozen=True)
class Figure:
    """A body as the passes read it: `bones` (84, 3), `tints` (5, 4) display colours by body part, both float32; `plane`
    (3,) of the ground under it: its height at the origin, and the metres that it rises in a metre of x and of z."""

    bones: np.ndarray
    tints: np.ndarray
    plane: np.ndarray


def figure(
    pose: Pose,
    part_colours: np.ndarray,
    shift: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0),
    plane: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Figure:
    """The body in `pose`, moved by `shift` metres, in display colours (5, 3) in the order of PART_NAMES, on a plane as
    Figure has it."""
    tints = np.ones((len(PART_NAMES), 4), np.float32)
    tints[:, :3] = part_colours
    return Figure(bones(pose, shift), tints, np.asarray(plane))


def bones(pose: Pose, shift: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    """(84, 3) float32: for each joint the transform (4, 3) of row vectors from the bind pose to `pose` moved by
    `shift`."""
    turns = rot.multiply(pose.rotations, rot.inverse(BIND.rotations))
    result = np.empty((JOINT_COUNT, 4, 3), np.float32)
    result[:, :3] = rot.rotate(turns[:, None], np.eye(3))
    result[:, 3] = pose.positions + shift - rot.rotate(turns, BIND.positions)
    return result.reshape(-1, 3)
