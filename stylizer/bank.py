"""The style bank: what the decoder needs to know of each style, computed once and kept in one small file a style."""

import re
import unicodedata
from difflib import get_close_matches
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file

from sim.atomic import replacing
from sim.clip import FPS, Clip
from sim.features import FEATURES, LAYOUT_VERSION, STRIDE, clip_features
from sim.folders import data_folder
from sim.retarget import load_clip
from sim.skeleton import JOINT_COUNT, skeleton_hash
from stylizer import weights
from stylizer.blend import Style
from stylizer.layers import PartStyle
from stylizer.motion_puzzle import MotionPuzzle

BUNDLED = Path(__file__).parent / "styles"
FORMAT = "patchwalk-style-1"
WINDOW = 32  # samples at 30 Hz, as in training: the encoder has learned the edges of such a window too
WINDOWS = 3  # spread over the clip; as many for every style, so that the parts of different styles stack
SHORTEST = WINDOW * STRIDE  # frames, about a second: one gait cycle
NAME_LENGTH = 40
NAME = re.compile(rf"[A-Za-z0-9][A-Za-z0-9_-]{{0,{NAME_LENGTH - 1}}}")


def user_folder() -> Path:
    """Where the user's own styles live."""
    return data_folder() / "styles"


def style_windows(features: np.ndarray) -> np.ndarray:
    """(WINDOWS, WINDOW, 21, 15) at 30 Hz, evenly spread over a clip's features (frames, 21, 15) at 60 Hz.

    Raises ValueError for a clip shorter than one window."""
    if len(features) < SHORTEST:
        raise ValueError(f"the clip is too short for a style: give at least {SHORTEST / FPS:.1f} s of motion")
    starts = np.linspace(0, len(features) - SHORTEST, WINDOWS).round().astype(int)
    return features[starts[:, None] + STRIDE * np.arange(WINDOW)]


@torch.inference_mode()
def encode(model: MotionPuzzle, windows: np.ndarray) -> Style:
    """The style of a clip from its windows: AdaIN scale and bias averaged over them, attention tokens and key poses of all."""
    motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
    style = model.encode_style(motion, motion.flatten(1, 2)[:, None])
    return {level: PartStyle(s.scale.mean(1, keepdim=True), s.bias.mean(1, keepdim=True),
                             s.keys.flatten(1, 2)[:, None], s.values.flatten(1, 2)[:, None])
            for level, s in style.items()}


def write(path: Path, name: str, style: Style, fingerprint: str, licence: str, source: str,
          windows: np.ndarray | None = None) -> None:
    """One style file. A user's own style keeps its windows too, so that new weights can read it again."""
    header = {"format": FORMAT, "name": name, "weights": fingerprint, "layout": LAYOUT_VERSION,
              "skeleton": skeleton_hash(), "licence": licence, "source": source}
    tensors = {f"{level}.{key}": value.half().contiguous()
               for level, part in style.items() for key, value in part._asdict().items()}
    if windows is not None:
        tensors["windows"] = torch.from_numpy(windows.astype(np.float16))
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        save_file(tensors, temporary, header)


def kept_windows(tensors: dict[str, torch.Tensor]) -> np.ndarray:
    """The windows (WINDOWS, WINDOW, 21, 15) that a style file was computed from, of a file that keeps them."""
    return tensors["windows"].numpy().reshape(WINDOWS, WINDOW, JOINT_COUNT, FEATURES)


def checked(path: Path) -> tuple[dict[str, str], dict[str, torch.Tensor]]:
    """Header and tensors of a style file. Raises ValueError for one that was made for something else."""
    header, tensors = weights.read(path)
    wanted = {"format": FORMAT, "layout": LAYOUT_VERSION, "skeleton": skeleton_hash()}
    for key, value in wanted.items():
        if header.get(key) != value:
            raise ValueError(f"{path} was made for {key} '{header.get(key)}', this version needs '{value}': "
                             "remove the file and add the style again")
    return header, tensors


