"""A crowd keeps to its square, makes way for one another and for a guest, and walks the same ways again."""

import numpy as np
import pytest

from demo import assemble, cli
from demo.live.live import Live
from demo.state.crowd import Crowd
from sim.command import Command
from sim.motion.clip import FPS

COUNT = 8
SHOULDERS = 0.35  # metres between two who touch


@pytest.fixture(scope="module")
def session():
    return assemble.build_session()


@pytest.fixture(scope="module")
def walked(session) -> tuple[Crowd, np.ndarray, np.ndarray]:
    """The crowd, and where it and its guest, who stands in the middle, were: (frames, COUNT, 2), (2,)."""
    crowd = Crowd(session, COUNT)
    session.restart()
    standing = session.step(Command()).styled
    poses = [crowd.step(standing) for _ in range(8 * FPS)]
    return crowd, np.array([pose.root_position[:, [0, 2]] for pose in poses]), standing.root_position[[0, 2]]


def test_everybody_goes_somewhere_and_nobody_leaves(walked):
    crowd, places, _ = walked
    assert np.ptp(places, axis=0).max(axis=-1).min() > 0.5
    assert np.abs(places).max() < crowd.half + 1.0


def test_nobody_runs_into_another_nor_into_the_guest(walked):
    _, places, guest = walked
    apart = np.linalg.norm(places[:, :, None] - places[:, None], axis=-1)
    apart[:, np.arange(COUNT), np.arange(COUNT)] = np.inf
    assert apart.min() > SHOULDERS
    assert np.linalg.norm(places - guest, axis=-1).min() > SHOULDERS


def test_each_wears_a_mixture_of_its_own(walked):
    crowd = walked[0]
    assert len({str(style) for style in crowd.styles}) == COUNT
    assert all(len(style) == 5 for style in crowd.styles)


def test_nobody_moves_in_a_style_that_may_be_renamed_or_removed(session, monkeypatch):
    bank = session.stylizer.bank
    own = bank.names[1::2]
    monkeypatch.setattr(type(bank), "users_own", own)
    used = {name for style in Crowd(session, 40).styles for name in style.names}
    assert used and not used & set(own)


def test_begun_again_it_walks_the_same_ways(session, walked):
    crowd, places, _ = walked
    styles = crowd.styles
    crowd.stand_on(None)
    assert crowd.styles == styles
    again = [crowd.step().root_position[:, [0, 2]] for _ in range(5)]
    np.testing.assert_allclose(again, places[:5], atol=1e-3)  # with no guest to make way for, who is far off yet


def test_frame_times_of_a_crowd_are_said_without_a_window(capsys):
    assert cli.main(["--crowd", "3", "--seconds", "0.2"]) == 0
    assert capsys.readouterr().out.startswith("3 characters, 12 frames: a frame took ")


def test_a_crowd_in_the_window_walks_with_the_character_and_counts_in_its_frame_time(session, screen):
    crowd = Crowd(session, 2)
    live = Live(session, session.stylizer.styles, screen)
    live.join(crowd)
    live.step()
    live.draw()
    assert len(live.view.crowd[0].hips) == len(live.view.crowd[1]) == 2
    assert live.figures.frame_ms == pytest.approx(session.latency.last_ms("frame") + crowd.last_ms)
    before = crowd.poses.root_position.copy()
    live.step()
    assert (crowd.poses.root_position != before).any()
    live.start_over()
    live.step()
    np.testing.assert_allclose(crowd.poses.root_position, before, atol=1e-6)
