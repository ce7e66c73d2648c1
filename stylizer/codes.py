"""The style bank of a whole-body system: codes of the bundled styles, of the user's own, and of styles drawn by chance."""

import json
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file
from torch import Tensor

from sim.atomic import replacing
from sim.clip import FPS
from sim.features import STRIDE, clip_features
from sim.retarget import load_clip
from sim.sources import ARCHIVES, CONTROLLER
from stylizer import weights
from stylizer.bank import BUNDLED, Bank, Style, checked, kept_windows, style_windows, write
from stylizer.bundled import CLIPS, NEUTRAL, without_ends
from stylizer.domains import label_of
from stylizer.whole_body import velocity_factor

FOLDER = "codes"  # in a folder of styles: one file a network, all its codes in it
POINTS = "key_points"  # in the user's folder: styles read from video
SEEN = 4 / np.pi  # how much quicker a joint is than its picture, on the average over the views from all around
DRAWN = "drawn"  # what the names of styles drawn by chance begin with


def build(network: str, weights_folder: Path, data_dir: Path, out_dir: Path) -> list[str]:
    """Writes the codes of the neutral style, which needs no data, and of every style of `bundled.CLIPS` whose clip lies under
    data_dir, into out_dir/codes/network.safetensors; returns their names."""
    model, fingerprint = weights.load(network, weights_folder)
    windows = kept_windows(weights.read(BUNDLED / f"{NEUTRAL}.safetensors")[1])
    codes, speeds = {NEUTRAL: model.encode_style(windows, NEUTRAL)}, {NEUTRAL: velocity_factor(windows)}
    licences = {ARCHIVES[CONTROLLER]}
    for name, (clip, licence) in CLIPS.items():
        path = Path(data_dir) / clip
        if path.exists():
            windows = style_windows(without_ends(clip_features(load_clip(path))))
            codes[name] = model.encode_style(windows, label_of(str(Path(clip).with_suffix(""))))
            speeds[name] = velocity_factor(windows)
            licences.add(licence)
    path = Path(out_dir) / FOLDER / f"{network}.safetensors"
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        save_file({name: code.contiguous() for name, code in codes.items()}, temporary,
                  {"weights": fingerprint, "licence": "; ".join(sorted(licences)), "speeds": json.dumps(speeds)})
    return list(codes)


class CodeBank(Bank):
    """All styles by name, as `Bank` has them, for a whole-body system. What a user added from a clip is there for every
    stylizer; what was read from a video, for those that can read key points."""

    def __init__(self, network: str, bundled: Path = BUNDLED, user: Path | None = None) -> None:
        """Raises ValueError where weights or codes are missing or do not belong together."""
        self.seed = 0
        self._speeds: dict[str, float] = {}  # metres a second, V of Aberman et al. 2020, Eq. 2
        super().__init__(network, bundled, user)
        self.reroll(0)

    def refresh(self) -> None:
        super().refresh()
        for path in sorted((self.user / POINTS).glob("*.safetensors")) if self.reads_points else ():
            if path.stem not in self._styles:
                self._styles[path.stem] = self._read_points(path)

    @property
    def reads_points(self) -> bool:
        """Whether styles can be read from video."""
        return hasattr(self.model, "encode_points")

    @property
    def drawn(self) -> dict[str, str | None]:
        """Name -> label of the styles that are drawn by chance; a system that knows no labels has one."""
        if not self.model.NOISE:
            return {}
        labels = self.model.config.labels if getattr(self.model.config, "labelled", True) else ()
        return {f"{DRAWN}-{label.replace(' ', '-')}": label for label in labels} or {DRAWN: None}

    def speed_of(self, name: str) -> float:
        """How quick the clip of a style is, V of Eq. 2 (Aberman et al. 2020) in metres a second; name may be a clip's path.

        Raises ValueError for a style of which it is not known: one drawn by chance."""
        if name in self._speeds:
            return self._speeds[name]
        if name in self.names:
            raise ValueError(f"nobody can tell how quick '{name}' is: leave --global-motion out, or name a clip")
        return velocity_factor(clip_features(load_clip(name)))

    def reroll(self, seed: int | None = None) -> None:
        """Draws the styles of `drawn` anew; the same seed draws the same."""
        self.seed = self.seed + 1 if seed is None else seed
        for place, (name, label) in enumerate(self.drawn.items()):
            self._styles[name] = self.model.drawn(label, np.random.default_rng((self.seed, place)))

    def add_points(self, folder: Path, name: str, fps: float = 30.0) -> None:
        """Learns a style from a folder of OpenPose key points, `fps` frames a second. Raises ValueError or OSError."""
        if not self.reads_points:
            raise ValueError(f"the {self.name} stylizer reads no key points: use --stylizer unpaired, or a BVH clip")
        from stylizer import key_points
        from stylizer.unpaired import POINTS as NAMES
        self.check_new(name)
        windows = style_windows(key_points.read(folder, NAMES, fps)).astype(np.float16)
        file = self.user / POINTS / f"{name}.safetensors"
        write(file, name, {}, self.fingerprint, "the user's own video", Path(folder).name, windows)
        self._styles[name] = self._read_points(file)

    def _taken(self, name: str) -> bool:
        known = (path.stem.lower() for path in (self.user / POINTS).glob("*.safetensors"))
        return super()._taken(name) or name.lower() in known

    def _file(self, name: str) -> Path:
        of_video = self.user / POINTS / f"{name}.safetensors"
        return of_video if of_video.exists() else super()._file(name)

    def _learned(self, windows: np.ndarray) -> Style:
        return {}  # the windows are enough: a code is made of them in a moment

    def _bundled_styles(self) -> dict[str, Tensor]:
        path = self.bundled / FOLDER / f"{self.name}.safetensors"
        if not path.exists():
            raise ValueError(f"no style codes at {path}: reinstall Patchwalk or run 'patchwalk train stylizer'")
        header, codes = weights.read(path)
        if header.get("weights") != self.fingerprint:
            raise ValueError(f"{path} was computed with other stylizer weights: reinstall Patchwalk or train again")
        self._speeds |= json.loads(header["speeds"])
        return codes

    def _read(self, path: Path) -> Tensor:
        _, tensors = checked(path)
        if "windows" not in tensors:
            raise ValueError(f"{path} keeps no motion, which the {self.name} stylizer needs: add the style again")
        windows = kept_windows(tensors)
        self._speeds[path.stem] = velocity_factor(windows.astype(np.float32))
        return self.model.encode_style(windows)

    @torch.inference_mode()
    def _read_points(self, path: Path) -> Tensor:
        points = checked(path)[1]["windows"].float()
        speed = points.diff(dim=1).norm(dim=-1).amax(dim=-1).mean() * FPS / STRIDE
        self._speeds[path.stem] = float(speed) * SEEN
        return self.model.encode_points(points).mean(dim=0)
