"""Whether the window keeps up: the picture is made simpler before the world is slow, and better again with care."""

import pytest

from demo.live.load import PATIENCE, TOO_SLOW, Load

FRAME, MOST = 1 / 60, 4


class Machine:
    """A window whose pictures cost so many seconds at the best quality, and a share of that at simpler ones."""

    def __init__(self, levels: int = 2, gain: float = 0.5) -> None:
        self.load, self.gain, self.now, self.levels = Load(levels), gain, 0.0, []

    def run(self, seconds: float, cost: float) -> "Machine":
        end = self.now + seconds
        while self.now < end:
            drawing = cost * self.gain**self.load.level
            due = max(1, round(drawing / FRAME))
            self.now += max(drawing, FRAME)
            if self.load.turn(self.now, due, min(due, MOST), drawing):
                self.levels.append(self.load.level)
        return self


def test_a_quick_machine_draws_the_best_picture():
    machine = Machine().run(20, 0.012)
    assert machine.levels == [] and not machine.load.slow


def test_the_picture_is_made_simpler_before_the_world_is_slow():
    machine = Machine().run(2, 1.2 * TOO_SLOW)
    assert machine.levels == [1] and not machine.load.slow
    assert machine.run(2, 2.5 * TOO_SLOW).levels == [1, 2] and not machine.load.slow


def test_it_is_better_again_when_there_is_time_for_it():
    machine = Machine().run(2, 1.5 * TOO_SLOW).run(2 * PATIENCE, 0.3 * TOO_SLOW)
    assert machine.levels == [1, 0]


def test_it_does_not_go_back_and_forth():
    """At a cost that only the simpler picture meets, it stays simple; where the load itself goes up and down, a richer
    one is tried ever more rarely."""
    assert Machine().run(60, 1.5 * TOO_SLOW).levels == [1]
    machine = Machine()
    for _ in range(60):
        machine.run(PATIENCE + 1, 0.3 * TOO_SLOW).run(1, 1.5 * TOO_SLOW)
    assert len(machine.levels) < 30


def test_a_world_that_is_slow_says_why():
    machine = Machine(levels=0).run(3, 0.1)
    assert machine.load.slow and machine.load.describe(0.004) == "slow motion: drawing takes 100 ms"
    assert machine.load.describe(0.05) == "slow motion: a frame's motion takes 50 ms"
    machine.run(3, 0.01)
    assert not machine.load.slow and machine.load.describe(0.004) == ""


@pytest.mark.parametrize("stops", [1, 2])
def test_a_stop_or_two_are_no_slow_motion(stops):
    """Another stylizer is loaded, the computer slept: the picture is none the simpler for it."""
    machine = Machine().run(2, 0.01)
    for _ in range(stops):
        machine.run(0.01, 5.0).run(3, 0.01)
    assert machine.levels == [] and not machine.load.slow
