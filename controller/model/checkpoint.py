"""The controller's weight file: safetensors, loaded by name, with a header that says what it is for."""

import hashlib
from pathlib import Path

from safetensors import safe_open
from safetensors.torch import save_file

from controller.model.io_layout import LAYOUT_VERSION
from controller.model.network import PhaseFunctionedNetwork
from sim.body.skeleton import skeleton_hash
from sim.io.atomic_write import replacing

FOLDER = Path(__file__).parents[1] / "weights"
MODEL = "pfnn"


def save(network: PhaseFunctionedNetwork, path: Path, **origin: str) -> None:
    """Writes weights as float16 (statistics as float32); `origin` says data, licence, command and commit."""
    header = {
        "model": MODEL,
        "layout": LAYOUT_VERSION,
        "skeleton": skeleton_hash(),
        "hidden": str(network.hidden),
        **origin,
    }
    tensors = {
        name: value.half() if name.startswith("layers") else value for name, value in network.state_dict().items()
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        save_file(tensors, temporary, header)


def load(name: str = MODEL, folder: Path = FOLDER) -> PhaseFunctionedNetwork:
    """The network ready to run. Raises ValueError where the file is missing or made for something else."""
    path = folder / f"{name}.safetensors"
    if not path.exists():
        raise ValueError(f"no controller weights at {path}: reinstall Patchwalk or run 'patchwalk train controller'")
    try:
        with safe_open(path, "pt") as file:
            header = file.metadata() or {}
            tensors = {key: file.get_tensor(key).float() for key in file.keys()}
    except Exception as error:  # safetensors raises its own kinds for a damaged file
        raise ValueError(f"{path} is not a readable weight file ({error}): reinstall Patchwalk") from error
    for key, wanted in (("model", MODEL), ("layout", LAYOUT_VERSION), ("skeleton", skeleton_hash())):
        if header.get(key) != wanted:
            raise ValueError(
                f"{path} was made for {key} '{header.get(key)}', this version needs '{wanted}': train again"
            )
    network = PhaseFunctionedNetwork(int(header["hidden"]))
    network.load_state_dict(tensors)
    return network.eval()


def fingerprint(name: str = MODEL, folder: Path = FOLDER) -> str:
    """A hash of the weight file, by which what was computed from its motion is known to belong to it."""
    return hashlib.sha256((folder / f"{name}.safetensors").read_bytes()).hexdigest()[:16]
