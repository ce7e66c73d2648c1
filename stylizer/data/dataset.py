"""Training data: a folder of BVH files, packed once into one array of features."""

import json
import re
import zlib
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Callable, Iterable

import numpy as np
from tqdm import tqdm

from sim.body.skeleton import INDEX, JOINT_COUNT, skeleton_hash
from sim.io.atomic_write import atomic_write
from sim.io.provenance import CONTROLLER
from sim.motion.clip import FPS, Clip
from sim.motion.features import FEATURES, LAYOUT, LAYOUT_VERSION, STRIDE, WINDOW, clip_features
from sim.motion.thresholds import MOVING_CLIP
from sim.retarget.retarget import load_clip
from stylizer.data.style_labels import labels

STYLE_WINDOW = 32  # samples of a style clip in training: about one gait cycle
CLIP_WINDOW = 64  # samples of it a style is read from: a slow gait cycle and more
CONTENT_SPAN = (WINDOW - 1) * STRIDE  # frames between the first and the last sample of a content window
LATER = 7  # frames between a content window and the later one that sees the same instants again; odd
SHORTEST = CONTENT_SPAN + LATER + 1  # frames; shorter clips hold no window
UPRIGHT = 0.55  # metres; clips whose hips come lower (crawling, lying) are not what a standing character does
STILL_SHARE = 0.5
HELD_OUT_EVERY = 10  # one clip in ten, by a hash of its name, is never trained on


@dataclass(frozen=True)
class PackedClip:
    """Where a clip lies in the packed array. label: its name without numbers, which groups takes of one action."""

    name: str
    label: str
    start: int
    frames: int
    speed: float  # mean root speed, m/s

    @property
    def performer_style(self) -> str | None:
        """What clips share that one person moves in, in one style, where that is known."""
        if found := labels(Path(self.name).name):
            return found[1]
        return CONTROLLER if self.name.startswith(f"{CONTROLLER}/") else None

    @property
    def held_out(self) -> bool:
        return zlib.crc32(self.name.encode()) % HELD_OUT_EVERY == 0


def pack(data_dir: Path, out_dir: Path) -> "MotionData":
    """Reads every BVH under data_dir into out_dir/motion.f16 and clips.json; a finished pack of the same files is kept.

    Files that cannot be used are counted with the reason in `skipped`. Raises ValueError where nothing can be used."""
    files = sorted(Path(data_dir).rglob("*.bvh"))
    if not files:
        raise ValueError(f"no .bvh files under {data_dir}: give a folder of BVH motion with --data")
    source = {
        "features": LAYOUT_VERSION,
        "skeleton": skeleton_hash(),
        "files": zlib.crc32("\n".join(f"{f} {f.stat().st_size}" for f in files).encode()),
    }
    index = Path(out_dir) / "clips.json"
    if _source_of(index) == source:
        return MotionData.open(out_dir)
    out_dir.mkdir(parents=True, exist_ok=True)
    index.unlink(missing_ok=True)  # until the pack is whole there is none: who is killed here begins anew
    clips, start = [], 0
    skipped: Counter[str] = Counter()
    raw = out_dir / "motion.f16"
    with raw.open("wb") as sink:
        for path in tqdm(files, desc="reading motion", unit="clip"):
            try:
                features = _usable_features(load_clip(path))
            except (ValueError, OSError) as error:
                skipped[str(error).replace(str(path), "").replace(path.name, "")[:100]] += 1
                continue
            name = str(path.relative_to(data_dir).with_suffix(""))
            speed = float(np.linalg.norm(features[:, 0, LAYOUT["root"]][:, :2], axis=1).mean())
            clips.append(PackedClip(name, re.sub(r"[\d_]+", "_", name), start, len(features), speed))
            features.astype(np.float16).tofile(sink)
            start += len(features)
    if not clips:
        reason = skipped.most_common(1)[0][0]
        raise ValueError(f"none of the {len(files)} BVH files under {data_dir} can be used: {reason}")
    with atomic_write(index) as temporary:
        temporary.write_text(json.dumps({"source": source, "skipped": skipped, "clips": [asdict(c) for c in clips]}))
    return MotionData.open(out_dir)


