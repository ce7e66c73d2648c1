"""The stylizer's weight files: safetensors, loaded by name, with a header that says what they are for."""

import hashlib
import json
from importlib import import_module
from pathlib import Path

import torch
from safetensors import safe_open
from safetensors.torch import save_file

from sim.body.skeleton import skeleton_hash
from sim.io.atomic_write import replacing
from sim.motion.features import LAYOUT_VERSION
from stylizer.networks.normalization import Scaled

FOLDER = Path(__file__).parents[1] / "weights"
# What a file's header calls its model -> the class, in a module that is imported when it is wanted.
MOTION_PUZZLE = "motion-puzzle"
KINDS = {
    MOTION_PUZZLE: ("motion_puzzle.model", "MotionPuzzle"),
    "unpaired": ("unpaired", "Unpaired"),
    "diverse": ("diverse", "Diverse"),
    "latent": ("latent", "Latent"),
}
VERSION = "1"
SLIM = "slim"  # the name of the shipped real-time network
STATISTICS = ("mean", "deviation")  # kept in float32


def save(model: Scaled, path: Path, **origin: str) -> None:
    """Writes weights as float16; `origin` says training data, licence, command and commit."""
    header = {**_expected(), "model": model.KIND, "config": json.dumps(model.settings()), **origin}
    tensors = {
        name: (value if name.rpartition(".")[2] in STATISTICS else value.half()).contiguous()
        for name, value in model.state_dict().items()
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        save_file(tensors, temporary, header)


def load(name: str = SLIM, folder: Path | None = None) -> tuple[Scaled, str]:
    """The network ready to run and the fingerprint of its weight file.

    Raises ValueError where the file is missing or made for something else."""
    path = _path(name, folder)
    header, tensors = read(path)
    for key, wanted in _expected().items():
        if header.get(key) != wanted:
            raise ValueError(f"{path} was made for {key} '{header.get(key)}', not '{wanted}': train again")
    if header.get("model") not in KINDS:
        raise ValueError(
            f"{path} was made for model '{header.get('model')}', not one of {', '.join(KINDS)}: train again"
        )
    module, kind = KINDS[header["model"]]
    kind = getattr(import_module(f"stylizer.systems.{module}"), kind)
    settings = json.loads(header["config"]).items()
    try:
        model = kind(kind.CONFIG(**{key: tuple(v) if isinstance(v, list) else v for key, v in settings}))
        model.load_state_dict({name: value.float() for name, value in tensors.items()})
    except (TypeError, RuntimeError) as error:  # a setting that there is no more, or layers that are others now
        raise ValueError(f"{path} holds a network of another version of Patchwalk: train again") from error
    return model.eval(), hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def kind(name: str, folder: Path | None = None) -> str:
    """Of KINDS, what a weight file holds. Raises ValueError where it is missing."""
    path = _path(name, folder)
    try:
        with safe_open(path, "pt") as file:
            return (file.metadata() or {}).get("model", "")
    except Exception as error:  # safetensors raises its own kinds for a damaged file
        raise ValueError(f"{path} is not a readable safetensors file ({error}): reinstall Patchwalk") from error


def _path(name: str, folder: Path | None) -> Path:
    path = (folder or FOLDER) / f"{name}.safetensors"
    if not path.exists():
        there = ", ".join(sorted(other.stem for other in path.parent.glob("*.safetensors")))
        raise ValueError(
            f"no stylizer weights at {path}: reinstall Patchwalk or run 'patchwalk train stylizer'"
            + f"; there are {there}" * bool(there)
        )
    return path


def read(path: Path) -> tuple[dict[str, str], dict[str, torch.Tensor]]:
    """Header and tensors of any safetensors file. Raises ValueError, in one sentence, for a damaged one."""
    try:
        with safe_open(path, "pt") as file:
            return file.metadata() or {}, {key: file.get_tensor(key) for key in file.keys()}
    except Exception as error:  # safetensors raises its own kinds for a damaged file
        raise ValueError(f"{path} is not a readable safetensors file ({error}): reinstall Patchwalk") from error


def _expected() -> dict[str, str]:
    return {"version": VERSION, "layout": LAYOUT_VERSION, "skeleton": skeleton_hash()}
