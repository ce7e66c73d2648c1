"""The phase-functioned network against the paper's formula, and its training on a synthetic walk."""

import math
from pathlib import Path

import numpy as np
import pytest
import torch
from torch.nn import functional as F

from controller.model import checkpoint
from controller.model.io_layout import INPUT_SIZE, INPUT_SLICES, OUTPUT_SIZE, OUTPUT_SLICES, POSE_SIZE
from controller.model.network import PhaseFunctionedNetwork, spline_coefficients
from controller.training.dataset import Frames, frames_of, is_held_out, kind_of
from controller.training.labelled_clip import label
from controller.training.train import Starts, Trainer
from sim.motion.clip import FPS
from tests.support.walker import SPEED, planted_clip, walking_clip


def test_blending_outputs_equals_blending_weights_by_the_papers_spline():
    torch.manual_seed(0)
    layer = PhaseFunctionedNetwork(hidden=16).layers[0]
    a = layer.weight.view(4, 16, INPUT_SIZE)
    x = torch.randn(7, INPUT_SIZE)
    for i, phase in enumerate(torch.linspace(0, 2 * math.pi - 1e-3, 7)):
        w = 4 * phase / (2 * math.pi)
        k1, t = int(w) % 4, w % 1
        a0, a1, a2, a3 = a[k1 - 1], a[k1], a[(k1 + 1) % 4], a[(k1 + 2) % 4]
        theta = (
            a1
            + t * (a2 - a0) / 2
            + t**2 * (a0 - 5 / 2 * a1 + 2 * a2 - a3 / 2)
            + t**3 * (3 / 2 * a1 - 3 / 2 * a2 + a3 / 2 - a0 / 2)
        )
        ours = layer(x[i : i + 1], spline_coefficients(phase[None]))[0]
        torch.testing.assert_close(ours, F.linear(x[i], theta), rtol=1e-4, atol=1e-5)


def test_the_phase_is_cyclic():
    ends = spline_coefficients(torch.tensor([0.0, 2 * math.pi, 4 * math.pi]))
    torch.testing.assert_close(ends, torch.tensor([[1.0, 0, 0, 0]]).expand(3, 4), atol=1e-5, rtol=0)


def test_frames_describe_the_walk_they_were_made_from():
    inputs, targets, phase = frames_of(label(walking_clip(240, yaw=0.8).grounded()))
    assert inputs.shape == (239, INPUT_SIZE) and targets.shape == (239, OUTPUT_SIZE) and phase.shape == (239,)
    step = targets[:, OUTPUT_SLICES["root"]]
    np.testing.assert_allclose(step, np.tile([0, SPEED / FPS, 0], (239, 1)), atol=1e-5)
    ahead = inputs[:, INPUT_SLICES["trajectory_positions"]].reshape(-1, 12, 3)[..., ::2]
    np.testing.assert_allclose(ahead[..., 1], np.tile(np.arange(-60, 60, 10) * SPEED / FPS, (239, 1)), atol=1e-4)
    np.testing.assert_allclose(ahead[..., 0], 0, atol=1e-4)
    np.testing.assert_allclose(
        targets[:-1, OUTPUT_SLICES["positions"]], inputs[1:, INPUT_SLICES["positions"]], atol=1e-6
    )


def test_kinds_of_movement_are_told_apart():
    walk = walking_clip(240)
    path = Path("walk.bvh")
    assert kind_of(path, walk) == "forward walk"
    assert kind_of(path, walk.paced(2.5)) == "run"
    assert kind_of(path, planted_clip()) == "stand"
    assert kind_of(path, walk[::-1]) == "backing"
    assert kind_of(Path("o3de/Jumps1.bvh"), walk) == "jump" and kind_of(Path("o3de/Crouching1.bvh"), walk) == "crouch"


