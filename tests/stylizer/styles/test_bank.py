"""Weight files and the style bank: what fits is read, what does not is refused in one clear sentence."""

import json
import unicodedata
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from sim.io import bvh, tensor_file
from sim.motion.features import clip_features
from stylizer.runtime.catalogue import make_stylizer
from stylizer.styles import own_style, style_file
from stylizer.styles.bank import StyleBank, own_motion_file
from stylizer.styles.style_clips import style_windows
from stylizer.systems import checkpoint, weight_files
from tests.stylizer.conftest import CONTROLLER, own_motion
from tests.support.walker import CYCLE, SPEED, planted_clip, walking_clip


def same(a, b):
    """Whether two styles are equal to the last bit, features and gait."""
    gaits = ((getattr(a.gait, field.name), getattr(b.gait, field.name)) for field in fields(a.gait))
    return all(torch.equal(values, b.features[name]) for name, values in a.features.items()) and all(
        np.array_equal(x, y) if isinstance(x, np.ndarray) else x == y for x, y in gaits
    )


def again(bank):
    """The bank as the next start of the program finds it."""
    return StyleBank("tiny", bank.bundled, bank.user)


def rewritten(path, **changes):
    header, tensors = checkpoint.read(path)
    save_file(tensors, path, {**header, **changes})


@pytest.mark.parametrize("key", ["model", "version", "layout", "skeleton"])
def test_weights_made_for_something_else_are_refused(bank, key):
    rewritten(weight_files.FOLDER / "tiny.safetensors", **{key: "another"})
    with pytest.raises(ValueError, match=f"made for {key} 'another'"):
        checkpoint.load("tiny", weight_files.FOLDER)


@pytest.mark.parametrize("change", [{"stem": 5}, {"no_longer": 1}])
def test_a_network_that_is_made_otherwise_now_is_refused(bank, change):
    path = weight_files.FOLDER / "tiny.safetensors"
    rewritten(path, config=json.dumps({**json.loads(checkpoint.read(path)[0]["config"]), **change}))
    with pytest.raises(ValueError, match="of another version"):
        checkpoint.load("tiny", weight_files.FOLDER)


def test_missing_and_damaged_weights_are_refused(bank):
    with pytest.raises(ValueError, match="no stylizer weights at"):
        checkpoint.load("absent", weight_files.FOLDER)
    (weight_files.FOLDER / "broken.safetensors").write_bytes(b"nonsense")
    with pytest.raises(ValueError, match="not a readable safetensors file"):
        checkpoint.load("broken", weight_files.FOLDER)


def test_a_style_is_added_found_again_and_removed(bank, walk_file):
    bank.add("my-walk", walk_file)
    assert bank.names == ("my-walk", "neutral", "other")
    kept = again(bank)
    assert same(bank["my-walk"], kept["my-walk"]), "a recording made now replays to equal poses after the next start"
    kept.remove("my-walk")
    assert again(bank).names == ("neutral", "other")


@pytest.mark.parametrize(
    "name, message",
    [
        ("other", "there is a style 'other' already"),
        ("Other", "already"),
        ("../x", "no style name"),
        ("", "no style name"),
    ],
)
def test_bad_names_are_refused(bank, walk_file, name, message):
    with pytest.raises(ValueError, match=message):
        bank.add(name, walk_file)


@pytest.mark.parametrize(
    "file, name",
    [
        ("Sneaky walk (2).bvh", "Sneaky-walk-2"),
        ("_x_.bvh", "x"),
        ("Müßig über.bvh", "Muessig-ueber"),
        (unicodedata.normalize("NFD", "Müßig.bvh"), "Muessig"),
        ("Café ÉLAN.bvh", "Cafe-ELAN"),
        ("Łódź søvn.bvh", "Lodz-soevn"),
        ("\u8d70.bvh", "style"),
        ("Other.bvh", "Other-2"),
        ("n" * 60 + ".bvh", "n" * 36),
    ],
)
def test_names_made_from_a_file_s(bank, file, name):
    assert bank.free_name(Path(file)) == name


def test_the_same_motion_learned_twice_is_one_style(bank, walk_file, tmp_path):
    stylizer = make_stylizer(bank)
    first, clip = stylizer.learn(walk_file)
    kept = (bank.user / "walk.safetensors").read_bytes()
    copy = tmp_path / "Copy.bvh"
    copy.write_bytes(walk_file.read_bytes())
    assert first == "walk" and len(clip) == len(walking_clip())
    assert stylizer.learn(walk_file)[0] == stylizer.learn(copy)[0] == "walk" and again(bank).names == bank.names
    assert again(bank).learn(copy)[0] == "walk", "after the next start too"
    assert (bank.user / "walk.safetensors").read_bytes() == kept


