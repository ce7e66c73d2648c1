"""A clip to learn from, with all that is known of its frames beside the motion itself."""

from dataclasses import dataclass, field, replace
from typing import Callable

import numpy as np

from controller.model.gait_phase import flight_lift, jump_weight, label_phase
from controller.training.leaps import find_flights
from sim.math.easing import ramp
from sim.motion.clip import FPS, Clip, RootFrame, root_frame
from sim.motion.contacts import foot_contacts
from sim.motion.thresholds import CROUCHED_HIPS

LEFT_RIGHT = [2, 3, 0, 1]  # contacts of the mirrored body
STANCE_SMOOTHING = 0.25  # seconds (Gaussian sigma): hips dip in every stride, a crouch lasts

HeightAt = Callable[[np.ndarray], np.ndarray]  # metres (...) at places (..., 2), world x and z


def level(places: np.ndarray) -> np.ndarray:
    """The height 0 (...) of level ground at places (..., 2)."""
    return np.zeros(places.shape[:-1])


@dataclass(frozen=True)
class LabelledClip:
    """A grounded 60 Hz clip; contacts (frames, 4); phase (frames,) unwrapped radians; crouch, jump (frames,) in 0..1;
    lift (frames,): metres that a jump carries the root over the ground; the ground, as it is and blurred."""

    clip: Clip
    contacts: np.ndarray
    phase: np.ndarray
    crouch: np.ndarray
    jump: np.ndarray
    lift: np.ndarray
    height_at: HeightAt = field(default=level)
    smooth_height_at: HeightAt = field(default=level)

    def __len__(self) -> int:
        return len(self.clip)

    def __getitem__(self, frames: slice) -> "LabelledClip":
        parts = {name: getattr(self, name)[frames] for name in ("clip", "contacts", "phase", "crouch", "jump", "lift")}
        return replace(self, **parts)

    def mirrored(self) -> "LabelledClip":
        """Left and right exchanged, on level ground."""
        return replace(self, clip=self.clip.mirrored(), contacts=self.contacts[:, LEFT_RIGHT], phase=self.phase + np.pi)

    def root(self) -> RootFrame:
        """Its root: on the ground, or carried over it by a jump."""
        root = root_frame(self.clip.positions())
        root.positions[:, 1] = self.smooth_height_at(root.positions[:, ::2]) + self.lift
        return root


def label(clip: Clip, jumps: bool = False, crouches: bool = False) -> LabelledClip:
    """The labels of a grounded 60 Hz clip on level floor; jumps, crouches: whether it may show any at all."""
    from scipy.ndimage import gaussian_filter1d

    positions, contacts = clip.positions(), foot_contacts(clip)
    jump, lift = np.zeros(len(clip)), np.zeros(len(clip))
    for start, stop in find_flights(positions) if jumps else ():
        time = (np.arange(len(clip)) - start) / FPS
        seconds = (stop - start) / FPS
        lift += flight_lift(time, seconds)
        jump = np.maximum(jump, jump_weight(time, seconds))
    hips = gaussian_filter1d(positions[:, 0, 1] - lift, STANCE_SMOOTHING * FPS, mode="nearest")
    crouch = 1 - ramp(hips, *CROUCHED_HIPS) if crouches else np.zeros(len(clip))
    return LabelledClip(clip, contacts, label_phase(positions, contacts), crouch, jump, lift)
