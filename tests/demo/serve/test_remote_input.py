"""Input from a page: the same commands as from keys and sticks that are here, and nothing else."""

import math

import pytest

from demo.serve.remote_input import RemoteInput
from demo.state import steering
from sim.style_spec import StyleSpec

STYLE = StyleSpec({"arms": "old"})


def command(remote, facing=0.0):
    return remote.command(facing, STYLE, True, 1 / 60)


def test_held_keys_walk_away_from_the_camera():
    remote = RemoteInput()
    assert remote.take({"n": 3, "held": ["forward", "run", "fly"], "yaw": 0.5})
    made = command(remote)
    assert made.move == steering.to_world((0, 1), 0.5) and made.gait == "run" and made.style == STYLE and made.pace
    assert remote.answers == 3
    remote.let_go()
    assert command(remote).move == (0, 0) and command(remote).gait == "walk"


def test_a_stick_has_its_dead_zone_and_a_full_length():
    remote = RemoteInput()
    assert not remote.take({"stick": [0.1, 0.1]})
    remote.take({"stick": [1.0, 1.0]})
    assert math.hypot(*command(remote).move) <= 1


def test_a_jump_counts_once_and_a_crouch_until_pressed_again():
    remote = RemoteInput()
    remote.press("jump")
    remote.press("crouch_toggle")
    first, second = command(remote), command(remote)
    assert first.jump and not second.jump and second.gait == "crouch"
    remote.press("crouch_toggle")
    assert command(remote).gait == "walk"


def test_facing_is_turned_and_let_go():
    remote = RemoteInput()
    remote.take({"held": ["face_left"]})
    turned = command(remote, facing=1.0).face
    assert turned == steering.direction(1.0 + steering.TURN_RATE / 60)
    remote.take({"held": []})
    assert command(remote, facing=2.0).face == turned
    remote.press("face_free")
    assert command(remote).face is None


def test_comparing_shows_the_neutral_motion():
    remote = RemoteInput()
    remote.take({"held": ["compare"]})
    assert command(remote).style == StyleSpec()


@pytest.mark.parametrize(
    "said",
    [
        {"n": -1},
        {"n": "1"},
        {"yaw": "north"},
        {"yaw": math.inf},
        {"stick": [1]},
        {"stick": [math.nan, 0]},
        {"held": "run"},
    ],
    ids=str,
)
def test_what_no_page_of_ours_says_is_refused_and_changes_nothing(said):
    remote = RemoteInput()
    with pytest.raises(ValueError, match="load it anew"):
        remote.take(said)
    assert command(remote).move == (0, 0) and remote.answers == 0
