"""The picture of a bench report: times of what it compares, of crowds, and of the frames as they went by."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from sim.io.atomic_write import atomic_write
from sim.latency import BUDGET_MS, STAGES

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402 - after the choice of a backend that needs no display

OURS, THEIRS, LATE = "#0b6e99", "#9aa5b1", "#c8553d"
STYLE: dict[Any, object] = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e6e9ec",
    "axes.edgecolor": "#9aa5b1",
    "legend.frameon": False,
    "figure.dpi": 120,
}
LABELS = {"full": "Motion Puzzle, full", "paper_slim": "Motion Puzzle, paper's slim", "shipped": "stylizer, shipped"}


# What is paid for speed: figure of an evaluation's row, its title, and whether more of it is better.
QUALITY = {
    "sra": ("style recognition accuracy", True),
    "geodesic": ("angle to the content, rad", False),
    "jitter_ratio": ("jerk / the content's", False),
}


def save(report: dict, path: Path, quality: list[dict] | None = None) -> None:
    """Draws a report of demo.bench.bench into a PNG; quality: the `rows` of an evaluation of the stylizer, time against
    figures."""
    with plt.rc_context(STYLE), atomic_write(path) as temporary:
        figure = plt.figure(figsize=(10, 9 if quality else 6), layout="constrained")
        parts = figure.subfigures(2, 1, squeeze=False, height_ratios=(2, 1))[:, 0] if quality else [figure]
        top, bottom = parts[0].subplots(2, 2, width_ratios=(3, 2))
        _compared(top[0], report)
        _crowds(top[1], report)
        _frames(bottom[0], report)
        _stages(bottom[1], report)
        if quality:
            for axes, name in zip(parts[1].subplots(1, len(QUALITY)), QUALITY):
                _quality(axes, quality, name)
        machine = report["machine"]
        figure.suptitle(
            f"{machine['cpu']}, {machine['threads']} thread, torch {machine['torch']}", fontsize=9, color=THEIRS
        )
        figure.savefig(temporary, format="png")
        plt.close(figure)


def _compared(axes: Axes, report: dict) -> None:
    times = [report["stylizer_ms"][name] for name in LABELS]
    middle = [time["p50"] for time in times]
    spread = [[0] * len(times), [time["p99"] - time["p50"] for time in times]]
    axes.barh(list(LABELS.values()), middle, xerr=spread, color=[THEIRS, THEIRS, OURS], ecolor=LATE, height=0.6)
    for row, ms in enumerate(middle):
        axes.text(ms, row - 0.33, f"{ms:.2f} ms", fontsize=8, va="bottom")
    axes.set(title="one frame's style, ms: median, and up to p99", xlabel="ms")
    axes.invert_yaxis()


def _crowds(axes: Axes, report: dict) -> None:
    sizes, each = zip(*((int(size), ms) for size, ms in report["characters"].items()))
    axes.plot(sizes, each, "o-", color=OURS)
    for size, ms in zip(sizes, each):
        axes.annotate(f"{ms:.2f}", (size, ms), (0, 6), textcoords="offset points", ha="center", fontsize=8)
    axes.set(xscale="log", ylim=(0, 1.3 * max(each)), title="a character's whole frame, ms", xlabel="characters")
    axes.set_xticks(sizes, map(str, sizes))


def _frames(axes: Axes, report: dict) -> None:
    seconds = np.array(report["timeline"]).reshape(-1, 2)
    for column, name, colour in ((0, "p50", OURS), (1, "p99", LATE)):
        axes.plot(np.arange(len(seconds)) + 1, seconds[:, column], color=colour, label=name, linewidth=1)
    axes.axhline(BUDGET_MS / 2, color=THEIRS, linestyle="--", linewidth=1)
    axes.text(0, BUDGET_MS / 2, " half of a 60 Hz frame", fontsize=8, va="bottom", transform=axes.get_yaxis_transform())
    axes.set(ylim=(0, None), title="whole frame without drawing, ms, second by second", xlabel="second of motion")
    axes.legend(ncols=2)


def _quality(axes: Axes, rows: list[dict], name: str) -> None:
    title, more_is_better = QUALITY[name]
    for row in rows:
        if row.get(name) and row.get("ms_per_frame"):
            (ms, _), (value, deviation) = row["ms_per_frame"], row[name]
            live = row["mode"] == "live"
            axes.errorbar(ms, value, deviation, fmt="o" if live else "s", color=OURS if live else THEIRS, capsize=2)
            axes.annotate(f"{row['model']}, {row['mode']}", (ms, value), (5, 4), textcoords="offset points", fontsize=7)
    better = "more" if more_is_better else "less"
    axes.margins(x=0.35, y=0.25)
    axes.set(xlim=(0, None), title=f"{title} ({better} is better)", xlabel="ms a frame, whole stylizer")


def _stages(axes: Axes, report: dict) -> None:
    stages = [stage for stage in STAGES if stage in report and stage != "frame"]
    axes.bar(stages, [report[stage]["p99_ms"] for stage in stages], color="#d7e3ea", label="p99")
    axes.bar(stages, [report[stage]["p50_ms"] for stage in stages], color=OURS, label="p50")
    axes.set(ylim=(0, 1.25 * max(report[stage]["p99_ms"] for stage in stages)), title="stages of a frame, ms")
    axes.legend(ncols=2)
