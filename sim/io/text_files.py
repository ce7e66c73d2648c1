"""Text, JSON and TOML files of the user's, read whole: of a bounded size, and each failure in one sentence."""

import json
import tomllib
from pathlib import Path
from typing import Any, Callable

MEGABYTE = 1_000_000
SETTINGS_MEGABYTES = 16  # of a file of settings, of a joint map, of the key points of a video


def read_text(path: str | Path, megabytes: int = SETTINGS_MEGABYTES) -> str:
    """The text of a file, with or without a byte order mark; what is no UTF-8 becomes a question mark.

    Raises OSError where it cannot be read, ValueError where it is larger than so many megabytes."""
    with open(path, "rb") as file:
        data = file.read(megabytes * MEGABYTE + 1)
    if len(data) > megabytes * MEGABYTE:
        raise ValueError(f"{path} is larger than {megabytes} MB, the most that is read: give a smaller file")
    return data.decode("utf-8-sig", errors="replace")


def read_json(path: str | Path) -> Any:
    """What a JSON file holds. Raises OSError, or ValueError, in one sentence, for what is none."""
    return _parsed(path, "JSON", json.loads)


def read_toml(path: str | Path) -> dict[str, Any]:
    """What a TOML file holds. Raises OSError, or ValueError, in one sentence, for what is none."""
    return _parsed(path, "TOML", tomllib.loads)


def _parsed(path: str | Path, format: str, parse: Callable[[str], Any]) -> Any:
    text = read_text(path)
    try:
        return parse(text)
    except RecursionError:
        raise ValueError(f"{path} is not a {format} file that can be used: it is nested too deep") from None
    except ValueError as error:  # both parsers say the line; so many digits that it is no number say none
        raise ValueError(f"{path} is not a {format} file: {error}") from None
