"""Motion of the controller itself as BVH clips, for the stylizer to learn from: what it sees live.

python -m demo.tools.controller_clips DATA/patchwalk
"""

import math
import sys
from pathlib import Path

import numpy as np

from controller.runtime.controller import PhaseFunctionedController
from sim.body.pose import Pose
from sim.command import GAIT_SPEEDS, Command, Commands
from sim.io import bvh
from sim.motion.clip import FPS, Clip

SETTLE = 2 * FPS  # frames until a steady movement is steady
SECONDS = 24
STRAIGHT = (0.4, 0.65, 0.85, 1.0, 1.15, 1.3, 1.6, 2.0, 2.5, 3.0, 3.5)  # metres a second
BACKWARD, SIDEWAYS = (0.4, 0.7, 1.0, 1.3), (0.4, 0.7, 1.0, 1.3)
TURN_RATES, TURN_SPEEDS = (25, 50, 90), (0.7, 1.3, 2.5)  # degrees and metres a second
SPOT_RATES = (40, 90)  # degrees a second, turning on the spot
STANDING = 2  # clips
VARIED, VARIED_SECONDS = 16, (0.7, 3.0)  # clips of commands by chance, and how long each command holds


def steered(speed: float, heading: float, facing: float | None = None) -> Command:
    """Going at `speed` m/s along yaw `heading`, facing yaw `facing` (None: where it goes)."""
    gait = "walk" if speed <= GAIT_SPEEDS["walk"] else "run"
    stick = speed / GAIT_SPEEDS[gait]
    face = None if facing is None else (math.sin(facing), math.cos(facing))
    return Command((stick * math.sin(heading), stick * math.cos(heading)), face, gait)


def scripts(random: np.random.Generator) -> dict[str, list[Command]]:
    """Name -> the command of every frame, of all clips."""
    seconds = np.arange(SETTLE + SECONDS * FPS) / FPS
    sides = (("left", 1), ("right", -1))
    result = {f"straight_{speed}": [steered(speed, 0.0)] * len(seconds) for speed in STRAIGHT}
    result |= {f"backward_{speed}": [steered(speed, np.pi, 0.0)] * len(seconds) for speed in BACKWARD}
    result |= {
        f"sideways_{speed}_{side}": [steered(speed, sign * np.pi / 2, 0.0)] * len(seconds)
        for speed in SIDEWAYS
        for side, sign in sides
    }
    result |= {
        f"turning_{rate}_{speed}_{side}": [steered(speed, sign * np.radians(rate) * t) for t in seconds]
        for rate in TURN_RATES
        for speed in TURN_SPEEDS
        for side, sign in sides
    }
    result |= {f"spot_{rate}": [steered(0.0, 0.0, np.radians(rate) * t) for t in seconds] for rate in SPOT_RATES}
    result |= {f"standing_{take}": [Command()] * len(seconds) for take in range(STANDING)}
    return result | {f"varied_{take}": varied(random, len(seconds)) for take in range(VARIED)}


def varied(random: np.random.Generator, frames: int) -> list[Command]:
    """Commands by chance: mostly straight on, now and then in another direction, backward, sideways or standing."""
    commands: list[Command] = []
    heading = 0.0
    while len(commands) < frames:
        heading += random.normal(0.0, 0.9)
        speed = random.choice([0.0, random.uniform(0.3, 1.4), random.uniform(1.4, 3.5)], p=[0.15, 0.55, 0.3])
        facing = heading + random.uniform(-np.pi, np.pi) if random.random() < 0.25 and speed < 1.4 else None
        commands += [steered(speed, heading, facing)] * int(FPS * random.uniform(*VARIED_SECONDS))
    return commands[:frames]


def record(scripts: dict[str, list[Command]]) -> dict[str, Clip]:
    """The controller's motion under each script, without the first SETTLE frames."""
    controller = PhaseFunctionedController.from_pretrained().crowd(len(scripts))
    poses = Pose.stacked([controller.step(Commands(each)) for each in zip(*scripts.values())][SETTLE:])
    return {
        name: Clip(poses.hips[:, one], poses.local_rotations[:, one], FPS, name) for one, name in enumerate(scripts)
    }


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name, clip in record(scripts(np.random.default_rng(1))).items():
        bvh.write(folder / f"{name}.bvh", clip)