def _source_of(index: Path) -> object:
    """What a finished pack was made of; None where there is none, or not a whole one."""
    try:
        return json.loads(index.read_text())["source"]
    except (OSError, ValueError, LookupError, TypeError):
        return None


def _usable_features(clip: Clip) -> np.ndarray:
    if len(clip) < SHORTEST:
        raise ValueError(f"shorter than {SHORTEST / FPS:.2f} s")
    features = clip_features(clip)
    if not np.isfinite(features).all():
        raise ValueError("holds numbers that are not finite")
    if features[:, INDEX["Hips"], 1].min() < UPRIGHT:
        raise ValueError("not upright throughout")
    return features


class MotionData:
    """Packed features (frames, 21, 15) and the clips in them."""

    def __init__(self, motion: np.ndarray, clips: list[PackedClip], skipped: dict[str, int]) -> None:
        self.motion, self.clips, self.skipped = motion, clips, skipped

    @classmethod
    def open(cls, folder: Path) -> "MotionData":
        """Maps a finished pack into memory."""
        index = json.loads((Path(folder) / "clips.json").read_text())
        motion = np.memmap(Path(folder) / "motion.f16", np.float16, "r").reshape(-1, JOINT_COUNT, FEATURES)
        return cls(
            motion, [PackedClip(**clip) for clip in index["clips"] if clip["frames"] >= SHORTEST], index["skipped"]
        )

    def split(self, held_out: bool) -> "MotionData":
        """The clips for training, or the held-out ones; a set too small to split serves as both."""
        clips = [clip for clip in self.clips if clip.held_out == held_out] or self.clips
        return MotionData(self.motion, clips, self.skipped)

    def without(self, words: Iterable[str]) -> "MotionData":
        """The clips in whose file name none of the words stands. Raises ValueError where none is left."""
        clips = [clip for clip in self.clips if not any(word in Path(clip.name).name.lower() for word in words)]
        if not clips:
            raise ValueError("every clip is left out: leave out fewer words")
        return MotionData(self.motion, clips, self.skipped)

    def features(self, clip: PackedClip) -> np.ndarray:
        """(frames, 21, 15) of one clip."""
        return np.asarray(self.motion[clip.start : clip.start + clip.frames], dtype=np.float32)

    def weights(self) -> tuple[np.ndarray, np.ndarray]:
        """How often each clip is drawn as source and as target, gestures and idling less than locomotion.

        Both: half of the time labels by the square root of their length, so that rare ones are seen. Otherwise sources
        are folders by the square root of theirs, so that small archives count; and targets all manners alike."""
        by_label = self._shares(lambda clip: clip.label)
        by_folder = self._shares(lambda clip: clip.name.split("/")[0])
        by_performer_style = (
            self._shares(lambda clip: clip.performer_style, alike=True)
            if any(clip.performer_style for clip in self.clips)
            else by_label
        )
        return (by_label + by_folder) / 2, (by_label + by_performer_style) / 2

    def _shares(self, group_of: Callable[[PackedClip], str | None], alike: bool = False) -> np.ndarray:
        """Shares of 1: groups by the square root of their length, or all alike; clips within a group by their length,
        gestures and idling less. A clip of no group has none."""
        groups = [group_of(clip) for clip in self.clips]
        frames: Counter[str | None] = Counter()
        for group, clip in zip(groups, self.clips):
            frames[group] += clip.frames
        shares = np.array(
            [
                clip.frames
                / frames[group] ** (1.0 if alike else 0.5)
                * (1.0 if clip.speed > MOVING_CLIP else STILL_SHARE)
                * (group is not None)
                for group, clip in zip(groups, self.clips)
            ]
        )
        return shares / shares.sum()
