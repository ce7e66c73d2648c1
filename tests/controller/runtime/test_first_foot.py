"""Who stands and is asked to go aslant begins with the foot of that side."""

import copy
import math
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from controller.evaluation import suite
from controller.evaluation.metrics import direction_error, speed_share
from controller.evaluation.steering_figures import settled
from controller.runtime.controller import PhaseFunctionedController
from controller.runtime.first_foot import FASTEST, FREE, choose_first_foot
from sim.command import GAIT_SPEEDS, Command
from sim.math import rotations as rot

LEFT, RIGHT, FORWARD = np.array([1.3, 0.0]), np.array([-1.3, 0.0]), np.array([0.0, 1.3])
PHASES = np.arange(16) * math.pi / 8
controller = cache(PhaseFunctionedController.from_pretrained)


def chosen(phase, way, frames=8, facing=0.0, standing=1.0, speed=0.0):
    """The phase after so many frames of a body that goes at `speed` and is asked to go as `way` says."""
    trajectory = SimpleNamespace(
        wanted_velocity=way, velocity=np.stack([speed * np.ones(way.shape[:-1]), np.zeros(way.shape[:-1])], axis=-1)
    )
    trajectory.facing, trajectory.standing = np.asarray(facing), np.asarray(standing)
    for _ in range(frames):
        phase = choose_first_foot(phase, trajectory)
    return phase


@pytest.mark.parametrize("way, middle", [(LEFT, 0.0), (RIGHT, math.pi)])
@pytest.mark.parametrize("phase", PHASES)
def test_the_foot_of_that_side_is_next(way, middle, phase):
    one = chosen(phase, way, frames=1)
    assert abs(rot.wrap_angle(one - phase)) <= FASTEST + 1e-9
    there = chosen(phase, way)
    assert abs(rot.wrap_angle(there - middle)) <= FREE + 1e-9
    assert abs(rot.wrap_angle(phase - middle)) > FREE or there == pytest.approx(phase), "no farther than it must"


@pytest.mark.parametrize(
    "way, how",
    [
        (FORWARD, {}),
        (np.zeros(2), {}),
        (LEFT, {"standing": 0.0}),
        (RIGHT, {"standing": 0.4}),  # who creeps has a step under way
        (RIGHT, {"speed": 1.2}),  # set off already
    ],
)
def test_otherwise_the_phase_is_left_alone(way, how):
    assert np.array([chosen(phase, way, **how) for phase in PHASES]) == pytest.approx(PHASES)


def test_the_side_is_that_of_the_body():
    """Who faces to the left of the world and goes along +Z goes to its own right."""
    assert chosen(0.0, FORWARD, facing=math.pi / 2) == chosen(0.0, RIGHT) != 0.0


def test_a_crowd_is_as_each_alone():
    ways, facings = np.stack([LEFT, RIGHT, FORWARD, LEFT]), np.array([0.0, 0.3, 0.0, math.pi])
    together = chosen(np.full(4, 3.0), ways, facing=facings, standing=np.ones(4))
    alone = [chosen(3.0, way, facing=facing) for way, facing in zip(ways, facings)]
    assert together == pytest.approx(alone)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_who_side_steps_slowly_keeps_stepping(side):
    """At 0.4 m/s its gait is a stand's in part all the time."""
    trial = suite.play(suite.script((5, Command((side * 0.4 / GAIT_SPEEDS["walk"], 0.0), (0.0, 1.0)))), controller())
    assert speed_share(*settled(trial)) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("way", ["back left", "back right"])
def test_back_and_aside_is_found_at_once_from_every_phase(way):
    one, misses = controller(), []
    phase, *rest = one._start
    for turned in PHASES[::2]:
        one._start = (phase + turned) % (2 * math.pi), *copy.deepcopy(rest)
        one.restart()
        trial = suite.play(suite.script((3, Command(suite.FACING_FORWARD[way], (0.0, 1.0)))), one)
        misses.append((math.degrees(direction_error(*settled(trial))), abs(speed_share(*settled(trial)) - 1)))
    assert np.max(misses, axis=0)[0] < 5.0 and np.max(misses, axis=0)[1] < 0.1


def test_who_is_asked_to_creep_does_not_twitch():
    """From every phase that a stop leaves; at 0.07 m/s toes and hands were seen to move at 0.45."""
    one, fastest = controller(), []
    phase, *rest = one._start
    for turned in PHASES[::2]:
        one._start = (phase + turned) % (2 * math.pi), *copy.deepcopy(rest)
        one.restart()
        for _ in range(120):
            one.step(Command(face=(0.0, 1.0)))
        for side in (1, -1):
            each = copy.deepcopy(one)
            poses = [each.step(Command((0.05 * side, 0.0), (0.0, 1.0))) for _ in range(20)]
            places = np.array([pose.positions - pose.root_position for pose in poses])
            fastest.append(60 * np.linalg.norm(np.diff(places, axis=0), axis=-1).max())
    one._start = phase, *rest
    assert max(fastest) < 0.2, np.round(fastest, 2)
