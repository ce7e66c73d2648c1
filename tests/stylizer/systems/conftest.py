"""Whole-body systems that learn in a moment, and labelled motion for them."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.motion.features import clip_features
from stylizer.data.dataset import MotionData, PackedClip
from stylizer.data.sampler import measure_statistics
from stylizer.systems import diverse, latent, unpaired
from stylizer.systems.registry import SYSTEMS
from stylizer.training import train_systems
from tests.support.walker import walking_clip

TINY = {
    "unpaired": replace(
        unpaired.CONFIGS["unpaired"],
        content=(32, 32),
        style=(16, 16),
        discriminator=(8, 8),
        code=8,
        taps=3,
        views=2,
        window=16,
    ),
    "diverse": replace(diverse.CONFIGS["diverse"], channels=(12, 16, 16), code=8, hidden=(8, 8, 8), window=16),
    "latent": replace(latent.CONFIGS["latent"], pose=(24, 24), latent=16, width=16, content=8, code=4, window=16),
}
LABELS = ("old 1", "proud 1")


@pytest.fixture
def tiny(monkeypatch):
    """Networks that learn in a moment under the names of the real ones."""
    for module in (unpaired, diverse, latent):
        monkeypatch.setattr(module, "CONFIGS", {name: TINY[name] for name in module.CONFIGS if name in TINY})
    monkeypatch.setattr(train_systems, "HELD_OUT_BATCHES", 1)
    monkeypatch.setattr(train_systems, "measure_statistics", lambda sampler: measure_statistics(sampler, 2))


@pytest.fixture(scope="module")
def data():
    """Two styles, two clips each: one walks as it is, the other leans back, bends its arms and walks with a lower
    step."""
    clips, motion, start = [], [], 0
    for label, shift in (("old", 0.0), ("proud", 0.4)):
        for take in (1, 2):
            features = clip_features(walking_clip(120 + 10 * take)).astype(np.float32)
            features[:, 9:, 3:9] += shift
            clips.append(PackedClip(f"bandai-namco/dataset-1_walk_{label}_00{take}", label, start, len(features), 1.0))
            motion.append(features)
            start += len(features)
    return MotionData(np.concatenate(motion), clips, {})


def model_of(network, seed=0):
    torch.manual_seed(seed)
    return SYSTEMS[network].load_training().Objective(replace(TINY[network], labels=LABELS)).system.eval()
