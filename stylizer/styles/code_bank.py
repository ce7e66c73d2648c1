"""The style bank of a whole-body system: codes of the bundled styles, of the user's own, and of styles drawn by
chance."""

import json
from pathlib import Path
from typing import Sequence

import numpy as np
import torch

from sim.io import tensor_file
from sim.io.provenance import ARCHIVES, CONTROLLER
from sim.motion.clip import FPS
from sim.motion.features import STRIDE, clip_features
from sim.retarget.retarget import load_clip
from stylizer.data.domains import label_of
from stylizer.styles.bank import StyleBank, own_motion_file
from stylizer.styles.bundled_styles import find_clip, folder_for, read_clip
from stylizer.styles.clip_table import CLIPS, licence_of
from stylizer.styles.own_style import OWN
from stylizer.styles.style_clips import Gait, Movement, StyleClips, movements_in, no_cycles, style_windows
from stylizer.styles.style_file import (
    gait_from,
    gait_tensors,
    read_gait,
    read_own_motion,
    read_windows,
    write,
)
from stylizer.styles.style_names import CODES, POINTS, codes_file, sampled_styles
from stylizer.systems import checkpoint
from stylizer.systems.whole_body import WholeBody, velocity_factor

SEEN = 4 / np.pi  # how much quicker a joint is than its picture, on the average over the views from all around
# Of a style that no captured clip shows.
UNKNOWN_GAIT = Gait(("walk",), np.zeros((1, 3)), np.zeros(1), np.zeros(1), no_cycles(1), None)


def build_codes(network: str, weights_folder: Path, data_dir: Path, out_dir: Path) -> list[str]:
    """Writes the codes of the own style, which needs no data, and of every style of `bundled.CLIPS` whose first clip
    lies under data_dir, into codes/network.safetensors of out_dir, or of its `noncommercial` folder; returns their
    names."""
    model, fingerprint = checkpoint.load(network, weights_folder)
    own = read_own_motion(own_motion_file())
    styles = {OWN: encode_codes(model, own.windows, own.gait, [OWN] * len(own.windows))}
    speeds, licences = {OWN: velocity_factor(np.concatenate(own.windows))}, {ARCHIVES[CONTROLLER]}
    for name, clips in CLIPS.items():
        if find_clip(data_dir, clips[0]) is None:
            continue
        movements: list[Movement] = []
        labels: list[str | None] = []
        for clip in clips:
            if motion := read_clip(data_dir, clip):
                found = movements_in(clip_features(motion))
                movements, labels = movements + found, labels + [label_of(clip.removesuffix(".bvh"))] * len(found)
        styles[name] = encode_codes(model, [m.windows for m in movements], Gait.of(movements), labels)
        speeds[name] = velocity_factor(movements[0].windows)
        licences.add(licence_of(clips))
    licence = "; ".join(sorted(licences))
    path = folder_for(licence, Path(out_dir)) / CODES / f"{network}.safetensors"
    tensors = {name: style.features.contiguous() for name, style in styles.items()}
    for name, style in styles.items():
        tensors |= gait_tensors(style.gait, f"{name}.")
    header = {
        "weights": fingerprint,
        "controller": own.controller,
        "licence": licence,
        "speeds": json.dumps(speeds),
        "movements": json.dumps({name: style.gait.movements for name, style in styles.items()}),
    }
    tensor_file.write(path, {key: tensor.numpy() for key, tensor in tensors.items()}, header)
    return list(styles)


def encode_codes(
    model: WholeBody, windows: Sequence[np.ndarray], gait: Gait, labels: Sequence[str | None]
) -> StyleClips:
    """A style from the windows (m, T, 21, 15) of each of its clips and their domains, where they are known."""
    return StyleClips(
        torch.stack(
            [model.encode_style(np.asarray(each, dtype=np.float32), label) for each, label in zip(windows, labels)]
        ),
        gait,
    )


