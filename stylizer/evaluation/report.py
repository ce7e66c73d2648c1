"""Evaluation of the stylizer: classifiers trained on one half of the labelled motion, every network evaluated on the
other (Sec. 7.2)."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Iterable

from sim.io.provenance import SHIPPED, allowed
from sim.io.user_dirs import cache_folder
from sim.torch_setup import set_up_torch
from stylizer.data import style_labels
from stylizer.data.style_labels import LabelledTakes
from stylizer.evaluation.classifier import STEPS, load_classifier
from stylizer.evaluation.figures import Further
from stylizer.evaluation.held_out_pairs import measure_real_unknown, shown_pairs, split_folds
from stylizer.evaluation.transfer_benchmark import (
    TRIALS,
    Classifiers,
    Transfer,
    measure_milliseconds,
    measure_real,
    measure_transfer,
)
from stylizer.systems import checkpoint, weight_files
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle

# What is measured, in the order of the table: name of the weights, offline or live, pairs a trial. Where the weights
# are not there, the row is left out.
ROWS = (
    ("joints", "offline", 44),
    ("joints", "live", 22),
    ("joints_half_second", "offline", 44),
    ("joints_no_attention", "offline", 44),
    ("joints_whole_body_adain", "offline", 44),
    ("slim", "offline", 44),
    ("slim", "live", 22),
    ("paper_narrow", "offline", 44),
    ("full", "offline", 22),
    ("large", "offline", 22),
)
LEFT_OUT = "left_out"  # weights whose training left some styles out, and what that option is called
LEFT_OUT_SIZE = SAME_CONTENT_SIZE = 22
REAL_SIZE = 88
FURTHER_FIGURES = 5

Progress = Callable[[int], Callable[[], object]]


@dataclass(frozen=True)
class Evaluation:
    """The report as JSON has it, what was left out and why, and the material for pictures."""

    report: dict
    notes: list[str]
    data: LabelledTakes
    model: JointPuzzle


def evaluate_transfer(data_dir: Path, folder: Path | None = None, progress: Progress | None = None) -> Evaluation:
    """Trains the classifiers (or finds them trained), evaluates every network whose weights are there, measures the
    shipped one further.

    folder: where more weights lie than those shipped (full.safetensors ...). progress(steps) is given how much there is
    to do and returns what to call once a step. Raises ValueError where `data_dir` holds no labelled motion or weights
    are broken."""
    found = find_weights([*(name for name, _, _ in ROWS), LEFT_OUT], folder)
    left_out = found.pop(LEFT_OUT, None)
    present = [entry for entry in ROWS if entry[0] in found]
    files = style_labels.labelled_files(data_dir)
    kept = split_folds(files)
    steps = sum(map(len, files.values())) + 2 * STEPS * (1 + len(kept)) + FURTHER_FIGURES
    steps += TRIALS * (sum(size for _, _, size in present) + 2 * SAME_CONTENT_SIZE + (LEFT_OUT_SIZE if left_out else 0))
    tick = progress(steps) if progress else lambda: None
    models = {name: checkpoint.load(name, where)[0] for name, where in found.items()}
    data, classifiers = load_data_and_classifiers(data_dir, tick)
    rows = []
    for name, mode, size in present:
        transfer = Transfer(models[name], mode)
        figures = measure_transfer(transfer, data.generate, classifiers, size, tick)
        rows.append(
            {
                "model": name,
                "mode": mode,
                **figures,
                "parameters": [models[name].parameter_count(), 0],
                "ms_per_frame": measure_milliseconds(transfer),
            }
        )
    further = Further(models[SHIPPED], data.generate).all(tick)
    for mode in ("offline", "live"):
        transfer = Transfer(models[SHIPPED], mode)
        further[f"same_content_{mode}"] = measure_transfer(
            transfer, data.generate, classifiers, SAME_CONTENT_SIZE, tick, same_content=True
        )
    if left_out:
        further[LEFT_OUT] = _unseen(left_out / f"{LEFT_OUT}.safetensors", data, classifiers, tick)
    further["real_where_unknown"] = measure_real_unknown(data, kept, cache_folder(), tick)
    report = {"real": measure_real(data.generate, classifiers, REAL_SIZE), "rows": rows, "figures": further}
    wanted = dict.fromkeys([name for name, _, _ in ROWS] + [LEFT_OUT])
    there = {*found, *([LEFT_OUT] if left_out else [])}
    notes = [f"no weights for {name}: its row is left out" for name in wanted if name not in there]
    return Evaluation(round_figures(report), notes, data, models[SHIPPED])


def find_weights(names: Iterable[str], folder: Path | None) -> dict[str, Path]:
    """Of these names the weights that are in the package or in `folder`, which goes first, and where they are."""
    folders = [*allowed(weight_files.FOLDER), *([folder] if folder else [])]
    return {name: where for name in names for where in folders if (where / f"{name}.safetensors").exists()}


def load_data_and_classifiers(data_dir: Path, tick: Callable[[], object]) -> tuple[LabelledTakes, Classifiers]:
    """The labelled motion and classifiers trained on it, on one thread as all that is timed; calls tick once a file and
    a step."""
    set_up_torch()
    data = style_labels.load(data_dir, tick)
    content, style = (load_classifier(kind, data.classify, cache_folder(), tick=tick) for kind in ("content", "style"))
    return data, Classifiers(content, style, frozenset(shown_pairs(data.classify)))


def _unseen(path: Path, data: LabelledTakes, classifiers: Classifiers, tick: Callable[[], object]) -> dict:
    """How weights do on the styles that `patchwalk train stylizer --leave-out WORD ...` kept from them."""
    words = checkpoint.read(path)[0]["command"].partition("--leave-out ")[2].split()
    targets = [take for take in data.generate if any(word in take.path.stem.lower() for word in words)]
    if not targets:
        raise ValueError(f"{path} says of no labelled style that it was left out: train it with --leave-out WORD ...")
    model, _ = checkpoint.load(path.stem, path.parent)
    figures = measure_transfer(Transfer(model, "offline"), data.generate, classifiers, LEFT_OUT_SIZE, tick, targets)
    return {"styles": sorted({take.style for take in targets}), "sra": figures["sra"], "cra": figures["cra"]}


def round_figures(value: Any) -> Any:
    """Four significant digits of every number in a report."""
    if isinstance(value, dict):
        return {key: round_figures(item) for key, item in value.items()}
    if isinstance(value, list):
        return [round_figures(item) for item in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value
