"""Where a user's files are kept, by platform and by what the environment says."""

from pathlib import Path

import pytest

from sim.io.user_dirs import cache_folder, data_folder

VARIABLES = ("PATCHWALK_HOME", "APPDATA", "LOCALAPPDATA", "XDG_DATA_HOME", "XDG_CACHE_HOME")


@pytest.fixture(autouse=True)
def bare(monkeypatch):
    """A home at /home/kim and nothing said of any other folder."""
    for variable in VARIABLES:
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(Path, "home", lambda: Path("/home/kim"))


@pytest.mark.parametrize(
    ("platform", "variable", "data", "cache"),
    [
        ("linux", "XDG_DATA_HOME", ".local/share", ".cache"),
        ("darwin", "", "Library/Application Support", "Library/Caches"),
        ("win32", "APPDATA", "", ""),
    ],
)
def test_each_platform_has_its_places(monkeypatch, platform, variable, data, cache):
    monkeypatch.setattr("sys.platform", platform)
    assert data_folder() == Path("/home/kim") / data / "patchwalk"
    assert cache_folder() == Path("/home/kim") / cache / "patchwalk"
    if variable:
        monkeypatch.setenv(variable, "/elsewhere")
        assert (
            data_folder() == Path("/elsewhere/patchwalk") and cache_folder() == Path("/home/kim") / cache / "patchwalk"
        )


def test_patchwalk_home_goes_before_all(monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", "/elsewhere")
    monkeypatch.setenv("PATCHWALK_HOME", "/here")
    assert (data_folder(), cache_folder()) == (Path("/here"), Path("/here/cache"))
