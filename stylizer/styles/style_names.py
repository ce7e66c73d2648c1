"""Which styles there are, told by their files alone: no network is loaded, nor torch, so it is answered at once."""

import json
import re
import unicodedata
from difflib import get_close_matches
from pathlib import Path
from typing import Iterable, Iterator, NamedTuple

from sim.io import tensor_file
from sim.io.bvh_parser import shorten
from sim.io.motion_file import is_motion
from sim.io.provenance import NONCOMMERCIAL, allowed, noncommercial
from sim.io.user_dirs import data_folder
from stylizer.styles.clip_table import CLIPS, licence_of
from stylizer.systems import weight_files
from stylizer.systems.registry import System

BUNDLED = Path(__file__).parents[1] / "styles"  # a folder for each network that takes styles by part
CODES = "codes"  # in a folder of styles: one file a whole-body network, all its codes in it
POINTS = "key_points"  # in the user's folder: styles read from video
SAMPLED = "drawn"  # what the names of styles drawn by chance begin with
NAME_LENGTH = 40
NAME = re.compile(rf"[A-Za-z0-9][A-Za-z0-9_-]{{0,{NAME_LENGTH - 1}}}")
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
    """Name -> file of the styles that have one: the user's own, and those of a network whose styles are files."""
    folders = [*(folder / network for folder in allowed(BUNDLED)), user_folder()]
    if weight_files.system(network).reads_key_points:
        folders.append(user_folder() / POINTS)
    paths = [path for folder in folders for path in folder.glob("*.safetensors")]
    return {path.stem: path for path in sorted(paths, key=lambda path: path.stem)}


def codes_file(network: str, bundled: Path) -> Path:
    """Where the codes of all styles of a whole-body network lie, in a folder of styles."""
    paths = [folder / CODES / f"{network}.safetensors" for folder in allowed(bundled)]
    return next((path for path in paths if path.exists()), paths[0])


def sampled_styles(system: System, labels: Iterable[str], labelled: bool = True) -> dict[str, str | None]:
    """Name -> label of the styles that a system draws by chance; one that knows no labels has one."""
    if not system.samples_styles:
        return {}
    return {f"{SAMPLED}-{label.replace(' ', '-')}": label for label in labels if labelled} or {SAMPLED: None}


def style_entries(network: str) -> Iterator[StyleEntry | str]:
    """Each style of a network, by name; for a file that cannot be read a sentence that says so. Raises ValueError for
    an unknown network."""
    entries: dict[str, StyleEntry | str] = {}
    if not has_own_files(network):
        entries |= {entry.name: entry for entry in _entries_of_codes(network)}
    for name, path in style_files(network).items():
        try:
            with tensor_file.understanding(path, f"`patchwalk styles remove {name}` removes it"):
                header = tensor_file.read_header(path, "add the style again")
                movements = () if path.parent.name == POINTS else tuple(json.loads(header.get("movements", "[]")))
                entries[name] = StyleEntry(name, movements, NONCOMMERCIAL in header["licence"])
        except ValueError as error:
            entries[name] = str(error)
    yield from (entries[name] for name in sorted(entries))


def _entries_of_codes(network: str) -> Iterator[StyleEntry]:
    """The styles whose codes lie in one file, and those that the network draws by chance."""
    system, settings = weight_files.system(network), weight_files.config_of(network)
    path = codes_file(network, BUNDLED)
    with tensor_file.understanding(path, tensor_file.REINSTALL):
        for name, movements in json.loads(tensor_file.read_header(path)["movements"]).items():
            licence = licence_of(CLIPS[name]) if name in CLIPS else ""
            yield StyleEntry(name, tuple(movements), NONCOMMERCIAL in licence)
    for name in sampled_styles(system, settings.get("labels", ()), settings.get("labelled", True)):
        yield StyleEntry(name, (), False)


def known_names(network: str) -> set[str]:
    """The names of all styles of a network, told by its files. Raises ValueError for an unknown network."""
    coded = () if has_own_files(network) else _entries_of_codes(network)
    return {*style_files(network), *(entry.name for entry in coded)}


def check_known(names: Iterable[str], network: str) -> None:
    """Raises ValueError for an unknown network and for the first name that is neither one of its styles nor a clip's
    file, before anything is loaded."""
    known = known_names(network)
    for name in names:
        if name not in known and not is_clip(name):
            raise unknown_style(name, known, BUNDLED / network)


def check_name(name: str) -> None:
    """Raises ValueError for what cannot be the name of a style."""
    if not NAME.fullmatch(name):
        raise ValueError(f"'{shorten(name)}' is no style name: use up to 40 letters, digits, - and _, not - or _ first")
    if is_reserved(name):
        raise ValueError(f"'{name}' cannot be a style's name: it is kept for something else; choose another")


def check_free(name: str, known: Iterable[str]) -> None:
    """Raises ValueError for a name that one of the known styles has; not every file system tells cases apart."""
    if name.lower() in map(str.lower, known):
        raise ValueError(f"there is a style '{name}' already: choose another name, or remove that one first")


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
