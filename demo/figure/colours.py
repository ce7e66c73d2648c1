"""Colours: a stable one for each style name, a neutral one for a part's own style, and those of the scene."""

import zlib
from functools import lru_cache
from typing import Mapping

import numpy as np

from demo.figure.palette import BUNDLED, OTHERS
from sim.body.skeleton import PART_NAMES
from sim.session import Frame
from sim.style_spec import PartSpec, StyleSpec

OWN_STYLE = (0.545, 0.62, 0.69)  # grey-blue, of every part that keeps its own style
TWIN = (0.74, 0.76, 0.78)  # the neutral twin
GHOST = (0.30, 0.42, 0.62)  # the neutral twin seen through
PAST = (0.42, 0.36, 0.62)  # the last half second
PATHS = {"walked": (0.42, 0.46, 0.52), "asked": (0.97, 0.60, 0.16), "predicted": (0.10, 0.55, 0.62)}  # on the ground
BONES = (0.10, 0.12, 0.16)


@lru_cache(maxsize=None)
def style_colour(name: str) -> tuple[float, float, float]:
    """The colour of a style, from its name alone: display red, green, blue in 0..1."""
    code = BUNDLED.get(name) or OTHERS[zlib.crc32(name.encode()) % len(OTHERS)]
    red, green, blue = (channel / 255 for channel in bytes.fromhex(code))
    return red, green, blue


def oklch(lightness: float, chroma: float, hue: float) -> tuple[float, float, float]:
    """Display colour of an OKLCH triple (Ottosson 2020): equal lightness looks equally light whatever the hue."""
    a, b = chroma * np.cos(hue), chroma * np.sin(hue)
    cones = (
        np.array(
            [
                lightness + 0.3963377774 * a + 0.2158037573 * b,
                lightness - 0.1055613458 * a - 0.0638541728 * b,
                lightness - 0.0894841775 * a - 1.2914855480 * b,
            ]
        )
        ** 3
    )
    linear = (
        np.array(
            [
                [4.0767416621, -3.3077115913, 0.2309699292],
                [-1.2684380046, 2.6097574011, -0.3413193965],
                [-0.0041960863, -0.7034186147, 1.7076147010],
            ]
        )
        @ cones
    )
    red, green, blue = (float(channel) for channel in np.clip(linear, 0, 1) ** (1 / 2.2))
    return red, green, blue


def worn(frame: Frame) -> StyleSpec:
    """What the one character of a frame is asked to wear."""
    style = frame.command.style
    assert not isinstance(style, list)
    return style


def part_colours(style: StyleSpec) -> np.ndarray:
    """(5, 3) colours of the body parts, in the order of PART_NAMES: neutral to the style's as strength grows to 1."""
    colours = np.tile(OWN_STYLE, (len(PART_NAMES), 1))
    for part, spec in style.items():
        row = PART_NAMES.index(part)
        colours[row] += (spec_colour(spec) - colours[row]) * min(spec.strength, 1.0)
    return colours


def spec_colour(spec: PartSpec) -> np.ndarray:
    """(3,) the colour of a style, or the mixture of two styles' in the shares in which they are blended."""
    first, other = (np.array(style_colour(name)) for name in (spec.names[0], spec.names[-1]))
    return first + (other - first) * spec.share


def brighten(colours: np.ndarray, glow: Mapping[str, float]) -> np.ndarray:
    """(5, 3) colours with some parts nearer to white: part name -> 0..1."""
    amounts = np.array([glow.get(part, 0.0) for part in PART_NAMES])[:, None]
    return colours + 0.7 * amounts * (1.0 - colours)
