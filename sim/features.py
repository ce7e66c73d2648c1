"""Motion features of Motion Puzzle (Jang et al. 2022, Sec. 3): 15 numbers a joint, built and read in this one place.

Per joint, in the character's own ground frame: position 3, rotation 6 (forward and up axes), velocity 3 (the root's taken out),
root velocity x, root velocity z, root turn rate. Velocities are metres (radians) a second and look back over `STRIDE` frames.
"""

import numpy as np

from sim import rotations as rot
from sim.clip import FPS, Clip, root_frame

LAYOUT = {"position": slice(0, 3), "rotation": slice(3, 9), "velocity": slice(9, 12), "root": slice(12, 15)}
FEATURES = 15
STRIDE = 2  # the networks see every second frame: 30 Hz
WINDOW = 16  # samples: i - 30, i - 28 .. i, the last half second
LAYOUT_VERSION = "patchwalk-features-1"  # kept in weight files


def features_from(positions: np.ndarray, rotations: np.ndarray, root_positions: np.ndarray,
                  root_facing: np.ndarray) -> np.ndarray:
    """Features (frames, 21, 15) of consecutive frames.

    positions (frames + STRIDE, 21, 3), rotations (frames + STRIDE, 21, 4) global, root_positions (.., 3), root_facing (..,):
    the first STRIDE frames serve the velocities only.
    """
    now, before = slice(STRIDE, None), slice(None, -STRIDE)
    rate = FPS / STRIDE
    to_character = rot.from_yaw(-root_facing[now])[:, None]
    root_velocity = (root_positions[now] - root_positions[before]) * rate
    turn_rate = rot.wrap_angle(root_facing[now] - root_facing[before]) * rate
    velocity = (positions[now] - positions[before]) * rate - root_velocity[:, None]
    local_root_velocity = rot.rotate(to_character[:, 0], root_velocity)
    root = np.stack([local_root_velocity[:, 0], local_root_velocity[:, 2], turn_rate], axis=-1)

    result = np.empty((len(turn_rate), positions.shape[1], FEATURES))
    result[..., LAYOUT["position"]] = rot.rotate(to_character, positions[now] - root_positions[now][:, None])
    result[..., LAYOUT["rotation"]] = rot.to_6d(rot.multiply(to_character, rotations[now]))
    result[..., LAYOUT["velocity"]] = rot.rotate(to_character, velocity)
    result[..., LAYOUT["root"]] = root[:, None]
    return result


def clip_features(clip: Clip) -> np.ndarray:
    """Features (frames, 21, 15) of a 60 Hz clip; the first frames borrow the velocity of the first that has one."""
    positions, rotations = clip.positions(), clip.global_rotations()
    root = root_frame(positions, clip.fps)
    led = (np.concatenate([values[:1].repeat(STRIDE, axis=0), values])
           for values in (positions, rotations, root.positions, root.facing))
    result = features_from(*led)
    velocities = slice(LAYOUT["velocity"].start, None)
    result[:STRIDE, :, velocities] = result[STRIDE, :, velocities]
    return result


def rotations_of(features: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 21, 3, 3) in the character's own frame, read back from features (..., 21, 15)."""
    return rot.matrix_of_6d(features[..., LAYOUT["rotation"]])
