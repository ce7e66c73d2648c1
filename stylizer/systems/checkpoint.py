"""The stylizer's weight files: loaded by name, with a header that says what they are for."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from sim.body.skeleton import skeleton_hash
from sim.io import tensor_file
from sim.io.provenance import SHIPPED
from sim.motion.features import LAYOUT_VERSION
from stylizer.networks.normalization import Scaled
from stylizer.systems import weight_files

VERSION = "1"
STATISTICS = ("mean", "deviation")  # kept in float32
# What weight files of earlier versions call a setting, and what the names of their arrays begin with.
FORMER_SETTINGS = {"way": "root_units", "relative": "residual_output", "judge": "discriminator"}
FORMER_NAMES = {"way.": "root_condition.", "postures": "mean_poses"}


def save(model: Scaled, path: Path, **origin: str) -> None:
    """Writes weights as float16; `origin` says training data, licence, command and commit."""
    header = {**_expected(), "model": model.KIND, "config": json.dumps(asdict(model.config)), **origin}
    arrays = {
        name: (value if name.rpartition(".")[2] in STATISTICS else value.half()).numpy()
        for name, value in model.state_dict().items()
    }
    tensor_file.write(path, arrays, header)


def load(name: str = SHIPPED, folder: Path | None = None) -> tuple[Any, str]:
    """The network ready to run, of the class that `System.load_class` gives, and the fingerprint of its weight file.

    Raises ValueError where the file is missing or made for something else."""
    return load_file(weight_files.find(name, folder))


def load_file(path: Path, remedy: str = tensor_file.REINSTALL) -> tuple[Any, str]:
    """As `load`, from a file of any name; remedy: what to do with one that is damaged."""
    header, tensors = read(path, remedy=remedy)
    tensor_file.check_header(path, header, _expected(), "train again")
    kind = weight_files.system_of(path, header).load_class()
    with tensor_file.understanding(path, "reinstall, or train again"):
        settings = {FORMER_SETTINGS.get(key, key): value for key, value in json.loads(header["config"]).items()}
        tensor_file.check_settings(settings, tensors)
        config = {key: tuple(value) if isinstance(value, list) else value for key, value in settings.items()}
        model = kind(kind.CONFIG(**config))
        model.load_state_dict({_present_name(name): value.float() for name, value in tensors.items()})
    return model.eval(), tensor_file.fingerprint(path)


def read(
    path: Path, may_be_nan: tuple[str, ...] = (), remedy: str = tensor_file.REINSTALL
) -> tuple[dict[str, str], dict[str, Tensor]]:
    """Header and tensors of a file of weights, of a style or of codes, as sim.io.tensor_file.read checks them. Raises
    ValueError, in one sentence, for a damaged one."""
    header, arrays = tensor_file.read(path, may_be_nan, remedy)
    return header, {name: torch.from_numpy(array) for name, array in arrays.items()}


def _present_name(name: str) -> str:
    for former, present in FORMER_NAMES.items():
        if name.startswith(former):
            return present + name.removeprefix(former)
    return name


def _expected() -> dict[str, str]:
    return {"version": VERSION, "layout": LAYOUT_VERSION, "skeleton": skeleton_hash()}
