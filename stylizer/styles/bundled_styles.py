"""The styles that come with Patchwalk: which clips each is computed from, and how to compute them."""

from functools import cache
from pathlib import Path
from typing import Sequence

import numpy as np

from sim.motion.features import clip_features
from sim.retarget.retarget import load_clip
from stylizer.styles import own_style
from stylizer.styles.encoding import encode_clips
from stylizer.styles.own_style import OWN
from stylizer.styles.style_clips import Gait, Movement, movements_in
from stylizer.styles.style_file import read_own_motion, write
from stylizer.systems import checkpoint

FOLDER = Path(__file__).parents[1] / "styles"
BANDAI = "CC BY-NC 4.0 (Bandai Namco Research Inc.)"
SNU = "Apache-2.0 (SNU Movement Research Lab)"
SET_1 = ("run_{}_001", "dash_{}_001", "walk-back_{}_001", "walk-left_{}_001", "walk-right_{}_001")  # besides the walk
# takes of the run
SET_2 = {"active": "042", "elderly": "019", "exhausted": "038", "masculine": "007", "youthful": "004"}

# name: (clips in the data folder, licence); the first one walks straight ahead, in what the labels say
CLIPS: dict[str, tuple[tuple[str, ...], str]] = {
    **{
        name: (
            (
                f"bandai-namco/dataset-1_walk_{name}_{take}.bvh",
                *(f"bandai-namco/dataset-1_{clip.format(name)}.bvh" for clip in SET_1),
            ),
            BANDAI,
        )
        for name, take in {
            "angry": "002",
            "childish": "001",
            "chimpira": "002",
            "feminine": "001",
            "giant": "002",
            "happy": "001",
            "musical": "001",
            "not-confident": "001",
            "old": "002",
            "proud": "001",
            "sad": "002",
            "tired": "001",
        }.items()
    },
    **{
        name: (
            (f"bandai-namco/dataset-2_walk_{name}_{take}.bvh", f"bandai-namco/dataset-2_run_{name}_{SET_2[name]}.bvh"),
            BANDAI,
        )
        for name, take in {
            "active": "017",
            "elderly": "009",
            "exhausted": "012",
            "masculine": "013",
            "youthful": "014",
        }.items()
    },
    **{
        name: ((f"snu-styles/wd2_Walk{label}.bvh",), SNU)
        for name, label in {
            "soldier": "Soldier01",
            "marching": "Azuma01",
            "hunched": "Sukiko01",
            "bouncy": "TongTong01",
            "leaning": "Lean01",
        }.items()
    },
}
MARGIN = 0.15  # share of a clip at each end that is left out: starts, stops and T-poses


def build_bundled(weights_name: str, weights_folder: Path, data_dir: Path, out_dir: Path) -> list[str]:
    """Computes with the given weights the own style, which needs no data, and every style of CLIPS whose first clip
    lies under data_dir; returns their names."""
    model, fingerprint = checkpoint.load(weights_name, weights_folder)
    own = read_own_motion(FOLDER / f"{OWN}.safetensors")
    own_style.write_own_style(Path(out_dir), own, model, fingerprint)
    written = [OWN]
    for name, (clips, licence) in CLIPS.items():
        movements = movements_of(data_dir, clips)
        if movements:
            style = encode_clips(model, [m.windows for m in movements], Gait.of(movements), own)
            header = {
                "weights": fingerprint,
                "controller": own.controller,
                "licence": licence,
                "source": ", ".join(clips),
            }
            write(Path(out_dir) / f"{name}.safetensors", name, style, header)
            written.append(name)
    return written


def find_clip(data_dir: Path, clip: str) -> Path | None:
    """Where a clip (archive/file.bvh) lies under a data folder, at any depth."""
    direct = Path(data_dir) / clip
    return direct if direct.exists() else files_under(Path(data_dir)).get(Path(clip).name)


@cache
def files_under(folder: Path) -> dict[str, Path]:
    """The BVH files under a folder by name."""
    return {path.name: path for path in sorted(folder.rglob("*.bvh"))}


def movements_of(data_dir: Path, clips: Sequence[str]) -> list[Movement]:
    """What the clips of a style show, the first clip's own movement first; nothing where that clip is not there."""
    paths = [find_clip(data_dir, clip) for clip in clips]
    if paths[0] is None:
        return []
    return [movement for path in paths if path for movement in movements_in(trim_ends(clip_features(load_clip(path))))]


def trim_ends(features: np.ndarray) -> np.ndarray:
    """A clip's features (frames, 21, 15) without MARGIN of them at either end."""
    margin = int(len(features) * MARGIN)
    return features[margin : len(features) - margin]
