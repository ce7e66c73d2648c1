"""Strips of what the session draws: for every style neutral, drawn and captured poses, walking and running at the
style's pace."""

from pathlib import Path
from typing import Mapping

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from sim.io.atomic_write import atomic_write
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT
from stylizer.evaluation.live_benchmark import LiveEvaluation, Motion, reference_for
from stylizer.evaluation.pictures import OUTPUT, SOURCE, TARGET, draw_pose, finish_axes

MOVEMENTS = ("walk_pace", "run_pace")  # of stylizer.evaluation.live_benchmark.MOVEMENTS
POSES, APART = 10, 0.75  # figures in a row, and the metres between them
SECONDS = {"walk_pace": 1.4, "run_pace": 0.9}


def save_strips(folder: Path, evaluation: LiveEvaluation) -> list[Path]:
    """Draws a picture a style into a folder, made if missing."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for style, references in evaluation.references.items():
        rows = {}
        for movement in (name for name in MOVEMENTS if style in evaluation.drawn.get(name, {})):
            content, reference = reference_for(movement, references)
            rows[f"{movement}: neutral"] = evaluation.neutral[movement], SOURCE, SECONDS[movement]
            rows[f"{movement}: {style}, drawn"] = evaluation.drawn[movement][style], OUTPUT, SECONDS[movement]
            rows[f"captured {content}"] = reference.clip, TARGET, SECONDS[movement]
        if rows:
            figure = _strip(rows)
            paths.append(folder / f"live-{style}.png")
            with atomic_write(paths[-1]) as temporary:
                figure.savefig(temporary, dpi=80)
            plt.close(figure)
    return paths


def _strip(rows: Mapping[str, tuple[Motion, str, float]]) -> Figure:
    """A row of poses for each named motion."""
    figure, panels = plt.subplots(len(rows), 1, figsize=(9, 1.9 * len(rows)), layout="constrained", squeeze=False)
    for axes, (name, (motion, color, seconds)) in zip(panels[:, 0], rows.items()):
        places = motion.features[..., LAYOUT["position"]]
        start = max(0, (len(places) - round(seconds * FPS)) // 2)
        frames = np.minimum(start + np.linspace(0, seconds * FPS, POSES).astype(int), len(places) - 1)
        for place, pose in enumerate(places[frames]):
            draw_pose(axes, pose, APART * place, color, "", ())
        finish_axes(axes)
        axes.set_title(name, fontsize=9, loc="left", pad=1)
    return figure
