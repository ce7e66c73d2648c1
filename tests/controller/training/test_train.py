"""A run of training: what it leaves when it is stopped, and when nothing is left to do."""

from pathlib import Path

import pytest

from controller.training import train
from tests.controller.model.test_network import tiny_frames


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setattr(train, "BATCH", 64)
    monkeypatch.setattr(train, "_cached", lambda data, cache: tiny_frames())
    return lambda minutes, **options: train.train(Path("mocap"), tmp_path, minutes, **options)


def test_a_finished_run_says_that_nothing_is_left_to_resume(run, tmp_path):
    assert run(0.001) == tmp_path / "pfnn.safetensors"
    with pytest.raises(ValueError, match="has trained for its 0.001 minutes: give it more with --minutes"):
        run(0.001, resume=True)


def test_ctrl_c_leaves_a_checkpoint_to_go_on_from(run, tmp_path, monkeypatch, capsys):
    update, done = train.Trainer.update, []

    def interrupted(self, progress):
        if len(done) == 3:
            raise KeyboardInterrupt
        done.append(progress)
        return update(self, progress)

    monkeypatch.setattr(train.Trainer, "update", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run(60)
    assert (tmp_path / "checkpoint.pt").exists() and "--resume" in capsys.readouterr().err
    monkeypatch.setattr(train.Trainer, "update", update)
    run(0.01, resume=True)
    assert (tmp_path / "pfnn.safetensors").exists()


def test_it_says_what_it_writes_and_how_large_that_is(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(train, "load_folder", lambda folder: tiny_frames())
    train._cached(Path("mocap"), tmp_path / "frames.npz")
    said = capsys.readouterr().out
    assert f"into {tmp_path}" in said and "frames.npz" in said and "GB" in said


@pytest.mark.parametrize("damaged", ["checkpoint.pt", "frames.npz"])
def test_a_damaged_run_is_a_sentence_that_says_what_to_do(tmp_path, monkeypatch, damaged):
    monkeypatch.setattr(train, "BATCH", 64)
    monkeypatch.setattr(train, "load_folder", lambda folder: tiny_frames())
    train.train(Path("mocap"), tmp_path, 0.001)
    content = (tmp_path / damaged).read_bytes()
    for bytes_left in (b"", b"nonsense", content[: len(content) // 2]):
        (tmp_path / damaged).write_bytes(bytes_left)
        with pytest.raises(ValueError, match=f"{damaged} is damaged"):
            train.train(Path("mocap"), tmp_path, 0.002, resume=True)
