"""A style of several clips: which of them counts at which root velocity, what a long clip shows, and the pace of its
legs."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.motion.clip import FPS, Clip
from sim.motion.features import LAYOUT, clip_features
from sim.motion.gait import cycle_at, stride_phase
from stylizer.styles.style_clips import (
    BODY,
    HOP,
    MANY,
    PLAYBACK_RATES,
    SHORTEST,
    WINDOW,
    Gait,
    Movement,
    StyleClips,
    movements_in,
    no_cycles,
    single_clip,
    style_windows,
)
from tests.support.walker import CYCLE, SPEED, planted_clip, walking_clip

VELOCITIES = {
    "stand": (0, 0, 0),
    "walk_0.6": (0, 0.6, 0),
    "walk_1.3": (0, 1.3, 0),
    "run_3.0": (0, 3.0, 0),
    "back": (0, -1.0, 0),
    "strafe left": (1.0, 0, 0),
    "strafe right": (-1.0, 0, 0),
    "turn left": (0, 1.0, 1.0),
    "spin left": (0, 0, 1.5),
}


def gait_of(velocities: dict[str, tuple], cadences=None) -> Gait:
    count = len(velocities)
    runs = np.array([float(name.startswith("run")) for name in velocities])
    return Gait(
        tuple(velocities),
        np.array(list(velocities.values()), dtype=float),
        runs,
        np.zeros(count) if cadences is None else np.array(cadences),
        no_cycles(count),
        None,
    )


@pytest.fixture
def gait() -> Gait:
    return gait_of(VELOCITIES)


# ---- which clip counts --------------------------------------------------------------------


def test_at_a_clips_own_velocity_it_counts_alone(gait):
    np.testing.assert_array_equal(gait.weights(gait.root_velocities), np.eye(len(VELOCITIES)))


def test_weights_are_shares(gait):
    anywhere = np.random.default_rng(0).uniform((-2, -2, -2), (2, 4, 2), (500, 3))
    weights = gait.weights(anywhere)
    assert weights.min() >= 0 and weights.max() <= 1
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-12)
    for velocity, weight in zip(anywhere[:20], weights):
        np.testing.assert_allclose(gait.weights(velocity), weight, atol=1e-12)
    np.testing.assert_array_equal(gait_of({"walk": (0, 1, 0)}).weights(anywhere), 1.0)


@pytest.mark.parametrize(
    "start, end",
    [
        ((0, 0, 0), (0, 3.5, 0)),
        ((0, -1.3, 0), (0, 1.3, 0)),
        ((-1.3, 0.3, 0), (1.3, 0.3, 0)),
        ((0, 1.0, -1.0), (0, 1.0, 1.0)),
        ((0, 0.6, 0), (1.0, 0, 1.5)),
    ],
)
def test_weights_are_continuous(gait, start, end):
    """However little the velocity changes, they change as little: no clip comes or goes at once."""
    steps = []
    for count in (1000, 4000):
        way = np.linspace(start, end, count)
        steps.append(np.abs(np.diff(gait.weights(way), axis=0)).max())
    assert steps[0] < 0.08 and steps[1] < 0.35 * steps[0]


def test_between_two_clips_those_two_count(gait):
    weights = gait.weights(np.array([0, 0.9, 0]))
    names = list(VELOCITIES)
    assert weights[[names.index("walk_0.6"), names.index("walk_1.3")]].sum() > 0.8
    assert weights[names.index("back")] == weights[names.index("run_3.0")] == 0.0


def test_who_runs_listens_to_runs_though_a_walk_is_nearer():
    gait = gait_of({"walk": (0, 1.9, 0), "run": (0, 3.6, 0)})
    assert gait.weights(np.array([0, 2.5, 0]))[1] > 0.9 and gait.weights(np.array([0, 1.7, 0]))[0] > 0.98


def style(count: int) -> StyleClips:
    rng = np.random.default_rng(1)

    shapes = {"scale": (7,), "bias": (9,), "keys": (6, 4), "values": (6, 5), "none": (0, 3)}
    features = {
        name: torch.from_numpy(rng.normal(size=(5, count, *shape)).astype(np.float32)) for name, shape in shapes.items()
    }
    return StyleClips(features, gait_of(dict(list(VELOCITIES.items())[:count])))


def test_a_style_at_a_clips_velocity_is_that_clip_to_the_last_bit():
    clips = style(4)
    for place, velocity in enumerate(clips.gait.root_velocities):
        for name, ours in clips.at(velocity).items():
            theirs = clips.features[name]
            assert ours.shape == (5, 1, *theirs.shape[2:]) and torch.equal(ours[:, 0], theirs[:, place])


def test_in_between_it_is_the_mean_by_weights_for_one_velocity_or_many():
    clips, velocities = style(5), np.random.default_rng(3).uniform(-1, 2, (6, 3))
    together = clips.at(velocities)
    for place, (velocity, weights) in enumerate(zip(velocities, clips.gait.weights(velocities))):
        for name, one in clips.at(velocity).items():
            assert torch.allclose(one[:, 0], together[name][:, place], atol=1e-5)
            wanted = np.tensordot(clips.features[name].double().numpy(), weights, axes=(1, 0))
            assert np.allclose(one[:, 0], wanted, atol=1e-5)


def test_codes_are_interpolated_alike():
    codes = torch.randn(4, 8, generator=torch.Generator().manual_seed(0))
    clips = StyleClips(codes, gait_of(dict(list(VELOCITIES.items())[:4])))
    assert torch.equal(clips.at(np.array([0, 1.3, 0])), codes[2])
    assert clips.at(np.zeros((6, 3))).shape == (6, 8) and torch.equal(clips.at(np.zeros((6, 3)))[3], codes[0])
    between = np.array([0, 0.8, 0])
    assert np.allclose(clips.at(between), clips.gait.weights(between) @ codes.double().numpy(), atol=1e-6)


def test_a_style_of_one_clip_is_the_same_everywhere():
    features = clip_features(walking_clip())
    one = style(1).features
    clips = single_clip(one, features)
    assert clips.gait.root_velocities[0] == pytest.approx((0, SPEED, 0), abs=0.02)
    for velocity in ((0, 0, 0), (0, 3.5, 0), (-1, 0, 1)):
        assert all(torch.equal(values, one[name]) for name, values in clips.at(np.array(velocity, float)).items())
    assert torch.equal(single_clip(torch.ones(8), features).at(np.ones(3)), torch.ones(8))


# ---- what a clip shows --------------------------------------------------------------------


def going_at(speed: float, frames: int, cadence: float = FPS / CYCLE) -> Clip:
    """The walker at another speed and cadence."""
    clip = walking_clip(round(frames * cadence * CYCLE / FPS) + 2).paced(cadence * CYCLE / FPS)[:frames]
    hips = clip.hips.copy()
    hips[:, 2] = np.arange(frames) * speed / FPS
    return replace(clip, hips=hips)


def after_each_other(*clips: Clip) -> Clip:
    hips, end = [], np.zeros(3)
    for clip in clips:
        hips.append(clip.hips + end - clip.hips[0] * (1, 0, 1))
        end = hips[-1][-1] * (1, 0, 1)
    return Clip(np.concatenate(hips), np.concatenate([clip.rotations for clip in clips]))


def test_pauses_are_left_out():
    clip = after_each_other(planted_clip(150), walking_clip(300), planted_clip(150))
    (found,) = movements_in(clip_features(clip))
    assert found.name == "walk" and 0 < len(found.windows) <= MANY and found.windows.shape[1:] == (WINDOW, 21, 15)
    start, end = found.seconds
    assert 150 / FPS - 0.6 < start < 150 / FPS + 0.6 and 450 / FPS - 0.6 < end < 450 / FPS + 0.6
    speeds = found.windows[..., 0, 13].mean(axis=1)
    assert speeds == pytest.approx(SPEED, rel=0.36), "starts and stops are no walk"


def test_a_clip_that_only_speeds_up_shows_what_there_is():
    """Of two windows that walk, each is too far from their median speed to be steady: both are taken."""
    features = clip_features(going_at(0.95, SHORTEST + HOP))
    features[:HOP, :, LAYOUT["root"].start + 1] = -0.8
    features[-HOP:, :, LAYOUT["root"].start + 1] = 3.2
    (found,) = movements_in(features)
    assert found.name == "walk" and len(found.windows) == 2 and len(found.features) == len(features)


def test_who_only_stands_shows_standing():
    (found,) = movements_in(clip_features(planted_clip(150)))
    assert found.name == "stand" and found.seconds[0] == 0.0


def test_a_walk_and_a_run_in_one_clip_are_told_apart():
    walk, run = going_at(1.2, 360), going_at(3.0, 240, 1.4)
    found = movements_in(clip_features(after_each_other(walk, run)))
    assert [m.name for m in found] == ["walk", "run"], "the longest first"
    for movement, speed, (start, end) in zip(found, (1.2, 3.0), ((0, 6), (6, 10))):
        assert start - 0.6 < movement.seconds[0] and movement.seconds[1] < end + 0.6
        assert movement.windows[..., 0, 13].mean() == pytest.approx(speed, rel=0.1)
    gait = Gait.of(found)
    assert gait.movements == ("walk", "run") and list(gait.runs) == [0.0, 1.0]
    assert gait.cadences == pytest.approx([1.0, 1.4], rel=0.06)
    np.testing.assert_array_equal(gait.weights(gait.root_velocities), np.eye(2))


def test_backwards_and_sideways_have_names_of_their_own():
    back = going_at(-0.8, 200)
    assert [m.name for m in movements_in(clip_features(back))] == ["back"]
    sideways = walking_clip(200)
    hips = sideways.hips.copy()
    hips[:, 0], hips[:, 2] = hips[:, 2], 0.0
    assert [m.name for m in movements_in(clip_features(replace(sideways, hips=hips)))] == ["strafe left"]


def test_as_many_windows_as_the_clip_needs():
    counts = [len(movements_in(clip_features(walking_clip(frames)))[0].windows) for frames in (64, 120, 240, 1200)]
    assert counts[0] == 1 and counts == sorted(counts) and counts[-1] == MANY
    windows = movements_in(clip_features(walking_clip(1200)))[0].windows
    assert len(np.unique(windows[:, 0, 3, 2].round(3))) > 2, "they do not all begin with the same pose"


def test_too_short_a_clip_is_refused():
    for read in (movements_in, style_windows):
        with pytest.raises(ValueError, match="too short for a style: give at least 1.1 s"):
            read(clip_features(walking_clip(63)))


def test_what_is_known_of_a_gait():
    features = clip_features(walking_clip(300))
    gait = Gait.of(
        [
            Movement("walk", style_windows(features), features, (0.0, 5.0)),
            Movement("stand", style_windows(clip_features(planted_clip())), clip_features(planted_clip()), (0.0, 2.0)),
        ]
    )
    assert gait.cadences == pytest.approx([FPS / CYCLE, 0.0], rel=1e-2) and gait.residual is not None
    assert not gait.cycles[1].any(), "who stands has no cycle"
    again = cycle_at(gait.cycles[0], stride_phase(features))
    assert np.abs(again - features[..., BODY])[10:-10].max() < 0.02, "a walk that repeats is its cycle"


# ---- pace ---------------------------------------------------------------------------------

OWN_SPEEDS, OWN_CADENCES = (0.4, 0.8, 1.3, 2.0), (0.6, 0.75, 0.9, 1.1)
OWN = gait_of(
    {**{f"walk_{speed}": (0, speed, 0) for speed in OWN_SPEEDS}, "run_2.5": (0, 2.5, 0), "run_3.5": (0, 3.5, 0)},
    (*OWN_CADENCES, 1.4, 1.5),
)


def walking(speed: float, cadence: float, name: str = "walk") -> Gait:
    return gait_of({name: (0, speed, 0)}, [cadence])


@pytest.mark.parametrize("speed, cadence", [(0.7, 0.8), (1.3, 0.9), (1.0, 1.05), (0.5, 0.56), (1.5, 0.95)])
def test_the_controller_goes_with_the_strides_of_the_style(speed, cadence):
    """At the speed and playback rate that are asked for, its stride and its cadence are the style's, and so is its
    speed."""
    asked, rate = walking(speed, cadence).pace_of("walk", OWN)
    own_cadence = np.interp(asked, OWN_SPEEDS, OWN_CADENCES)
    assert asked / own_cadence == pytest.approx(speed / cadence, rel=0.02)
    assert own_cadence * rate == pytest.approx(cadence, rel=1e-6) and asked * rate == pytest.approx(speed, rel=0.02)


def test_its_own_walk_is_at_its_own_pace():
    for speed, cadence in zip(OWN_SPEEDS, OWN_CADENCES):
        asked, rate = walking(speed, cadence).pace_of("walk", OWN)
        assert asked == pytest.approx(speed, abs=0.01) and rate == pytest.approx(1.0, abs=0.01)


def test_rates_stay_within_what_a_body_can_do():
    for cadence in (0.1, 5.0):
        asked, rate = walking(1.3, cadence).pace_of("walk", OWN)
        assert PLAYBACK_RATES[0] <= rate <= PLAYBACK_RATES[1] and OWN_SPEEDS[0] <= asked <= OWN_SPEEDS[-1]


def test_a_run_has_the_pace_of_a_run():
    asked, rate = walking(3.0, 1.45, "run").pace_of("run", OWN)
    assert asked == pytest.approx(3.0, abs=0.02) and rate == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("gait", [walking(1.3, 0.9), walking(2.5, 0.0, "run")], ids=["no run", "no strides"])
def test_a_pace_that_no_clip_shows_is_no_pace(gait):
    with pytest.raises(KeyError, match="run"):
        gait.pace_of("run", OWN)
