"""Grounds that are made by rule: hills, stairs, rough ground. Each is one tile that repeats without a seam."""

import numpy as np

from sim.ground.ground import Ground, rest_on_origin
from sim.math.easing import smooth_step

CELL = 0.05  # metres
CELLS = 1024  # of a tile's side, 51 m
STEEPEST = np.tan(np.radians(25))  # of hills, metres in a metre
HILL_LENGTHS = (6.0, 14.0)  # metres from crest to crest
ROUGH_LENGTHS, ROUGH_HEIGHT = (0.7, 2.0), 0.05  # metres: from bump to bump, and their deviation
WAVES = 24  # that hills and rough ground are made of
LEVEL_START = (1.0, 3.0)  # metres from the origin: level before, as it comes after
RISE, TREAD = 0.18, 0.30  # metres, of a step of stairs
STEPS = 8  # of a flight
LANDING = 2.5  # metres between flights
FLIGHT_WIDTH = 6.4  # metres, after which what is beside begins: stairs of a lower rise, then a ramp
LOWER_RISE = 0.85  # of their rise and of the ramp's, as a share of the steepest


def make_hills(random: np.random.Generator, steepest: float = STEEPEST) -> Ground:
    """Long swells no steeper than `steepest` metres in a metre."""
    heights = _sum_waves(random, HILL_LENGTHS)
    slope = np.hypot(*np.gradient(heights, CELL))
    return _with_level_start(heights * (steepest / slope.max()))


def make_rough(random: np.random.Generator, deviation: float = ROUGH_HEIGHT) -> Ground:
    """Bumps and hollows of a stride's length and less; deviation: of their heights, in metres."""
    heights = _sum_waves(random, ROUGH_LENGTHS)
    return _with_level_start(heights * (deviation / heights.std()))


def make_stairs(random: np.random.Generator, rise: float = RISE, tread: float = TREAD) -> Ground:
    """Flights of STEPS up and down along z with landings between, beside them others with a lower rise and a ramp of
    that slope; rise, tread: metres of a step of the steepest."""
    tile = CELLS * CELL
    x, z = (np.arange(CELLS) - CELLS // 2) * CELL + random.uniform(0, 1e-6), (np.arange(CELLS) - CELLS // 2) * CELL
    period = tile / max(1, round(tile / (2 * (LANDING + STEPS * tread))))
    run = (period - 2 * LANDING) / 2  # of a flight
    place = (z - LANDING / 2) % period  # the origin lies in the middle of a landing
    climbed = STEPS * (np.clip(place / run, 0, 1) - np.clip((place - run - LANDING) / run, 0, 1))
    lanes = np.floor((x + FLIGHT_WIDTH / 2) / FLIGHT_WIDTH).astype(int) % 3
    kinds = np.stack([rise * np.ceil(climbed), LOWER_RISE * rise * np.ceil(climbed), LOWER_RISE * rise * climbed])
    return rest_on_origin(Ground(kinds[lanes].T.astype(np.float32), CELL))


def _sum_waves(random: np.random.Generator, lengths: tuple[float, float]) -> np.ndarray:
    """Heights (CELLS, CELLS) of plane waves in all directions, of deviation 1 about; each fits the tile whole times."""
    tile = CELLS * CELL
    angles = random.uniform(0, 2 * np.pi, WAVES)
    counts = tile / random.uniform(*lengths, WAVES)
    counts = np.round(counts[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1))  # along x and z
    place = 2 * np.pi * np.arange(CELLS) / CELLS
    waves_x, waves_z = (np.exp(1j * counts[:, axis, None] * place) for axis in (0, 1))
    waves_x = waves_x * np.exp(1j * random.uniform(0, 2 * np.pi, WAVES))[:, None]
    return np.einsum("wz,wx->zx", waves_z, waves_x).real / np.sqrt(WAVES / 2)


def _with_level_start(heights: np.ndarray) -> Ground:
    """The ground of these heights, levelled around the origin."""
    place = (np.arange(CELLS) - CELLS // 2) * CELL
    away = np.hypot(place, place[:, None])
    middle = heights[CELLS // 2, CELLS // 2]
    return rest_on_origin(Ground(((heights - middle) * smooth_step(away, *LEVEL_START)).astype(np.float32), CELL))
