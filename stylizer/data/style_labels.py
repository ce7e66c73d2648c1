"""The labelled motion that transfer is judged on: locomotion of Bandai-Namco and SNU by content and style, in two fixed
halves.

`classify` teaches the classifiers (stylizer.evaluation.classifier), `generate` holds the sources and the styles to
evaluate (Sec. 7.2.2)."""

import re
import zlib
from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Callable, Iterable, Sequence

import numpy as np

from sim.motion.clip import Clip
from sim.motion.features import STRIDE, clip_features
from sim.retarget.retarget import load_clip

# Whose names tell what is in them: set (its performer's styles are told apart from those of another), content and
# style.
NAMES = tuple(
    map(
        re.compile,
        (
            r"dataset-(?P<set>\d)_(?P<content>[a-z-]+)_(?P<style>[a-z-]+)_\d+",
            r"(?P<set>wd2)_(?P<content>Walk)(?P<style>Azuma|HandWav|Lean|SameSame|Soldier|Sukiko|TongTong)\d+",
        ),
    )
)
CONTENTS = ("walk", "run", "dash", "walk-back", "walk-left", "walk-right", "walk-turn-left", "walk-turn-right")
MOST_TAKES = 4  # of one content in one style and half; set 2 has up to 50
SHORTEST = 64  # frames: a take shorter than a window of the classifiers (SAMPLES at 30 Hz)
SAMPLES = 32
CUT_FROM = 2 * SHORTEST + 8  # frames: where a label has one take, it is cut in two if it is so long


@dataclass(eq=False)
class Take:
    """One clip, or half of one, with its labels. The sets have different performers, so their styles are told apart."""

    content: str
    style: str
    clip: Clip
    path: Path

    @cached_property
    def features(self) -> np.ndarray:
        """(frames, 21, 15)"""
        return clip_features(self.clip)


@dataclass
class LabelledTakes:
    """The two halves."""

    classify: list[Take]
    generate: list[Take]


def load(data_dir: Path, tick: Callable[[], object] = lambda: None) -> LabelledTakes:
    """Reads both halves from the labelled files anywhere under data_dir; calls tick once a file.

    Of each content in each style, takes go to the two halves in turn, in an order that their names' hash decides; a
    single long take is cut in two, a single short one serves `generate`. Raises ValueError where there is none."""
    groups = labelled_files(data_dir)
    if not groups:
        raise ValueError(
            f"{data_dir} holds no labelled motion (dataset-1_walk_old_001.bvh ...): unpack bandai-namco there"
        )
    result = LabelledTakes([], [])
    for (content, style), files in groups.items():
        takes = []
        for path in files[: 2 * MOST_TAKES]:
            clip = load_clip(path)
            tick()
            if len(clip) >= SHORTEST:
                takes.append(Take(content, style, clip, path))
        if len(takes) == 1 and len(takes[0].clip) >= CUT_FROM:
            whole = takes[0].clip
            takes = [
                Take(content, style, part, takes[0].path)
                for part in (whole[: len(whole) // 2], whole[len(whole) // 2 :])
            ]
        result.generate += takes[::2]
        result.classify += takes[1::2]
    return result


def labelled_files(data_dir: Path) -> dict[tuple[str, str], list[Path]]:
    """(content, style) -> files, in an order that has nothing to do with when they were captured."""
    groups = defaultdict(list)
    for path in sorted(Path(data_dir).rglob("*.bvh")):
        if (label := labels(path.stem)) and label[0] in CONTENTS:
            groups[label].append(path)
    return {
        label: sorted(files, key=lambda path: zlib.crc32(path.stem.encode())) for label, files in sorted(groups.items())
    }


def labels(name: str) -> tuple[str, str] | None:
    """Content and style that the name of a file without its suffix tells, the style with its set; None for another
    name."""
    found = next(filter(None, (pattern.fullmatch(name) for pattern in NAMES)), None)
    return found and (found["content"].lower(), f"{found['style'].lower()} {found['set']}")


def windows(features: np.ndarray, starts: Iterable[int]) -> np.ndarray:
    """(n, SAMPLES, 21, 15) at 30 Hz from features (frames, 21, 15) at 60 Hz."""
    return features[np.asarray(list(starts))[:, None] + STRIDE * np.arange(SAMPLES)]


def draw_balanced(random: np.random.Generator, takes: Sequence[Take], label: str) -> list[int]:
    """Indices of takes, one for each value of `label` ("content" or "style"), in turn and at random within."""
    values = sorted({getattr(take, label) for take in takes})
    return [
        int(random.choice([i for i, take in enumerate(takes) if getattr(take, label) == value])) for value in values
    ]
