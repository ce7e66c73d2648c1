"""Files of named arrays with a header of texts (safetensors): weights, styles and codes are read and written here."""

import hashlib
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator, Mapping

import numpy as np
from safetensors import safe_open
from safetensors.numpy import save

from sim.io.atomic_write import atomic_write
from sim.io.bvh_parser import shorten
from sim.io.checks import check_finite

Arrays = dict[str, np.ndarray]


MOST_LAYERS = 64  # of a network
REINSTALL = "reinstall Patchwalk"


def read(path: Path, may_be_nan: tuple[str, ...] = (), remedy: str = REINSTALL) -> tuple[dict[str, str], Arrays]:
    """Header and arrays. may_be_nan: names of arrays in which NaN says that there is no number; remedy: what to do with
    a file that is damaged.

    Raises ValueError, in one sentence, for a missing or damaged file, and for one with numbers that are not finite."""
    try:
        with safe_open(path, "np") as file:
            header, arrays = file.metadata() or {}, {key: file.get_tensor(key) for key in file.keys()}
    except Exception as error:  # safetensors raises its own kinds for a damaged file
        raise ValueError(_unreadable(path, error, remedy)) from error
    check_finite(path, *(array for name, array in arrays.items() if name not in may_be_nan))
    return header, arrays


def read_header(path: Path, remedy: str = REINSTALL) -> dict[str, str]:
    """The header alone, without reading any array. Raises ValueError as `read` does."""
    try:
        with safe_open(path, "np") as file:
            return file.metadata() or {}
    except Exception as error:  # as above
        raise ValueError(_unreadable(path, error, remedy)) from error


def write(path: Path, arrays: Mapping[str, np.ndarray], header: Mapping[str, str]) -> None:
    """Writes a file whole or not at all, with the folders above it. Raises OSError where it cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as temporary:
        temporary.write_bytes(save({key: np.ascontiguousarray(array) for key, array in arrays.items()}, dict(header)))


def check_header(path: Path, header: Mapping[str, str], wanted: Mapping[str, str], remedy: str) -> None:
    """Raises ValueError, ending with the remedy, where a file was made for something else than what is wanted."""
    for key, value in wanted.items():
        if header.get(key) != value:
            found = shorten(str(header.get(key)))
            raise ValueError(f"{path} was made for {key} '{found}', this version needs '{value}': {remedy}")


def check_settings(settings: Any, arrays: Mapping[str, Any]) -> None:
    """Raises ValueError where a whole number among a network's settings is larger than any axis of its arrays: damaged
    ones could ask for any amount of memory."""
    largest = max(
        (max(array.shape) for array in arrays.values() if 0 not in array.shape and len(array.shape)), default=0
    )
    open_values = [settings]
    while open_values:
        value = open_values.pop()
        if isinstance(value, dict):
            open_values += value.values()
        elif isinstance(value, list | tuple):
            if len(value) > MOST_LAYERS and not isinstance(value[0], str):
                raise ValueError(f"there are {len(value)} layers")
            open_values += value
        elif isinstance(value, int) and value > largest:
            raise ValueError(f"a size of {value} is larger than what the file holds")


@contextmanager
def understanding(path: Path, remedy: str) -> Iterator[None]:
    """Turns whatever fails while the block makes sense of a file's header and arrays into a ValueError that names the
    file and ends with the remedy."""
    try:
        yield
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RuntimeError) as error:
        if isinstance(error, ValueError) and str(path) in str(error):
            raise
        raise ValueError(f"{path} is damaged, or of another version of Patchwalk: {remedy}") from error


def fingerprint(path: Path) -> str:
    """Sixteen hexadecimal digits of the file's SHA-256, by which what was computed from it is known to belong to it."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def _unreadable(path: Path, error: Exception, remedy: str) -> str:
    return f"{path} is not a readable safetensors file ({error}): {remedy}"
