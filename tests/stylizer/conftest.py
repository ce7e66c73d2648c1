"""A tiny network with its bank, made in a moment, so that nothing here depends on the trained weights."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim import bvh
from sim.features import clip_features
from stylizer import weights
from stylizer.bank import Bank, encode, style_windows, write
from stylizer.configs import SLIM
from stylizer.motion_puzzle import MotionPuzzle
from tests.sim.walker import walking_clip

TINY = replace(SLIM, stem=8, channels=(8, 8, 8))


@pytest.fixture(autouse=True, scope="session")
def one_thread():
    """As in a session; two threads of two tests in each other's way are many times slower."""
    torch.set_num_threads(1)


@pytest.fixture
def walk_file(tmp_path):
    """A BVH file of four seconds of walking."""
    path = tmp_path / "walk.bvh"
    bvh.write(path, walking_clip())
    return path


@pytest.fixture
def bank(tmp_path, monkeypatch):
    """A bank of two bundled styles, `neutral` and `other`, and an empty user's folder."""
    torch.manual_seed(0)
    features = clip_features(walking_clip())
    model = MotionPuzzle(TINY)
    model.set_statistics(features.mean(0), np.full((21, 15), 0.3))
    with torch.no_grad():
        model.decoder.head.weight.mul_(2)  # untrained, the styles would hardly differ
    weights.save(model, tmp_path / "weights" / "tiny.safetensors", licence="none")
    monkeypatch.setattr(weights, "FOLDER", tmp_path / "weights")
    model, fingerprint = weights.load("tiny")
    elsewhere = np.random.default_rng(0).normal(size=(21, 15))
    for name, windows in (("neutral", style_windows(features)), ("other", style_windows(features) + elsewhere)):
        write(tmp_path / "styles" / f"{name}.safetensors", name, encode(model, windows), fingerprint, "none", "made up")
    return Bank("tiny", tmp_path / "styles", tmp_path / "user")
