"""What is for non-commercial use says so, lies in a folder of its own, and is left out by one switch; nothing needs
it."""

from pathlib import Path

import pytest

from demo import assemble, cli
from demo.state.presets import Presets
from sim.io import recording, tensor_file
from sim.io.provenance import NONCOMMERCIAL, PERMISSIVE, noncommercial
from stylizer.styles import bank as bank_module
from stylizer.styles.bank import BUNDLED, StyleBank
from stylizer.styles.clip_table import CLIPS, licence_of
from stylizer.styles.own_style import OWN
from stylizer.systems import checkpoint, weight_files

FREE = {name for name, clips in CLIPS.items() if NONCOMMERCIAL not in licence_of(clips)}
OLD = '{"format": "patchwalk-recording", "version": 1, "fps": 60}\n{"frame": 0, "style": {"spine": ["old", 1.0]}}\n'


@pytest.fixture
def permissive(monkeypatch, tmp_path):
    monkeypatch.setenv(PERMISSIVE, "1")
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path / "home"))


@pytest.fixture
def switch(monkeypatch, tmp_path):
    """What `--permissive` sets in the environment is put back."""
    monkeypatch.setenv(PERMISSIVE, "0")
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path / "home"))


@pytest.mark.parametrize("folder", [BUNDLED, weight_files.FOLDER])
def test_every_file_says_which_it_is(folder):
    for where, marked in ((folder, False), (noncommercial(folder), True)):
        files = list(where.rglob("*.safetensors"))
        assert files
        for file in files:
            assert (NONCOMMERCIAL in tensor_file.read_header(file)["licence"]) == marked, file


def test_the_switch_leaves_out_styles_and_stylizers(permissive):
    assert len(FREE) >= 14
    assert set(StyleBank().names) == {*FREE, OWN} and weight_files.names() == (checkpoint.SHIPPED, "slim")
    with pytest.raises(ValueError, match="the style 'old' is for non-commercial use: start without --permissive"):
        StyleBank()["old"]
    with pytest.raises(ValueError, match="the stylizer 'latent' is for non-commercial use: start without --permissive"):
        checkpoint.load("latent")


def test_what_comes_with_the_package_needs_none_of_it(permissive, tmp_path):
    presets = {name for _, style in Presets(tmp_path / "none").slots.values() for name in style.names}
    used = {*recording.read(assemble.BUNDLED_RECORDING).styles} | presets
    assert used and used <= FREE


def test_the_folder_may_be_deleted(monkeypatch, tmp_path):
    styles = tmp_path / "styles"
    (tmp_path / "styles").symlink_to(BUNDLED)
    monkeypatch.setattr(bank_module, "BUNDLED", styles)
    assert set(StyleBank(user=tmp_path / "user").names) == {*FREE, OWN}
    with pytest.raises(ValueError, match="unknown style 'old'"):
        StyleBank(user=tmp_path / "user")["old"]


def test_the_command_line_marks_it_and_leaves_it_out(switch, capsys):
    assert cli.main(["styles", "list"]) == 0
    listed = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert {name for name, text in listed.items() if NONCOMMERCIAL in text} == {*CLIPS} - FREE
    for command in (["styles", "list", "--permissive"], ["--permissive", "styles", "list"]):
        assert cli.main(command) == 0
        assert {line.split()[0] for line in capsys.readouterr().out.splitlines()} == {*FREE, OWN}


def test_a_recording_that_wants_it_is_refused_in_a_sentence(switch, tmp_path, capsys):
    Path(tmp_path / "old.jsonl").write_text(OLD + '{"frame": 30, "end": true}\n')
    assert cli.main(["replay", str(tmp_path / "old.jsonl"), "--headless", "--permissive"]) == 2
    assert "the style 'old' is for non-commercial use" in capsys.readouterr().err
