"""Before a jump from the spot the body sinks on feet that stay, and pushes as fast as it then flies."""

import numpy as np
import pytest
import torch

from controller.model.gait_phase import GRAVITY
from controller.runtime.controller import PhaseFunctionedController
from controller.runtime.gathering import DEPTH, gather, gathered
from controller.runtime.jump import ANTICIPATION, FLIGHT
from sim.body.skeleton import CONTACT_JOINTS, INDEX
from sim.command import Command
from sim.motion.clip import FPS

SETTLED = 120  # frames before the jump is asked for


def jump(**steering) -> list:
    """Poses of a character that is steered so, and jumps once it has settled."""
    torch.set_num_threads(1)
    controller = PhaseFunctionedController.from_pretrained()
    return [controller.step(Command(jump=frame == SETTLED, **steering)) for frame in range(SETTLED + 60)]


def test_from_the_spot_hips_sink():
    poses = jump()
    before = poses[SETTLED - 1]
    low = min(poses[SETTLED : SETTLED + round(ANTICIPATION * FPS)], key=lambda pose: pose.hips[1])
    assert before.hips[1] - low.hips[1] == pytest.approx(DEPTH, abs=0.03)


def test_feet_stay_while_the_trunk_leans_forward():
    pose = jump()[SETTLED - 1]
    low = gather(pose, np.array(1.0))
    np.testing.assert_allclose(low.positions[CONTACT_JOINTS], pose.positions[CONTACT_JOINTS], atol=1e-3)
    head = low.to_character((low.positions - pose.positions)[[INDEX["Head"]]])[0]
    assert head[2] > 0.1 > abs(head[0])
    np.testing.assert_allclose(gather(pose, np.array(0.0)).rotations, pose.rotations, atol=1e-3)


def test_who_walks_or_crouches_gathers_less_or_not_at_all():
    for steering in ({"move": (0.0, 1.0), "gait": "run"}, {"gait": "crouch"}):
        poses = jump(**steering)
        hips = np.array([pose.hips[1] for pose in poses])
        assert hips[:SETTLED].min() - hips[SETTLED : SETTLED + round(ANTICIPATION * FPS)].min() < DEPTH / 2


def test_the_push_ends_as_fast_as_the_flight_begins():
    time = np.array([-1e-4, 0.0])
    up = -DEPTH * np.diff(gathered(time, np.zeros(2)))[0] / 1e-4
    assert up == pytest.approx(GRAVITY * FLIGHT / 2, rel=0.01)


def test_nothing_is_gathered_before_the_press_after_the_take_off_or_on_the_run():
    time = np.array([-5.0, -ANTICIPATION, 0.0, 0.3])
    np.testing.assert_allclose(gathered(time, np.zeros(4)), 0.0, atol=1e-12)
    assert gathered(np.array(-0.1), np.array(3.0)) == 0 < gathered(np.array(-0.1), np.array(0.0))
