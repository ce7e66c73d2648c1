"""Measures of motion quality that controller and stylizer are both judged by: foot skate, jerk, Frechet distance.

Measures of frames answer for every frame, NaN where they do not apply: the caller may choose frames and pool clips.
"""

import numpy as np

from sim.body.skeleton import TOE_HEIGHT
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT

SKATE_HEIGHT = 0.025  # metres above the toe joint's place on the floor: H of Zhang et al. 2018
VELOCITY_SECONDS = 0.1  # a velocity counts as the way gone in this time, so that all features are lengths
SHRINKAGE = 1e-3  # share of the mean variance that every direction of a covariance gets, for samples too few to fill it


def foot_skate(toes: np.ndarray, fps: float = FPS) -> np.ndarray:
    """Skating (frames, n) in metres a second of toe joints (frames, n, 3) in world metres, NaN where a toe is over H.

    v (2 - 2^(h / H)), v the horizontal speed since the frame before, h the height over the floor, H SKATE_HEIGHT (Zhang
    et al. 2018, "Mode-adaptive neural networks for quadruped motion control"). A flat foot's toe joint lies TOE_HEIGHT
    up: there h is 0."""
    height = toes[..., 1] - TOE_HEIGHT
    weight = 2 - 2 ** np.clip(height / SKATE_HEIGHT, 0.0, 1.0)
    return np.where(height < SKATE_HEIGHT, horizontal_speed(toes, fps) * weight, np.nan)


def horizontal_speed(points: np.ndarray, fps: float = FPS) -> np.ndarray:
    """Speed over the floor (frames, ...) in metres a second of points (frames, ..., 3) since the frame before;
    NaN in the first."""
    return _since(np.linalg.norm(np.diff(points[..., [0, 2]], axis=0), axis=-1) * fps, 1)


def jerk(positions: np.ndarray, root_positions: np.ndarray, fps: float = FPS) -> np.ndarray:
    """Jerk (frames, joints) in metres a second cubed: length of the third difference of root-relative joint positions.

    positions (frames, joints, 3), root_positions (frames, 3) in world metres; the first three frames are NaN."""
    third = np.diff(positions - root_positions[:, None], 3, axis=0) * fps**3
    return _since(np.linalg.norm(third, axis=-1), 3)


def pose_and_velocity(features: np.ndarray) -> np.ndarray:
    """What the Frechet distance compares (frames, 129), in metres: root-relative joint positions, joint velocities, and
    the root's velocity and turn (times VELOCITY_SECONDS), from motion features (frames, 21, 15) of
    sim.motion.features."""
    frames = len(features)
    return np.concatenate(
        [
            features[..., LAYOUT["position"]].reshape(frames, -1),
            features[..., LAYOUT["velocity"]].reshape(frames, -1) * VELOCITY_SECONDS,
            features[:, 0, LAYOUT["root"]] * VELOCITY_SECONDS,
        ],
        axis=1,
    )


def frechet_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Frechet distance of the Gaussians fitted to samples (n, d) and (m, d), squared as is the custom (Heusel et al.
    2017, Eq. 6): |mean a - mean b|^2 + tr(A + B - 2 (A B)^(1/2)); 0 for equal samples.

    Covariances are shrunk a little towards a ball, which keeps the root real and stable for few samples."""
    (mean_a, cov_a), (mean_b, cov_b) = _gaussian(a), _gaussian(b)
    values, vectors = np.linalg.eigh(cov_a)
    root_a = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    # tr (A B)^(1/2) by the eigenvalues of the symmetric A^(1/2) B A^(1/2), which are those of A B
    shared = np.sqrt(np.maximum(np.linalg.eigvalsh(root_a @ cov_b @ root_a), 0.0)).sum()
    return float(np.sum((mean_a - mean_b) ** 2) + np.trace(cov_a) + np.trace(cov_b) - 2 * shared)


def _gaussian(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean (d,) and shrunk covariance (d, d)."""
    covariance = np.atleast_2d(np.cov(samples, rowvar=False))
    size = len(covariance)
    ball = np.trace(covariance) / size * np.eye(size)
    return samples.mean(axis=0), (1 - SHRINKAGE) * covariance + SHRINKAGE * ball


def _since(values: np.ndarray, frames: int) -> np.ndarray:
    """Differences that look back over so many frames, led by NaN to the motion's own length."""
    return np.concatenate([np.full((frames, *values.shape[1:]), np.nan), values])
