"""The styles that come with Patchwalk: which clips each is computed from, and how to compute them."""

from functools import cache
from pathlib import Path
from typing import Sequence

from sim.io.provenance import ARCHIVES, NONCOMMERCIAL, noncommercial
from sim.motion.clip import Clip
from sim.motion.features import clip_features
from sim.motion.in_place import restore_travel
from sim.retarget.retarget import load_clip
from stylizer.styles import own_style
from stylizer.styles.bank import LOOP_SECONDS, own_motion_file
from stylizer.styles.encoding import encode_clips
from stylizer.styles.own_style import OWN
from stylizer.styles.style_clips import Gait, Movement, movements_in
from stylizer.styles.style_file import read_own_motion, write
from stylizer.systems import checkpoint

SET_1 = ("run_{}_001", "dash_{}_001", "walk-back_{}_001", "walk-left_{}_001", "walk-right_{}_001")  # besides the walk
# takes of the run
SET_2 = {"active": "042", "elderly": "019", "exhausted": "038", "masculine": "007", "youthful": "004"}

# name: clips in the data folder, archive/file.bvh, or archive/file.bvh@from-to for some seconds of a longer one; the
# first one walks straight ahead, in what the labels say
CLIPS: dict[str, tuple[str, ...]] = {
    **{
        name: (
            f"bandai-namco/dataset-1_walk_{name}_{take}.bvh",
            *(f"bandai-namco/dataset-1_{clip.format(name)}.bvh" for clip in SET_1),
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
        name: (f"bandai-namco/dataset-2_walk_{name}_{take}.bvh", f"bandai-namco/dataset-2_run_{name}_{SET_2[name]}.bvh")
        for name, take in {
            "active": "017",
            "elderly": "009",
            "exhausted": "012",
            "masculine": "013",
            "youthful": "014",
        }.items()
    },
    **{
        name: (f"snu-styles/wd2_Walk{label}.bvh",)
        for name, label in {
            "soldier": "Soldier01",
            "marching": "Azuma01",
            "hunched": "Sukiko01",
            "bouncy": "TongTong01",
            "leaning": "Lean01",
        }.items()
    },
    "carrying": ("accad/Female1_B20_WalkWithBox.bvh",),
    "crouching": ("o3de/Crouching1.bvh@3.0-28.0", "o3de/Crouching1.bvh@31.0-49.5"),
    "hurrying": ("snu-biped/woddy2_walk_straight_very_fast.bvh@12.5-15.0",),
    "lunging": tuple(f"snu-biped/woddy2_wide_ext_walk1.bvh@{part}" for part in ("6.0-8.9", "11.2-14.0", "17.0-20.0")),
    "prowling": ("snu-biped/woddy2_low_walk.bvh@63.5-68.8",),
    "pushing": ("cc0-quaternius/Push_Loop.bvh",),
    "skipping": ("accad/Female1_A14_StandToSkip.bvh@1.5-4.0", "accad/Female1_A13_Skipping.bvh"),
    "slouching": tuple(f"snu-biped/woddy2_walk_normal_style_4.bvh@{part}" for part in ("15.0-19.0", "8.0-11.5")),
    "strutting": tuple(f"snu-biped/woddy2_walk_normal_style_2.bvh@{part}" for part in ("9.3-13.5", "17.0-21.5")),
    "swaggering": ("cmu131/131_01.bvh@4.3-6.1",),
    "tiptoeing": ("cmu131/131_02.bvh@2.5-8.5",),
    "zombie": ("zombie/zombie.bvh@2.5-11.5",),
}
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


def licence_of(clips: Sequence[str]) -> str:
    """Who made the clips of a style, and the licence."""
    return ARCHIVES[clips[0].partition("/")[0]]


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
