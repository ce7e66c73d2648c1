"""Files of named arrays with a header of texts (safetensors): weights, styles and codes are read and written here."""

import hashlib
from pathlib import Path
from typing import Mapping

import numpy as np
from safetensors import safe_open
from safetensors.numpy import save

from sim.io.atomic_write import atomic_write

Arrays = dict[str, np.ndarray]


def read(path: Path) -> tuple[dict[str, str], Arrays]:
    """Header and arrays. Raises ValueError, in one sentence, for a missing or damaged file."""
    try:
        with safe_open(path, "np") as file:
            return file.metadata() or {}, {key: file.get_tensor(key) for key in file.keys()}
    except Exception as error:  # safetensors raises its own kinds for a damaged file
        raise ValueError(_unreadable(path, error)) from error


def read_header(path: Path) -> dict[str, str]:
    """The header alone, without reading any array. Raises ValueError as `read` does."""
    try:
        with safe_open(path, "np") as file:
            return file.metadata() or {}
    except Exception as error:  # as above
        raise ValueError(_unreadable(path, error)) from error


def write(path: Path, arrays: Mapping[str, np.ndarray], header: Mapping[str, str]) -> None:
    """Writes a file whole or not at all, with the folders above it. Raises OSError where it cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as temporary:
        temporary.write_bytes(save({key: np.ascontiguousarray(array) for key, array in arrays.items()}, dict(header)))


def check_header(path: Path, header: Mapping[str, str], wanted: Mapping[str, str], remedy: str) -> None:
    """Raises ValueError, ending with the remedy, where a file was made for something else than what is wanted."""
    for key, value in wanted.items():
        if header.get(key) != value:
            raise ValueError(f"{path} was made for {key} '{header.get(key)}', this version needs '{value}': {remedy}")


def fingerprint(path: Path) -> str:
    """Sixteen hexadecimal digits of the file's SHA-256, by which what was computed from it is known to belong to it."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def _unreadable(path: Path, error: Exception) -> str:
    return f"{path} is not a readable safetensors file ({error}): reinstall Patchwalk"
