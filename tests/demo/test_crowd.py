"""A crowd of the shipped models: what each of it does is what a session of its own would do."""

import numpy as np
import pytest

from demo import assemble
from sim.command import Command, Commands


@pytest.fixture(scope="module")
def session():
    return assemble.build_session()


def test_each_of_a_crowd_does_what_it_would_do_alone(session):
    """To a tenth of a millimetre."""
    first, other = session.stylizer.styles[:2]
    script = {
        0: [(1.0, 0.0), "walk", {"spine": (first, 1.0), "left_arm": (other, 0.7)}],
        1: [(0.0, -1.0), "run", {}],
        2: [(0.0, 1.0), "run", {"right_leg": (other, 1.2)}],
        3: [(-0.6, 0.0), "walk", {"spine": (other, 1.0, first, 0.3)}],
    }
    commands = [
        [
            Command(move if frame < 50 else (0.0, 0.0), None, gait, style if frame > 4 * one else {})
            for one, (move, gait, style) in script.items()
        ]
        for frame in range(70)
    ]
    crowd = session.crowd(len(script))
    together = [crowd.step(Commands(each)) for each in commands]
    for one in script:
        session.restart()
        for each, frames in zip(commands, together, strict=True):
            alone = session.step(each[one])
            np.testing.assert_allclose(frames.styled[one].positions, alone.styled.positions, atol=1e-4)
            np.testing.assert_allclose(frames.neutral[one].positions, alone.neutral.positions, atol=1e-4)
    crowd.restart()
    np.testing.assert_array_equal(crowd.step(Commands(commands[0])).styled.positions, together[0].styled.positions)
