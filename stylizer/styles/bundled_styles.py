"""The styles that come with Patchwalk: how each is computed from the clips that `clip_table` names."""

from functools import cache
from pathlib import Path
from typing import Sequence

from sim.io.provenance import NONCOMMERCIAL, noncommercial
from sim.motion.clip import Clip
from sim.motion.features import clip_features
from sim.motion.in_place import restore_travel
from sim.retarget.retarget import load_clip
from stylizer.styles import own_style
from stylizer.styles.bank import LOOP_SECONDS, own_motion_file
from stylizer.styles.clip_table import CLIPS, licence_of
from stylizer.styles.encoding import encode_clips
from stylizer.styles.own_style import OWN
from stylizer.styles.style_clips import Gait, Movement, movements_in
from stylizer.styles.style_file import read_own_motion, write
from stylizer.systems import checkpoint

MARGIN = 0.15  # share of a clip at each end that is left out: starts, stops and T-poses


def build_bundled(weights_name: str, weights_folder: Path, data_dir: Path, out_dir: Path) -> list[str]:
    """Computes with the given weights the own style, which needs no data, and every style of CLIPS whose first clip
    lies under data_dir, into out_dir/weights_name and its `noncommercial` folder; returns their names."""
    model, fingerprint = checkpoint.load(weights_name, weights_folder)
    own = read_own_motion(own_motion_file())
    own_style.write_own_style(Path(out_dir) / weights_name, own, model, fingerprint)
    written = [OWN]
    for name, clips in CLIPS.items():
        movements, licence = movements_of(data_dir, clips), licence_of(clips)
        if movements:
            style = encode_clips(model, [m.windows for m in movements], Gait.of(movements), own)
            header = {
                "weights": fingerprint,
                "controller": own.controller,
                "licence": licence,
                "source": ", ".join(clips),
            }
            write(folder_for(licence, Path(out_dir)) / weights_name / f"{name}.safetensors", name, style, header)
            written.append(name)
    return written


def folder_for(licence: str, folder: Path) -> Path:
    """The folder, or its `noncommercial` one, for what has this licence."""
    return noncommercial(folder) if NONCOMMERCIAL in licence else folder


def find_clip(data_dir: Path, clip: str) -> Path | None:
    """Where a clip of CLIPS lies under a data folder, at any depth."""
    file = clip.partition("@")[0]
    direct = Path(data_dir) / file
    return direct if direct.exists() else files_under(Path(data_dir)).get(Path(file).name)


@cache
def files_under(folder: Path) -> dict[str, Path]:
    """The BVH files under a folder by name."""
    return {path.name: path for path in sorted(folder.rglob("*.bvh"))}


def read_clip(data_dir: Path, clip: str) -> Clip | None:
    """The motion of a clip of CLIPS: the seconds that it names, or all but its ends; None where it is not there."""
    path = find_clip(data_dir, clip)
    if path is None:
        return None
    motion = restore_travel(load_clip(path), LOOP_SECONDS)
    seconds = clip.partition("@")[2]
    if not seconds:
        return trim_ends(motion)
    first, last = (round(float(second) * motion.fps) for second in seconds.split("-"))
    return motion[first:last]


def movements_of(data_dir: Path, clips: Sequence[str]) -> list[Movement]:
    """What the clips of a style show, the first clip's own movement first; nothing where that clip is not there."""
    motions = [read_clip(data_dir, clip) for clip in clips]
    if motions[0] is None:
        return []
    return [movement for motion in motions if motion for movement in movements_in(clip_features(motion))]


def trim_ends(clip: Clip) -> Clip:
    """A clip without MARGIN of it at either end."""
    margin = int(len(clip) * MARGIN)
    return clip[margin : len(clip) - margin]