def test_another_motion_of_the_same_file_name_gets_another_name(bank, walk_file):
    bank.learn(walk_file)
    bvh.write(walk_file, walking_clip(300))
    assert bank.learn(walk_file)[0] == "walk-2"
    (bank.user / "walk-3.safetensors").touch()  # as if another window had added it
    bvh.write(walk_file, walking_clip(360))
    assert bank.learn(walk_file)[0] == "walk-4"


def test_a_style_is_renamed_in_its_file_too(bank, walk_file):
    bank.add("walk", walk_file)
    before = bank["walk"]
    bank.rename("walk", "stroll")
    for each in (bank, again(bank)):
        assert each.names == ("neutral", "other", "stroll") and same(each["stroll"], before)
    assert bank.users_own == ("stroll",)
    bank.rename("stroll", "Stroll")
    assert again(bank).users_own == ("Stroll",)


@pytest.mark.parametrize(
    "name, new, sentence",
    [
        ("walk", "other", "there is a style 'other' already"),
        ("walk", "walk", "'walk' is its name already"),
        ("walk", "a b", "no style name"),
        ("other", "mine", "comes with Patchwalk and cannot be renamed"),
        ("wlak", "mine", "unknown style 'wlak': did you mean walk"),
    ],
)
def test_what_cannot_be_renamed_is_said(bank, walk_file, name, new, sentence):
    bank.add("walk", walk_file)
    with pytest.raises(ValueError, match=sentence):
        bank.rename(name, new)
    assert bank.names == ("neutral", "other", "walk")


def test_what_has_gone_from_the_users_folder_is_forgotten_when_it_is_read_again(bank, walk_file):
    bank.add("walk", walk_file)
    again(bank).remove("walk")
    bank.refresh()
    assert bank.names == ("neutral", "other") and bank.users_own == ()


def test_unknown_and_bundled_styles_are_not_removed(bank):
    with pytest.raises(ValueError, match="unknown style 'othr': did you mean other"):
        bank.remove("othr")
    with pytest.raises(ValueError, match="comes with Patchwalk and cannot be removed"):
        bank.remove("other")


def test_a_short_clip_is_refused(bank, tmp_path):
    bvh.write(tmp_path / "short.bvh", walking_clip()[:40])
    with pytest.raises(ValueError, match="short.bvh: the clip is too short"):
        bank.add("short", tmp_path / "short.bvh")


def test_new_weights_read_the_users_styles_again_and_refuse_bundled_ones(bank, walk_file):
    bank.add("mine", walk_file)
    before = bank["mine"]
    model, _ = checkpoint.load("tiny")
    with torch.no_grad():
        model.moments.code.weight.mul_(2)
    checkpoint.save(model, weight_files.FOLDER / "tiny.safetensors")
    with pytest.raises(
        ValueError, match="neutral.safetensors was computed for other weights of stylizer or controller"
    ):
        again(bank)
    own_style.write_own_style(bank.bundled / "tiny", bank.own_motion, *checkpoint.load("tiny"))
    with pytest.raises(ValueError, match="other.safetensors was computed for other weights of stylizer or controller"):
        again(bank)
    (bank.bundled / "tiny" / "other.safetensors").unlink()
    renewed = again(bank)
    assert not same(renewed["mine"], before)
    assert same(again(bank)["mine"], renewed["mine"]), "what was computed anew is kept"


def test_another_controllers_own_style_refits_the_users_styles(bank, walk_file):
    """Their tokens are fitted to its strides; the bundled ones are refused, for no file of theirs holds their
    motion."""
    bank.add("mine", walk_file)
    before = bank["mine"]
    features = clip_features(walking_clip())
    features[..., :9] *= 1.2
    moving_more = own_motion(features, controller="another")
    style_file.write_own_motion(own_motion_file(bank.bundled), moving_more)
    own_style.write_own_style(bank.bundled / "tiny", moving_more, bank.model, bank.fingerprint)
    with pytest.raises(ValueError, match="other.safetensors was computed for other weights of stylizer or controller"):
        again(bank)
    (bank.bundled / "tiny" / "other.safetensors").unlink()
    renewed = again(bank)
    header, _ = checkpoint.read(bank.user / "mine.safetensors")
    assert renewed.controller == header["controller"] == "another" and not same(renewed["mine"], before)
    assert np.array_equal(renewed["mine"].gait.root_velocities, before.gait.root_velocities)


