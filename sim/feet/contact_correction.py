"""The feet of whole clips: planted ones held still by the smoothest correction that takes their slide away, and longer
strides.

Whole clips can be looked ahead in: no release is needed as in the live foot lock (sim.feet.foot_lock)."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d, uniform_filter1d

from sim.body.kinematics import forward_kinematics, to_local, two_bone_ik
from sim.body.limb_ik import KNEES_FORWARD, LEG_LENGTH, LEGS, height_missing
from sim.body.skeleton import BONE_OFFSETS, CONTACT_JOINTS, TOE_HEIGHT, TOES
from sim.math import rotations as rot
from sim.math.easing import ramp
from sim.math.smoothing import smooth_penalised
from sim.math.vectors import FLOOR, FORWARD, UP
from sim.motion.clip import Clip, root_frame
from sim.motion.contacts import foot_contacts
from sim.motion.thresholds import SWINGING_TOE

FADE_SECONDS = 0.12  # over which a correction grows before a foot lands and is gone after it has lifted
EDGE_SECONDS = 0.05  # over which a contact's hold sets in: a landing foot is slowed down, not stopped dead
CLEARANCE = 0.03  # metres that a swinging toe is at least higher than a planted one
DROP_SECONDS = 0.4  # over which hips sink for a stride that their legs would not reach
SOFTNESS = 2.0  # of the hold: a landing foot is stopped over about the square root of this many frames
NEVER_FREE = 1e-4  # how much a held correction counts as free, lest a foot that always stands has no place of its own
HANDOVER_SECONDS = 0.05  # over which the toe takes over from the ankle what holds a rolling foot
REACH = 1.0  # share of a leg's length that is used: a captured leg that is straight stays so
FOOT_LENGTH = float(np.linalg.norm(BONE_OFFSETS[TOES[0]]))


def plant_feet(clip: Clip, contacts: np.ndarray | None = None) -> Clip:
    """The clip with its planted joints held in place; contacts (frames, 4) in 0..1, measured on the clip where None.

    Hips and upper body stay as they are. A foot that its leg cannot bring back keeps what is left of its slide."""
    if len(clip) < 4:
        return clip
    contacts = foot_contacts(clip) if contacts is None else contacts
    hold = uniform_filter1d(contacts, max(1, round(EDGE_SECONDS * clip.fps)) | 1, axis=0, mode="nearest")
    rotations = clip.global_rotations()
    positions = forward_kinematics(clip.hips, rotations)
    feet = positions[:, CONTACT_JOINTS]
    wanted = feet.copy()
    for joint in range(4):
        wanted[:, joint] += FLOOR * _still(feet[:, joint], hold[:, joint], clip.fps)
    for toe in (1, 3):
        flat = np.minimum(hold[:, toe - 1], hold[:, toe])
        wanted[:, toe, 1] += _level(feet[:, toe], hold[:, toe], flat, clip.fps)
    ankles, toes = _joined(wanted.reshape(-1, 2, 2, 3), feet.reshape(-1, 2, 2, 3), hold.reshape(-1, 2, 2), clip.fps)
    return replace(clip, rotations=to_local(_put_feet(clip.hips, rotations, positions, ankles, toes)))


def scale_strides(clip: Clip, factor: float) -> Clip:
    """The clip with strides `factor` times as long, in the same time: root and feet go that much further, planted feet
    stay planted, and the hips sink as far as the legs need. The body is carried along as it is."""
    if factor == 1:
        return clip
    rotations = clip.global_rotations()
    positions = forward_kinematics(clip.hips, rotations)
    further = (factor - 1) * FLOOR
    hips = clip.hips + further * root_frame(positions, clip.fps).positions
    feet = positions[:, CONTACT_JOINTS].reshape(-1, 2, 2, 3)
    shift = further * feet[:, :, :1]  # of a foot as a whole, which keeps its length
    return stand_on_feet(clip, hips, rotations, feet + shift, REACH * LEG_LENGTH)


def stand_on_feet(
    clip: Clip, hips: np.ndarray, rotations: np.ndarray, feet: np.ndarray, longest: np.ndarray | float
) -> Clip:
    """The clip with hips (frames, 3) and global rotations (frames, 21, 4), ankles and toes at feet (frames, 2, 2, 3);
    the hips sink, slowly, as far as legs no longer than `longest` (frames, 2) in metres need."""
    sockets = forward_kinematics(hips, rotations)[:, LEGS[0]]
    missing = height_missing(sockets, feet[:, :, 0], longest).max(axis=1).clip(min=0.0)
    window = round(DROP_SECONDS * clip.fps)
    hips = hips - gaussian_filter1d(maximum_filter1d(missing, window), window / 4)[:, None] * UP
    positions = forward_kinematics(hips, rotations)
    return replace(clip, hips=hips, rotations=to_local(_put_feet(hips, rotations, positions, *np.moveaxis(feet, 2, 0))))


def _joined(wanted: np.ndarray, feet: np.ndarray, hold: np.ndarray, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Ankles and toes (frames, 2, 3) a foot's length apart, near the wanted ones (frames, 2, 2, 3): the one that is
    held stays, the other gives way; heights stay in any case. feet: as captured; hold: (frames, 2, 2)."""
    rise = np.clip(wanted[:, :, 1, 1] - wanted[:, :, 0, 1], -FOOT_LENGTH, FOOT_LENGTH)
    across = np.sqrt(FOOT_LENGTH**2 - rise**2)[..., None]
    captured = (feet[:, :, 1] - feet[:, :, 0])[..., [0, 2]]
    change = (wanted[:, :, 1] - wanted[:, :, 0])[..., [0, 2]] - captured
    # A foot that hangs straight down has no heading for a change to turn.
    direction = rot.normalize(captured + change * np.clip(across / FOOT_LENGTH, 0.0, 1.0))
    gap = np.linalg.norm(captured + change, axis=-1, keepdims=True) - across
    hold = gaussian_filter1d(hold, HANDOVER_SECONDS * fps, axis=0, mode="nearest")
    share = 0.5 + 0.5 * (hold[:, :, 1] - hold[:, :, 0])[..., None]  # of the gap that the ankle closes
    ankles, toes = wanted[:, :, 0].copy(), wanted[:, :, 1].copy()
    ankles[..., [0, 2]] += share * gap * direction
    toes[..., [0, 2]] = ankles[..., [0, 2]] + across * direction
    return ankles, toes


