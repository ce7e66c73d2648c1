"""Stylizers by name: the right bank and live stylizer for each, key points on the command line, changing in a running
session."""

import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from demo import cli
from demo.state.stylizers import Stylizers
from sim.motion.features import clip_features
from stylizer.runtime import catalogue
from stylizer.runtime.joint_live import JointStylizer
from stylizer.runtime.whole_body_live import WholeBodyStylizer
from stylizer.styles import bank as bank_module
from stylizer.styles import code_bank
from stylizer.styles.bank import StyleBank
from stylizer.styles.code_bank import CodeBank
from stylizer.systems import checkpoint, unpaired, weight_files
from tests.stylizer.conftest import CONTROLLER
from tests.stylizer.styles import test_keypoints_2d as test_key_points
from tests.support.walker import walking_clip


@pytest.fixture
def package(bank, tmp_path, monkeypatch):
    """A package with two stylizers: a tiny Motion Puzzle called `joints`, as the shipped one, and a tiny `unpaired`;
    the user has no styles yet."""
    torch.manual_seed(0)
    model = unpaired.Unpaired(
        replace(unpaired.CONFIGS["unpaired"], content=(8, 8), style=(8, 8), code=8, taps=3, labels=("old 1", "sad 1"))
    )
    features = clip_features(walking_clip())
    model.set_statistics(features.mean(0), np.full((21, 15), 0.3))
    (weight_files.FOLDER / "tiny.safetensors").rename(weight_files.FOLDER / "joints.safetensors")
    checkpoint.save(model, weight_files.FOLDER / "unpaired.safetensors", licence="none")
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path / "home"))
    (tmp_path / "styles" / "tiny").rename(tmp_path / "styles" / "joints")
    monkeypatch.setattr(bank_module, "BUNDLED", tmp_path / "styles")
    code_bank.build_codes("unpaired", weight_files.FOLDER, tmp_path, tmp_path / "styles")
    return tmp_path


def test_each_name_has_its_bank_and_its_live_stylizer(package):
    assert weight_files.names() == ("joints", "unpaired")
    assert (
        type(catalogue.load_bank()) is type(catalogue.load_bank("joints")) is StyleBank
        and type(catalogue.load_bank("unpaired")) is CodeBank
    )
    assert type(catalogue.from_pretrained()) is JointStylizer
    assert type(catalogue.from_pretrained("unpaired")) is WholeBodyStylizer
    with pytest.raises(ValueError, match="no stylizer weights at .*; there are joints, unpaired"):
        catalogue.load_bank("absent")


def test_weights_and_styles_of_a_training_run_are_taken_from_its_folder(package):
    run = package / "run"
    shutil.copytree(package / "styles" / "joints", run / catalogue.STYLES / "joints")
    shutil.move(weight_files.FOLDER / "joints.safetensors", run)
    with pytest.raises(ValueError, match="no stylizer weights"):
        catalogue.load_bank("joints")
    bank = catalogue.load_bank("joints", run)
    assert bank.names == ("neutral", "other") and bank.controller == CONTROLLER, "of the package's own motion"
    with pytest.raises(ValueError, match="only weights of Motion Puzzle are taken from a folder"):
        catalogue.load_bank("unpaired", weight_files.FOLDER)


def test_codes_of_other_weights_are_refused(package):
    checkpoint.save(checkpoint.load("unpaired")[0], weight_files.FOLDER / "unpaired.safetensors", licence="changed")
    with pytest.raises(ValueError, match="computed with other stylizer weights"):
        catalogue.load_bank("unpaired")


def test_a_style_is_learned_from_a_video(package, capsys):
    folder = test_key_points.write(
        package / "points", test_key_points.detected(test_key_points.body(), test_key_points.BODY_25)
    )
    command = ["styles", "add", str(folder), "--name", "limp"]
    assert cli.main(command) == 2 and "--stylizer unpaired" in capsys.readouterr().err
    assert (
        cli.main([*command, "--stylizer", "unpaired", "--fps", "0"]) == 2 and "no frame rate" in capsys.readouterr().err
    )
    assert cli.main([*command, "--stylizer", "unpaired"]) == 0
    assert cli.main(["styles", "list", "--stylizer", "unpaired"]) == 0
    assert "limp" in capsys.readouterr().out.split()
    assert (
        torch.isfinite(catalogue.load_bank("unpaired")["limp"].features).all()
        and "limp" not in catalogue.load_bank().names
    )
    assert cli.main([*command, "--stylizer", "unpaired"]) == 2 and "already" in capsys.readouterr().err
    assert cli.main(["styles", "remove", "limp", "--stylizer", "unpaired"]) == 0
    assert "limp" not in catalogue.load_bank("unpaired").names


def test_a_clip_added_for_one_is_there_for_all(package, walk_file):
    assert cli.main(["styles", "add", str(walk_file), "--name", "mine", "--stylizer", "unpaired"]) == 0
    assert "mine" in catalogue.load_bank().names and "mine" in catalogue.load_bank("unpaired").names


class Standing:
    """As much of a session as changes its stylizer; of a controller with that fingerprint."""

    def __init__(self, stylizer, fingerprint=CONTROLLER):
        self.stylizer, self.controller = stylizer, SimpleNamespace(fingerprint=fingerprint)


def test_the_window_goes_through_the_stylizers_and_back(package, walk_file, monkeypatch):
    first = catalogue.from_pretrained()
    session = Standing(first)
    stylizers = Stylizers(session)
    assert stylizers.next() == "unpaired" and type(session.stylizer) is WholeBodyStylizer
    with pytest.raises(ValueError, match="clips only"):
        stylizers.resample()
    session.stylizer.bank.add("learned", walk_file)
    assert stylizers.next() == "joints" and session.stylizer is first and "learned" in first.styles
    monkeypatch.setattr(weight_files, "names", lambda: ("joints",))
    with pytest.raises(ValueError, match="no other stylizer"):
        stylizers.next()