def former(path, name, windows, fingerprint):
    """A style file as versions before this one wrote it: the windows of one clip, and what they were encoded to."""
    from sim.body.skeleton import skeleton_hash
    from sim.motion.features import LAYOUT_VERSION

    header = {
        "format": "patchwalk-style-1",
        "name": name,
        "layout": LAYOUT_VERSION,
        "skeleton": skeleton_hash(),
        "weights": fingerprint,
        "licence": "the user's own clip",
        "source": f"{name}.bvh",
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    tensors = {"3.scale": torch.zeros(5, 1, 8).half(), "windows": torch.from_numpy(windows.astype(np.float16))}
    save_file(tensors, path, header)


def test_a_users_style_of_the_former_format_is_read_and_written_anew(bank):
    path, windows = bank.user / "limp.safetensors", style_windows(clip_features(walking_clip()))
    former(path, "limp", windows, bank.fingerprint)
    first, second = again(bank), again(bank)
    assert "limp" in first.names and same(first["limp"], second["limp"])
    header, tensors = style_file.read_checked(path)
    assert (
        header["format"] == style_file.FORMAT
        and header["licence"] == "the user's own clip"
        and header["source"] == "limp.bvh"
    )
    assert header["controller"] == CONTROLLER and header["weights"] == bank.fingerprint
    np.testing.assert_array_equal(style_file.read_windows(tensors)[0], windows.astype(np.float16))
    gait = first["limp"].gait
    assert gait.movements == ("walk",) and gait.root_velocities[0] == pytest.approx((0, SPEED, 0), abs=0.02)
    assert all(torch.isfinite(values).all() for values in first["limp"].features.values())


def test_a_style_of_the_former_format_without_motion_is_refused_in_a_sentence(bank):
    path = bank.user / "limp.safetensors"
    former(path, "limp", style_windows(clip_features(walking_clip())), bank.fingerprint)
    header, tensors = checkpoint.read(path)
    del tensors["windows"]
    save_file(tensors, path, header)
    with pytest.warns(
        UserWarning, match="'limp' is left out: .*limp.safetensors was made for format 'patchwalk-style-1'"
    ):
        assert "limp" not in again(bank).names


def test_several_files_make_one_style_that_knows_what_each_shows(bank, tmp_path):
    """And says which seconds of which file it took."""
    walk, stand = tmp_path / "walk.bvh", tmp_path / "stand.bvh"
    bvh.write(walk, walking_clip())
    bvh.write(stand, planted_clip())
    added = bank.add("mine", walk, stand)
    assert len(added.clip) == 240
    assert added.taken == ("walk.bvh: walk from 0.0 to 4.0 s", "stand.bvh: stand from 0.0 to 2.0 s")
    gait = bank["mine"].gait
    assert gait.movements == ("walk", "stand") and gait.cadences == pytest.approx([60 / CYCLE, 0.0], abs=1e-3)
    assert same(bank["mine"], again(bank)["mine"])
    ours = [bank["mine"].at(velocity) for velocity in gait.root_velocities]
    for name, values in bank["mine"].features.items():
        for place, style in enumerate(ours):
            assert torch.equal(style[name][:, 0], values[:, place])


def test_the_bundled_styles_and_the_own_style_are_of_one_controller(bank):
    """One file that was left behind is enough to be refused."""
    assert again(bank).controller == CONTROLLER
    rewritten(bank.bundled / "tiny" / "other.safetensors", controller="another")
    with pytest.raises(ValueError, match="other.safetensors was computed for other weights of stylizer or controller"):
        again(bank)


def of_other_weights_without_motion(path):
    header, tensors = checkpoint.read(path)
    save_file({name: each for name, each in tensors.items() if name != "windows"}, path, {**header, "weights": "older"})


def broken_header(path: Path) -> None:
    header, tensors = checkpoint.read(path)
    save_file(tensors, path, {key: value for key, value in header.items() if key != "licence"})


def not_finite(path: Path) -> None:
    header, tensors = checkpoint.read(path)
    tensors["windows"][0, 0, 0, 0] = torch.inf
    save_file(tensors, path, header)


def nested_deep(path: Path) -> None:
    header, tensors = checkpoint.read(path)
    save_file(tensors, path, {**header, "movements": "[" * 50_000})


@pytest.mark.parametrize(
    "spoil",
    [
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(b"\0" * 99),
        broken_header,
        not_finite,
        nested_deep,
        of_other_weights_without_motion,
    ],
    ids=["empty", "zeros", "no licence", "infinite", "nested", "other weights"],
)
def test_one_file_that_cannot_be_used_is_left_out_and_can_be_removed(bank, spoil):
    bank.add("limp", walking_clip())
    bank.add("good", walking_clip())
    spoil(bank.user / "limp.safetensors")
    with pytest.warns(
        UserWarning, match="'limp' is left out: .*limp.safetensors.*patchwalk styles remove limp"
    ) as warned:
        after = again(bank)
    assert "reinstall" not in str(warned[0].message)
    assert "good" in after.names and "limp" not in after.names
    after.refresh()  # which says it no second time
    after.remove("limp")
    assert not (bank.user / "limp.safetensors").exists()


def test_a_style_of_older_weights_in_a_home_that_cannot_be_written_is_made_again_in_memory(bank, monkeypatch):
    bank.add("limp", walking_clip())
    rewritten(bank.user / "limp.safetensors", weights="older")

    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied", "limp.safetensors")

    monkeypatch.setattr("stylizer.styles.bank.write", refuse)
    assert "limp" in again(bank).names


def test_weights_that_are_not_finite_are_refused(bank):
    path = weight_files.FOLDER / "tiny.safetensors"
    header, tensors = checkpoint.read(path)
    next(iter(tensors.values())).view(-1)[0] = torch.nan
    save_file(tensors, path, header)
    with pytest.raises(ValueError, match="tiny.safetensors: some of its numbers are not finite"):
        checkpoint.load("tiny", weight_files.FOLDER)


@pytest.mark.parametrize("config", ["[" * 50_000, "[]", "{", '{"parts": null}', "1e999", '{"stem": 1000000}'])
def test_weights_whose_header_makes_no_sense_are_refused(bank, config):
    path = weight_files.FOLDER / "tiny.safetensors"
    rewritten(path, config=config)
    with pytest.raises(ValueError, match="tiny.safetensors is damaged, or of another version"):
        checkpoint.load("tiny", weight_files.FOLDER)


def test_settings_ask_for_no_more_than_the_file_holds():
    """Damaged ones would have networks of any size made before anything is compared."""
    arrays = {"a": np.zeros((3, 8)), "b": np.zeros((0, 10**9)), "c": np.zeros(())}
    tensor_file.check_settings({"width": [8, 3], "by_part": True, "rate": 1e9, "labels": ["x"] * 100}, arrays)
    for settings in ({"width": 9}, {"width": [3, [9]]}, 10**9, {"width": [1] * 100_000}):
        with pytest.raises(ValueError, match="larger than what the file holds|100000 layers"):
            tensor_file.check_settings(settings, arrays)


def test_a_bundled_style_of_other_shapes_is_refused_by_name(bank):
    path = bank.bundled / bank.name / "other.safetensors"
    header, tensors = checkpoint.read(path)
    name = next(name for name in tensors if name.startswith("style."))
    save_file({**tensors, name: tensors[name][..., :1].contiguous()}, path, header)
    with pytest.raises(ValueError, match="other.safetensors is damaged, or of another version.*: reinstall"):
        again(bank)


def test_a_bank_without_an_own_style_is_refused(bank):
    (bank.bundled / bank.name / "neutral.safetensors").unlink()
    with pytest.raises(ValueError, match="there is no own style in .*: reinstall"):
        again(bank)


@pytest.mark.parametrize("name", ["../tiny", "/etc/passwd", "a/b", "", "x" * 200, "..\\tiny"])
def test_the_name_of_a_stylizer_is_no_path(bank, name):
    with pytest.raises(ValueError, match="is no name of a stylizer"):
        checkpoint.load(name)


@pytest.mark.parametrize("name", ["drawn", "drawn-happy-1", "Drawn", "CON", "nul", "com1", "LPT9"])
def test_names_that_are_kept_for_something_else_are_refused(bank, name):
    with pytest.raises(ValueError, match=f"'{name}' cannot be a style's name"):
        bank.add(name, walking_clip())
    assert bank.free_name(Path(f"{name}.bvh")) == f"style-{name}"


def test_a_clip_too_quick_for_half_precision_is_refused(bank):
    clip = walking_clip()
    clip.hips[:, 2] *= 1e6
    with pytest.raises(ValueError, match="not finite"):
        bank.add("far", clip)
    assert not (bank.user / "far.safetensors").exists()
