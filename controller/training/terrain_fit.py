"""Motion captured on level floor, laid on uneven ground: Holden et al. 2017 (Sec. 4.2) fit a height map under each
capture and edit what is left; here the ground is given, and legs and lean of the capture are fitted to it.

A planted foot is raised to the ground under it and tilted with it; in between it goes from the one height to the next,
clear of what lies on its way. The hips follow the blurred ground and sink where a leg would not reach."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from controller.training.labelled_clip import LabelledClip
from sim.body.kinematics import forward_kinematics
from sim.body.limb_ik import LEG_LENGTH, LEGS
from sim.body.skeleton import CONTACT_JOINTS, INDEX, PART_NAMES, PART_OF_JOINT, TOE_HEIGHT
from sim.feet.contact_correction import stand_on_feet
from sim.ground.ground import Ground, sole_heights
from sim.math import rotations as rot
from sim.math.easing import smooth_step
from sim.math.vectors import LEFT, UP
from sim.motion.clip import FPS, root_frame
from sim.motion.thresholds import PLANTED

CLEARANCE = 0.03  # metres that a swinging foot is above what it passes over
CLEARING_SECONDS = 0.08  # (Gaussian sigma) over which it rises for that
HIP_SECONDS = 0.08  # (Gaussian sigma) of the hips' way up and down
REACH = 0.995  # share of a leg's length that is used
LEAN = {"up": 0.45, "down": 0.15}  # of the slope's angle that the body leans into it
SLOPE_REACH = 0.3  # metres ahead and behind over which that slope is measured
LEAN_SECONDS = 0.25  # (Gaussian sigma)
UPPER = np.flatnonzero(PART_OF_JOINT >= PART_NAMES.index("spine"))[1:]  # what leans: all above the hips
HEAD_LEAN = 0.4  # share of it that the head goes along with: it looks ahead


@dataclass(frozen=True)
class Placed:
    """A ground, turned by `yaw` radians about the clip's origin and shifted by (2,) metres."""

    ground: Ground
    yaw: float
    shift: np.ndarray

    def _there(self, places: np.ndarray) -> np.ndarray:
        sine, cosine = np.sin(self.yaw), np.cos(self.yaw)
        return places @ np.array([[cosine, -sine], [sine, cosine]]) + self.shift

    def height_at(self, places: np.ndarray) -> np.ndarray:
        """As Ground.height_at."""
        return self.ground.height_at(self._there(places))

    def smooth_height_at(self, places: np.ndarray) -> np.ndarray:
        """As Ground.smooth_height_at."""
        return self.ground.smooth_height_at(self._there(places))


def fit_to_ground(source: LabelledClip, ground: Placed) -> LabelledClip:
    """The clip of level floor, its feet planted, walking over the ground."""
    clip = source.clip
    rotations = clip.global_rotations()
    flat = forward_kinematics(clip.hips, rotations)
    root = root_frame(flat)
    rotations = _lean(rotations, _slope_ahead(ground, root.positions, root.facing), root.facing)
    feet = flat[:, CONTACT_JOINTS].reshape(-1, 2, 2, 3)
    feet = feet + _raise(feet, source.contacts.reshape(-1, 2, 2).max(axis=2), ground)[..., None] * UP
    hips = (
        clip.hips + gaussian_filter1d(ground.smooth_height_at(root.positions[:, ::2]), HIP_SECONDS * FPS)[:, None] * UP
    )
    own_stretch = np.linalg.norm(flat[:, LEGS[0]] - flat[:, LEGS[-1]], axis=-1)
    return replace(
        source,
        clip=stand_on_feet(clip, hips, rotations, feet, np.maximum(own_stretch, REACH * LEG_LENGTH)),
        height_at=ground.height_at,
        smooth_height_at=ground.smooth_height_at,
    )


def _raise(feet: np.ndarray, planted: np.ndarray, ground: Placed) -> np.ndarray:
    """What (frames, 2 feet, 2) ankles and toes (frames, 2, 2, 3) of level floor rise by; planted (frames, 2) in
    0..1."""
    soles = sole_heights(ground.height_at(feet[..., ::2]))
    result = np.empty(soles.shape)
    frames = np.arange(len(feet))
    for foot in range(2):
        down = np.flatnonzero(planted[:, foot] > PLANTED)
        if not len(down):
            down = frames[[0, -1]]
        last = down[np.maximum(np.searchsorted(down, frames, side="right") - 1, 0)]
        following = down[np.minimum(np.searchsorted(down, frames), len(down) - 1)]
        share = smooth_step((frames - last) / np.maximum(following - last, 1), 0.0, 1.0)[:, None]
        between = soles[last, foot] * (1 - share) + soles[following, foot] * share
        # Over an edge the foot has to be clear of the ground it has not come to, or has left, by then.
        under = ground.height_at(feet[:, foot][..., ::2]) + TOE_HEIGHT + CLEARANCE * (last != following)[:, None]
        missing = (under - feet[:, foot, :, 1] - between).max(axis=1).clip(min=0.0)
        missing[last == following] = 0.0
        window = round(2 * CLEARING_SECONDS * FPS) | 1
        clear = gaussian_filter1d(maximum_filter1d(missing, window), CLEARING_SECONDS * FPS / 2)
        swing = smooth_step(np.minimum(frames - last, following - frames) / FPS, 0.0, CLEARING_SECONDS)
        result[:, foot] = between + (clear * swing)[:, None]
    return result


def _slope_ahead(ground: Placed, places: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """The angle (frames,) in radians at which the ground rises along the facing (frames,) at roots (frames, 3)."""
    ahead = SLOPE_REACH * np.stack([np.sin(facing), np.cos(facing)], axis=-1)
    rise = ground.smooth_height_at(places[:, ::2] + ahead) - ground.smooth_height_at(places[:, ::2] - ahead)
    return gaussian_filter1d(np.arctan2(rise, 2 * SLOPE_REACH), LEAN_SECONDS * FPS, mode="nearest")


def _lean(rotations: np.ndarray, slope: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """Global rotations (frames, 21, 4) with the upper body leant into slopes (frames,) in radians."""
    angle = np.where(slope > 0, LEAN["up"], LEAN["down"]) * slope
    axis = rot.rotate(rot.from_yaw(facing), LEFT)
    result = rotations.copy()
    for joints, share in ((UPPER, 1.0), ([INDEX["Head"]], HEAD_LEAN)):
        turn = rot.from_rotation_vector((share * angle)[:, None] * axis)
        result[:, joints] = rot.multiply(turn[:, None], rotations[:, joints])
    return result
