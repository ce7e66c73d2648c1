"""Standing alive: the bearing, breath and slow weight shifts of a captured idle, laid on the standing pose.

A network that is fed its own pose comes to rest while nothing is asked of it, in whatever bearing it stopped; people do
not."""

import numpy as np

from controller.model.io_layout import GAITS, INPUT, INPUT_SLICES, OFFSETS, OUTPUT_SLICES
from sim.body.limb_ik import ARMS
from sim.body.skeleton import JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from sim.math import rotations as rot
from sim.math.springs import response, spring_step
from sim.motion.clip import FPS

SECONDS = 10  # length of the loop
HARMONICS = 8  # of it, so nothing quicker than 0.8 Hz
QUIET = 0.06  # metres of deviation of the hands over which an idle is a gesture
# How much more than the captured one it sways: an idle quiet enough to loop moves less than people who stand and wait.
LIVELIER = 1.45
EASE_HALFLIFE = 0.4  # seconds, for the sway
BEARING_HALFLIFE = 1.0  # seconds, for spine and arms to come to the captured bearing
LEVEL = 0.01  # metres that the ground of an idle rises or falls at most
NEGLIGIBLE = 1e-6  # a share this small is none
ROWS = JOINT_COUNT + 1  # a rotation vector a joint, and last the hips' shift in metres; all in the root frame
SHAPE = (1 + 2 * HARMONICS, ROWS, 3)  # the bearing, then cosine and sine amplitudes of the sway about it
UPPER = np.flatnonzero(PART_OF_JOINT >= PART_NAMES.index("spine"))[1:]  # without the hips, which the legs stand under
DT = 1 / FPS
EASE = np.stack([response(spring_step, halflife, DT) for halflife in (EASE_HALFLIFE, BEARING_HALFLIFE)])
TURNS = 2 * np.pi * np.arange(1, HARMONICS + 1)  # radians of each harmonic in a loop


def fit(inputs: np.ndarray, targets: np.ndarray, clip: np.ndarray) -> np.ndarray:
    """Bearing and sway (SHAPE) of the quiet standing stretch whose hips sway most; zeros where no clip stands that
    long.

    inputs (N, INPUT_SIZE), targets (N, OUTPUT_SIZE), clip (N,) as in controller.training.dataset.Frames."""
    length = SECONDS * FPS
    gaits = inputs[:, INPUT_SLICES["trajectory_gaits"]].reshape(-1, *INPUT["trajectory_gaits"])[:, OFFSETS.index(0)]
    level = np.ptp(inputs[:, INPUT_SLICES["trajectory_heights"]], axis=1) < LEVEL
    standing = level & (gaits[:, GAITS.index("stand")] - gaits[:, GAITS.index("crouch")] > 0.99)
    broken = np.cumsum(~standing | np.append(False, np.diff(clip) != 0))
    starts = np.flatnonzero(standing[:-length] & (broken[length:] == broken[:-length]))[:: FPS // 10]
    positions = targets[:, OUTPUT_SLICES["positions"]].reshape(-1, JOINT_COUNT, 3)
    root = slice(OUTPUT_SLICES["root"].start, OUTPUT_SLICES["root"].start + 2)
    best, most = np.zeros(SHAPE), 0.0
    for start in starts:
        stretch = positions[start : start + length]
        # The smoothed root takes part in a weight shift; here it must stand, or the feet would move instead.
        hips = stretch[:, 0] + np.insert(np.cumsum(targets[start : start + length, root], axis=0), 1, 0.0, axis=1)
        sway = float(np.linalg.norm(hips.std(axis=0)))
        if np.linalg.norm(stretch[:, ARMS[-1]].std(axis=0), axis=-1).max() < QUIET and sway > most:
            axes = targets[start : start + length, OUTPUT_SLICES["rotations"]].reshape(length, JOINT_COUNT, 6)
            best, most = _harmonics(rot.from_6d(axes.astype(float)), hips.astype(float)), sway
    return best


def _harmonics(rotations: np.ndarray, hips: np.ndarray) -> np.ndarray:
    """Mean of rotations (frames, 21, 4), and Fourier amplitudes of them and of hips (frames, 3) about their mean, any
    drift taken out (SHAPE)."""
    rows, bearing = np.empty((len(hips), ROWS, 3)), np.zeros((1, ROWS, 3))
    for joint in range(JOINT_COUNT):
        turns = rot.to_scipy(rotations[:, joint])
        bearing[0, joint] = turns.mean().as_rotvec()
        rows[:, joint] = (turns * turns.mean().inv()).as_rotvec()
    rows[:, JOINT_COUNT] = hips
    time = np.linspace(-0.5, 0.5, len(rows))
    rows = rows - rows.mean(axis=0) - time[:, None, None] * np.tensordot(time, rows, 1) / np.sum(time**2)
    spectrum = 2 * np.fft.rfft(rows, axis=0)[1 : HARMONICS + 1] / len(rows)
    return np.concatenate([bearing, spectrum.real, -spectrum.imag])


class Idle:
    """Plays the loop while the character stands and eases it in and out. Any leading axes, of a crowd."""

    STATE = "frame", "easing"

    def __init__(self, loop: np.ndarray) -> None:
        """loop: SHAPE, from `fit`; zeros lay nothing on."""
        self.bearing = rot.from_rotation_vector(loop[0, UPPER])
        self.amplitudes = LIVELIER * loop[1:].reshape(2 * HARMONICS, -1)
        self.captured = bool(loop.any())
        self.frame = np.zeros(())  # (...): a motion that is played at another rate breathes at that rate
        # (..., 2, 3, 1) of the sway and of the bearing: share, its rate, wanted share
        self.easing = np.zeros((2, 3, 1))

    def step(self, standing: np.ndarray, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (..., 21, 4) in the root frame with the idle laid on them, and the hips' shift (..., 3); standing
        (...) 0..1."""
        self.frame = self.frame + 1
        self.easing[..., 2, 0] = np.asarray(standing)[..., None]
        self.easing[..., :2, :] = EASE @ self.easing
        shares = self.easing[..., 0, :, None]  # (..., 2, 1, 1)
        if not self.captured or shares.max() < NEGLIGIBLE:
            return rotations, np.zeros(3)
        rotations = rotations.copy()
        rotations[..., UPPER, :] = rot.slerp(rotations[..., UPPER, :], self.bearing, shares[..., 1, :, :])
        angle = TURNS * (self.frame * DT / SECONDS)[..., None]
        wave = np.concatenate([np.cos(angle), np.sin(angle)], axis=-1) @ self.amplitudes
        rows = shares[..., 0, :, :] * wave.reshape(*wave.shape[:-1], ROWS, 3)
        return rot.multiply(rot.from_rotation_vector(rows[..., :JOINT_COUNT, :]), rotations), rows[..., JOINT_COUNT, :]
