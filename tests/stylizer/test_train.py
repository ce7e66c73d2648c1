"""Training: a folder of BVH becomes weights, mirroring mirrors, and a resumed run is the run that never stopped."""

import json

import numpy as np
import pytest
import torch

from sim import bvh
from sim.features import clip_features
from stylizer import train as training
from stylizer import weights
from stylizer.dataset import LATER, MotionData, PackedClip, Sampler, mirrored, pack
from tests.sim.walker import walking_clip
from tests.stylizer.conftest import TINY


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Small batches, a row in the curve for every step."""
    for name, value in (("BATCH", 3), ("HELD_OUT_BATCHES", 1), ("LOG_EVERY", 1)):
        monkeypatch.setattr(training, name, value)


@pytest.fixture
def folder(tmp_path):
    """Two usable clips, one too short, one that is no BVH."""
    data = tmp_path / "data" / "archive"
    data.mkdir(parents=True)
    bvh.write(data / "walk_01.bvh", walking_clip(90))
    bvh.write(data / "walk_02.bvh", walking_clip(120, yaw=1.0))
    bvh.write(data / "short.bvh", walking_clip(20))
    (data / "broken.bvh").write_text("not a BVH file")
    return data.parent


def test_a_folder_is_packed_and_what_cannot_be_used_is_counted(folder, tmp_path):
    data = pack(folder, tmp_path / "pack")
    assert [(clip.name, clip.label, clip.frames) for clip in data.clips] == [
        ("archive/walk_01", "archive/walk_", 90), ("archive/walk_02", "archive/walk_", 120)]
    assert sorted(data.skipped.values()) == [1, 1] and any("shorter than" in reason for reason in data.skipped)
    assert np.allclose(data.features(data.clips[0]), clip_features(walking_clip(90).grounded()), atol=0.02)


def test_a_folder_without_motion_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no .bvh files under"):
        pack(tmp_path, tmp_path / "pack")


def test_mirrored_features_are_the_mirrored_clips():
    clip = walking_clip()
    assert np.allclose(mirrored(clip_features(clip)), clip_features(clip.mirrored()), atol=1e-4)


def test_windows_end_where_they_should():
    motion = np.broadcast_to(np.arange(100, dtype=np.float32)[:, None, None], (100, 21, 15))
    sampler = Sampler(MotionData(motion, [PackedClip("a", "a", 0, 100, 1.0)], {}), seed=0)
    batch = sampler.batch(50)
    assert np.allclose(np.diff(np.abs(batch.later[:, :, 0, 1]), axis=1), 2)
    assert np.allclose(batch.later[:, :, 0, 1], batch.source[:, -16:, 0, 1] + LATER)
    assert batch.later[:, -1, 0, 1].max() <= 99


def test_mixing_keeps_the_source_in_some_parts():
    use_target = training.draw_mixing(np.random.default_rng(0), 4000)
    assert use_target.shape == (5, 4000)
    assert abs(use_target.all(axis=0).mean() - (1 - training.MIXING)) < 0.03
    assert abs((~use_target).sum(0)[~use_target.all(0)].mean() - 3) < 0.1  # 1 to 5 parts, evenly


def test_a_resumed_run_is_the_run_that_never_stopped(tmp_path):
    features = clip_features(walking_clip())
    data = MotionData(features.astype(np.float32), [PackedClip("a", "a", 0, len(features), 1.0)], {})
    whole = training.Trainer(data, TINY)
    for step in range(4):
        if step == 2:
            whole.keep(tmp_path / "checkpoint.pt")
        whole.update(progress=0.0)
    resumed = training.Trainer(data, TINY, seed=7)
    resumed.restore(tmp_path / "checkpoint.pt")
    for _ in range(2):
        resumed.update(progress=0.0)
    assert resumed.step == whole.step == 4
    for part in ("model", "average"):
        for a, b in zip(getattr(whole, part).parameters(), getattr(resumed, part).parameters()):
            assert torch.equal(a, b)


def test_training_writes_weights_and_curve(folder, tmp_path):
    path = training.train(folder, tmp_path / "out", minutes=0.002, config=TINY)
    header, _ = weights.read(path)
    assert json.loads(header["config"])["channels"] == [8, 8, 8] and "CC BY-NC" in header["licence"]
    assert (tmp_path / "out" / "curve.csv").read_text().startswith("step,minutes,reconstruction")
    assert (tmp_path / "out" / "curve.png").exists()
    weights.load("slim", tmp_path / "out")
    training.train(folder, tmp_path / "out", minutes=0.003, resume=True, config=TINY)


def test_resuming_without_a_checkpoint_is_refused(folder, tmp_path):
    with pytest.raises(ValueError, match="no checkpoint at"):
        training.train(folder, tmp_path / "out", minutes=0.01, resume=True, config=TINY)
