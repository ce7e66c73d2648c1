"""What is checked before anything is written or believed, and how names stand in a sentence."""

from pathlib import Path
from typing import Iterable

import numpy as np

from sim.io.bvh_parser import shorten

NAMES_SHOWN = 3  # of a list in a sentence, unless told otherwise


def check_finite(path: str | Path, *arrays: np.ndarray) -> None:
    """Raises ValueError, naming the file, where numbers that it holds or is to hold are not finite."""
    if not all(np.isfinite(array).all() for array in arrays if array.dtype.kind == "f"):
        raise ValueError(f"{path}: some of its numbers are not finite")


def count_names(names: Iterable[str], most: int = NAMES_SHOWN) -> str:
    """Names as a sentence holds them: the first of them, at most so many, and how many more there are."""
    names = list(names)
    return ", ".join(map(shorten, names[:most])) + f" and {len(names) - most} more" * (len(names) > most)