def tiny_frames() -> Frames:
    inputs, targets, phase = frames_of(label(walking_clip(240).grounded()))
    count = len(phase)
    last = np.zeros(count, bool)
    last[[count // 2, count - 1]] = True
    return Frames(
        inputs,
        targets,
        phase,
        np.full(count, 1 / count),
        np.arange(count) > count // 2,
        last,
        np.zeros(count, int),
        ["walk"],
    )


def test_rollouts_never_cross_the_end_of_a_clip():
    frames = tiny_frames()
    starts = Starts(frames, ~frames.held_out).draw(np.random.default_rng(0), 16, 5000)
    np.testing.assert_array_equal(np.unique(starts), np.arange(len(frames.last) // 2 - 14))


def test_training_learns_a_walk_and_a_resumed_run_goes_on_exactly(tmp_path, monkeypatch):
    monkeypatch.setattr("controller.training.train.BATCH", 128)
    monkeypatch.setattr("controller.training.train.has_fast_bf16", lambda device: False)
    frames = tiny_frames()
    whole = Trainer(frames, hidden=32)
    first = [whole.update(0.2)["loss"] for _ in range(20)]
    whole.keep(tmp_path / "checkpoint.pt")
    rest = [whole.update(0.2)["loss"] for _ in range(20)]
    assert np.mean(rest[-5:]) < 0.7 * np.mean(first[:5])
    resumed = Trainer(frames, hidden=32)
    resumed.restore(tmp_path / "checkpoint.pt")
    assert [resumed.update(0.2)["loss"] for _ in range(20)] == rest


def test_training_goes_on_from_other_weights_in_the_statistics_of_its_own_data():
    frames = tiny_frames()
    begun = Trainer(frames, hidden=32).network
    frames.inputs += 1.0
    trainer = Trainer(frames, seed=2, start=begun)
    assert trainer.network.hidden == 32 and trainer.begun > 0
    torch.testing.assert_close(dict(trainer.network.named_parameters()), dict(begun.named_parameters()), rtol=0, atol=0)
    torch.testing.assert_close(trainer.network.input_mean, begun.input_mean + 1.0, rtol=1e-4, atol=1e-4)


def test_weights_come_back_and_those_made_for_something_else_are_refused(tmp_path, monkeypatch):
    network = PhaseFunctionedNetwork(hidden=16)
    checkpoint.save(network, tmp_path / "pfnn.safetensors", licence="none")
    x, phase = torch.randn(3, INPUT_SIZE), torch.rand(3)
    torch.testing.assert_close(checkpoint.load(folder=tmp_path)(x, phase), network(x, phase), rtol=1e-2, atol=1e-2)
    assert network.standing.shape == (POSE_SIZE,)
    with pytest.raises(ValueError, match="no controller weights"):
        checkpoint.load(folder=tmp_path / "elsewhere")
    checkpoint.save(network, tmp_path / "pfnn.safetensors", licence="none", hidden="1000000")
    with pytest.raises(ValueError, match="pfnn.safetensors is damaged"):  # and no terabyte is asked for
        checkpoint.load(folder=tmp_path)
    monkeypatch.setattr(checkpoint, "skeleton_hash", lambda: "another")
    with pytest.raises(ValueError, match="skeleton"):
        checkpoint.load(folder=tmp_path)
    (tmp_path / "pfnn.safetensors").write_bytes(b"not weights")
    with pytest.raises(ValueError, match="not a readable safetensors file"):
        checkpoint.load(folder=tmp_path)


POSE_CHANNELS = ["clip2", "clip15", "clip17", "clip38", "clip43", "clip55", "clip56"]  # of the first sixty names below


def test_the_split_is_fixed_by_name():
    names = [f"clip{i}" for i in range(2000)]
    assert 0.07 < np.mean([is_held_out(name) for name in names]) < 0.13
    assert [name for name in names[:60] if is_held_out(name)] == POSE_CHANNELS, (
        "the same ones in every process, for ever"
    )
