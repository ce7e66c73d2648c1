"""One table of all style-transfer systems (`patchwalk evaluate stylizer --all`): the same pairs, the same classifiers,
one thread."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Sequence

import numpy as np
import torch

from sim.body.skeleton import PART_NAMES
from sim.io.bvh_parser import shorten
from sim.motion.features import clip_features
from stylizer.data import style_labels
from stylizer.data.style_labels import SHORTEST, Take, windows
from stylizer.evaluation.classifier import STEPS
from stylizer.evaluation.report import Progress, find_weights, load_data_and_classifiers, round_figures
from stylizer.evaluation.transfer_benchmark import (
    JUDGED,
    SEGMENT,
    TRIALS,
    Classifiers,
    Transfer,
    measure_milliseconds,
    measure_real,
    measure_transfer,
)
from stylizer.networks.layers import of_kind
from stylizer.runtime.offline import Network, ResolvedStyle, evaluate
from stylizer.styles.code_bank import UNKNOWN_GAIT
from stylizer.styles.joint_tokens import TOKENS
from stylizer.styles.style_clips import StyleClips
from stylizer.systems import checkpoint
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.registry import SYSTEMS
from stylizer.systems.whole_body import WholeBody

# Weights, mode, pairs a trial. `sampled`: offline, with styles by label or from the prior instead of from a clip.
ALL = (
    ("full", "offline", 22),
    ("large", "offline", 22),
    ("joints", "offline", 44),
    ("joints", "live", 22),
    ("slim", "offline", 44),
    ("slim", "live", 22),
    *(
        (name, mode, size)
        for name in ("unpaired", "diverse", "latent", "latent_vae", "latent_unlabelled")
        for mode, size in (("offline", 44), ("live", 22), ("sampled", 44))
    ),
)
REAL_SIZE = 88
DIVERSE_CONTENTS, DIVERSE_DRAWS = 8, 4  # motions, and styles that each is restyled in, of one label
CLIP = 160  # samples: the clip of Guo et al. 2024, Table 5
CLIP_TIMES = 5
INTERVAL = 1.96 / TRIALS**0.5  # deviations over the trials that make half of a 95% interval of their mean


@dataclass(frozen=True)
class Comparison:
    """The report as JSON has it, each figure as [mean, deviation, half of the 95% interval], and what was left out."""

    report: dict
    notes: list[str]


class Sampled(Transfer):
    """Transfer where nobody shows the style: a code by chance, of the target's label if the system knows labels."""

    model: WholeBody

    def __init__(self, model: WholeBody) -> None:
        super().__init__(model, "offline")
        self.random = np.random.default_rng(0)
        self.by_label = getattr(model.config, "labelled", True)
        self.style = self._draw

    def _draw(self, take: Take) -> StyleClips:
        code = self.model.sample_code(take.style if self.by_label else None, self.random)
        return StyleClips(code[None], UNKNOWN_GAIT)

    def targets(self, takes: Sequence[Take]) -> Sequence[Take]:
        """Those whose style it can draw: of labels that it learned; all where it asks for none or knows none of
        them."""
        return self.by_label and [take for take in takes if take.style in self.model.config.labels] or takes


def compare(
    data_dir: Path, folder: Path | None = None, progress: Progress | None = None, networks: Sequence[str] = ()
) -> Comparison:
    """Judges every system whose weights are in the package or in `folder`, or only those of `networks`.

    Raises ValueError for a network that is not judged or has no weights there, where `data_dir` holds no labelled
    motion or weights are broken."""
    known = dict.fromkeys(name for name, _, _ in ALL)
    if unknown := [name for name in networks if name not in known]:
        raise ValueError(f"there is no network '{shorten(unknown[0])}' to compare: use some of {', '.join(known)}")
    chosen = [name for name in known if name in networks or not networks]
    found = find_weights(chosen, folder)
    missing = [name for name in chosen if name not in found]
    if networks and missing:
        raise ValueError(f"there are no weights of {missing[0]}: name the folder that holds them with --weights")
    models = {name: checkpoint.load(name, where)[0] for name, where in found.items()}
    entries = [
        entry
        for entry in ALL
        if entry[0] in models and (entry[1] != "sampled" or SYSTEMS[models[entry[0]].KIND].samples_styles)
    ]
    files = sum(map(len, style_labels.labelled_files(data_dir).values()))
    tick = progress(files + 2 * STEPS + TRIALS * sum(size for *_, size in entries)) if progress else lambda: None
    data, classifiers = load_data_and_classifiers(data_dir, tick)
    rows = [
        measure_network(models[name], name, mode, size, data.generate, classifiers, tick)
        for name, mode, size in entries
    ]
    real = {name: with_interval(figure) for name, figure in measure_real(data.generate, classifiers, REAL_SIZE).items()}
    notes = [f"no weights for {name}: its rows are left out" for name in missing]
    return Comparison(round_figures({"real": real, "rows": rows}), notes)


