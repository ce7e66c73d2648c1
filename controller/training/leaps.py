"""Leaps in captured clips: when they are in the air."""

import numpy as np

from controller.model.gait_phase import GRAVITY
from sim.body.skeleton import CONTACT_JOINTS
from sim.motion.clip import FPS

FLIGHT_FEET = 0.06  # metres over the floor, of the lowest joint of the feet, that a flight reaches
LIFTED_FEET = 0.035  # metres: where it begins and ends
FLIGHT_SECONDS = (0.25, 0.75)  # between which a leap over level floor lasts
FALLING = (0.6, 1.4)  # share of GRAVITY between which hips fall that are free


def find_flights(positions: np.ndarray) -> list[tuple[int, int]]:
    """The first and the last frame of each leap over level floor, in joint positions (frames, 21, 3): both feet leave
    it and the hips fall freely."""
    low = positions[:, CONTACT_JOINTS, 1].min(axis=1)
    found = []
    lifted = np.flatnonzero(np.diff(np.concatenate([[0], low > LIFTED_FEET, [0]])))
    for start, stop in zip(lifted[::2], lifted[1::2]):
        seconds = (stop - start) / FPS
        if not FLIGHT_SECONDS[0] < seconds < FLIGHT_SECONDS[1] or low[start:stop].max() < FLIGHT_FEET:
            continue
        height = positions[start:stop, 0, 1]
        fall = -2 * np.polyfit(np.arange(len(height)) / FPS, height, 2)[0] / GRAVITY
        if FALLING[0] < fall < FALLING[1] and start > 0 and stop < len(positions):
            found.append((int(start), int(stop)))
    return found
