"""Evaluation of the stylizer: judges trained on one half of the labelled motion, every network judged on the other
(Sec. 7.2)."""

from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Iterable

import torch

from sim.io.user_dirs import cache_folder
from stylizer.data import style_labels as labelled
from stylizer.data.style_labels import Labelled
from stylizer.evaluation.classifier import STEPS, judge
from stylizer.evaluation.combinations import combinations, folds, real_where_unknown
from stylizer.evaluation.figures import Further
from stylizer.evaluation.transfer_benchmark import TRIALS, Judges, Transfer, milliseconds, real_row, row
from stylizer.networks import checkpoint as weights
from stylizer.systems.motion_puzzle.model import MotionPuzzle

# What is measured, in the order of the table: name of the weights, offline or live, pairs a trial. Where the weights
# are not there, the row is left out.
ROWS = (
    ("full", "offline", 22),
    ("large", "offline", 22),
    ("slim", "offline", 44),
    ("slim", "live", 22),
    ("no_key_poses", "offline", 44),
    ("key_poses_alone", "offline", 44),
    ("no_attention", "offline", 44),
    ("whole_body_adain", "offline", 44),
    ("paper_losses", "offline", 44),
)
LEFT_OUT = "left_out"  # weights whose training left some styles out, and what that option is called
LEFT_OUT_SIZE = SAME_CONTENT_SIZE = 22
REAL_SIZE = 88
FURTHER_FIGURES = 5
SHIPPED = weights.SLIM

Progress = Callable[[int], Callable[[], object]]


@dataclass(frozen=True)
class Evaluation:
    """The report as JSON has it, what was left out and why, and the material for pictures."""

    report: dict
    notes: list[str]
    data: Labelled
    model: MotionPuzzle


def evaluate(data_dir: Path, folder: Path | None = None, progress: Progress | None = None) -> Evaluation:
    """Trains the judges (or finds them trained), judges every network whose weights are there, measures the shipped one
    further.

    folder: where more weights lie than those shipped (full.safetensors ...). progress(steps) is told how much there is
    to do and returns what to call once a step. Raises ValueError where `data_dir` holds no labelled motion or weights
    are broken."""
    found = weights_found([*(name for name, _, _ in ROWS), LEFT_OUT], folder)
    left_out = found.pop(LEFT_OUT, None)
    present = [entry for entry in ROWS if entry[0] in found]
    files = labelled.labelled_files(data_dir)
    kept = folds(files)
    steps = sum(map(len, files.values())) + 2 * STEPS * (1 + len(kept)) + FURTHER_FIGURES
    steps += TRIALS * (sum(size for _, _, size in present) + 2 * SAME_CONTENT_SIZE + (LEFT_OUT_SIZE if left_out else 0))
    tick = progress(steps) if progress else lambda: None
    models = {name: weights.load(name, where)[0] for name, where in found.items()}
    data, judges = judged(data_dir, tick)
    rows = []
    for name, mode, size in present:
        transfer = Transfer(models[name], mode)
        figures = row(transfer, data.generate, judges, size, tick)
        rows.append(
            {
                "model": name,
                "mode": mode,
                **figures,
                "parameters": [models[name].parameter_count(), 0],
                "ms_per_frame": milliseconds(transfer),
            }
        )
    figures = Further(models[SHIPPED], data.generate).all(tick)
    for mode in ("offline", "live"):
        transfer = Transfer(models[SHIPPED], mode)
        figures[f"same_content_{mode}"] = row(
            transfer, data.generate, judges, SAME_CONTENT_SIZE, tick, same_content=True
        )
    if left_out:
        figures[LEFT_OUT] = _unseen(left_out / f"{LEFT_OUT}.safetensors", data, judges, tick)
    figures["real_where_unknown"] = real_where_unknown(data, kept, cache_folder(), tick)
    report = {"real": real_row(data.generate, judges, REAL_SIZE), "rows": rows, "figures": figures}
    wanted = dict.fromkeys([name for name, _, _ in ROWS] + [LEFT_OUT])
    there = {*found, *([LEFT_OUT] if left_out else [])}
    notes = [f"no weights for {name}: its row is left out" for name in wanted if name not in there]
    return Evaluation(rounded(report), notes, data, models[SHIPPED])


def weights_found(names: Iterable[str], folder: Path | None) -> dict[str, Path]:
    """Of these names the weights that are in the package or in `folder`, which goes first, and where they are."""
    folders = [weights.FOLDER, *([folder] if folder else [])]
    return {name: where for name in names for where in folders if (where / f"{name}.safetensors").exists()}


def judged(data_dir: Path, tick: Callable[[], object]) -> tuple[Labelled, Judges]:
    """The labelled motion and judges trained on it, on one thread as all that is timed; calls tick once a file and a
    step."""
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    data = labelled.load(data_dir, tick)
    judges = (judge(kind, data.classify, cache_folder(), tick=tick) for kind in ("content", "style"))
    return data, Judges(*judges, frozenset(combinations(data.classify)))


def _unseen(path: Path, data: Labelled, judges: Judges, tick: Callable[[], object]) -> dict:
    """How weights do on the styles that `patchwalk train stylizer --leave-out WORD ...` kept from them."""
    words = weights.read(path)[0]["command"].partition("--leave-out ")[2].split()
    targets = [take for take in data.generate if any(word in take.path.stem.lower() for word in words)]
    if not targets:
        raise ValueError(f"{path} says of no labelled style that it was left out: train it with --leave-out WORD ...")
    model, _ = weights.load(path.stem, path.parent)
    figures = row(Transfer(model, "offline"), data.generate, judges, LEFT_OUT_SIZE, tick, targets)
    return {"styles": sorted({take.style for take in targets}), "sra": figures["sra"], "cra": figures["cra"]}


def rounded(value):
    """Four significant digits of every number in a report."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value
