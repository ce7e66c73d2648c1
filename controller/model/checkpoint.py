"""The controller's weight file: loaded by name, with a header that says what it is for."""

from pathlib import Path

import torch

from controller.model.io_layout import LAYOUT_VERSION
from controller.model.network import PhaseFunctionedNetwork
from sim.body.skeleton import skeleton_hash
from sim.io import tensor_file

FOLDER = Path(__file__).parents[1] / "weights"
MODEL = "pfnn"


def save(network: PhaseFunctionedNetwork, path: Path, **origin: str) -> None:
    """Writes weights as float16 (statistics as float32); `origin` says data, licence, command and commit."""
    arrays = {
        name: (value.half() if name.startswith("layers") else value).numpy()
        for name, value in network.state_dict().items()
    }
    tensor_file.write(path, arrays, {**_expected(), "hidden": str(network.hidden), **origin})


def load(name: str = MODEL, folder: Path = FOLDER) -> PhaseFunctionedNetwork:
    """The network ready to run. Raises ValueError where the file is missing or made for something else."""
    path = folder / f"{name}.safetensors"
    if not path.exists():
        raise ValueError(f"no controller weights at {path}: reinstall Patchwalk or run 'patchwalk train controller'")
    header, arrays = tensor_file.read(path)
    tensor_file.check_header(path, header, _expected(), "train again")
    with tensor_file.understanding(path, "reinstall, or train again"):
        hidden = int(header["hidden"])
        tensor_file.check_settings(hidden, arrays)
        network = PhaseFunctionedNetwork(hidden)
        network.load_state_dict({key: torch.from_numpy(array).float() for key, array in arrays.items()})
    return network.eval()


def fingerprint(name: str = MODEL, folder: Path = FOLDER) -> str:
    """A hash of the weight file, by which what was computed from its motion is known to belong to it."""
    return tensor_file.fingerprint(folder / f"{name}.safetensors")


def _expected() -> dict[str, str]:
    return {"model": MODEL, "layout": LAYOUT_VERSION, "skeleton": skeleton_hash()}
