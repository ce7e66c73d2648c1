"""The styles that come with Patchwalk: which clip each is computed from, and how to compute them."""

from pathlib import Path

import numpy as np

from sim.features import clip_features
from sim.retarget import load_clip
from sim.sources import ARCHIVES, CONTROLLER
from stylizer import weights
from stylizer.bank import BUNDLED, encode, kept_windows, style_windows, write

BANDAI = "CC BY-NC 4.0 (Bandai Namco Research Inc.)"
SNU = "Apache-2.0 (SNU Movement Research Lab)"
NEUTRAL = "neutral"  # the live motion's own style: the controller walking straight on; its file keeps the windows it is read from

# name: (clip in the data folder, licence); all walk straight ahead, in what their label says
CLIPS = {
    **{name: (f"bandai-namco/dataset-1_walk_{label}.bvh", BANDAI) for name, label in {
        "angry": "angry_002", "childish": "childish_001", "chimpira": "chimpira_002", "feminine": "feminine_001",
        "giant": "giant_002", "happy": "happy_001", "musical": "musical_001", "not-confident": "not-confident_001",
        "old": "old_002", "proud": "proud_001", "sad": "sad_002", "tired": "tired_001"}.items()},
    **{name: (f"bandai-namco/dataset-2_walk_{name}_{take}.bvh", BANDAI) for name, take in {
        "active": "017", "elderly": "009", "exhausted": "012", "masculine": "013", "youthful": "014"}.items()},
    **{name: (f"snu-styles/wd2_Walk{label}.bvh", SNU) for name, label in {
        "soldier": "Soldier01", "marching": "Azuma01", "hunched": "Sukiko01", "bouncy": "TongTong01",
        "leaning": "Lean01"}.items()},
}
MARGIN = 0.15  # share of a clip at each end that is left out: starts, stops and T-poses


def build(weights_name: str, weights_folder: Path, data_dir: Path, out_dir: Path) -> list[str]:
    """Computes with the given weights the neutral style, which needs no data, and every style of CLIPS whose clip lies under
    data_dir; returns their names."""
    model, fingerprint = weights.load(weights_name, weights_folder)
    header, tensors = weights.read(BUNDLED / f"{NEUTRAL}.safetensors")
    windows = kept_windows(tensors)
    write(Path(out_dir) / f"{NEUTRAL}.safetensors", NEUTRAL, encode(model, windows), fingerprint, header["licence"],
          header["source"], windows)
    written = [NEUTRAL]
    for name, (clip, licence) in CLIPS.items():
        path = Path(data_dir) / clip
        if path.exists():
            style = encode(model, style_windows(without_ends(clip_features(load_clip(path)))))
            write(Path(out_dir) / f"{name}.safetensors", name, style, fingerprint, licence, clip)
            written.append(name)
    return written


def keep_neutral(clip: Path, weights_name: str = weights.SLIM) -> None:
    """Makes a BVH of the controller walking straight on (`patchwalk replay --bvh`) the neutral style of this package."""
    model, fingerprint = weights.load(weights_name)
    windows = style_windows(without_ends(clip_features(load_clip(clip))))
    write(BUNDLED / f"{NEUTRAL}.safetensors", NEUTRAL, encode(model, windows), fingerprint, ARCHIVES[CONTROLLER],
          "the controller walking straight on", windows)


def without_ends(features: np.ndarray) -> np.ndarray:
    """A clip's features without MARGIN of them at either end."""
    margin = int(len(features) * MARGIN)
    return features[margin:len(features) - margin]
