"""Style files: what a style's clips were encoded to, and what is known of their gait, as safetensors with a header."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Sequence

import numpy as np
import torch

from sim.body.skeleton import JOINT_COUNT, skeleton_hash
from sim.io import tensor_file
from sim.io.provenance import ARCHIVES, CONTROLLER
from sim.motion.features import FEATURES, LAYOUT_VERSION
from sim.motion.gait import movement_of
from stylizer.styles.stride_residual import JOINTS as RESIDUAL_JOINTS
from stylizer.styles.style_clips import WINDOW, Gait, Movement, OwnMotion, StyleClips
from stylizer.systems import checkpoint
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures

FEATURES_OF = "style."  # what the names of a style's features begin with in a file
FORMAT, FORMER_FORMAT = "patchwalk-style-2", "patchwalk-style-1"  # the former one held a single clip
GAIT_NUMBERS = ("root_velocities", "runs", "cadences", "cycles")  # of Gait, kept in a style file as they are


def write(
    path: Path,
    name: str,
    style: StyleClips,
    header: dict[str, str],
    windows: Sequence[np.ndarray] | None = None,
) -> None:
    """Writes one style file. header: weights (their fingerprint), licence, source, and what else is to be said.

    windows: of each clip, for a style of which no other file holds the motion: new weights can then read it again."""
    header = {**_expected(), "name": name, "movements": json.dumps(style.gait.movements), **header}
    tensors = {f"{FEATURES_OF}{key}": value.half().contiguous() for key, value in style.features.items()}
    tensors |= gait_tensors(style.gait)
    if windows is not None:
        tensors |= windows_tensors(windows)
    tensor_file.write(path, {key: tensor.numpy() for key, tensor in tensors.items()}, header)


def features_from(tensors: dict[str, torch.Tensor]) -> StyleFeatures:
    """The features that a network of Motion Puzzle made of a style, of the tensors of its file."""
    return {
        name.removeprefix(FEATURES_OF): values.float()
        for name, values in tensors.items()
        if name.startswith(FEATURES_OF)
    }


def gait_tensors(gait: Gait, prefix: str = "") -> dict[str, torch.Tensor]:
    """What a file keeps of a gait besides the movements' names, each tensor's name beginning with the prefix."""
    result = {prefix + key: torch.from_numpy(np.asarray(getattr(gait, key), dtype=np.float32)) for key in GAIT_NUMBERS}
    if gait.residual is not None:
        result[prefix + "residual"] = torch.from_numpy(
            np.ascontiguousarray(gait.residual[:, RESIDUAL_JOINTS], dtype=np.float16)
        )
    return result


def gait_from(tensors: dict[str, torch.Tensor], movements: Sequence[str], prefix: str = "") -> Gait:
    """The inverse of `gait_tensors`."""
    residual = None
    if (kept := tensors.get(prefix + "residual")) is not None:
        residual = np.zeros((len(kept), JOINT_COUNT, 3))
        residual[:, RESIDUAL_JOINTS] = kept.double().numpy()
    numbers = {key: tensors[prefix + key].double().numpy() for key in GAIT_NUMBERS}
    return Gait(tuple(movements), **numbers, residual=residual)


def windows_tensors(windows: Sequence[np.ndarray]) -> dict[str, torch.Tensor]:
    """What a file keeps of the windows (m, WINDOW, 21, 15) of each clip."""
    return {
        "windows": torch.from_numpy(np.concatenate(windows).astype(np.float16)),
        "windows_of_clip": torch.tensor([len(each) for each in windows]),
    }


def read_windows(tensors: dict[str, torch.Tensor]) -> list[np.ndarray]:
    """Of each clip the windows (m, WINDOW, 21, 15) that a style file was computed from, of a file that keeps them."""
    windows = tensors["windows"].numpy().reshape(-1, WINDOW, JOINT_COUNT, FEATURES)
    counts = tensors.get("windows_of_clip", torch.tensor([len(windows)])).tolist()
    return np.split(windows, np.cumsum(counts)[:-1])


def read_gait(header: dict[str, str], tensors: dict[str, torch.Tensor]) -> Gait:
    """What a style file says of its clips' gait; of a file of the former format, what its windows show."""
    if header["format"] == FORMER_FORMAT:
        windows = [w.astype(np.float32) for w in read_windows(tensors)]
        movements = [Movement("walk", w, w.reshape(-1, JOINT_COUNT, FEATURES)[:1], (0.0, 0.0)) for w in windows]
        gait = Gait.of(movements)
        return replace(gait, movements=tuple(map(movement_of, gait.root_velocities)))
    return gait_from(tensors, json.loads(header["movements"]))


def write_own_motion(path: Path, own: OwnMotion) -> None:
    """Writes the controller's motion, which the own style and all that is fitted to it is computed from."""
    tensors = gait_tensors(own.gait) | windows_tensors(own.windows)
    tensors["phases"] = torch.from_numpy(np.concatenate(own.phases).astype(np.float32))
    header = _expected() | {"controller": own.controller, "movements": json.dumps(own.gait.movements)}
    header |= {"licence": ARCHIVES[CONTROLLER]}
    tensor_file.write(path, {key: tensor.numpy() for key, tensor in tensors.items()}, header)


def read_own_motion(path: Path) -> OwnMotion:
    """The controller's motion. Raises ValueError for a file without it."""
    header, tensors = read_checked(path)
    if "phases" not in tensors:
        raise ValueError(
            f"{path} does not hold the controller's motion: run 'patchwalk styles capture', or reinstall Patchwalk"
        )
    with tensor_file.understanding(path, "run 'patchwalk styles capture', or reinstall Patchwalk"):
        return _own_motion(header, tensors)


def _own_motion(header: dict[str, str], tensors: dict[str, torch.Tensor]) -> OwnMotion:
    windows = read_windows(tensors)
    phases = np.split(tensors["phases"].double().numpy(), np.cumsum([len(each) for each in windows])[:-1])
    return OwnMotion(windows, phases, read_gait(header, tensors), header.get("controller", ""))


def read_checked(path: Path, remedy: str = tensor_file.REINSTALL) -> tuple[dict[str, str], dict[str, torch.Tensor]]:
    """Header and tensors of a style file. remedy: what to do with one that is damaged. Raises ValueError for such a
    one, and for one that was made for something else."""
    header, tensors = checkpoint.read(path, ("phases",), remedy)  # NaN in those of movements without strides
    former = header.get("format") == FORMER_FORMAT and "windows" in tensors
    wanted = _expected() | ({"format": FORMER_FORMAT} if former else {})
    tensor_file.check_header(path, header, wanted, "remove the file and add the style again")
    return header, tensors


def _expected() -> dict[str, str]:
    return {"format": FORMAT, "layout": LAYOUT_VERSION, "skeleton": skeleton_hash()}
