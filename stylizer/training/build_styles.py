"""The styles of the package for another controller: the own style, and what of the other styles depends on it.

No captured clip is needed: a style file keeps what its clips' strides look like."""

import json
from pathlib import Path

import numpy as np
import torch

from sim.io import tensor_file
from sim.io.provenance import noncommercial
from stylizer.styles import own_style
from stylizer.styles.bank import own_motion_file
from stylizer.styles.code_bank import encode_codes
from stylizer.styles.encoding import refit_clips
from stylizer.styles.own_style import OWN
from stylizer.styles.style_clips import OwnMotion, StyleClips
from stylizer.styles.style_file import (
    features_from,
    gait_tensors,
    read_checked,
    read_gait,
    read_own_motion,
    write,
    write_own_motion,
)
from stylizer.styles.style_names import BUNDLED, CODES
from stylizer.systems import checkpoint
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.motion_puzzle.model import MotionPuzzle
from stylizer.systems.whole_body import WholeBody, velocity_factor


def rebuild(own: OwnMotion, out_dir: Path, styles: Path = BUNDLED) -> list[Path]:
    """Writes into out_dir and its `noncommercial` folder, for a controller that moves like `own`: the own style, and
    all other styles of the folder `styles`, those of every network that takes styles by part and the codes of the
    whole-body systems. Returns the files.

    Raises ValueError, and writes nothing, where weights or styles are missing or do not belong together."""
    out = {
        folder: to for folder, to in ((styles, Path(out_dir)), (noncommercial(styles), noncommercial(Path(out_dir))))
    }
    folders = [child for folder in out for child in sorted(folder.glob("*/")) if child.name != CODES]
    files = {
        path: read_checked(path)
        for folder in folders
        for path in sorted(folder.glob("*.safetensors"))
        if path.stem != OWN
    }
    codes = {path: checkpoint.read(path) for folder in out for path in sorted((folder / CODES).glob("*.safetensors"))}
    networks = {name: checkpoint.load(name) for name in dict.fromkeys(path.parent.name for path in files)}
    systems = {path: checkpoint.load(path.stem) for path in codes}
    for path, (header, _) in (files | codes).items():
        if header.get("weights") != (systems.get(path) or networks[path.parent.name])[1]:
            raise ValueError(f"{path} was computed with other stylizer weights: reinstall Patchwalk or train again")
        if "movements" not in header:
            raise ValueError(f"{path} was made by another version of Patchwalk: reinstall it or train again")

    file_of_motion = own_motion_file(Path(out_dir))
    write_own_motion(file_of_motion, own)
    own = read_own_motion(file_of_motion)  # as every later reader finds it: the file keeps half precision
    for name, network in networks.items():
        own_style.write_own_style(Path(out_dir) / name, own, *network)
    places = {path: out[path.parents[1]] / path.parent.name / path.name for path in (*files, *codes)}
    for path, file in files.items():
        _write_style(places[path], networks[path.parent.name][0], own, *file)
    for path, file in codes.items():
        _write_codes(places[path], systems[path][0], own, *file)
    return [file_of_motion, *(Path(out_dir) / name / f"{OWN}.safetensors" for name in networks), *places.values()]


def _write_style(
    path: Path,
    model: MotionPuzzle | JointPuzzle,
    own: OwnMotion,
    header: dict[str, str],
    tensors: dict[str, torch.Tensor],
) -> None:
    """A style of Motion Puzzle, given as its file for another controller."""
    style = refit_clips(model, StyleClips(features_from(tensors), read_gait(header, tensors)), own)
    kept = {key: header[key] for key in ("weights", "licence", "source")}
    write(path, header["name"], style, kept | {"controller": own.controller})


def _write_codes(
    path: Path, model: WholeBody, own: OwnMotion, header: dict[str, str], tensors: dict[str, torch.Tensor]
) -> None:
    """The codes of a whole-body system, given as their file for another controller: only the own style's change."""
    style = encode_codes(model, own.windows, own.gait, [OWN] * len(own.windows))
    tensors = {name: tensor for name, tensor in tensors.items() if name.partition(".")[0] != OWN}
    tensors |= {OWN: style.features.contiguous()} | gait_tensors(own.gait, f"{OWN}.")
    speeds = json.loads(header["speeds"]) | {OWN: velocity_factor(np.concatenate(own.windows))}
    movements = json.loads(header["movements"]) | {OWN: own.gait.movements}
    header = header | {"controller": own.controller, "speeds": json.dumps(speeds), "movements": json.dumps(movements)}
    tensor_file.write(path, {key: tensor.numpy() for key, tensor in tensors.items()}, header)