def measure_network(
    model: Network,
    name: str,
    mode: str,
    size: int,
    takes: Sequence[Take],
    classifiers: Classifiers,
    tick: Callable[[], object],
) -> dict:
    """One row."""
    sampled = Sampled(of_kind(WholeBody, model)) if mode == "sampled" else None
    transfer = sampled or Transfer(model, mode)
    figures = measure_transfer(transfer, takes, classifiers, size, tick, sampled.targets(takes) if sampled else None)
    if sampled and not sampled.by_label:
        figures |= {"sra": None, "drawn_sra": None}  # nobody asked for a style
    return {
        "model": name,
        "mode": mode,
        **{key: with_interval(figure) for key, figure in figures.items()},
        "diversity": with_interval(diversity(sampled, takes, classifiers)) if sampled else None,
        "parameters": [model.parameter_count(), 0, 0],
        "ms_per_frame": [*measure_milliseconds(transfer), 0.0],
        "clip_ms": with_interval(clip_milliseconds(model)),
    }


def with_interval(figure: list[float] | None) -> list[float] | None:
    """[mean, deviation] with half of the 95% interval of the mean behind it."""
    return None if figure is None else [*figure, INTERVAL * figure[1]]


def diversity(transfer: Sampled, takes: Sequence[Take], classifiers: Classifiers) -> list[float]:
    """How far results of one motion in styles drawn of one label are apart (Lee et al. 2019): the mean distance of what
    the style classifier sees in them, as [mean, deviation] over the motions."""
    random = np.random.default_rng(0)
    sources, targets = [take for take in takes if len(take.clip) >= SEGMENT], transfer.targets(takes)
    distances = []
    for _ in range(DIVERSE_CONTENTS):
        source, target = (some[int(random.integers(len(some)))] for some in (sources, targets))
        features = clip_features(source.clip[:SEGMENT])
        outputs = [
            evaluate(transfer.model, features, dict.fromkeys(PART_NAMES, ResolvedStyle(transfer.style(target))))
            for _ in range(DIVERSE_DRAWS)
        ]
        seen = classifiers.style.names(np.concatenate([windows(a, [len(a) - SHORTEST]) for a in outputs]))[1]
        first, second = np.triu_indices(DIVERSE_DRAWS, 1)
        distances.append(np.linalg.norm(seen[first] - seen[second], axis=1).mean())
    return [float(np.mean(distances)), float(np.std(distances))]


@torch.inference_mode()
def clip_milliseconds(model: Network) -> list[float]:
    """[median, deviation] of what the network takes to restyle a clip of CLIP samples in the style of another as
    long."""
    motion = torch.randn(21, 1, CLIP, 15, generator=torch.Generator().manual_seed(0))
    times = []
    for _ in range(CLIP_TIMES + 1):
        start = time.perf_counter()
        if isinstance(model, WholeBody):
            model.restyled(motion, model.encode(motion, torch.zeros(1, dtype=torch.long)))
        elif isinstance(model, JointPuzzle):
            style = model.encode_style(motion, TOKENS)
            model(motion, style, style, CLIP)
        else:
            style = model.encode_style(motion)
            model(motion, style, style)
        times.append(1000 * (time.perf_counter() - start))
    return [float(np.median(times[1:])), float(np.std(times[1:]))]


def format_comparison(report: dict) -> str:
    """The rows, mean and half of the 95% interval."""
    names = (*JUDGED, "drawn_sra", "geodesic", "diversity", "skate_cm_s", "jitter_ratio")
    columns = "{:<18} {:<8}" + " {:>15}" * len(names) + " {:>11} {:>9} {:>9}"
    lines = [columns.format("model", "mode", *names, "parameters", "ms/frame", "ms/clip")]
    for entry in ({"model": "real motion", "mode": "", **report["real"]}, *report["rows"]):
        cells = ["-" if entry.get(name) is None else f"{entry[name][0]:.3g} ± {entry[name][2]:.2g}" for name in names]
        costs = [
            f"{entry[name][0]:.{digits}f}" if entry["mode"] else "-"
            for name, digits in (("parameters", 0), ("ms_per_frame", 1), ("clip_ms", 1))
        ]
        lines.append(columns.format(entry["model"], entry["mode"], *cells, *costs))
    return "\n".join(lines)
