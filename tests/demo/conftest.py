"""A window that nobody sees, in an empty folder, for whatever is driven by events; and a screen that nobody sees."""

import os
import shutil
import subprocess

import pytest

from tests.support.fakes import offscreen

SIZE = (320, 180)


@pytest.fixture
def screen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path / "home"))
    with offscreen(SIZE) as opened:
        yield opened


@pytest.fixture
def display():
    """The name of an X server of the test's own."""
    if not (shutil.which("Xvfb") and shutil.which("xdotool")):
        pytest.skip("needs Xvfb and xdotool")
    reading, writing = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1024x640x24"],
        pass_fds=[writing],
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    number = os.read(reading, 16).decode().strip()
    if not number:
        pytest.skip("Xvfb does not start here")
    yield f":{number}"
    server.terminate()
    server.wait()
    os.close(reading)
