"""The own style: what the controller's motion looks like, standing, walking, running, backing, strafing and turning.

What is drawn is the neutral pose changed by how a style differs from this one, so it has to be the style of the very
controller that runs: its file carries the fingerprint of that controller's weights."""

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Callable, Sequence

import numpy as np

from sim.body.pose import Pose
from sim.command import GAIT_SPEEDS, Command, Commands
from sim.io.provenance import ARCHIVES, CONTROLLER
from sim.math.easing import smooth_step
from sim.motion.clip import FPS
from sim.motion.features import STRIDE, features_from
from sim.motion.gait import stride_phase
from sim.motion.thresholds import STYLE_WALK_OR_RUN
from sim.protocols import Controller
from stylizer.styles import style_file
from stylizer.styles.encoding import encode_own
from stylizer.styles.style_clips import SHORTEST, WINDOW, Gait, Movement, OwnMotion
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.motion_puzzle.model import MotionPuzzle

OWN = "neutral"  # the name of the own style, which parts keep that are not restyled
SETTLE_SECONDS, SECONDS = 6, 10  # of each movement: before it counts, and that it is looked at
WINDOWS = 9  # that are kept of each movement
FORWARD = 0.0, 1.0


def walk_command(speed: float, gait: str = "walk", direction: tuple[float, float] = FORWARD, _: int = 0) -> Command:
    """Straight on, facing +Z, at metres a second, in a direction over the floor."""
    stick = speed / GAIT_SPEEDS[gait]
    return Command((direction[0] * stick, direction[1] * stick), FORWARD, gait)


def turn_command(speed: float, rate: float, frame: int) -> Command:
    """Along a circle at metres a second and radians a second; on the spot where the speed is 0."""
    angle = rate * frame / FPS
    way = math.sin(angle), math.cos(angle)
    stick = speed / GAIT_SPEEDS["walk"]
    return Command((way[0] * stick, way[1] * stick), way)


Script = Callable[[int], Command]  # what is asked in each frame
MOVEMENTS: dict[str, Script] = {
    "stand": lambda _: Command(),
    **{
        f"walk_{speed}": partial(walk_command, speed, "run" if speed > 1.3 else "walk", FORWARD)
        for speed in (0.4, 0.65, 0.85, 1.0, 1.15, 1.3, 1.6, 2.0)
    },
    **{f"run_{speed}": partial(walk_command, speed, "run", FORWARD) for speed in (2.5, 3.0, 3.5)},
    **{f"back_{speed}": partial(walk_command, speed, "walk", (0.0, -1.0)) for speed in (0.4, 0.65, 1.0, 1.3)},
    **{
        f"strafe_{side}_{speed}": partial(walk_command, speed, "walk", (sign, 0.0))
        for side, sign in (("left", 1.0), ("right", -1.0))
        for speed in (0.4, 0.65, 0.85, 1.0, 1.15, 1.3)
    },
    **{
        f"turn_{side}_{rate}": partial(turn_command, 1.0, sign * rate)
        for side, sign in (("left", 1.0), ("right", -1.0))
        for rate in (0.4, 0.8, 1.2)
    },
    **{f"spin_{side}": partial(turn_command, 0.0, 1.5 * sign) for side, sign in (("left", 1.0), ("right", -1.0))},
}


def capture(controller: Controller, scripts: Sequence[Script], seconds: float = SECONDS) -> np.ndarray:
    """Features (scripts, frames, 21, 15) at 60 Hz of a controller's motion under each script, all side by side."""
    crowd = controller.crowd(len(scripts))
    frames = round((SETTLE_SECONDS + seconds) * FPS) + STRIDE
    poses = [crowd.step(Commands([script(frame) for script in scripts])) for frame in range(frames)]
    all_poses = Pose.stacked(poses[SETTLE_SECONDS * FPS :])
    fields = (
        np.moveaxis(np.asarray(value), 1, 0)
        for value in (all_poses.positions, all_poses.rotations, all_poses.root_position, all_poses.root_facing)
    )
    return np.array([features_from(*one) for one in zip(*fields)])


def capture_motion(controller: Controller, fingerprint: str) -> OwnMotion:
    """The motion under MOVEMENTS of a controller whose weights have that fingerprint."""
    movements, phases = [], []
    for name, features in zip(MOVEMENTS, capture(controller, list(MOVEMENTS.values()))):
        starts = np.linspace(0, len(features) - SHORTEST, WINDOWS).round().astype(int)
        samples = starts[:, None] + STRIDE * np.arange(WINDOW)
        phase = stride_phase(features)
        movements.append(Movement(name, features[samples], features, (0.0, float(SECONDS))))
        phases.append(np.full(samples.shape, np.nan) if phase is None else phase[samples])
    gait = Gait.of(movements)
    runs = smooth_step(gait.root_velocities[:, 1], *STYLE_WALK_OR_RUN)  # decided as the content's is, by speed
    return OwnMotion([m.windows for m in movements], phases, replace(gait, runs=runs, residual=None), fingerprint)


def write_own_style(folder: Path, motion: OwnMotion, model: MotionPuzzle | JointPuzzle, fingerprint: str) -> None:
    """Writes the own style as a network of Motion Puzzle, whose weights have that fingerprint, encodes it."""
    header = {
        "weights": fingerprint,
        "controller": motion.controller,
        "licence": ARCHIVES[CONTROLLER],
        "source": "the controller's own motion, by root velocity",
    }
    style_file.write(folder / f"{OWN}.safetensors", OWN, encode_own(model, motion), header)
