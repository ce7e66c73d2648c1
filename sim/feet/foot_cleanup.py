"""Feet of a whole restyled clip: planted where the content plants them, over the floor, with a view of what comes.

Jang et al. 2022 (Sec. 7.2.3) and Aberman et al. 2020 move a planted foot to its mean place in the contact phase. Here
it is the foot's displacement from the content's own that stands still while the content's foot is planted: the styled
foot then slides exactly as little as the captured one, nothing jumps, and a clip that is not restyled stays as it
is."""

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d, uniform_filter1d

from sim.body.limb_ik import KNEES_FORWARD, LEG_LENGTH, LEGS, height_missing, reach
from sim.body.pose import Pose
from sim.body.skeleton import CONTACT_JOINTS
from sim.math.smoothing import smooth_penalised
from sim.math.vectors import FLOOR, UP
from sim.motion.clip import FPS

FADE = 0.15 * FPS  # frames over which a correction comes before a contact and goes after it
EDGE = 3  # frames over which a contact's hold sets in
LEVEL_SECONDS = 0.1  # the body rises and sinks no quicker (Gaussian sigma)
CLEARANCE = 0.05  # metres: a lifted foot stays as high as the content's up to this
REACH = 0.9999  # share of a leg's length that is used
STRETCH = 0.98  # share over which the hips sink, unless the content's own leg is stretched more
LONGEST_DROP = 0.25  # metres that the hips sink at most to let a foot reach its place
LIMB_REACH = 0.999  # share of a leg's length that raised feet use


def clean_feet(styled: Pose, content: Pose) -> Pose:
    """The styled poses (fields with a leading axis of frames) with their feet in order; content.contacts say when.

    Hips move up and down only; feet keep their attitude, bones their length."""
    ours, theirs = (pose.positions[:, CONTACT_JOINTS].reshape(-1, 2, 2, 3) for pose in (styled, content))
    if len(ours) < 4 or np.abs(ours - theirs).max() < 1e-6:
        return styled
    lift = _slowly(theirs[..., 1].min(axis=(1, 2)) - ours[..., 1].min(axis=(1, 2)))
    ours = ours + lift[:, None, None, None] * UP
    contacts = uniform_filter1d(content.contacts.reshape(-1, 2, 2), EDGE, axis=0, mode="nearest")
    targets = ours[:, :, 0].copy()
    for foot in range(2):
        targets[:, foot] += _correction(ours[:, foot], theirs[:, foot], contacts[:, foot])
    own_stretch = np.linalg.norm(content.positions[:, LEGS[0]] - theirs[:, :, 0], axis=-1)
    lift -= _drop(
        styled.positions[:, LEGS[0]] + lift[:, None, None] * UP, targets, np.maximum(own_stretch, STRETCH * LEG_LENGTH)
    )
    hips = styled.hips + lift[:, None] * UP
    return reach(styled.with_body(hips, styled.rotations), LEGS, targets, KNEES_FORWARD, REACH)


def _correction(ours: np.ndarray, theirs: np.ndarray, contacts: np.ndarray) -> np.ndarray:
    """What to add to one foot (frames, 3): ours, theirs (frames, 2, 3) its ankle and toe, contacts (frames, 2)
    theirs."""
    hold, bearing = contacts.max(axis=1), contacts.argmax(axis=1)
    frames = np.arange(len(ours))
    apart = ours - theirs
    moved = np.diff(apart, axis=0)[frames[1:] - 1, bearing[1:]]  # of the joint that carries the weight
    still = np.minimum(hold[1:], hold[:-1]) ** 2
    across = smooth_penalised(-np.concatenate([np.zeros((1, 3)), moved.cumsum(axis=0)]), 0.0, still, FADE)
    low = ours[..., 1].min(axis=1)
    clear = np.minimum(theirs[..., 1].min(axis=1), CLEARANCE) - low
    height = np.where(hold > 0, np.maximum(-apart[frames, bearing, 1], clear), clear)
    up = smooth_penalised(height, np.maximum(hold, clear > 0), 0.0, FADE)
    return across * FLOOR + up[:, None] * UP


def _drop(hips: np.ndarray, targets: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """How far (frames,) the hips sink so that legs from (frames, 2, 3), no longer than (frames, 2), reach their
    ankles."""
    needed = np.clip(height_missing(hips, targets, stretch).max(axis=1), 0.0, LONGEST_DROP)
    return _slowly(maximum_filter1d(needed, 4 * round(LEVEL_SECONDS * FPS) + 1, mode="nearest"))


def _slowly(values: np.ndarray) -> np.ndarray:
    """Values (frames, ...) of a body that rises and sinks no quicker than LEVEL_SECONDS let it."""
    return gaussian_filter1d(values, LEVEL_SECONDS * FPS, mode="nearest")


def foot_height_error(styled: Pose, content: Pose) -> np.ndarray:
    """How far (...) the lowest joint of the styled feet is under the content's lowest, in metres."""
    return content.positions[..., CONTACT_JOINTS, 1].min(axis=-1) - styled.positions[..., CONTACT_JOINTS, 1].min(
        axis=-1
    )


def raise_feet(styled: Pose, height: np.ndarray) -> Pose:
    """Both feet moved up by a height (...) in metres, the hips staying where they are."""
    targets = styled.positions[..., LEGS[-1], :] + np.multiply.outer(height, UP)[..., None, :]
    return reach(styled, LEGS, targets, KNEES_FORWARD, LIMB_REACH)
