"""The grounds by name, and those that a picture holds."""

import warnings
from functools import cache
from pathlib import Path
from typing import Callable

import numpy as np

from sim.ground.ground import Ground, rest_on_origin
from sim.ground.terrains import make_hills, make_rough, make_stairs

FLAT = "flat"
SEED = 1  # of the named grounds, which look alike on every machine
MAKERS: dict[str, Callable[[np.random.Generator], Ground]] = {
    "hills": make_hills,
    "stairs": make_stairs,
    "rough": make_rough,
}
NAMES = (FLAT, *MAKERS)
PICTURE_CELL = 0.1  # metres a pixel of a height map
PICTURE_HEIGHT = 5.0  # metres from black to white
LARGEST = 4096  # pixels a side


def load_ground(name: str | None) -> Ground | None:
    """The ground of a name of NAMES, or of a picture's path; None is level floor.

    A picture's grey says the height, black 0 m to white PICTURE_HEIGHT; a pixel is PICTURE_CELL wide, its top lies to
    the north, away from who faces the viewer (-z), and the middle is where the character starts. Raises ValueError for
    an unknown name or a file that is no picture, OSError for one that cannot be read."""
    if name is None or name == FLAT:
        return None
    if not isinstance(name, str):
        raise ValueError(f"a ground is a name, and {name!r:.60} is none")
    if name in MAKERS:
        return _make(name)
    if Path(name).suffix.lower() != ".png":
        raise ValueError(f"unknown ground {name!r:.60}: use one of {', '.join(NAMES)}, or a height map FILE.png")
    return _read_picture(Path(name))


@cache
def _make(name: str) -> Ground:
    return MAKERS[name](np.random.default_rng(SEED))


def _read_picture(path: Path) -> Ground:
    from PIL import Image, UnidentifiedImageError  # only who walks on a picture needs it

    try:
        with warnings.catch_warnings(), Image.open(path) as picture:
            warnings.simplefilter("ignore")  # what Pillow says of palettes and sizes is said below, or does not matter
            if max(picture.size) > LARGEST or min(picture.size) < 2:
                raise ValueError(f"{path}: a height map is 2 to {LARGEST} pixels wide and high, this is {picture.size}")
            deep = picture.mode.startswith("I")
            grey = np.asarray(picture if deep else picture.convert("L"), float)
    except Image.DecompressionBombError:
        raise ValueError(f"{path}: a height map is 2 to {LARGEST} pixels wide and high, this is larger") from None
    except (UnidentifiedImageError, SyntaxError, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise
        raise ValueError(f"{path}: this is no picture that can be read; save the height map as a grey PNG") from None
    heights = (grey / (65535 if deep else 255) * PICTURE_HEIGHT).astype(np.float32)
    return rest_on_origin(Ground(heights, PICTURE_CELL, tiled=False, name=path.name))