def _put_feet(
    hips: np.ndarray, rotations: np.ndarray, positions: np.ndarray, ankles: np.ndarray, toes: np.ndarray
) -> np.ndarray:
    """Global rotations (frames, 21, 4) with ankles, then toes, brought to where they are wanted (frames, 2, 3); from
    hips (frames, 3), global rotations and positions (frames, 21, 3)."""
    upper, lower, foot = LEGS
    forward = rot.rotate(rotations[:, :1], KNEES_FORWARD * FORWARD)
    turns = two_bone_ik(positions[:, upper], positions[:, lower], positions[:, foot], ankles, forward, REACH)
    result = rotations.copy()
    for joint, turn in zip((upper, lower), turns):
        result[:, joint] = rot.multiply(turn, rotations[:, joint])
    moved = forward_kinematics(hips, result)
    aim = rot.between(rot.normalize(moved[:, TOES] - moved[:, foot]), rot.normalize(toes - moved[:, foot]))
    for joint in (foot, TOES):
        result[:, joint] = rot.multiply(aim, result[:, joint])
    return result


def _still(joint: np.ndarray, hold: np.ndarray, fps: float) -> np.ndarray:
    """The smooth correction (frames, 3) whose steps undo those of a joint (frames, 3) while hold (frames,) is 1."""
    held = np.minimum(hold[:-1], hold[1:]) ** 2
    return smooth_penalised(-joint, 0.0, held / SOFTNESS, FADE_SECONDS * fps, np.maximum(1 - hold, NEVER_FREE))


def _level(toe: np.ndarray, hold: np.ndarray, flat: np.ndarray, fps: float) -> np.ndarray:
    """The smooth vertical correction (frames,) of a toe (frames, 3): onto the floor while its foot is flat, not under
    it while it pushes off, and clear of it while it swings, for captured toes may brush the floor at full speed."""
    speed = np.linalg.norm(np.gradient(toe[:, [0, 2]], 1 / fps, axis=0), axis=-1)
    swing = ramp(speed, *SWINGING_TOE) * (1 - hold)
    missing = TOE_HEIGHT - toe[:, 1]
    weight = hold + swing
    pull = flat * missing + (hold - flat) * np.maximum(missing, 0.0) + swing * np.maximum(missing + CLEARANCE, 0.0)
    return smooth_penalised(pull / np.maximum(weight, 1e-9), weight / SOFTNESS, 0.0, FADE_SECONDS * fps)
