"""The second lesson of the whole-body systems: what they give live becomes what they give with the future in view."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.io import tensor_file
from stylizer.data.dataset import MotionData
from stylizer.systems import checkpoint
from stylizer.systems.registry import SYSTEMS
from stylizer.training import train_live
from stylizer.training.train import make_trainer, train
from stylizer.training.train_live import LiveTrainer
from tests.stylizer.systems.conftest import TINY, model_of

pytestmark = pytest.mark.usefixtures("tiny")


@pytest.fixture(params=TINY)
def trained(request, tmp_path):
    """A weight file of a tiny system, and its network's name."""
    path = tmp_path / f"{request.param}.safetensors"
    checkpoint.save(model_of(request.param), path, licence="none")
    return request.param, path


def test_a_live_window_repeats_its_newest_sample():
    model = model_of("latent")
    samples = model.live_samples()
    assert len(samples) == model.config.window and list(samples[: model.newest + 1]) == list(range(model.newest + 1))
    assert set(samples[model.newest :]) == {model.newest} and len(samples) - 1 - model.newest == model.LOOK_AHEAD


def test_it_learns_what_it_gave_with_the_future_in_view(trained, data, monkeypatch):
    name, path = trained
    trainer = LiveTrainer(data, name, path)
    batch = trainer.sampler.batch(4)
    trainer.sampler.batch = lambda size: batch
    first = trainer.update(0.0)
    assert first["window"] < 1e-5 < first["newest"], "it begins as its own teacher"
    for _ in range(80):
        last = trainer.update(0.0)
    assert last["newest"] < 0.8 * first["newest"]


def test_a_style_keeps_its_code(trained, data):
    name, path = trained
    trainer = LiveTrainer(data, name, path)
    motion, domain = torch.randn(21, 3, trainer.model.config.window, 15), torch.tensor([0, 1, 0])
    before = trainer.model.encode(motion, domain)
    for _ in range(3):
        trainer.update(0.0)
    assert torch.equal(trainer.model.encode(motion, domain), before)
    with torch.no_grad():
        codes = before
        moved = trainer.model.restyled(motion, codes).axes - trainer.objective.teacher.restyled(motion, codes).axes
    assert moved.abs().max() > 0


def test_the_header_says_what_it_went_on_from(trained, data, tmp_path):
    name, path = trained
    trainer = make_trainer(name, "live", path)(data, 1)
    trainer.update(0.0)
    trainer.save_weights(tmp_path / "new.safetensors", tmp_path, "command")
    header, _ = checkpoint.read(tmp_path / "new.safetensors")
    assert header["started_from"] == tensor_file.fingerprint(path)
    kept = checkpoint.load(name, path.parent)[0]
    assert np.array_equal(header["config"], checkpoint.read(path)[0]["config"]) and kept.KIND == header["model"]


@pytest.mark.parametrize(
    "network, recipe, start, message",
    [
        ("latent", "live", None, "give both --recipe live and --start FILE"),
        ("latent", "ours", "latent.safetensors", "give both --recipe live and --start FILE"),
        ("joints", "live", "latent.safetensors", "joints has no recipe live: it is for unpaired, diverse and latent"),
        ("slim", "live", "latent.safetensors", "slim has no recipe live"),
    ],
)
def test_what_does_not_go_together_is_refused(network, recipe, start, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        make_trainer(network, recipe, start and tmp_path / start)


def test_weights_of_another_system_are_refused(data, tmp_path):
    path = tmp_path / "latent.safetensors"
    checkpoint.save(model_of("latent"), path, licence="none")
    with pytest.raises(ValueError, match="holds weights of latent, not of diverse"):
        train_live.LiveTrainer(data, "diverse", path)


def test_weights_with_the_settings_of_another_network_are_refused(trained, monkeypatch):
    name, path = trained
    module = SYSTEMS[name].load_training()
    monkeypatch.setitem(module.CONFIGS, name, replace(TINY[name], window=20))
    with pytest.raises(ValueError, match=f"{path.name} holds weights of {name} with other settings than {name} has"):
        make_trainer(name, "live", path)


def test_the_file_that_is_named_is_the_one_that_is_read(tmp_path):
    """Whatever it is called, and whatever lies beside it."""
    checkpoint.save(model_of("latent"), tmp_path / "my latent 1.2.st", licence="none")
    checkpoint.save(model_of("diverse"), tmp_path / "my latent 1.2.safetensors", licence="none")
    assert train_live.load_start(tmp_path / "my latent 1.2.st", "latent")[0].KIND == "latent"


def test_a_damaged_file_is_refused_before_the_motion_is_read(tmp_path):
    (tmp_path / "latent.safetensors").write_bytes(b"nothing of the kind")
    with pytest.raises(ValueError, match="latent.safetensors is not a readable .*: name others with --start"):
        train(
            tmp_path / "data", tmp_path / "out", network="latent", recipe="live", start=tmp_path / "latent.safetensors"
        )
    assert not (tmp_path / "out").exists()


def test_training_does_not_write_over_what_it_goes_on_from(trained):
    name, path = trained
    with pytest.raises(ValueError, match="training would write over .*: choose another folder with --out"):
        train(path.parent / "data", path.parent, network=name, recipe="live", start=path)


def test_a_run_is_resumed_with_the_weights_that_it_began_with(trained, data, tmp_path):
    name, path = trained
    trainer = LiveTrainer(data, name, path)
    trainer.update(0.0)
    trainer.keep(tmp_path / "checkpoint.pt")
    LiveTrainer(data, name, path).restore(tmp_path / "checkpoint.pt")
    other = tmp_path / "other.safetensors"
    checkpoint.save(model_of(name, seed=1), other, licence="none")
    with pytest.raises(ValueError, match="is of a run that began with other weights: name those with --start"):
        LiveTrainer(data, name, other).restore(tmp_path / "checkpoint.pt")


def test_data_without_a_label_that_it_was_taught_is_refused(trained, data):
    name, path = trained
    foreign = [replace(clip, name=clip.name.replace("dataset-1", "dataset-2")) for clip in data.clips]
    with pytest.raises(ValueError, match="no clip to learn from has a style label that .* was taught: unpack"):
        LiveTrainer(MotionData(data.motion, foreign, {}), name, path)


def test_held_out_clips_may_be_without_labels(trained, data, monkeypatch):
    name, path = trained
    unlabelled = [replace(clip, name=f"other/{place}") for place, clip in enumerate(data.clips)]
    monkeypatch.setattr(
        MotionData, "split", lambda self, held_out: MotionData(self.motion, unlabelled, {}) if held_out else data
    )
    assert np.isfinite(list(LiveTrainer(data, name, path).held_out_losses().values())).all()


def test_a_style_whose_clips_all_stand_is_learned_from_too(trained, data):
    name, _ = trained
    clips = [replace(clip, speed=0.1) if "old" in clip.name else clip for clip in data.clips]
    trainer = make_trainer(name, "ours")(MotionData(data.motion, clips, {}), 1)
    assert np.isfinite(list(trainer.update(0.0).values())).all()
