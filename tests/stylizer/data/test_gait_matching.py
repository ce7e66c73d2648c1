"""The same step of the gait is found in another clip, whatever its style, pace and side."""

import numpy as np
import pytest

from sim.motion.features import LAYOUT, clip_features
from stylizer.data.gait_matching import LAGS, OTHER_FOOT, best_match, closeness, gait_signal
from stylizer.data.sampler import mirror
from tests.support.walker import CYCLE, planted_clip, walking_clip


@pytest.fixture(scope="module")
def walk():
    return clip_features(walking_clip())


def test_the_step_is_found_in_a_shuffle(walk):
    shuffle = walk.copy()
    positions = shuffle[..., LAYOUT["position"]]
    positions -= 0.6 * (positions - positions.mean(axis=0))
    content = gait_signal(walk)[130 - LAGS]
    frame, pace, apart = best_match(content, gait_signal(shuffle))
    assert (frame - 130) % CYCLE in (0, 1, CYCLE - 1) and pace == 1 and apart < 0.1


def test_a_slower_clip_is_played_faster(walk):
    slow = clip_features(walking_clip(480).paced(1 / 1.2))
    frame, pace, apart = best_match(gait_signal(walk)[130 - LAGS], gait_signal(slow))
    assert pace == 1.2 and abs((frame / 1.2 - 130 + CYCLE / 2) % CYCLE - CYCLE / 2) < 3 and apart < 0.05


def test_mirroring_exchanges_the_feet(walk):
    assert np.allclose(gait_signal(mirror(walk)), gait_signal(walk)[:, OTHER_FOOT], atol=1e-5)


def test_standing_feet_are_not_blown_up():
    assert np.abs(gait_signal(clip_features(planted_clip()))).max() < 1e-3


def test_a_clip_too_short_matches_nothing(walk):
    content = gait_signal(walk)[130 - LAGS]
    assert best_match(content, gait_signal(walk[:15]))[2] == np.inf
    assert closeness(np.inf, 1.0, 1.0) == 0


def test_closeness_falls_with_difference_and_stillness():
    assert closeness(0.0, 1.2, 1.2) == 1
    assert closeness(0.5, 1.2, 1.2) < 0.5 and closeness(0.0, 1.2, 2.2) < 0.2 and closeness(0.0, 1.2, 0.1) == 0
