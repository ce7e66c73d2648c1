"""Training: a folder of BVH becomes weights, a resumed run is the run that never stopped, two processes learn one
network."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from sim.io import bvh
from sim.motion.features import clip_features
from stylizer.data.dataset import MotionData, PackedClip, pack
from stylizer.styles.bank import StyleBank, own_motion_file
from stylizer.systems import checkpoint, weight_files
from stylizer.systems.motion_puzzle.config import CONFIGS
from stylizer.systems.motion_puzzle.objective import OURS, RECIPES
from stylizer.systems.registry import SYSTEMS
from stylizer.training import train as training
from stylizer.training import trainer
from tests.stylizer.conftest import TINY
from tests.support.walker import walking_clip

SMALL = replace(OURS, batch=3)


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """A small network and small batches, a row in the curve for every step."""
    monkeypatch.setitem(CONFIGS, "tiny", TINY)
    puzzle = SYSTEMS["motion-puzzle"]
    monkeypatch.setitem(SYSTEMS, puzzle.kind, replace(puzzle, networks=(*puzzle.networks, "tiny")))
    monkeypatch.setitem(RECIPES, "small", SMALL)
    for name, value in (("HELD_OUT_BATCHES", 1), ("LOG_EVERY", 1)):
        monkeypatch.setattr(trainer, name, value)


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
        ("archive/walk_01", "archive/walk_", 90),
        ("archive/walk_02", "archive/walk_", 120),
    ]
    assert sorted(data.skipped.values()) == [1, 1] and any("shorter than" in reason for reason in data.skipped)
    assert np.allclose(data.features(data.clips[0]), clip_features(walking_clip(90).grounded()), atol=0.02)


def test_a_folder_without_motion_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no .bvh files under"):
        pack(tmp_path, tmp_path / "pack")


def test_clips_can_be_left_out(folder, tmp_path):
    data = pack(folder, tmp_path / "pack")
    assert [clip.name for clip in data.without(["walk_01"]).clips] == ["archive/walk_02"]
    with pytest.raises(ValueError, match="every clip is left out"):
        data.without(["walk"])


def test_mixing_keeps_the_source_in_some_parts():
    use_target = trainer.draw_mixing(np.random.default_rng(0), 4000)
    assert use_target.shape == (5, 4000)
    assert abs(use_target.all(axis=0).mean() - (1 - trainer.MIXING)) < 0.03
    assert abs((~use_target).sum(0)[~use_target.all(0)].mean() - 3) < 0.1  # 1 to 5 parts, evenly


def test_a_resumed_run_is_the_run_that_never_stopped(tmp_path):
    features = clip_features(walking_clip())
    data = MotionData(features.astype(np.float32), [PackedClip("a", "a", 0, len(features), 1.0)], {})
    whole = training.Trainer(data, TINY, SMALL)
    for step in range(4):
        if step == 2:
            whole.keep(tmp_path / "checkpoint.pt")
        whole.update(progress=0.0)
    resumed = training.Trainer(data, TINY, SMALL, seed=7)
    resumed.restore(tmp_path / "checkpoint.pt")
    for _ in range(2):
        resumed.update(progress=0.0)
    assert resumed.step == whole.step == 4
    for part in ("model", "average"):
        for a, b in zip(getattr(whole, part).parameters(), getattr(resumed, part).parameters()):
            assert torch.equal(a, b)


def test_training_writes_weights_curve_and_the_neutral_style(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(weight_files, "FOLDER", tmp_path / "out")
    path = training.train(folder, tmp_path / "out", minutes=0.002, network="tiny", recipe="small")
    header, _ = checkpoint.read(path)
    assert json.loads(header["config"])["channels"] == [8, 8, 8]
    assert header["licence"] == "trained on the user's own clips"
    assert (tmp_path / "out" / "curve.csv").read_text().startswith("step,minutes,reconstruction")
    assert (tmp_path / "out" / "curve.png").exists()
    checkpoint.load("tiny", tmp_path / "out")
    shutil.copy(own_motion_file(), tmp_path / "out" / "styles")  # where the package's lies
    assert StyleBank("tiny", tmp_path / "out" / "styles", tmp_path / "user").names == ("neutral",)
    steps, curve = int(header["steps"]) + 2, (tmp_path / "out" / "curve.csv").read_text()
    training.train(folder, tmp_path / "out", steps=steps, resume=True, network="tiny", recipe="small")
    assert checkpoint.read(path)[0]["steps"] == str(steps)
    longer = (tmp_path / "out" / "curve.csv").read_text()
    assert longer.startswith(curve)
    assert [int(line.split(",")[0]) for line in longer[len(curve) :].split()] == [steps - 1, steps]


def test_training_can_stop_after_steps(folder, tmp_path):
    path = training.train(folder, tmp_path / "out", steps=2, network="tiny", recipe="small")
    header, _ = checkpoint.read(path)
    assert header["steps"] == "2" and "--steps 2 --network tiny" in header["command"]


def test_resuming_without_a_checkpoint_is_refused(folder, tmp_path):
    with pytest.raises(ValueError, match="no checkpoint at"):
        training.train(folder, tmp_path / "out", minutes=0.01, resume=True, network="tiny", recipe="small")


def test_a_damaged_checkpoint_is_a_sentence_that_says_what_to_do(folder, tmp_path):
    out = tmp_path / "out"
    training.train(folder, out, steps=1, network="tiny", recipe="small")
    content = (out / "checkpoint.pt").read_bytes()
    for bytes_left in (b"", b"nonsense", content[: len(content) // 2]):
        (out / "checkpoint.pt").write_bytes(bytes_left)
        with pytest.raises(ValueError, match="checkpoint.pt is damaged, or another network's or recipe's: train anew"):
            training.train(folder, out, steps=2, resume=True, network="tiny", recipe="small")


@pytest.mark.parametrize("index", ["", '{"source": {"feat', "[]", "{}"])
def test_who_is_killed_while_packing_packs_anew(folder, tmp_path, monkeypatch, index):
    whole = pack(folder, tmp_path / "pack")
    (tmp_path / "pack" / "clips.json").write_text(index)
    assert [clip.name for clip in pack(folder, tmp_path / "pack").clips] == [clip.name for clip in whole.clips]


def test_a_pack_that_is_being_made_anew_has_no_index(folder, tmp_path, monkeypatch):
    pack(folder, tmp_path / "pack")
    (folder / "archive" / "walk_02.bvh").unlink()
    monkeypatch.setattr("stylizer.data.dataset.load_clip", lambda path: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        pack(folder, tmp_path / "pack")
    assert not (tmp_path / "pack" / "clips.json").exists()


@pytest.mark.parametrize(
    "wrong, message",
    [
        ({"network": "huge"}, "there is no network 'huge': use one of full, paper_slim"),
        ({"network": "slim", "recipe": "magic"}, "there is no recipe 'magic': use one of paper, ours"),
    ],
)
def test_unknown_networks_and_recipes_are_refused(folder, tmp_path, wrong, message):
    with pytest.raises(ValueError, match=message):
        training.train(folder, tmp_path / "out", **wrong)


TWO_PROCESSES = """
import sys
from dataclasses import replace
from pathlib import Path
import torch
from stylizer.training import train
from stylizer.data.dataset import MotionData
from stylizer.systems.motion_puzzle.objective import OURS
from stylizer.systems.motion_puzzle.config import SLIM
torch.set_num_threads(1)
out = Path(sys.argv[1])
with train.Processes() as rank:
    small = replace(SLIM, stem=8, channels=(8, 8, 8)), replace(OURS, batch=2)
    trainer = train.Trainer(MotionData.open(out), *small, seed=1 + rank)
    windows = trainer.sampler.batch(1).source.sum()
    for _ in range(3):
        trainer.update(progress=0.0)
    learned = list(trainer.model.parameters())
    torch.save({"windows": float(windows), "spent": trainer.spent, "weights": learned}, out / f"{rank}.pt")
"""


def test_two_processes_learn_one_network_from_different_windows(folder, tmp_path):
    pack(folder, tmp_path / "pack")
    script = tmp_path / "two_processes.py"
    script.write_text(TWO_PROCESSES)
    torchrun = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2"]
    root = Path(__file__).parents[3]
    subprocess.run(
        [*torchrun, script, tmp_path / "pack"],
        check=True,
        capture_output=True,
        timeout=300,
        cwd=root,
        env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(root)},
    )
    first, second = (torch.load(tmp_path / "pack" / f"{rank}.pt", weights_only=True) for rank in (0, 1))
    assert first["windows"] != second["windows"] and first["spent"] == second["spent"]
    assert all(torch.equal(a, b) for a, b in zip(first["weights"], second["weights"]))
