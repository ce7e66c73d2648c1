"""The figures of crouching, jumping, uneven ground and the head, on statues whose answers are known."""

import numpy as np
import pytest

from controller.evaluation.agility_figures import bearing, crouching, jumping, terrain
from controller.evaluation.suite import CROUCHES, JUMPS, PRESS_SECONDS, TURN_ON_THE_SPOT, WAIT, script, suite
from controller.model.gait_phase import GRAVITY
from sim.command import Command
from sim.ground.catalogue import load_ground
from sim.motion.clip import FPS
from tests.controller.evaluation.test_report import glide

SUITE = suite()


def test_a_crouch_is_timed_by_the_height_of_the_hips():
    def trial(name: str, late: int):
        commands = SUITE[name]
        crouched = np.array([command.gait == "crouch" for command in commands], float)
        return glide(commands, height=-0.2 * np.concatenate([np.zeros(late), crouched])[: len(crouched)])

    played = {name: trial(name, 18) for names in CROUCHES.values() for name in names}
    figures = crouching(played, None)
    assert figures["crouch_down_s"].ours == figures["crouch_up_s"].ours == pytest.approx(0.3, abs=1.5 / FPS)
    assert figures["speed_held_crouching_share"].ours == pytest.approx(1.0)
    assert figures["crouching_hips_height_cm"].real is None


def test_a_jump_is_measured_by_hips_and_feet():
    def trial(name: str):
        commands = SUITE[name]
        time = np.arange(len(commands)) / FPS - WAIT - PRESS_SECONDS - 0.3
        return glide(commands, height=np.maximum(0, GRAVITY / 2 * time * (0.6 - time)))

    figures = jumping({name: trial(name) for name in JUMPS})
    assert figures["jump_height_cm"].ours == pytest.approx(100 * GRAVITY / 8 * 0.6**2, abs=0.5)
    assert figures["jump_distance_run_m"].ours == pytest.approx(3.5 * 0.6, abs=0.5)
    assert figures["jump_landing_skate_cm_s"].ours > 100, "a statue that glides on skates"


def test_who_never_leaves_the_floor_has_not_jumped():
    figures = jumping({name: glide(SUITE[name]) for name in JUMPS})
    assert figures["jump_height_cm"].ours == figures["jump_distance_run_m"].ours == 0
    assert not figures["jump_landing_skate_cm_s"].reached


def test_feet_on_uneven_ground_are_measured_from_the_ground_under_them():
    commands = script((2, Command()))
    on, off = (glide(commands, ground="hills", height=height) for height in (0.0, 0.04))
    above = glide(commands, ground="hills", height=load_ground("hills").height_at(np.zeros(2)) - 0.05)
    for trial, distance in ((on, 0.0), (off, 4.0), (above, 5.0)):
        figure = terrain({"stand": trial})["hills_planted_foot_off_ground_cm"].ours
        assert figure == pytest.approx(distance, abs=0.3)


def test_the_statue_looks_level_and_does_not_cross_its_feet():
    figures = bearing(
        {name: glide(SUITE[name]) for name in SUITE if "m/s" in name or name in ("stand", TURN_ON_THE_SPOT)}, None
    )
    assert figures["head_pitch_change_max_deg"].ours == pytest.approx(0.0, abs=1e-6)
    assert figures["head_pitch_walking_deg"].ours == pytest.approx(0.0, abs=1e-6)
    assert figures["feet_crossed_turning_on_the_spot_count"].ours == 0