class Bank:
    """All styles by name: the bundled ones and the user's own, for one weight file."""

    def __init__(self, weights_name: str = weights.SLIM, bundled: Path = BUNDLED, user: Path | None = None) -> None:
        """Raises ValueError where weights or a bundled style are missing or do not belong together."""
        self.name = weights_name
        self.model, self.fingerprint = weights.load(weights_name)
        self.bundled, self.user = bundled, user or user_folder()
        self._styles = self._bundled_styles()
        self.refresh()

    def refresh(self) -> None:
        """Reads what has come into the user's folder since it was read."""
        for path in sorted(self.user.glob("*.safetensors")):
            if path.stem not in self._styles:
                self._styles[path.stem] = self._read(path)

    def _bundled_styles(self) -> dict[str, Style]:
        """Name -> style of those that come with Patchwalk."""
        return {path.stem: self._read(path) for path in sorted(self.bundled.glob("*.safetensors"))}

    @property
    def names(self) -> tuple[str, ...]:
        """Every style, alphabetically."""
        return tuple(sorted(self._styles))

    def __getitem__(self, name: str) -> Style:
        """Raises ValueError, naming those spelt like it, for a style that is not there."""
        if name not in self._styles:
            near = get_close_matches(name, self._styles, 3)
            hint = f"did you mean {' or '.join(near)}?" if near else "`patchwalk styles list` shows what there is"
            raise ValueError(f"unknown style '{name}': {hint}")
        return self._styles[name]

    def free_name(self, path: Path) -> str:
        """A name that no style has yet, made from a clip's file name."""
        stem = re.sub(r"[^A-Za-z0-9_]+", "-", unicodedata.normalize("NFKD", path.stem)).strip("-_")[:NAME_LENGTH - 4] or "style"
        names = (stem, *(f"{stem}-{number}" for number in range(2, 1000)))
        return next(name for name in names if not self._taken(name))

    def _taken(self, name: str) -> bool:
        """Whether a style of that name is in the bank, or came into the user's folder since it was read."""
        known = (*self._styles, *(path.stem for path in self.user.glob("*.safetensors")))
        return name.lower() in map(str.lower, known)  # not every file system tells cases apart

    def add(self, path: Path, name: str, name_map: dict[str, str] | None = None) -> Clip:
        """Learns a style from a BVH clip, keeps it in the user's folder and gives the clip. Raises ValueError or OSError.

        name_map: our joint -> theirs, for a skeleton whose names are not known (sim.name_maps.load)."""
        self.check_new(name)
        clip = load_clip(path, name_map)
        try:
            windows = style_windows(clip_features(clip)).astype(np.float16)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error
        file = self.user / f"{name}.safetensors"
        write(file, name, self._learned(windows), self.fingerprint, "the user's own clip", Path(path).name, windows)
        self._styles[name] = self._read(file)  # as every later start will find it: the file keeps half precision
        return clip

    def check_new(self, name: str) -> None:
        """Raises ValueError for what is no name of a style, or one that a style has."""
        if not NAME.fullmatch(name):
            raise ValueError(f"'{name}' is no style name: use up to 40 letters, digits, - and _, not - or _ first")
        if self._taken(name):
            raise ValueError(f"there is a style '{name}' already: choose another name, or remove that one first")

    def _learned(self, windows: np.ndarray) -> Style:
        """What a file keeps of a clip's windows besides them."""
        return encode(self.model, windows)

    def remove(self, name: str) -> None:
        """Forgets one of the user's own styles. Raises ValueError for a bundled or an unknown one."""
        self[name]
        path = self._file(name)
        if not path.exists():
            raise ValueError(f"'{name}' comes with Patchwalk and cannot be removed: only styles that you added can")
        path.unlink()
        del self._styles[name]

    def _file(self, name: str) -> Path:
        """Where a style of the user's own lies."""
        return self.user / f"{name}.safetensors"

    def _read(self, path: Path) -> Style:
        header, tensors = checked(path)
        if header["weights"] != self.fingerprint:
            if "windows" not in tensors:
                raise ValueError(f"{path} was computed with other stylizer weights: reinstall Patchwalk or train again")
            windows = kept_windows(tensors)
            write(path, header["name"], encode(self.model, windows), self.fingerprint, header["licence"], header["source"],
                  windows)
            return self._read(path)
        return {level: PartStyle(*(tensors[f"{level}.{key}"].float() for key in PartStyle._fields))
                for level in self.model.config.styled}
