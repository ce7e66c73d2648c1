"""Where a machine keeps what belongs to a user: one folder for data, one for what can be made again."""

import os
import sys
from pathlib import Path

# Environment variable that names the platform's folder, if it is set, and where it lies in the user's home otherwise.
_DATA = {"win32": ("APPDATA", ""), "darwin": ("", "Library/Application Support"), "": ("XDG_DATA_HOME", ".local/share")}
_CACHE = {"win32": ("LOCALAPPDATA", ""), "darwin": ("", "Library/Caches"), "": ("XDG_CACHE_HOME", ".cache")}


def data_folder() -> Path:
    """Styles, presets and key bindings: PATCHWALK_HOME, or `patchwalk` in the platform's folder for program data."""
    home = os.environ.get("PATCHWALK_HOME")
    return Path(home) if home else _platform(_DATA)


def cache_folder() -> Path:
    """What can be made again: PATCHWALK_HOME/cache, or `patchwalk` in the platform's folder for such files."""
    home = os.environ.get("PATCHWALK_HOME")
    return Path(home) / "cache" if home else _platform(_CACHE)


def _platform(places: dict[str, tuple[str, str]]) -> Path:
    variable, below_home = places.get(sys.platform, places[""])
    return Path(os.environ.get(variable) or Path.home() / below_home) / "patchwalk"
