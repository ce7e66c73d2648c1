"""Which weight files of the stylizer there are, and of which system each is: told without loading torch."""

import json
import re
from pathlib import Path
from typing import Any, Mapping

from sim.io import tensor_file
from sim.io.bvh_parser import shorten
from sim.io.provenance import NONCOMMERCIAL, SHIPPED, allowed, noncommercial
from stylizer.systems.registry import SYSTEMS, System

FOLDER = Path(__file__).parents[1] / "weights"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,79}")  # of a weight file: never a path


def system(name: str = SHIPPED, folder: Path | None = None) -> System:
    """The system of a weight file. Raises ValueError where the file is missing or of an unknown system."""
    path = find(name, folder)
    return system_of(path, tensor_file.read_header(path))


def system_of(path: Path, header: Mapping[str, str]) -> System:
    """The system of a weight file with this header. Raises ValueError for an unknown one."""
    if header.get("model") not in SYSTEMS:
        found = shorten(str(header.get("model")))
        raise ValueError(f"{path} was made for model '{found}', not one of {', '.join(SYSTEMS)}: train again")
    return SYSTEMS[header["model"]]


def config_of(name: str) -> dict[str, Any]:
    """The settings of a network, as its file has them. Raises ValueError for a damaged file."""
    path = find(name, None)
    with tensor_file.understanding(path, tensor_file.REINSTALL):
        return dict(json.loads(tensor_file.read_header(path)["config"]))


def names() -> tuple[str, ...]:
    """The networks whose weights come with this package, SHIPPED first."""
    found = sorted({path.stem for folder in allowed(FOLDER) for path in folder.glob("*.safetensors")})
    return tuple(sorted(found, key=lambda name: name != SHIPPED))


def find(name: str, folder: Path | None) -> Path:
    """A weight file of the package, or of a folder. Raises ValueError where there is none of that name."""
    if not NAME.fullmatch(name):
        raise ValueError(f"'{shorten(name)}' is no name of a stylizer: there are {', '.join(names())}")
    file = f"{name}.safetensors"
    path = next((each / file for each in allowed(folder or FOLDER) if (each / file).exists()), None)
    if path:
        return path
    if (noncommercial(folder or FOLDER) / file).exists():
        raise ValueError(f"the stylizer '{name}' is for {NONCOMMERCIAL} use: start without --permissive to use it")
    there = ", ".join(names())
    raise ValueError(
        f"no stylizer weights at {(folder or FOLDER) / file}: reinstall Patchwalk or run 'patchwalk train stylizer'"
        + f"; there are {there}" * bool(there)
    )
