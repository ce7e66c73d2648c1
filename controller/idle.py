"""Standing alive: the breath and slow weight shifts of a captured idle, as a few harmonics laid on the standing pose.

A network that is fed its own pose comes to rest while nothing is asked of it; people do not."""

import numpy as np

from controller.layout import GAITS, INPUT, INPUT_SLICES, OFFSETS, OUTPUT_SLICES
from sim import rotations as rot
from sim.clip import FPS
from sim.skeleton import INDEX, JOINT_COUNT
from sim.springs import spring_step

SECONDS = 10  # length of the loop
HARMONICS = 8  # of it, so nothing quicker than 0.8 Hz
QUIET = 0.03  # metres of deviation of the hands over which an idle is a gesture
EASE_HALFLIFE = 0.4  # seconds
ROWS = JOINT_COUNT + 1  # a rotation vector a joint, and last the hips' shift in metres; all in the root frame
SHAPE = (2, HARMONICS, ROWS, 3)  # cosine and sine amplitudes
DT = 1 / FPS


def fit(inputs: np.ndarray, targets: np.ndarray, clip: np.ndarray) -> np.ndarray:
    """Amplitudes (SHAPE) of the quiet standing stretch whose hips sway most; zeros where no clip stands that long.

    inputs (N, INPUT_SIZE), targets (N, OUTPUT_SIZE), clip (N,) as in controller.dataset.Frames."""
    length = SECONDS * FPS
    stand = inputs[:, INPUT_SLICES["trajectory_gaits"]].reshape(-1, *INPUT["trajectory_gaits"])
    standing = stand[:, OFFSETS.index(0), GAITS.index("stand")] > 0.99
    broken = np.cumsum(~standing | np.append(False, np.diff(clip) != 0))
    starts = np.flatnonzero(standing[:-length] & (broken[length:] == broken[:-length]))[::FPS // 10]
    positions = targets[:, OUTPUT_SLICES["positions"]].reshape(-1, JOINT_COUNT, 3)
    hands = [INDEX["LeftHand"], INDEX["RightHand"]]
    root = slice(OUTPUT_SLICES["root"].start, OUTPUT_SLICES["root"].start + 2)
    best, most = np.zeros(SHAPE), 0.0
    for start in starts:
        stretch = positions[start:start + length]
        # The smoothed root takes part in a weight shift; here it must stand, or the feet would move instead.
        hips = stretch[:, 0] + np.insert(np.cumsum(targets[start:start + length, root], axis=0), 1, 0.0, axis=1)
        sway = np.linalg.norm(hips.std(axis=0))
        if np.linalg.norm(stretch[:, hands].std(axis=0), axis=-1).max() < QUIET and sway > most:
            axes = targets[start:start + length, OUTPUT_SLICES["rotations"]].reshape(length, JOINT_COUNT, 6)
            best, most = _harmonics(rot.from_6d(axes.astype(float)), hips.astype(float)), sway
    return best


def _harmonics(rotations: np.ndarray, hips: np.ndarray) -> np.ndarray:
    """Fourier amplitudes (SHAPE) of rotations (frames, 21, 4) and hips (frames, 3) about their mean, any drift taken out."""
    rows = np.empty((len(hips), ROWS, 3))
    for joint in range(JOINT_COUNT):
        turns = rot.to_scipy(rotations[:, joint])
        rows[:, joint] = (turns * turns.mean().inv()).as_rotvec()
    rows[:, JOINT_COUNT] = hips
    time = np.linspace(-0.5, 0.5, len(rows))
    rows = rows - rows.mean(axis=0) - time[:, None, None] * np.tensordot(time, rows, 1) / np.sum(time**2)
    spectrum = 2 * np.fft.rfft(rows, axis=0)[1:HARMONICS + 1] / len(rows)
    return np.stack([spectrum.real, -spectrum.imag])


class Idle:
    """Plays the loop while the character stands and eases it in and out."""

    def __init__(self, amplitudes: np.ndarray) -> None:
        self.amplitudes = amplitudes.reshape(2 * HARMONICS, ROWS, 3)
        self.frame, self.share, self.rate = 0, 0.0, 0.0

    def step(self, standing: float) -> tuple[np.ndarray, np.ndarray]:
        """Turns (21, 4) to put before the joints' rotations and the hips' shift (3,); standing 0..1."""
        self.frame += 1
        self.share, self.rate = spring_step(self.share, self.rate, standing, EASE_HALFLIFE, DT)
        angle = 2 * np.pi * np.arange(1, HARMONICS + 1) * (self.frame * DT / SECONDS)
        rows = self.share * np.tensordot(np.concatenate([np.cos(angle), np.sin(angle)]), self.amplitudes, 1)
        return rot.from_rotation_vector(rows[:JOINT_COUNT]), rows[JOINT_COUNT]
