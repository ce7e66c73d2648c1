"""Evaluation of the controller: plays the fixed suite and computes every figure beside that of held-out real clips."""

from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Mapping

from controller.evaluation.agility_figures import bearing, crouching, jumping, terrain
from controller.evaluation.figures import Figure, endurance, feet, likeness, smoothness, standing
from controller.evaluation.reference_clips import RealClips
from controller.evaluation.steering_figures import steering
from controller.evaluation.suite import Trial, follow, play, random_sticks, suite, terrain_suite
from controller.runtime.controller import PhaseFunctionedController
from sim.torch_setup import set_up_torch


@dataclass(frozen=True)
class Evaluation:
    """The figures by name and the suite as it was played, for the plots."""

    figures: Mapping[str, Figure]
    played: Mapping[str, Trial]


def evaluate(data: Path | None = None, progress: Callable[[int], Callable[[], object]] | None = None) -> Evaluation:
    """Plays everything with the shipped weights and measures it; `data` is a folder of BVH files or None.

    progress(frames) is given how much there is to play and returns what to call once a frame. The same weights and
    clips give the same figures. Raises ValueError where weights are missing or `data` holds no clips to compare
    with."""
    set_up_torch()
    standing_still = PhaseFunctionedController.from_pretrained()
    real = None if data is None else RealClips.load(data)
    scripts, uneven = {**suite(), "random": random_sticks()}, terrain_suite()
    paths = [follow(clip) for clip in real.held_out] if real else []
    frames = sum(map(len, [*scripts.values(), *paths, *(script for _, script in uneven.values())]))
    tick = progress(frames) if progress else lambda: None
    played = {name: play(script, standing_still, tick) for name, script in scripts.items()}
    on_ground = {name: play(script, standing_still, tick, ground) for name, (ground, script) in uneven.items()}
    random = played.pop("random")
    followed = [play(steps, standing_still, tick).locked for steps in paths]
    figures = {
        **steering(played),
        **feet(played, real),
        **smoothness(played, real),
        **standing(played["stand"], real),
        **likeness(real, followed),
        **endurance(random, real),
        **bearing(played, real),
        **crouching(played, real),
        **jumping(played),
        **terrain(on_ground),
    }
    return Evaluation({name: figure.rounded() for name, figure in figures.items()}, played)
