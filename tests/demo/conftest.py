"""A window that nobody sees, in an empty folder, for whatever is driven by events."""

import pytest

from tests.support.fakes import offscreen

SIZE = (320, 180)


@pytest.fixture
def screen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path / "home"))
    with offscreen(SIZE) as opened:
        yield opened
