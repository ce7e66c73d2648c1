"""Which styles there are, told by their files alone: no network is loaded, nor torch, so it is answered at once."""

import json
import unicodedata
from difflib import get_close_matches
from pathlib import Path
from typing import Iterable, Iterator, NamedTuple

from sim.io import tensor_file
from sim.io.bvh_parser import shorten
from sim.io.motion_file import is_motion
from sim.io.provenance import NONCOMMERCIAL, allowed, noncommercial
from sim.io.user_dirs import data_folder

BUNDLED = Path(__file__).parents[1] / "styles"  # a folder for each network that takes styles by part
POINTS = "key_points"  # in the user's folder: styles read from video
SAMPLED = "drawn"  # what the names of styles drawn by chance begin with
# Names that Windows keeps for devices, whatever ending follows.
DEVICES = {"CON", "PRN", "AUX", "NUL", *(f"{port}{number}" for port in ("COM", "LPT") for number in range(10))}


# Letters that are written as others where there are only those of ASCII, besides those that only lose an accent.
LETTERS = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "æ": "ae", "œ": "oe", "ø": "oe", "å": "aa", "ð": "d", "þ": "th"}
    | {"Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ẞ": "SS", "Æ": "Ae", "Œ": "Oe", "Ø": "Oe", "Å": "Aa", "Ð": "D", "Þ": "Th"}
    | {"ł": "l", "Ł": "L", "đ": "d", "Đ": "D", "ı": "i"}
)


class StyleEntry(NamedTuple):
    """A style by its file: the movements that it shows, and whether it is for non-commercial use only."""

    name: str
    movements: tuple[str, ...]
    noncommercial: bool


def user_folder() -> Path:
    """Where the user's own styles live."""
    return data_folder() / "styles"


def in_ascii(text: str) -> str:
    """A text with its accents and umlauts written out: `Müßig` as `Muessig`, `café` as `cafe`."""
    spelt = unicodedata.normalize("NFC", text).translate(LETTERS)
    return "".join(letter for letter in unicodedata.normalize("NFKD", spelt) if not unicodedata.combining(letter))


def is_reserved(name: str) -> bool:
    """Whether no file of the user's may have that name: it would be taken for a sampled style, or for a device."""
    return name.lower().startswith(SAMPLED) or name.upper() in DEVICES


def has_own_files(network: str) -> bool:
    """Whether a network's styles are files of their own, as those of Motion Puzzle are."""
    return any((folder / network).is_dir() for folder in allowed(BUNDLED))


def style_files(network: str) -> dict[str, Path]:
    """Name -> file of the styles of a network that has them, the user's own with them."""
    folders = [*(folder / network for folder in allowed(BUNDLED)), user_folder()]
    paths = [path for folder in folders for path in folder.glob("*.safetensors")]
    return {path.stem: path for path in sorted(paths, key=lambda path: path.stem)}


def style_entries(network: str) -> Iterator[StyleEntry | str]:
    """Each style of a network that has files of them; for a file that cannot be read a sentence that says so."""
    for name, path in style_files(network).items():
        try:
            with tensor_file.understanding(path, f"`patchwalk styles remove {name}` removes it"):
                header = tensor_file.read_header(path, "add the style again")
                yield StyleEntry(
                    name, tuple(json.loads(header.get("movements", "[]"))), NONCOMMERCIAL in header["licence"]
                )
        except ValueError as error:
            yield str(error)


def check_known(names: Iterable[str], network: str) -> None:
    """Raises ValueError for the first name that is neither a style of a network nor a clip's file, before anything is
    loaded; of a network whose styles are not files of their own nothing is said."""
    if not has_own_files(network):
        return
    known = style_files(network)
    for name in names:
        if name not in known and not is_clip(name):
            raise unknown_style(name, known, BUNDLED / network)


def is_clip(name: str) -> bool:
    """Whether what stands for a style is the path of a clip, and not a name."""
    return is_motion(name) or Path(name).exists()


def unknown_style(name: str, known: Iterable[str], folder: Path = BUNDLED) -> ValueError:
    """Says that there is no such style, and which ones are spelt like it. folder: of the bundled ones."""
    if (noncommercial(folder.parent) / folder.name / f"{shorten(name)}.safetensors").exists():
        return ValueError(f"the style '{name}' is for {NONCOMMERCIAL} use: start without --permissive to use it")
    near = get_close_matches(name, list(known), 3)
    hint = f"did you mean {' or '.join(near)}?" if near else "`patchwalk styles list` shows what there is"
    return ValueError(f"unknown style '{shorten(name)}': {hint}")


def remove(name: str, user: Path) -> bool:
    """Removes a style's file from the user's folder; False where there is none of that name."""
    paths = [path for path in (user / POINTS, user) for path in path.glob("*.safetensors") if path.stem == name]
    for path in paths[:1]:
        path.unlink()
    return bool(paths)
