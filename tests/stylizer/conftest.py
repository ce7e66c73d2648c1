"""A tiny network with its bank, made in a moment, so that nothing here depends on the trained weights."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.io import bvh
from sim.motion.features import STRIDE, clip_features
from sim.motion.gait import stride_phase
from stylizer.styles import own_style, style_file
from stylizer.styles.bank import StyleBank, own_motion_file
from stylizer.styles.encoding import encode_clips
from stylizer.styles.style_clips import SHORTEST, WINDOW, Gait, Movement, OwnMotion, style_windows
from stylizer.systems import checkpoint, weight_files
from stylizer.systems.motion_puzzle.config import SLIM
from stylizer.systems.motion_puzzle.joint_config import JOINT_PUZZLE
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.motion_puzzle.model import MotionPuzzle
from tests.support.walker import walking_clip

TINY = replace(SLIM, stem=8, channels=(8, 8, 8))
TINY_JOINTS = replace(JOINT_PUZZLE, hidden=16, code=8)
CONTROLLER = "a walker"  # the fingerprint of the controller whose motion the own style is


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


def movement(features: np.ndarray, name: str = "walk") -> Movement:
    """Features (frames, 21, 15) as one kind of movement."""
    return Movement(name, style_windows(features).astype(np.float32), features, (0.0, len(features) / 60))


def own_motion(features: np.ndarray, name: str = "walk_1.2", controller: str = CONTROLLER) -> OwnMotion:
    """The motion of a controller that can do one thing, features (frames, 21, 15)."""
    shown = movement(features, name)
    starts = np.linspace(0, len(features) - SHORTEST, len(shown.windows)).round().astype(int)
    phase = stride_phase(features)[starts[:, None] + STRIDE * np.arange(WINDOW)]
    return OwnMotion([shown.windows], [phase], replace(Gait.of([shown]), residual=None), controller)


def write_style(folder, name: str, model, fingerprint: str, movements: list[Movement], own: OwnMotion, **header):
    """A style file as those of the package are; it keeps no motion."""
    style = encode_clips(model, [m.windows for m in movements], Gait.of(movements), own)
    header = {"weights": fingerprint, "controller": own.controller, "licence": "none", "source": "made up", **header}
    style_file.write(folder / f"{name}.safetensors", name, style, header)


def expand_batch(style: dict, size: int) -> dict:
    """One style as that of a whole batch, without copies."""
    return {name: values.expand(-1, size, *values.shape[2:]) for name, values in style.items()}


def make_bank(folder, monkeypatch, model: MotionPuzzle | JointPuzzle) -> StyleBank:
    """A bank of two bundled styles, `neutral` and `other`, and an empty user's folder, for an untrained network."""
    features = clip_features(walking_clip())
    model.set_statistics(features.mean(0), np.full((21, 15), 0.3))
    checkpoint.save(model, folder / "weights" / "tiny.safetensors", licence="none")
    monkeypatch.setattr(weight_files, "FOLDER", folder / "weights")
    model, fingerprint = checkpoint.load("tiny")
    elsewhere = np.random.default_rng(0).normal(size=(21, 15))
    own = own_motion(features)
    style_file.write_own_motion(own_motion_file(folder / "styles"), own)
    own_style.write_own_style(folder / "styles" / "tiny", own, model, fingerprint)
    write_style(folder / "styles" / "tiny", "other", model, fingerprint, [movement(features + elsewhere)], own)
    return StyleBank("tiny", folder / "styles", folder / "user")


@pytest.fixture
def bank(tmp_path, monkeypatch):
    """For a network of the kind that is shipped."""
    torch.manual_seed(0)
    return make_bank(tmp_path, monkeypatch, JointPuzzle(TINY_JOINTS))


@pytest.fixture
def decoder_bank(tmp_path, monkeypatch):
    """For a network of the paper's own form."""
    torch.manual_seed(0)
    model = MotionPuzzle(TINY)
    with torch.no_grad():
        model.decoder.head.weight.mul_(2)  # untrained, the styles would hardly differ
    return make_bank(tmp_path, monkeypatch, model)
