"""The character that is kept for the next start; a bad file in the user's folder is said and stops nothing."""

import json

import numpy as np
import pytest

from demo import cli
from demo.state import characters
from sim.character.character import load_character
from tests.support.skinned import Build, write


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "home"


def test_a_character_is_kept_and_forgotten(tmp_path, home):
    assert characters.kept() is None
    path = write(tmp_path / "hero.vrm", Build(vrm=0))
    original = load_character(path)
    characters.keep(original)
    path.unlink()
    again = characters.kept()
    np.testing.assert_array_equal(again.mesh.positions, original.mesh.positions)
    characters.keep(again)  # itself once more
    characters.forget()
    assert characters.kept() is None and (home / "characters" / "hero.glb").is_file(), "nothing of the user's is lost"


def test_the_map_is_kept_with_it(tmp_path):
    names = {ours: f"b{number}" for number, ours in enumerate(Build().names)}
    path = write(tmp_path / "hero.glb", Build(names=names))
    characters.keep(load_character(path, names), names)
    assert characters.kept().notes == (), "nothing had to be guessed"


@pytest.mark.parametrize("content", ["", "[]", '{"format": "patchwalk-character", "file": "gone.glb"}', "{" * 5000])
def test_a_bad_file_is_said_with_what_to_do(home, content):
    home.mkdir()
    (home / "character.json").write_text(content)
    with pytest.raises(ValueError, match="drop it on the window again"):
        characters.kept()


def test_a_file_with_a_skinned_mesh_is_a_character_and_a_motion_is_none(tmp_path):
    path = write(tmp_path / "hero.glb")
    assert characters.is_character(path)
    (tmp_path / "walk.gltf").write_text(json.dumps({"nodes": [{"name": "Hips"}], "animations": []}))
    (tmp_path / "walk.bvh").write_text("HIERARCHY")
    assert not any(characters.is_character(tmp_path / name) for name in ("walk.gltf", "walk.bvh", "gone.glb"))


@pytest.mark.parametrize(
    "line, sentence",
    [
        ("--character gone.glb", "gone.glb: No such file"),
        ("--character walk.bvh", "walk.bvh is no character"),
        ("replay demo.jsonl --headless --character empty.glb", "empty.glb: it is a .glb without"),
        ("replay demo.jsonl --headless --in-place --root-motion", "not allowed with"),
        ("stylize a.bvh --style arms=old -o b.bvh --retarget-back --character hero.glb", "leave the others out"),
    ],
)
def test_a_mistake_on_the_command_line_is_one_sentence(tmp_path, capsys, line, sentence):
    (tmp_path / "empty.glb").write_bytes(b"glTF")
    (tmp_path / "demo.jsonl").write_text(
        '{"format": "patchwalk-recording", "version": 1, "fps": 60}\n{"frame": 2, "end": true}\n'
    )
    assert cli.main(line.split()) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and sentence in said[0]