class CodeBank(StyleBank):
    """All styles by name, as `StyleBank` has them, for a whole-body system. What a user added from a clip is there for
    every stylizer; what was read from a video, for those that can read key points."""

    def __init__(self, network: str, bundled: Path | None = None, user: Path | None = None) -> None:
        """Raises ValueError where weights or codes are missing or do not belong together."""
        self.seed = 0
        self._speeds: dict[str, float] = {}  # metres a second, V of Aberman et al. 2020, Eq. 2
        super().__init__(network, bundled, user)
        self.resample(0)

    def refresh(self) -> None:
        super().refresh()
        if self.system.reads_key_points:
            self._read_new(self.user / POINTS, self._read_points)

    @property
    def sampled(self) -> dict[str, str | None]:
        """Name -> label of the styles that are drawn by chance; a system that knows no labels has one."""
        config = self.model.config
        return sampled_styles(self.system, getattr(config, "labels", ()), getattr(config, "labelled", True))

    def speed_of(self, name: str) -> float:
        """How quick the clip of a style is, V of Eq. 2 (Aberman et al. 2020) in metres a second; name may be a clip's
        path.

        Raises ValueError for a style of which it is not known: one drawn by chance."""
        if name in self._speeds:
            return self._speeds[name]
        if name in self.names:
            raise ValueError(f"nobody can tell how quick '{name}' is: leave --global-motion out, or name a clip")
        return velocity_factor(clip_features(load_clip(name)))

    def resample(self, seed: int | None = None) -> None:
        """Draws the styles of `sampled` anew; the same seed draws the same."""
        self.seed = self.seed + 1 if seed is None else seed
        for place, (name, label) in enumerate(self.sampled.items()):
            code = self.model.sample_code(label, np.random.default_rng((self.seed, place)))
            self._styles[name] = StyleClips(code[None], UNKNOWN_GAIT)

    def add_points(self, path: Path, name: str, fps: float = 30.0) -> None:
        """Learns a style from key points (see stylizer.styles.keypoint_files), `fps` frames a second. Raises ValueError
        or OSError."""
        if not self.system.reads_key_points:
            raise ValueError(f"the {self.name} stylizer reads no key points: use --stylizer unpaired, or a BVH clip")
        from stylizer.styles import keypoints_2d
        from stylizer.systems.unpaired import POINTS as NAMES

        self.check_new(name)
        windows = style_windows(keypoints_2d.read_points(path, NAMES, fps)).astype(np.float16)
        file = self.user / POINTS / f"{name}.safetensors"
        write(
            file,
            name,
            StyleClips({}, UNKNOWN_GAIT),
            {"weights": self.fingerprint, "licence": "the user's own video", "source": Path(path).name},
            [windows],
        )
        self._styles[name], self._files[name] = self._read_points(file), file

    def _all_names(self) -> set[str]:
        return super()._all_names() | {path.stem for path in (self.user / POINTS).glob("*.safetensors")}

    def _learned(self, windows: Sequence[np.ndarray], gait: Gait) -> StyleClips:
        return StyleClips({}, gait)  # the windows are enough: codes are made of them in a moment

    def _bundled_styles(self) -> dict[str, StyleClips]:
        path = codes_file(self.name, self.bundled)
        if not path.exists():
            raise ValueError(f"no style codes at {path}: reinstall Patchwalk or run 'patchwalk train stylizer'")
        header, tensors = checkpoint.read(path)
        if header.get("controller") != self.controller:
            raise ValueError(
                f"{path} was computed for another controller: reinstall Patchwalk or run 'patchwalk styles capture'"
            )
        if header.get("weights") != self.fingerprint:
            raise ValueError(f"{path} was computed with other stylizer weights: reinstall Patchwalk or train again")
        with tensor_file.understanding(path, "reinstall Patchwalk"):
            return self._codes(header, tensors)

    def _codes(self, header: dict[str, str], tensors: dict[str, torch.Tensor]) -> dict[str, StyleClips]:
        """Name -> style of a file of codes."""
        self._speeds |= json.loads(header["speeds"])
        self.licences |= {name: licence_of(CLIPS[name]) for name in json.loads(header["movements"]) if name in CLIPS}
        styles = {
            name: StyleClips(tensors[name].float(), gait_from(tensors, movements, f"{name}."))
            for name, movements in json.loads(header["movements"]).items()
        }
        own = styles[OWN]
        for style in styles.values():
            style.check_like(own)
        return styles

    def _read(self, path: Path) -> StyleClips:
        header, tensors = self._checked(path)
        if "windows" not in tensors:
            raise ValueError(f"{path} keeps no motion, which the {self.name} stylizer needs: add the style again")
        windows = [each.astype(np.float32) for each in read_windows(tensors)]
        self._speeds[path.stem] = velocity_factor(windows[0])
        return encode_codes(self.model, windows, read_gait(header, tensors), [None] * len(windows))

    @torch.inference_mode()
    def _read_points(self, path: Path) -> StyleClips:
        points = self._checked(path)[1]["windows"].float()
        speed = points.diff(dim=1).norm(dim=-1).amax(dim=-1).mean() * FPS / STRIDE
        self._speeds[path.stem] = float(speed) * SEEN
        return StyleClips(self.model.encode_points(points).mean(dim=0)[None], UNKNOWN_GAIT)
