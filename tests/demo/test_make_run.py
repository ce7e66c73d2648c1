"""`make run` as on somebody's desk: an X server, a window manager if one is installed, and a window with an icon."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pygame
import pytest

ROOT = Path(__file__).parents[2]
PATIENCE = 120  # seconds after which it is given up; nothing is measured by it
MANAGERS = ("openbox", "xfwm4", "metacity", "marco", "icewm", "fluxbox", "mutter", "kwin_x11", "twm")


@pytest.fixture
def desk(display, tmp_path):
    """The environment of a user on that display, in a folder where everything is installed already."""
    environment = {**os.environ, "DISPLAY": display, "PATCHWALK_HOME": str(tmp_path / "home"), "PYTHONPATH": str(ROOT)}
    for name in ("SDL_VIDEODRIVER", "PYOPENGL_PLATFORM", "WAYLAND_DISPLAY"):
        environment.pop(name, None)
    started = tmp_path / ".venv" / "bin" / "patchwalk"
    started.parent.mkdir(parents=True)
    started.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m demo "$@"\n')
    started.chmod(0o755)
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    (tmp_path / ".venv" / ".installed-run").touch()
    manager = next(filter(shutil.which, MANAGERS), None)
    process = manager and subprocess.Popen([manager], env=environment, stderr=subprocess.DEVNULL)
    yield environment
    if process:
        process.terminate()
        process.wait()


def test_make_run_opens_a_window_that_can_be_resized_photographed_and_closed(desk, tmp_path):
    def xdotool(*words: str) -> str:
        return subprocess.run(
            ["xdotool", *words], env=desk, check=True, text=True, capture_output=True, timeout=PATIENCE
        ).stdout.strip()

    if not shutil.which("make"):
        pytest.skip("needs make")
    program = subprocess.Popen(["make", "run"], cwd=tmp_path, env=desk, text=True, stdout=subprocess.PIPE)
    try:
        window = xdotool("search", "--sync", "--onlyvisible", "--class", "Patchwalk").split()[0]
        if shutil.which("xprop"):
            known = subprocess.run(
                ["xprop", "-id", window, "WM_CLASS", "_NET_WM_ICON"], env=desk, text=True, capture_output=True
            ).stdout
            assert '"Patchwalk"' in known and "Icon (128 x 128)" in known
        xdotool("windowsize", "--sync", window, "800", "600")
        xdotool("windowfocus", "--sync", window)
        xdotool("key", "F12")
        xdotool("key", "Escape")
        said, _ = program.communicate(timeout=PATIENCE)
    finally:
        program.kill()
        program.wait()
    if "No window" in said:
        pytest.skip(said.splitlines()[-1])
    assert program.returncode == 0
    (picture,) = tmp_path.glob("patchwalk-*.png")
    assert f"wrote {picture}" in said and pygame.image.load(picture).get_size() == (800, 600)
