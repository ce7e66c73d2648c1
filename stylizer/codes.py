"""The style bank of a whole-body system: codes of the bundled styles, of the user's own, and of styles drawn by chance."""

from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file
from torch import Tensor

from sim.features import clip_features
from sim.retarget import load_clip
from sim.sources import ARCHIVES
from stylizer import weights
from stylizer.bank import BUNDLED, Bank, Style, checked, kept_windows, style_windows, write
from stylizer.bundled import CLIPS, NEUTRAL, without_ends
from stylizer.domains import label_of

FOLDER = "codes"  # in a folder of styles: one file a network, all its codes in it
POINTS = "key_points"  # in the user's folder: styles read from video
DRAWN = "drawn"  # what the names of styles drawn by chance begin with


def build(network: str, weights_folder: Path, data_dir: Path, out_dir: Path) -> list[str]:
    """Writes the codes of the neutral style, which needs no data, and of every style of `bundled.CLIPS` whose clip lies under
    data_dir, into out_dir/codes/network.safetensors; returns their names."""
    model, fingerprint = weights.load(network, weights_folder)
    codes = {NEUTRAL: model.encode_style(kept_windows(weights.read(BUNDLED / f"{NEUTRAL}.safetensors")[1]), NEUTRAL)}
    licences = {ARCHIVES["patchwalk"]}
    for name, (clip, licence) in CLIPS.items():
        path = Path(data_dir) / clip
        if path.exists():
            windows = style_windows(without_ends(clip_features(load_clip(path))))
            codes[name] = model.encode_style(windows, label_of(str(Path(clip).with_suffix(""))))
            licences.add(licence)
    path = Path(out_dir) / FOLDER / f"{network}.safetensors"
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    save_file({name: code.contiguous() for name, code in codes.items()}, partial,
              {"weights": fingerprint, "licence": "; ".join(sorted(licences))})
    partial.replace(path)
    return list(codes)


class CodeBank(Bank):
    """All styles by name, as `Bank` has them, for a whole-body system. What a user added from a clip is there for every
    stylizer; what was read from a video, for those that can read key points."""

    def __init__(self, network: str, bundled: Path = BUNDLED, user: Path | None = None) -> None:
        """Raises ValueError where weights or codes are missing or do not belong together."""
        self.network, self.seed = network, 0
        super().__init__(network, bundled, user)
        if self.reads_points:
            for path in sorted((self.user / POINTS).glob("*.safetensors")):
                self._styles.setdefault(path.stem, self._read_points(path))
        self.reroll(0)

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

    def reroll(self, seed: int | None = None) -> None:
        """Draws the styles of `drawn` anew; the same seed draws the same."""
        self.seed = self.seed + 1 if seed is None else seed
        for place, (name, label) in enumerate(self.drawn.items()):
            self._styles[name] = self.model.drawn(label, np.random.default_rng((self.seed, place)))

    def add_points(self, folder: Path, name: str, fps: float = 30.0) -> None:
        """Learns a style from a folder of OpenPose key points, `fps` frames a second. Raises ValueError or OSError."""
        if not self.reads_points:
            raise ValueError(f"the {self.network} stylizer reads no key points: use --stylizer unpaired, or a BVH clip")
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
        path = self.bundled / FOLDER / f"{self.network}.safetensors"
        if not path.exists():
            raise ValueError(f"no style codes at {path}: reinstall Patchwalk or run 'patchwalk train stylizer'")
        header, codes = weights.read(path)
        if header.get("weights") != self.fingerprint:
            raise ValueError(f"{path} was computed with other stylizer weights: reinstall Patchwalk or train again")
        return codes

    def _read(self, path: Path) -> Tensor:
        _, tensors = checked(path)
        if "windows" not in tensors:
            raise ValueError(f"{path} keeps no motion, which the {self.network} stylizer needs: add the style again")
        return self.model.encode_style(kept_windows(tensors))

    @torch.inference_mode()
    def _read_points(self, path: Path) -> Tensor:
        _, tensors = checked(path)
        return self.model.encode_points(tensors["windows"].float()).mean(dim=0)
