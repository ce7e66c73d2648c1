"""Contents in styles that the classifiers have never seen together, and how real motion fares there.

No performer did everything: of the pairs of a source and a style that the table of transfer is made of, nearly half are
combinations that no labelled clip shows (who walks for SNU never runs; set 1 never turns on the spot). What classifiers
say of those is to be read beside what they say of real motion whose combination was kept from them."""

from collections import defaultdict
from pathlib import Path
from typing import Callable, Iterable, Sequence

import numpy as np

from stylizer.data.style_labels import SHORTEST, LabelledTakes, Take, windows
from stylizer.evaluation.classifier import load_classifier

FOLDS = 4  # each keeps about a fourth of every style's contents from its classifiers
WINDOWS_A_CLIP = 5  # windows of a take that are judged, evenly spread

Pair = tuple[str, str]  # content, style


def shown_pairs(takes: Sequence[Take]) -> set[Pair]:
    """Those that some of the takes show."""
    return {(take.content, take.style) for take in takes}


def split_folds(known: Iterable[Pair]) -> list[set[Pair]]:
    """What to keep from classifiers: the contents of every style that was captured doing several things, shared out in
    turn."""
    contents = defaultdict(list)
    for content, style in sorted(known):
        contents[style].append(content)
    several = [(style, ones) for style, ones in sorted(contents.items()) if len(ones) > 1]
    shared: list[set[Pair]] = [set() for _ in range(FOLDS)]
    for first, (style, ones) in enumerate(several):
        for number, content in enumerate(ones):
            shared[(first + number) % FOLDS].add((content, style))
    return [fold for fold in shared if fold]


def measure_real_unknown(
    data: LabelledTakes, kept: Sequence[set[Pair]], folder: Path, tick: Callable[[], object]
) -> dict[str, float | None]:
    """SRA and CRA of real takes by classifiers that never saw their content in their style, for each of `kept` (see
    `split_folds`); classifiers are kept in `folder`. Calls tick 2 STEPS times for each."""
    hits: dict[str, list[float]] = {"style": [], "content": []}
    for fold in kept:
        learned = [take for take in data.classify if (take.content, take.style) not in fold]
        for kind, found in hits.items():
            one = load_classifier(kind, learned, folder, tick=tick)
            for take in data.generate:
                if (take.content, take.style) in fold:
                    starts = np.linspace(0, len(take.features) - SHORTEST, WINDOWS_A_CLIP).astype(int)
                    names, _ = one.names(windows(take.features, starts))
                    found.append(float(np.mean([name == getattr(take, kind) for name in names])))
    sra, cra = (float(np.mean(found)) if found else None for found in hits.values())
    return {"sra": sra, "cra": cra, "takes": len(hits["style"])}
