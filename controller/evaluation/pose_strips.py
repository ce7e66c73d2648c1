"""Strips of poses: each movement of the suite above a captured clip of the same movement, to be looked at side by
side."""

from pathlib import Path
from typing import Callable, Mapping

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from controller.evaluation.suite import Motion, Trial
from controller.training.dataset import load_neutral
from sim.body.skeleton import PARENTS, PART_NAMES, PART_OF_JOINT
from sim.math import rotations as rot
from sim.math.vectors import FLOOR
from sim.motion.clip import FPS
from sim.motion.thresholds import PLANTED

POSES, SPACING = 14, 0.75  # of a strip, and metres between two of them on the page
COLOURS = dict(zip(PART_NAMES, ("#0b6e99", "#c8553d", "#3b4252", "#5aa9c9", "#e39a86")))  # left is blue, right is red
VIEW = np.radians(40)  # the eye stands to the character's left and that far to its front


def _middle(motion: Motion) -> int:
    return len(motion) // 2


def _jolt(motion: Motion) -> int:
    """Where a start, a stop or a turn happens: the frame of the strongest acceleration, over a third of a second."""
    span = FPS // 6
    change = np.linalg.norm(motion.velocity[2 * span :] - motion.velocity[: -2 * span], axis=1)
    return int(change[FPS // 2 : len(change) - FPS // 2].argmax()) + FPS // 2 + span


def _spin(motion: Motion) -> int:
    return int(np.abs(motion.turn_rate).argmax())


def _highest(motion: Motion) -> int:
    return int(motion.positions[:, 0, 1].argmax())


# Movement: the take of the suite, the captured clip (a name under the data folder), which moment of both, seconds
# shown.
MOVEMENTS: dict[str, tuple[str, str, Callable[[Motion], int], float]] = {
    "stand": ("stand", "Female1_A01_Stand", _middle, 3.0),
    "walk": ("walk 1.3 m/s", "Female1_B03_Walk1", _middle, 1.3),
    "run": ("run 3.5 m/s", "Female1_C03_Run", _middle, 0.8),
    "start": ("walk 1.3 m/s", "Female1_B01_StandToWalk", _jolt, 1.6),
    "stop": ("stop walk 0", "Female1_B02_WalkToStand", _jolt, 1.6),
    "stop from a run": ("stop run 0", "Female1_C02_RunToStand", _jolt, 1.6),
    "turn left, walking": ("turn walk 135", "Female1_B11_WalkTurnLeft135", _jolt, 1.6),
    "turn left, running": ("turn run 90", "Female1_C11_RunTurnLeft90", _jolt, 1.6),
    "turn on the spot": ("turn on the spot", "69_10_1", _spin, 2.0),
    "strafe left": ("strafe left", "Female1_B22_SideStepLeft", _middle, 1.6),
    "back": ("back", "Female1_B05_WalkBackwards", _middle, 1.6),
    "crouch": ("crouch", "Crouching1", _middle, 1.6),
    "jump on the spot": ("jump on the spot", "13_40", _highest, 1.4),
    "jump from a walk": ("jump from a walk", "13_32", _highest, 1.4),
    "jump from a run": ("jump from a run", "Male1_C20_Run2Jump2Walk", _highest, 1.4),
}


def draw_strips(played: Mapping[str, Trial], data: Path | None) -> Figure:
    """A figure with a row of ours and a row of the captured clip, where `data` holds it, for every movement."""
    rows = []
    for movement, (name, clip, moment, seconds) in MOVEMENTS.items():
        if name not in played:
            continue
        rows.append((movement, _around(played[name].locked, moment, seconds)))
        path = next(iter(sorted(data.rglob(f"{clip}.bvh"))), None) if data else None
        if path:
            rows.append((f"captured: {clip}", _around(Motion.of_clip(load_neutral(path)), moment, seconds)))
    figure, panels = plt.subplots(len(rows), figsize=(13, 1.85 * len(rows)), layout="constrained", squeeze=False)
    for axes, (title, motion) in zip(panels[:, 0], rows):
        _strip(axes, motion)
        axes.set_title(f"{title}, {len(motion) / FPS:.1f} s", loc="left", pad=2)
    return figure


def _around(motion: Motion, moment: Callable[[Motion], int], seconds: float) -> Motion:
    """So many seconds of a motion about its moment, as far as it lasts."""
    length = min(round(seconds * FPS), len(motion))
    start = min(max(moment(motion) - length // 2, 0), len(motion) - length)
    return motion[start : start + length]


def _strip(axes: Axes, motion: Motion) -> None:
    """Poses side by side, seen as the first one faces; a dot is a joint in contact with the floor."""
    frames = np.linspace(0, len(motion) - 1, POSES).round().astype(int)
    turn = rot.from_yaw(-motion.root.facing[0] + np.pi / 2 - VIEW)
    for place, frame in enumerate(frames):
        below = motion.root.positions[frame] * FLOOR
        joints = rot.rotate(turn, motion.positions[frame] - below)
        x, y = joints[:, 0] + SPACING * place, joints[:, 1]
        for joint in np.argsort(joints[:, 2]):  # what is nearer is drawn later
            parent = PARENTS[joint]
            if parent >= 0:
                axes.plot(
                    (x[parent], x[joint]),
                    (y[parent], y[joint]),
                    lw=4,
                    solid_capstyle="round",
                    color=COLOURS[PART_NAMES[PART_OF_JOINT[joint]]],
                )
        feet = rot.rotate(turn, motion.feet[frame] - below)[motion.contacts[frame] > PLANTED]
        axes.plot(feet[:, 0] + SPACING * place, feet[:, 1], "o", ms=3, color="black", zorder=5)
    axes.axhline(0, color="#9aa5b1", lw=1, zorder=0)
    axes.set(xlim=(-SPACING, SPACING * POSES), ylim=(-0.05, 2.1), aspect="equal")
    axes.axis("off")
