"""Pictures of an evaluation: where the character was asked to go and went, how fast, and what its feet did."""

from pathlib import Path
from typing import Any, Mapping, Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from controller.evaluation.suite import Trial
from sim.body.skeleton import TOE_HEIGHT
from sim.io.atomic_write import atomic_write
from sim.motion.clip import FPS
from sim.motion.thresholds import PLANTED

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402 - after the choice of a backend that needs no display

from controller.evaluation.pose_strips import draw_strips  # noqa: E402

DESIRED, WALKED, FACING = "#9aa5b1", "#0b6e99", "#c8553d"
SIDES = {"left": ("#0b6e99", 1), "right": ("#c8553d", 3)}  # colour, and the toe's column among the contact joints
STYLE: dict[Any, object] = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e9ec",
    "axes.edgecolor": "#9aa5b1",
    "legend.frameon": False,
    "figure.dpi": 120,
}
COLUMNS = 6
STRIDES = {"walk 1.3 m/s": (2.0, 5.0), "run 3.5 m/s": (2.0, 4.0)}  # which seconds of which trials the feet are shown


def save_plots(folder: Path, played: Mapping[str, Trial], data: Path | None = None) -> list[Path]:
    """Writes trajectory.png, speed.png, feet.png and strips.png into a folder, made if missing; the strips are drawn
    beside captured clips of the `data` folder. Raises OSError where it cannot."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    drawings = {
        "trajectory": _trajectories,
        "speed": _speeds,
        "feet": _feet,
        "strips": lambda played: draw_strips(played, data),
    }
    for name, draw in drawings.items():
        with plt.rc_context(STYLE), atomic_write(folder / f"{name}.png") as temporary:
            figure = draw(played)
            figure.savefig(temporary)
            plt.close(figure)
        paths.append(folder / f"{name}.png")
    return paths


def _trajectories(played: Mapping[str, Trial]) -> Figure:
    """From above: the way the stick alone would give, and the character's."""
    figure, panels = _grid(played, "Trajectory asked and walked, from above (metres)", height=2.3)
    for axes, trial in zip(panels, played.values()):
        desired = np.cumsum(trial.desired, axis=0) / FPS
        root = trial.neutral.root.positions
        axes.plot(*desired.T, color=DESIRED, lw=3, label="asked: the stick's velocity, at once")
        axes.plot(root[:, 0], root[:, 2], color=WALKED, lw=1.3, label="walked")
        facing = trial.neutral.root.facing[:: FPS // 2]
        axes.quiver(
            root[:: FPS // 2, 0],
            root[:: FPS // 2, 2],
            -np.sin(facing),
            np.cos(facing),
            color=FACING,
            zorder=3,
            scale_units="inches",
            scale=8,
            width=0.009,
            headwidth=4,
            label="facing, twice a second",
        )
        axes.plot((-0.5, 0.5), (-0.5, 0.5), alpha=0)  # a character that stands needs no magnifying glass
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.12)
        axes.invert_xaxis()  # the character's left, +X, is on the left when it goes up the page
    return _with_legend(figure, panels[0])


def _speeds(played: Mapping[str, Trial]) -> Figure:
    """Root speed over time against the one asked for."""
    figure, panels = _grid(played, "Speed asked and walked (m/s over seconds)", height=1.7)
    for axes, trial in zip(panels, played.values()):
        seconds = np.arange(len(trial.desired)) / FPS
        axes.plot(seconds, np.linalg.norm(trial.desired, axis=1), color=DESIRED, lw=2.5, label="asked")
        axes.plot(seconds, np.linalg.norm(trial.neutral.velocity, axis=1), color=WALKED, lw=1.2, label="walked")
        axes.set_ylim(0, max(2.0, 1.3 * float(np.linalg.norm(trial.desired, axis=1).max())))
    return _with_legend(figure, panels[0])


def _feet(played: Mapping[str, Trial]) -> Figure:
    """Toe heights before and after the foot lock, and when each toe is in contact."""
    trials = {name: span for name, span in STRIDES.items() if name in played}
    figure, panels = plt.subplots(
        2, len(trials), figsize=(12, 5.5), layout="constrained", squeeze=False, sharex="col", height_ratios=(4, 1.2)
    )
    figure.suptitle("Toe height and contact over time")
    for (heights, contacts), (name, (start, stop)) in zip(panels.T, trials.items()):
        frames = slice(round(start * FPS), round(stop * FPS))
        seconds = np.arange(frames.start, frames.stop) / FPS
        for row, (side, (colour, toe)) in enumerate(SIDES.items()):
            for motion, look, text in (
                (played[name].neutral, {"ls": ":", "lw": 1.2}, "before the lock"),
                (played[name].locked, {"ls": "-", "lw": 1.6}, "after the lock"),
            ):
                heights.plot(
                    seconds, motion.feet[frames, toe, 1] * 100, color=colour, label=f"{side} toe, {text}", **look
                )
            contact = played[name].locked.contacts[frames, toe]
            contacts.fill_between(seconds, row, row + 0.8 * contact, color=colour, alpha=0.35, lw=0)
            contacts.fill_between(seconds, row, row + 0.8, where=contact > PLANTED, color=colour, lw=0, step="mid")
        heights.axhline(TOE_HEIGHT * 100, color=DESIRED, lw=1, label="toe joint of a flat foot")
        contacts.grid(visible=False)
        heights.set(title=name, ylabel="height of the toe joint (cm)")
        contacts.set(xlabel="seconds", yticks=[0.4, 1.4], yticklabels=SIDES, ylim=(0, 2), ylabel="contact")
    return _with_legend(figure, panels[0, 0])


def _grid(played: Mapping[str, Trial], title: str, height: float) -> tuple[Figure, Sequence[Axes]]:
    """A figure with one titled panel a trial; panels left over are taken away."""
    rows = -(-len(played) // COLUMNS)
    figure, panels = plt.subplots(
        rows, COLUMNS, figsize=(2.4 * COLUMNS, height * rows + 0.8), layout="constrained", squeeze=False
    )
    figure.suptitle(title)
    for axes, name in zip(panels.flat, played):
        axes.set_title(name)
    for axes in panels.flat[len(played) :]:
        axes.remove()
    return figure, list(panels.flat)


def _with_legend(figure: Figure, axes: Axes) -> Figure:
    """One legend for all panels, under them."""
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure
