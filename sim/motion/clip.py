"""Clips on our skeleton: resampling, mirroring, floor, and the root frame that features and controller share.

scipy is imported where it is used: the live loop imports this file too, has no use for it, and starts half a second
sooner."""

from dataclasses import dataclass, replace

import numpy as np

from sim.body.kinematics import forward_kinematics, to_global
from sim.body.skeleton import CONTACT_JOINTS, INDEX, MIRROR, TOE_HEIGHT
from sim.math import rotations as rot
from sim.math.vectors import FLOOR, UP
from sim.motion.thresholds import STILL_FOOT

FPS = 60
ROOT_SMOOTHING = 0.15  # seconds (Gaussian sigma): the root follows the way, not the sway of each step
# Reflection through the YZ plane, of positions and of rotations: left becomes right.
MIRROR_POSITION, MIRROR_QUATERNION = np.array([-1.0, 1.0, 1.0]), np.array([1.0, 1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Clip:
    """A motion on the 21-joint skeleton: hips (frames, 3) in metres, local quaternions (w, x, y, z) (frames, 21, 4),
    `fps` frames a second."""

    hips: np.ndarray
    rotations: np.ndarray
    fps: float = FPS
    name: str = ""

    def __len__(self) -> int:
        return len(self.hips)

    def __getitem__(self, frames: slice) -> "Clip":
        return replace(self, hips=self.hips[frames], rotations=self.rotations[frames])

    def global_rotations(self) -> np.ndarray:
        """(frames, 21, 4) in world axes."""
        return to_global(self.rotations)

    def positions(self) -> np.ndarray:
        """(frames, 21, 3) in world metres."""
        return forward_kinematics(self.hips, self.global_rotations())

    def resampled(self, fps: float = FPS) -> "Clip":
        """The same motion at another rate, first frame kept: cubic splines through hips and quaternions.

        Straight lines and slerp would leave a corner at each captured frame: a jerk that nobody moved."""
        if abs(fps - self.fps) < 1e-6 or len(self) < 2:
            return replace(self, fps=fps)
        from scipy.interpolate import CubicSpline

        captured = np.arange(len(self))
        wanted = np.arange(int((len(self) - 1) * fps / self.fps + 1e-6) + 1) * self.fps / fps
        hips = CubicSpline(captured, self.hips)(wanted)
        rotations = rot.normalize(CubicSpline(captured, rot.make_continuous(self.rotations))(wanted))
        return replace(self, hips=hips, rotations=rotations, fps=fps)

    def paced(self, pace: float) -> "Clip":
        """The same motion played `pace` times as fast, at the same frame rate."""
        return replace(self, fps=self.fps * pace).resampled(self.fps) if pace != 1 else self

    def mirrored(self) -> "Clip":
        """Left and right exchanged."""
        return replace(
            self,
            hips=self.hips * MIRROR_POSITION,
            rotations=self.rotations[:, MIRROR] * MIRROR_QUATERNION,
            name=self.name + "-mirrored",
        )

    def grounded(self) -> "Clip":
        """Moved vertically so that the planted toes stand at TOE_HEIGHT above a floor at 0."""
        return replace(self, hips=self.hips - floor_height(self.positions(), self.fps) * UP)


@dataclass(frozen=True)
class RootFrame:
    """The character's own ground frame: positions (frames, 3) on the floor in metres, facing (frames,) yaw in
    radians."""

    positions: np.ndarray
    facing: np.ndarray

    def local_velocity(self, fps: float = FPS) -> np.ndarray:
        """(frames, 3) metres a second, as seen along the facing: sideways to the left, 0, forwards."""
        return rot.rotate(rot.from_yaw(-self.facing), np.gradient(self.positions, 1 / fps, axis=0))


def floor_height(positions: np.ndarray, fps: float = FPS) -> float:
    """The floor under a clip, from joint positions (frames, 21, 3): where the lowest joint of the feet is while it
    stands still.

    The middle of those heights, not the lowest: real toes and markers dip under the floor as a foot rolls off."""
    feet = positions[:, CONTACT_JOINTS]
    lowest = feet[..., 1].argmin(axis=1)
    frames = np.arange(len(feet))
    height = feet[frames, lowest, 1]
    if len(feet) > 1:
        speed = np.linalg.norm(np.gradient(feet, 1 / fps, axis=0), axis=-1)[frames, lowest]
        height = height[speed <= max(STILL_FOOT, np.percentile(speed, 5))]
    return float(np.median(height) - TOE_HEIGHT)


def facing_of(positions: np.ndarray) -> np.ndarray:
    """Yaw (frames,) square to the hips and shoulders (Holden et al. 2016), from joint positions (frames, 21, 3),
    unsmoothed."""

    def across(left: str, right: str) -> np.ndarray:
        return rot.normalize((positions[..., INDEX[left], :] - positions[..., INDEX[right], :]) * FLOOR)

    left = across("LeftUpLeg", "RightUpLeg") + across("LeftArm", "RightArm")
    return rot.yaw_of(rot.cross(left, UP))


def root_frame(positions: np.ndarray, fps: float = FPS) -> RootFrame:
    """The root frame of joint positions (frames, 21, 3): hips on the floor and facing, both smoothed over
    ROOT_SMOOTHING."""
    sigma = ROOT_SMOOTHING * fps
    ground = positions[:, 0] * FLOOR
    return RootFrame(_smooth(ground, sigma), _smooth(np.unwrap(facing_of(positions)), sigma))


def _smooth(values: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian smoothing along frames; the ends are continued by point reflection, so a straight walk stays
    straight."""
    from scipy.ndimage import gaussian_filter1d

    pad = min(len(values) - 1, int(4 * sigma))
    before = 2 * values[:1] - values[pad:0:-1]
    after = 2 * values[-1:] - values[-2 : -pad - 2 : -1]
    return gaussian_filter1d(np.concatenate([before, values, after]), sigma, axis=0, mode="nearest")[
        pad : pad + len(values)
    ]
