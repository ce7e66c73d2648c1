"""The style bank: what the decoder needs to know of each style, computed once and kept in one small file a style."""

import re
import warnings
from pathlib import Path
from typing import Callable, NamedTuple, Sequence

import numpy as np
import torch

from sim.io import tensor_file
from sim.io.bvh_parser import shorten
from sim.io.checks import check_finite
from sim.io.provenance import NONCOMMERCIAL, SHIPPED, allowed
from sim.motion.clip import Clip
from sim.motion.features import clip_features
from sim.retarget.retarget import load_clip
from stylizer.styles import style_names
from stylizer.styles.encoding import encode_clips
from stylizer.styles.own_style import OWN
from stylizer.styles.style_clips import Gait, StyleClips, movements_in
from stylizer.styles.style_file import (
    FORMAT,
    features_from,
    read_checked,
    read_gait,
    read_own_motion,
    read_windows,
    windows_tensors,
    write,
)
from stylizer.styles.style_names import BUNDLED, NAME, NAME_LENGTH, in_ascii, is_reserved, user_folder
from stylizer.systems import checkpoint
from stylizer.systems.registry import SYSTEMS, System

LOOP_SECONDS = 8.0  # to which a loop that walks in place is repeated, so that it shows some strides
ADD_AGAIN = "add the style again"  # what to do with a file of the user's that cannot be used


def own_motion_file(bundled: Path | None = None) -> Path:
    """The file that holds the controller's motion, in a folder of styles (None: the package's)."""
    return (bundled or BUNDLED) / "own_motion.safetensors"


class Added(NamedTuple):
    """A new style: its first clip on our skeleton, and sentences that say which seconds of which file show which
    movement."""

    clip: Clip
    taken: tuple[str, ...]


class _Motion(NamedTuple):
    """What there is to learn from clips: the first one on our skeleton, the windows of each movement in half precision,
    their gait, the clips' names, and which seconds of which show what."""

    clip: Clip
    windows: list[np.ndarray]
    gait: Gait
    titles: list[str]
    taken: tuple[str, ...]


