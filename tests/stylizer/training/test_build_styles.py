"""Styles for another controller: each file says so and fits its motion, and what has nothing to do with that stays."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from controller.model import checkpoint as controller_weights
from demo import cli
from stylizer.styles import code_bank, own_style, style_file
from stylizer.styles.bank import BUNDLED, StyleBank, own_motion_file
from stylizer.styles.code_bank import CodeBank
from stylizer.systems import checkpoint, weight_files
from stylizer.training import build_styles

OWN = own_style.OWN
NETWORK = checkpoint.SHIPPED
STYLE, SYSTEM = "marching", "unpaired"  # one of each, the quickest


@pytest.fixture(scope="module")
def styles(tmp_path_factory) -> Path:
    """A folder of styles with one of each kind, for the shipped controller; a second one among the codes."""
    folder = tmp_path_factory.mktemp("styles")
    (folder / NETWORK).mkdir()
    for name in ("own_motion", f"{NETWORK}/{OWN}", f"{NETWORK}/{STYLE}"):
        shutil.copy(BUNDLED / f"{name}.safetensors", folder / f"{name}.safetensors")
    code_bank.build_codes(SYSTEM, weight_files.FOLDER, folder, folder)
    path = folder / code_bank.CODES / f"{SYSTEM}.safetensors"
    header, tensors = checkpoint.read(path)
    tensors |= {name.replace(OWN, STYLE): 0.5 * tensor for name, tensor in tensors.items()}
    for key in ("speeds", "movements"):
        header[key] = header[key].removesuffix("}") + ", " + header[key].removeprefix("{").replace(OWN, STYLE)
    save_file(tensors, path, header)
    return folder


@pytest.fixture(scope="module")
def rebuilt(styles, tmp_path_factory) -> tuple[Path, style_file.OwnMotion]:
    """Where they were written for a controller that moves a tenth more and is half a stride on, and its motion."""
    motion = style_file.read_own_motion(own_motion_file(styles))
    motion = motion._replace(
        controller="another",
        phases=[phase + np.pi for phase in motion.phases],
        windows=[1.1 * window.astype(np.float32) for window in motion.windows],
    )
    out = tmp_path_factory.mktemp("out") / "styles"
    files = build_styles.rebuild(motion, out, styles)
    assert sorted(files) == sorted(path for path in out.rglob("*") if path.is_file()) and len(files) == 4
    return out, motion


def test_every_file_is_for_the_new_controller(rebuilt, tmp_path):
    out, motion = rebuilt
    for bank in (StyleBank(bundled=out, user=tmp_path), CodeBank(SYSTEM, out, tmp_path)):
        assert bank.controller == "another" and bank.names == (STYLE, OWN)
        np.testing.assert_array_equal(bank[OWN].gait.root_velocities, motion.gait.root_velocities.astype(np.float32))
    assert checkpoint.read(out / NETWORK / f"{STYLE}.safetensors")[0]["controller"] == "another"
    kept = style_file.read_own_motion(own_motion_file(out))
    for ours, theirs in zip(kept.windows, motion.windows, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-3, atol=1e-5)


def test_own_styles_are_what_the_new_motion_is_encoded_to(rebuilt, styles, tmp_path):
    out, _ = rebuilt
    before, after = (CodeBank(SYSTEM, folder, tmp_path) for folder in (styles, out))
    own = after.model.encode_style(style_file.read_own_motion(own_motion_file(out)).windows[3].astype(np.float32), OWN)
    np.testing.assert_allclose(after[OWN].features[3], own, atol=1e-6)
    assert (after[OWN].features - before[OWN].features).abs().max() > 1e-3
    np.testing.assert_array_equal(after[STYLE].features, before[STYLE].features)
    assert after.speed_of(OWN) > 1.05 * before.speed_of(OWN) and after.speed_of(STYLE) == before.speed_of(STYLE)


def test_tokens_follow_the_new_strides_and_the_rest_of_a_style_stays(rebuilt, styles, tmp_path):
    before, after = (StyleBank(bundled=folder, user=tmp_path)[STYLE] for folder in (styles, rebuilt[0]))
    changed = {name for name, values in before.features.items() if not torch.equal(values, after.features[name])}
    assert "values" in changed <= {"values", "own_mean"}
    np.testing.assert_array_equal(before.gait.cycles, after.gait.cycles)
    again = build_styles.refit_clips(checkpoint.load()[0], after, style_file.read_own_motion(own_motion_file(styles)))
    values = [style.features["values"] for style in (before, again, after)]
    assert (values[1] - values[0]).abs().mean() < 0.5 * (values[2] - values[0]).abs().mean(), (
        "and come back with the first ones"
    )


def test_styles_of_other_weights_are_refused_before_anything_is_written(styles, tmp_path):
    folder = tmp_path / "styles"
    shutil.copytree(styles, folder)
    path = folder / code_bank.CODES / f"{SYSTEM}.safetensors"
    header, tensors = checkpoint.read(path)
    save_file(tensors, path, header | {"weights": "of old"})
    with pytest.raises(ValueError, match="unpaired.safetensors was computed with other stylizer weights"):
        build_styles.rebuild(style_file.read_own_motion(own_motion_file(styles)), tmp_path / "out", folder)
    assert not (tmp_path / "out").exists()


@pytest.fixture
def quick(styles, monkeypatch):
    """The command captures two movements and knows the styles of the fixture."""
    monkeypatch.setattr(own_style, "MOVEMENTS", {name: own_style.MOVEMENTS[name] for name in ("stand", "walk_1.0")})
    monkeypatch.setattr(build_styles.rebuild, "__defaults__", (styles,))


def test_the_command_captures_the_shipped_controller(quick, tmp_path, capsys):
    out = tmp_path / "new" / "styles"
    assert cli.main(["styles", "capture", "--out", str(out)]) == 0
    said, wrong = capsys.readouterr()
    assert said.count("\n") == 1 and f"wrote 4 style files into {out}" in said and wrong == ""
    motion = style_file.read_own_motion(own_motion_file(out))
    assert motion.controller == controller_weights.fingerprint() and motion.gait.movements == ("stand", "walk_1.0")
    np.testing.assert_allclose(motion.gait.root_velocities[:, 1], [0.0, 1.0], atol=0.05)


def test_the_command_writes_into_folders_only(quick, tmp_path, capsys):
    (tmp_path / "file").touch()
    assert cli.main(["styles", "capture", "--out", str(tmp_path / "file")]) == 2
    assert "it is not a folder" in capsys.readouterr().err


def test_training_a_controller_ends_with_its_own_style(quick, tmp_path, monkeypatch, capsys):
    def train(data, out, resume):
        out.mkdir()
        header, tensors = checkpoint.read(controller_weights.FOLDER / f"{controller_weights.MODEL}.safetensors")
        save_file(
            tensors, out / f"{controller_weights.MODEL}.safetensors", header | {"command": "trained a moment ago"}
        )
        return out / f"{controller_weights.MODEL}.safetensors"

    monkeypatch.setattr("controller.training.train.train", train)
    (tmp_path / "clips").mkdir()
    (tmp_path / "clips" / "walk.bvh").touch()
    out = tmp_path / "run"
    assert cli.main(["train", "controller", "--data", str(tmp_path / "clips"), "--out", str(out)]) == 0
    first, last = capsys.readouterr().out.splitlines()
    assert (
        first == f"wrote {out / 'pfnn.safetensors'}" and f"captured the own style from the controller in {out}" in last
    )
    trained = controller_weights.fingerprint(folder=out)
    captured = style_file.read_own_motion(own_motion_file(out / "styles")).controller
    assert captured == trained != controller_weights.fingerprint()
