"""A command is checked where it is made: what a recording refuses, a program cannot say either."""

import math

import numpy as np
import pytest

from sim.command import Command, Commands


@pytest.mark.parametrize(
    "wrong, sentence",
    [
        ({"move": (0.0, 9.0)}, "longer than 1, the full stick"),
        ({"move": (math.nan, 1.0)}, "move is .* must be two numbers"),
        ({"move": None}, "move is null, but must be two numbers"),
        ({"move": 5}, "move is 5, but must be two numbers"),
        ({"move": "up"}, 'move is "up", but must be two numbers'),
        ({"face": 1.0}, "face is 1.0, but must be two numbers"),
        ({"style": "old"}, 'style is "old", but must look like'),
        ({"face": (math.inf, 1.0)}, "face is .* must be two numbers"),
        ({"move": (0.0, 0.0, 1.0)}, "must be two numbers"),
        ({"gait": "fly"}, 'gait is "fly", but must be one of walk, run'),
        ({"style": {"tail": ("old", 1.0)}}, "unknown body part 'tail'"),
        ({"style": {"arms": ("old", 99)}}, "strength of arms is 99"),
        ({"style": {"arms": ("old", 1.0, "proud", 2)}}, "share of arms is 2"),
        ({"style": {"arms": 5}}, "style of arms is 5"),
        ({"style": {"arms": ("old", True)}}, "style of arms is"),
    ],
)
def test_what_is_no_command_is_refused(wrong, sentence):
    with pytest.raises(ValueError, match=sentence):
        Command(**wrong)


def test_groups_stand_for_their_parts_and_numbers_of_numpy_are_numbers():
    command = Command(move=np.array([0.6, 0.8]), style={"arms": ("old", np.float64(0.5))})
    assert command.style == {"left_arm": ("old", 0.5), "right_arm": ("old", 0.5)}


@pytest.mark.parametrize("name", ["pace", "jump"])
def test_what_is_true_or_false_is_checked(name):
    with pytest.raises(ValueError, match=f'{name} is "yes", but must be True or False'):
        Command(**{name: "yes"})


@pytest.mark.parametrize("wrong", [[], 3, None, [None], Command()])
def test_a_crowd_is_asked_by_a_list_of_commands(wrong):
    with pytest.raises(ValueError, match="a crowd is given .* needs a list of Command"):
        Commands(wrong)