class StyleBank:
    """All styles by name: the bundled ones and the user's own, for one weight file."""

    def __init__(
        self,
        weights_name: str = SHIPPED,
        bundled: Path | None = None,
        user: Path | None = None,
        weights: Path | None = None,
    ) -> None:
        """bundled, weights: folders with styles and weights in place of the package's. Raises ValueError where weights
        or a bundled style are missing or do not belong together."""
        self.name = weights_name
        self.model, self.fingerprint = checkpoint.load(weights_name, weights)
        self.bundled, self.user = bundled or BUNDLED, user or user_folder()
        own = own_motion_file(self.bundled)
        self.own_motion = read_own_motion(own if own.exists() else own_motion_file())
        self._left_out: set[Path] = set()  # the user's files that cannot be used
        self._files: dict[str, Path] = {}  # of the user's own styles
        self.licences: dict[str, str] = {}  # of the styles, as their files say
        self._styles = self._bundled_styles()
        self.refresh()

    def refresh(self) -> None:
        """Reads what has come into the user's folder since it was read, and forgets what has gone from it. A file that
        cannot be used is left out, with a warning that says what to do."""
        for name in [name for name, path in self._files.items() if not path.exists()]:
            self._forget(name)
        self._read_new(self.user, self._read)

    def _read_new(self, folder: Path, read: Callable[[Path], StyleClips]) -> None:
        for path in sorted(folder.glob("*.safetensors")):
            if path.stem in self._styles or path in self._left_out:
                continue
            try:
                with tensor_file.understanding(path, ADD_AGAIN):
                    style = read(path)
                    style.check_like(self._styles[OWN])
                self._styles[path.stem], self._files[path.stem] = style, path
            except (ValueError, OSError) as error:
                self._left_out.add(path)
                warnings.warn(
                    f"the style '{path.stem}' is left out: {error}; `patchwalk styles remove {path.stem}` removes it",
                    stacklevel=4,
                )

    def _bundled_styles(self) -> dict[str, StyleClips]:
        """Name -> style of those that come with Patchwalk."""
        paths = [path for folder in allowed(self.bundled) for path in (folder / self.name).glob("*.safetensors")]
        styles = {}
        for path in sorted(paths):
            with tensor_file.understanding(path, "reinstall Patchwalk"):
                styles[path.stem] = self._read(path)
        if OWN not in styles:
            raise ValueError(f"there is no own style in {self.bundled / self.name}: reinstall Patchwalk or train again")
        for path in paths:
            with tensor_file.understanding(path, "reinstall Patchwalk"):
                styles[path.stem].check_like(styles[OWN])
        return styles

    def is_noncommercial(self, name: str) -> bool:
        """Whether a style is for non-commercial use only."""
        return NONCOMMERCIAL in self.licences.get(name, "")

    @property
    def system(self) -> System:
        """The style-transfer system of the weights."""
        return SYSTEMS[self.model.KIND]

    @property
    def controller(self) -> str:
        """The fingerprint of the controller whose motion the own style is."""
        return self.own_motion.controller

    @property
    def names(self) -> tuple[str, ...]:
        """Every style, alphabetically."""
        return tuple(sorted(self._styles))

    def __getitem__(self, name: str) -> StyleClips:
        """Raises ValueError, naming those spelt like it, for a style that is not there."""
        if name not in self._styles:
            raise style_names.unknown_style(name, self._styles, self.bundled / self.name)
        return self._styles[name]

    def free_name(self, path: Path) -> str:
        """A name that no style has yet, made from a clip's file name."""
        stem = re.sub(r"[^A-Za-z0-9_]+", "-", in_ascii(path.stem)).strip("-_")
        stem = (f"style-{stem}" if not stem or is_reserved(stem) else stem)[: NAME_LENGTH - 4].strip("-_")
        names = (stem, *(f"{stem}-{number}" for number in range(2, 1000)))
        taken = set(map(str.lower, self._all_names()))  # not every file system tells cases apart
        return next(name for name in names if name.lower() not in taken)

    def _all_names(self) -> set[str]:
        """Of the styles in the bank, and of those that came into the user's folder since it was read."""
        return {*self._styles, *(path.stem for path in self.user.glob("*.safetensors"))}

    def add(
        self,
        name: str,
        *sources: str | Path | Clip,
        name_map: dict[str, str] | None = None,
        fps: float | None = None,
    ) -> Added:
        """Learns a style from one clip or several, of BVH files or in memory, and keeps it in the user's folder.

        Each kind of movement that a clip shows (sim.motion.gait.MOVEMENTS) becomes a clip of the style. A clip that
        walks in place gets its travel back.
        name_map: our joint -> theirs, for a skeleton whose names are not known (sim.retarget.joint_names.load); fps:
        frames a second, believed in place of what the files say.
        Raises ValueError for a name that is none or is taken and for a clip that is none, OSError for a file that
        cannot be read or written."""
        self.check_new(name)
        if not sources:
            raise ValueError(f"style '{name}' needs a clip to learn from: name one BVH file or more")
        motion = self._motion_of(sources, name_map, fps)
        self._keep(name, motion)
        return Added(motion.clip, motion.taken)

    def learn(self, *paths: Path) -> tuple[str, Clip]:
        """Learns a style from files under a name made from the first one's; or where one of the user's own was learned
        from the same motion, finds that. The name, and the first clip. Raises ValueError or OSError, as `add` does."""
        motion = self._motion_of(paths, None, None)
        name = self._with_motion(motion.windows)
        if name is None:
            self._keep(name := self.free_name(paths[0]), motion)
        return name, motion.clip

    def _motion_of(
        self, sources: Sequence[str | Path | Clip], name_map: dict[str, str] | None, fps: float | None
    ) -> "_Motion":
        """What there is to learn from clips. Raises ValueError or OSError."""
        from sim.motion.in_place import restore_travel  # here, because scipy would slow every start down

        clips = [source if isinstance(source, Clip) else load_clip(Path(source), name_map, fps) for source in sources]
        clips = [restore_travel(clip, LOOP_SECONDS) for clip in clips]
        titles = [clip.name if isinstance(source, Clip) else Path(source).name for source, clip in zip(sources, clips)]
        movements, taken = [], []
        for source, title, clip in zip(sources, titles, clips):
            try:
                found = movements_in(clip_features(clip))
            except ValueError as error:
                raise ValueError(f"{title if isinstance(source, Clip) else source}: {error}") from error
            movements += found
            taken += ["{}: {} from {:.1f} to {:.1f} s".format(title, m.name, *m.seconds) for m in found]
        with np.errstate(over="ignore"):  # what does not fit in half precision is refused in the next line
            windows = [m.windows.astype(np.float16) for m in movements]
        check_finite(sources[0] if not isinstance(sources[0], Clip) else titles[0], *windows)
        return _Motion(clips[0], windows, Gait.of(movements), titles, tuple(taken))

    def _keep(self, name: str, motion: "_Motion") -> None:
        """Makes a style of a motion and keeps it in the user's folder."""
        file = self.user / f"{name}.safetensors"
        write(
            file,
            name,
            self._learned(motion.windows, motion.gait),
            {**self._made_for, "licence": "the user's own clips", "source": ", ".join(motion.titles)},
            motion.windows,
        )
        self._styles[name] = self._read(file)  # as every later start will find it: the file keeps half precision
        self._files[name] = file

    def _with_motion(self, windows: Sequence[np.ndarray]) -> str | None:
        """The user's own style that was learned from the very same windows."""
        wanted = windows_tensors(windows)
        for name, path in list(self._files.items()):
            if path.parent == self.user and path.exists():
                kept = self._checked(path)[1]
                if all(key in kept and torch.equal(kept[key], wanted[key]) for key in wanted):
                    return name
        return None

    def check_new(self, name: str) -> None:
        """Raises ValueError for what is no name of a style, or one that a style has."""
        style_names.check_name(name)
        style_names.check_free(name, self._all_names())

    def _learned(self, windows: Sequence[np.ndarray], gait: Gait) -> StyleClips:
        """What a file keeps of its clips' windows besides them."""
        return encode_clips(self.model, windows, gait, self.own_motion)

    @property
    def _made_for(self) -> dict[str, str]:
        """What the header of a style file says of what it was computed for."""
        return {"weights": self.fingerprint, "controller": self.controller}

    def remove(self, name: str) -> None:
        """Forgets one of the user's own styles, whether its file can be read or not. Raises ValueError for a bundled or
        an unknown one."""
        if not style_names.remove(name, self.user):
            self[name]
            raise ValueError(f"'{name}' comes with Patchwalk and cannot be removed: only styles that you added can")
        self._forget(name)

    def rename(self, name: str, new: str) -> None:
        """Calls one of the user's own styles something else, in its file too. Raises ValueError for a bundled or an
        unknown one and for a name that is none or is taken, OSError where the file cannot be written."""
        if name not in self._files:
            self[name]
            raise ValueError(f"'{name}' comes with Patchwalk and cannot be renamed: only styles that you added can")
        if new.lower() != name.lower():
            self.check_new(new)
        elif not NAME.fullmatch(new) or new == name:
            raise ValueError(f"'{shorten(new)}' is its name already: choose another")
        path = self._files[name]
        path.rename(path.with_stem(new))
        self.refresh()

    @property
    def users_own(self) -> tuple[str, ...]:
        """The styles that the user added."""
        return tuple(sorted(self._files))

    def _forget(self, name: str) -> None:
        for known in (self._styles, self._files, self.licences):
            known.pop(name, None)

    def _checked(self, path: Path) -> tuple[dict[str, str], dict[str, torch.Tensor]]:
        """Header and tensors of a style file, a bundled one's or a user's."""
        return read_checked(path, *[ADD_AGAIN] * path.is_relative_to(self.user))

    def _read(self, path: Path) -> StyleClips:
        header, tensors = self._checked(path)
        gait = read_gait(header, tensors)
        if header["format"] != FORMAT or any(header.get(key) != value for key, value in self._made_for.items()):
            if "windows" not in tensors or path.stem == OWN:
                remedy = ADD_AGAIN if path.is_relative_to(self.user) else "reinstall Patchwalk or train again"
                raise ValueError(f"{path} was computed for other weights of stylizer or controller: {remedy}")
            windows = read_windows(tensors)
            kept = {key: header[key] for key in ("licence", "source")}
            style = encode_clips(self.model, windows, gait, self.own_motion)
            try:
                write(path, header["name"], style, kept | self._made_for, windows)
            except OSError:  # a home that cannot be written: it is made again at the next start
                return style
            return self._read(path)
        self.licences[path.stem] = header["licence"]
        return StyleClips(features_from(tensors), gait)
