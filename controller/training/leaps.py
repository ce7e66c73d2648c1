"""Leaps in captured clips: when they are in the air, and their gathering in the time that a game gives it."""

import numpy as np

from controller.model.gait_phase import GRAVITY
from sim.body.skeleton import CONTACT_JOINTS
from sim.motion.clip import FPS, Clip, root_frame

FLIGHT_FEET = 0.06  # metres over the floor, of the lowest joint of the feet, that a flight reaches
LIFTED_FEET = 0.035  # metres: where it begins and ends
FLIGHT_SECONDS = (0.25, 0.75)  # between which a leap over level floor lasts
FALLING = (0.6, 1.4)  # share of GRAVITY between which hips fall that are free
FROM_THE_SPOT = 0.5  # metres a second that the root has at most, in the mean, before a leap that is not run up to
# Seconds before the take-off in which the legs push, and of the gathering before that; how much quicker it is learned.
PUSH, GATHERING, QUICKER = 0.17, 0.8, 2.5
EASE = 0.04  # seconds (Gaussian sigma) over which the quicker time sets in


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


def quicken_gathering(clip: Clip, take_off: int) -> tuple[Clip, int]:
    """A 60 Hz clip with the gathering before a leap from the spot QUICKER times as fast, and the frame of its take-off
    in it; the clip itself where the leap is run up to.

    People squat for a second before they jump; a jump that was asked for leaves the floor after a third of that
    (JUMP_EDGES). Learned as captured, the body would stand upright when it should push. Still quicker, it would drop
    faster than it can fall."""
    gathering = slice(max(0, take_off - round(GATHERING * FPS)), max(1, take_off - round(GATHERING / 2 * FPS)))
    speed = np.linalg.norm(root_frame(clip.positions()).local_velocity(), axis=-1)
    if speed[gathering].mean() > FROM_THE_SPOT:
        return clip, take_off
    from scipy.ndimage import gaussian_filter1d

    push, quick = round(PUSH * FPS), round(GATHERING / QUICKER * FPS)
    rate = np.ones(take_off + 1)  # captured frames a frame, counted backwards from the take-off
    rate[push : push + quick] = QUICKER
    back = np.concatenate([[0.0], np.cumsum(gaussian_filter1d(rate, EASE * FPS))])
    earlier = take_off - back[1:][back[1:] <= take_off][::-1]
    at = np.concatenate([earlier, np.arange(take_off, len(clip))])
    return clip.sampled(at), len(earlier)
