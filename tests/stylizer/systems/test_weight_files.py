"""What weight files and tables say without torch is what their networks say."""

import pytest

from stylizer.runtime import catalogue
from stylizer.styles import style_names
from stylizer.systems import weight_files
from stylizer.systems.registry import SYSTEMS, all_networks, system_of_network


@pytest.mark.parametrize("name", weight_files.names())
def test_the_styles_that_are_told_by_files_are_those_of_the_bank(name, tmp_path, monkeypatch):
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path))
    bank = catalogue.load_bank(name)
    entries = list(style_names.style_entries(name))
    assert [entry.name for entry in entries] == list(bank.names) and style_names.known_names(name) == set(bank.names)
    assert [entry.noncommercial for entry in entries] == [bank.is_noncommercial(each) for each in bank.names]
    sampled = getattr(bank, "sampled", {})
    for entry in entries:
        assert entry.movements == (() if entry.name in sampled else bank[entry.name].gait.movements)


@pytest.mark.parametrize("kind", SYSTEMS)
def test_each_system_names_the_networks_that_it_has_settings_for(kind):
    assert SYSTEMS[kind].networks == tuple(SYSTEMS[kind].load_configs())


def test_an_unknown_network_is_a_sentence():
    assert system_of_network("latent") is SYSTEMS["latent"] and "joints" in all_networks()
    with pytest.raises(ValueError, match="there is no network 'latnet': use one of full"):
        system_of_network("latnet")


@pytest.mark.parametrize("name", ["../weights/joints", "joints.safetensors", "", "x" * 5000])
def test_a_path_is_no_name(name):
    with pytest.raises(ValueError, match="is no name of a stylizer: there are joints") as error:
        weight_files.system(name)
    assert len(str(error.value)) < 200
