"""Windows end where they should, are mirrored and paced as motion is, and come with the matching step of the target."""

from dataclasses import replace

import numpy as np
import pytest

from sim.motion.features import LAYOUT, clip_features
from stylizer.data import sampler as sampling
from stylizer.data.dataset import LATER, STYLE_WINDOW, MotionData, PackedClip
from stylizer.data.sampler import Sampler, mirror
from tests.support.walker import SPEED, walking_clip


def data_of(*features, speed=1.0):
    """The features of some clips as a data set."""
    starts = np.cumsum([0, *map(len, features)])
    clips = [
        PackedClip(f"archive/{i}", "walk", int(start), len(f), speed)
        for i, (start, f) in enumerate(zip(starts, features))
    ]
    return MotionData(np.concatenate(features).astype(np.float32), clips, {})


def counting(frames=100):
    return np.broadcast_to(np.arange(frames, dtype=np.float32)[:, None, None], (frames, 21, 15))


def test_mirrored_features_are_the_mirrored_clips():
    clip = walking_clip()
    assert np.allclose(mirror(clip_features(clip)), clip_features(clip.mirrored()), atol=1e-4)


def test_windows_end_where_they_should(monkeypatch):
    monkeypatch.setattr(sampling, "CROPPING", 0.0)
    batch = Sampler(data_of(counting()), seed=0).batch(50)
    assert np.allclose(np.diff(batch.later[:, :, 0, 1], axis=1), 2, atol=1e-4)
    assert np.allclose(batch.later[:, :, 0, 1], batch.source[:, -16:, 0, 1] + LATER, atol=1e-4)
    assert batch.later[:, -1, 0, 1].max() <= 99
    same = np.isclose(batch.own[:, -STYLE_WINDOW:], batch.source, atol=1e-4).all(axis=(1, 2, 3))
    assert 0.3 < same.mean() < 0.7


def test_paced_windows_are_paced_motion(monkeypatch):
    monkeypatch.setattr(sampling, "CROPPING", 1.0)
    batch = Sampler(data_of(clip_features(walking_clip())), seed=0).batch(50)
    speed = batch.source[:, -1, 0, LAYOUT["root"]][:, 1] / SPEED
    assert speed.min() > 0.58 and speed.max() < 1.62 and speed.std() > 0.2
    feet = np.abs(batch.source[:, -8:, [3, 7]])
    seen = np.abs(np.diff(feet[..., 2], axis=1)) * 30  # how fast the feet go in the window is the velocity they claim
    claimed = np.abs(feet[:, 1:, :, LAYOUT["velocity"].start + 2])
    assert np.median(np.abs(seen - claimed)) < 0.1 * np.median(claimed)


def test_the_match_steps_as_the_source_does():
    walk = clip_features(walking_clip())
    batch = Sampler(data_of(walk, clip_features(walking_clip(yaw=1.0))), seed=0).batch(30)
    assert np.median(batch.closeness) > 0.8
    for ours, theirs in ((batch.source[:, -16:], batch.match), (batch.later, batch.match_later)):
        assert np.median(np.abs(ours - theirs)[:, -1, [3, 7], 2]) < 0.03


@pytest.mark.parametrize("frames", [40, 45])
def test_short_clips_can_be_drawn(frames):
    batch = Sampler(data_of(counting(frames)), seed=0).batch(20)
    assert np.isfinite(batch.source).all() and batch.later[..., 0, 1].max() <= frames - 1


def test_the_exemplar_goes_the_sources_way_in_the_targets_style():
    """A forward and a turning take of two styles: who goes forward is shown the forward take, whichever is the
    target."""

    def going(turn, height):
        features = counting(60).copy() * 0.01
        features[..., 1], features[:, :, LAYOUT["root"]] = height, [0.0, 1.0, turn]
        return features

    root_velocities = {"walk": 0.0, "walk-turn-left": 1.0}
    data = data_of(*(going(turn, height) for height in (1.0, 2.0) for turn in root_velocities.values()))
    names = [
        f"a/dataset-1_{root_velocity}_{style}_001" for style in ("normal", "old") for root_velocity in root_velocities
    ]
    data.clips = [replace(clip, name=name) for clip, name in zip(data.clips, names)]
    sampler = Sampler(data, seed=0)
    assert sampler.exemplar(data.clips[3], np.array([0.0, 1.0, 0.0])) is data.clips[2]
    assert sampler.exemplar(data.clips[0], np.array([0.0, 1.0, 0.9])) is data.clips[1]
    assert sampler.exemplar(data.clips[1], np.zeros(3)) is data.clips[1]
    assert all(sampler.exemplar(clip, np.array([0.0, 1.0, 0.5])) is clip for clip in data.clips)  # as near as any other
    batch = sampler.batch(40)
    assert np.allclose(batch.exemplar[:, 0, 0, 1], batch.target[:, 0, 0, 1])  # the style's height
    straight = np.abs(batch.source[:, 0, 0, 14]) < 0.1
    assert 0.2 < straight.mean() < 0.8 and np.allclose(batch.exemplar[straight, 0, 0, 14], 0)  # the source's way


def test_own_styles_are_also_read_where_the_same_person_does_something_else(monkeypatch):
    monkeypatch.setattr(sampling, "ELSEWHERE", 1.0)
    monkeypatch.setattr(sampling, "ELSEWHERE_STILL", 1.0)
    data = data_of(*(np.full((60, 21, 15), value, np.float32) for value in range(4)))
    names = ("a/dataset-1_walk_old_001", "a/dataset-1_run_old_002", "a/dataset-1_walk_sad_001", "a/bow")
    data.clips = [replace(clip, name=name) for clip, name in zip(data.clips, names)]
    batch = Sampler(data, seed=0).batch(60)
    heights = zip(batch.source[:, 0, 0, 1], batch.own[:, 0, 0, 1])
    pairs = {tuple(np.round(pair).astype(int)) for pair in heights}
    assert pairs == {(0, 0), (0, 1), (1, 0), (1, 1), (2, 2), (3, 3)}
