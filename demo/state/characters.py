"""The user's own character, kept for the next start: a copy in the user's folder, and one file that names it."""

import json
from pathlib import Path

from sim.character.character import Character, load_character
from sim.character.glb import encode_still
from sim.io.atomic_write import atomic_write
from sim.io.gltf_file import ENDINGS, GltfFile
from sim.io.text_files import read_json
from sim.io.user_dirs import data_folder
from sim.retarget import joint_names

FIGURE = "figure"  # the built-in one, where a character is named
FORMAT = "patchwalk-character"


def is_character(path: Path) -> bool:
    """Whether a file holds a skinned mesh, as characters do; a motion holds a skeleton alone."""
    if path.suffix.lower() not in ENDINGS:
        return False
    try:
        return path.suffix.lower() == ".vrm" or any("skin" in node and "mesh" in node for node in GltfFile(path).nodes)
    except Exception:  # whoever reads it says what is wrong with it
        return False


def keep(character: Character, name_map: dict[str, str] | None = None) -> None:
    """Copies the character into the user's folder, whence `kept` reads it again. Raises OSError."""
    folder, name = _folder(), f"{character.name}.glb"
    folder.mkdir(parents=True, exist_ok=True)
    if character.path.resolve() != (folder / name).resolve():
        with atomic_write(folder / name) as temporary:
            temporary.write_bytes(encode_still(character.file))
    content = {"format": FORMAT, "version": 1, "file": name, "map": name_map}
    with atomic_write(_record()) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def kept() -> Character | None:
    """The character that was kept, None where there is none. Raises OSError, or ValueError saying what to do."""
    record = _record()
    if not record.exists():
        return None
    remedy = "drop it on the window again, or start once with --character figure"
    try:
        content = read_json(record)
        if not isinstance(content, dict) or content.get("format") != FORMAT or not isinstance(content.get("file"), str):
            raise ValueError(f"{record} names no character")
        name, name_map = Path(content["file"]).name, content.get("map")
        if name_map is not None:
            joint_names.check(name_map, record)
        return load_character(_folder() / name, name_map)
    except OSError as error:
        raise ValueError(f"{error.filename or record}: {error.strerror}; {remedy}") from None
    except ValueError as error:
        raise ValueError(f"{error}; {remedy}") from None


def forget() -> None:
    """The next start shows the figure; the copies stay."""
    _record().unlink(missing_ok=True)


def _folder() -> Path:
    return data_folder() / "characters"


def _record() -> Path:
    return data_folder() / "character.json"
