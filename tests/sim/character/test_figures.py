"""What says how truly a character follows: on poses whose answer is known."""

from dataclasses import replace

import numpy as np

from sim.body.skeleton import INDEX
from sim.character.character import load_character
from sim.character.figures import degrees_off, measure
from sim.character.fit import CharacterFit
from sim.math import rotations as rot
from sim.math.vectors import FORWARD, UP
from tests.sim.character.conftest import KINDS
from tests.support.skinned import write


def test_an_arm_that_is_turned_by_30_degrees_is_30_degrees_off(tmp_path, walk):
    character = load_character(write(tmp_path / "hero.glb", KINDS["our names"]))
    fitted = CharacterFit(character).step(walk[0])
    rotations = walk[0].rotations.copy()
    upper = [INDEX["LeftArm"], INDEX["LeftForeArm"]]
    across = walk[0].positions[upper[1]] - walk[0].positions[upper[0]]
    axis = rot.normalize(rot.cross(across, UP))
    rotations[upper] = rot.multiply(rot.from_axis_angle(axis, np.radians(30.0)), rotations[upper])
    off = degrees_off(character, [replace(walk[0], rotations=rotations)], [fitted])
    np.testing.assert_allclose(off["arms"], [[30.0, 0.0]], atol=1e-4)
    assert off["thighs"].max() < 1.0


def test_feet_that_are_drawn_along_and_off_the_floor_are_found(tmp_path, walk):
    character = load_character(write(tmp_path / "hero.glb", KINDS["our names"]))
    true = measure(character, walk[:20])
    assert true["our_skate_cm_s"] < 1 and true["our_soles_cm_p100"] < 1, "they stand"
    drawn = [
        replace(pose, root_position=pose.root_position + at, hips=pose.hips + at)
        for pose, at in ((pose, 0.002 * frame * FORWARD + 0.03 * UP) for frame, pose in enumerate(walk[:20]))
    ]
    figures = measure(character, drawn)
    assert abs(figures["our_skate_cm_s"] - 12.0) < 1.0 and abs(figures["our_soles_cm_p95"] - 3.0) < 0.5
    assert abs(figures["its_skate_cm_s"] - 12.0) < 1.0, "it goes as ours does"
