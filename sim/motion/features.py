"""Motion features of Motion Puzzle (Jang et al. 2022, Sec. 3): 15 numbers a joint, built and read in this one place.

Per joint, in the character's own ground frame: position 3, rotation 6 (forward and up axes), velocity 3 (the root's
taken out), root velocity x, root velocity z, root turn rate. Velocities are metres (radians) a second and look back
over `STRIDE` frames."""

from typing import NamedTuple

import numpy as np

from sim.body.pose import Pose
from sim.math import rotations as rot
from sim.motion.clip import FPS, Clip, root_frame

LAYOUT = {"position": slice(0, 3), "rotation": slice(3, 9), "velocity": slice(9, 12), "root": slice(12, 15)}
POSE_CHANNELS = slice(LAYOUT["position"].start, LAYOUT["rotation"].stop)  # how a joint is held: position and rotation
FEATURES = 15
STRIDE = 2  # the networks see every second frame: 30 Hz
WINDOW = 16  # samples: i - 30, i - 28 .. i, the last half second
LAYOUT_VERSION = "patchwalk-features-1"  # kept in weight files


def features_from(
    positions: np.ndarray, rotations: np.ndarray, root_positions: np.ndarray, root_facing: np.ndarray
) -> np.ndarray:
    """Features (frames, 21, 15) of consecutive frames.

    positions (frames + STRIDE, 21, 3), rotations (frames + STRIDE, 21, 4) global, root_positions (.., 3), root_facing
    (..,): the first STRIDE frames serve the velocities only."""
    whole = Body(positions, rotations, root_positions, root_facing)
    return features_between(
        *(Body(*(field[part] for field in whole)) for part in (slice(STRIDE, None), slice(None, -STRIDE)))
    )


class Body(NamedTuple):
    """What of a Pose its features are made of; any leading axes."""

    positions: np.ndarray  # (..., 21, 3)
    rotations: np.ndarray  # (..., 21, 4)
    root_position: np.ndarray  # (..., 3)
    root_facing: np.ndarray  # (...)

    @property
    def axes(self) -> np.ndarray:
        """See Pose.axes."""
        return rot.to_matrix(rot.from_yaw(self.root_facing))


def features_between(now: Pose | Body, before: Pose | Body) -> np.ndarray:
    """Features (..., 21, 15) of a pose, or of many at once, from it and the one STRIDE frames earlier."""
    rate = FPS / STRIDE
    root_velocity = ((now.root_position - before.root_position) * rate)[..., None, :]
    # All that turns with the character, three numbers at a time, in the order of LAYOUT.
    vectors = np.empty((*now.rotations.shape[:-1], 4, 3))
    vectors[..., 0, :] = now.positions - now.root_position[..., None, :]
    vectors[..., 1:3, :] = rot.to_6d(now.rotations).reshape(*now.rotations.shape[:-1], 2, 3)
    vectors[..., 3, :] = (now.positions - before.positions) * rate - root_velocity
    turned = vectors.reshape(*vectors.shape[:-3], -1, 3) @ now.axes

    result = np.empty((*now.rotations.shape[:-1], FEATURES))
    result[..., :12] = turned.reshape(*now.rotations.shape[:-1], 12)
    result[..., 12:14] = (root_velocity @ now.axes)[..., ::2]
    # may be a plain number
    result[..., 14] = np.asarray(rot.wrap_angle(now.root_facing - before.root_facing) * rate)[..., None]
    return result


def clip_features(clip: Clip) -> np.ndarray:
    """Features (frames, 21, 15) of a 60 Hz clip; the first frames borrow the velocity of the first that has one.

    Raises ValueError for a clip of too few frames to have one."""
    if len(clip) <= STRIDE:
        raise ValueError(
            f"the clip is too short to show a movement ({len(clip)} of {STRIDE + 1} frames): give about a second"
        )
    positions, rotations = clip.positions(), clip.global_rotations()
    root = root_frame(positions, clip.fps)
    led = (
        np.concatenate([values[:1].repeat(STRIDE, axis=0), values])
        for values in (positions, rotations, root.positions, root.facing)
    )
    result = features_from(*led)
    velocities = slice(LAYOUT["velocity"].start, None)
    result[:STRIDE, :, velocities] = result[STRIDE, :, velocities]
    return result


def rotations_of(features: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 21, 3, 3) in the character's own frame, read back from features (..., 21, 15)."""
    return rot.matrix_of_6d(features[..., LAYOUT["rotation"]])
