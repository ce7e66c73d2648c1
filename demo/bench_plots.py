"""The picture of a bench report: times of what it compares, of crowds, and of the frames as they went by."""

from pathlib import Path

import matplotlib
import numpy as np

from sim.atomic import replacing
from sim.latency import BUDGET_MS, STAGES

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402 - after the choice of a backend that needs no display

OURS, THEIRS, LATE = "#0b6e99", "#9aa5b1", "#c8553d"
STYLE = {"font.size": 9, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
         "axes.axisbelow": True, "grid.color": "#e6e9ec", "axes.edgecolor": "#9aa5b1", "legend.frameon": False, "figure.dpi": 120}
LABELS = {"full": "Motion Puzzle, full", "paper_slim": "Motion Puzzle, paper's slim", "shipped": "stylizer, shipped"}


def save(report: dict, path: Path) -> None:
    """Draws a report of demo.bench into a PNG."""
    with plt.rc_context(STYLE), replacing(path) as temporary:
        figure, (top, bottom) = plt.subplots(2, 2, figsize=(10, 6), width_ratios=(3, 2), layout="constrained")
        _compared(top[0], report)
        _crowds(top[1], report)
        _frames(bottom[0], report)
        _stages(bottom[1], report)
        machine = report["machine"]
        figure.suptitle(f"{machine['cpu']}, {machine['threads']} thread, torch {machine['torch']}", fontsize=9, color=THEIRS)
        figure.savefig(temporary, format="png")
        plt.close(figure)


def _compared(axes, report: dict) -> None:
    times = [report["stylizer_ms"][name] for name in LABELS]
    middle = [time["p50"] for time in times]
    spread = [[0] * len(times), [time["p99"] - time["p50"] for time in times]]
    axes.barh(list(LABELS.values()), middle, xerr=spread, color=[THEIRS, THEIRS, OURS], ecolor=LATE, height=0.6)
    for row, ms in enumerate(middle):
        axes.text(ms, row - 0.33, f"{ms:.2f} ms", fontsize=8, va="bottom")
    axes.set(title="one frame's style, ms: median, and up to p99", xlabel="ms")
    axes.invert_yaxis()


def _crowds(axes, report: dict) -> None:
    sizes, each = zip(*((int(size), ms) for size, ms in report["characters"].items()))
    axes.plot(sizes, each, "o-", color=OURS)
    for size, ms in zip(sizes, each):
        axes.annotate(f"{ms:.2f}", (size, ms), (0, 6), textcoords="offset points", ha="center", fontsize=8)
    axes.set(xscale="log", ylim=(0, 1.3 * max(each)), title="a character's whole frame, ms", xlabel="characters")
    axes.set_xticks(sizes, map(str, sizes))


def _frames(axes, report: dict) -> None:
    seconds = np.array(report["timeline"]).reshape(-1, 2)
    for column, name, colour in ((0, "p50", OURS), (1, "p99", LATE)):
        axes.plot(np.arange(len(seconds)) + 1, seconds[:, column], color=colour, label=name, linewidth=1)
    axes.axhline(BUDGET_MS / 2, color=THEIRS, linestyle="--", linewidth=1)
    axes.text(0, BUDGET_MS / 2, " half of a 60 Hz frame", fontsize=8, va="bottom", transform=axes.get_yaxis_transform())
    axes.set(ylim=(0, None), title="whole frame without drawing, ms, second by second", xlabel="second of motion")
    axes.legend(ncols=2)


def _stages(axes, report: dict) -> None:
    stages = [stage for stage in STAGES if stage in report and stage != "frame"]
    axes.bar(stages, [report[stage]["p99_ms"] for stage in stages], color="#d7e3ea", label="p99")
    axes.bar(stages, [report[stage]["p50_ms"] for stage in stages], color=OURS, label="p50")
    axes.set(ylim=(0, 1.25 * max(report[stage]["p99_ms"] for stage in stages)), title="stages of a frame, ms")
    axes.legend(ncols=2)
