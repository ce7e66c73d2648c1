"""Weight files and the style bank: what fits is read, what does not is refused in one clear sentence."""

import json
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file

from stylizer import weights
from stylizer.bank import Bank
from stylizer.live import LiveStylizer
from tests.sim.walker import walking_clip


def same(a, b):
    return all(torch.equal(x, y) for level in a for x, y in zip(a[level], b[level]))


def again(bank):
    """The bank as the next start of the program finds it."""
    return Bank("tiny", bank.bundled, bank.user)


def rewritten(path, **changes):
    header, tensors = weights.read(path)
    save_file(tensors, path, {**header, **changes})


@pytest.mark.parametrize("key", ["model", "version", "layout", "skeleton"])
def test_weights_made_for_something_else_are_refused(bank, key):
    rewritten(weights.FOLDER / "tiny.safetensors", **{key: "another"})
    with pytest.raises(ValueError, match=f"made for {key} 'another'"):
        weights.load("tiny", weights.FOLDER)


@pytest.mark.parametrize("change", [{"stem": 5}, {"no_longer": 1}])
def test_a_network_that_is_made_otherwise_now_is_refused(bank, change):
    path = weights.FOLDER / "tiny.safetensors"
    rewritten(path, config=json.dumps({**json.loads(weights.read(path)[0]["config"]), **change}))
    with pytest.raises(ValueError, match="network of another version"):
        weights.load("tiny", weights.FOLDER)


def test_missing_and_damaged_weights_are_refused(bank):
    with pytest.raises(ValueError, match="no stylizer weights at"):
        weights.load("absent", weights.FOLDER)
    (weights.FOLDER / "broken.safetensors").write_bytes(b"nonsense")
    with pytest.raises(ValueError, match="not a readable safetensors file"):
        weights.load("broken", weights.FOLDER)


def test_a_style_is_added_found_again_and_removed(bank, walk_file):
    bank.add(walk_file, "my-walk")
    assert bank.names == ("my-walk", "neutral", "other")
    kept = again(bank)
    for level in (3, 2):
        for a, b in zip(bank["my-walk"][level], kept["my-walk"][level]):
            assert torch.equal(a, b), "a recording made now replays to equal poses after the next start"
    kept.remove("my-walk")
    assert again(bank).names == ("neutral", "other")


@pytest.mark.parametrize("name, message", [
    ("other", "there is a style 'other' already"), ("Other", "already"), ("../x", "no style name"),
    ("", "no style name")])
def test_bad_names_are_refused(bank, walk_file, name, message):
    with pytest.raises(ValueError, match=message):
        bank.add(walk_file, name)


@pytest.mark.parametrize("file, name", [
    ("Sneaky walk (2).bvh", "Sneaky-walk-2"), ("_x_.bvh", "x"), ("\u8d70.bvh", "style"), ("Other.bvh", "Other-2"),
    ("n" * 60 + ".bvh", "n" * 36)])
def test_names_made_from_a_file_s(bank, file, name):
    assert bank.free_name(Path(file)) == name


def test_a_file_learned_twice_loses_nothing(bank, walk_file):
    stylizer = LiveStylizer(bank)
    first, clip = stylizer.learn(walk_file)
    kept = (bank.user / "walk.safetensors").read_bytes()
    assert first == "walk" and len(clip) == len(walking_clip())
    assert stylizer.learn(walk_file)[0] == "walk-2" and again(bank).names == bank.names
    (bank.user / "walk-3.safetensors").touch()  # as if another window had added it
    assert stylizer.learn(walk_file)[0] == "walk-4"
    assert (bank.user / "walk.safetensors").read_bytes() == kept


def test_unknown_and_bundled_styles_are_not_removed(bank):
    with pytest.raises(ValueError, match="unknown style 'othr': did you mean other"):
        bank.remove("othr")
    with pytest.raises(ValueError, match="comes with Patchwalk and cannot be removed"):
        bank.remove("other")


def test_a_short_clip_is_refused(bank, tmp_path):
    from sim import bvh
    bvh.write(tmp_path / "short.bvh", walking_clip()[:40])
    with pytest.raises(ValueError, match="short.bvh: the clip is too short"):
        bank.add(tmp_path / "short.bvh", "short")


def test_new_weights_read_the_users_styles_again_and_refuse_bundled_ones(bank, walk_file):
    bank.add(walk_file, "mine")
    before = bank["mine"]
    model, _ = weights.load("tiny")
    with torch.no_grad():
        model.style_encoder.stem.weight.mul_(2)
    weights.save(model, weights.FOLDER / "tiny.safetensors")
    with pytest.raises(ValueError, match="computed with other stylizer weights"):
        again(bank)
    for path in bank.bundled.iterdir():
        path.unlink()
    renewed = again(bank)
    assert not same(renewed["mine"], before)
    assert same(again(bank)["mine"], again(bank)["mine"])
