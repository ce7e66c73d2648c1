"""The window on a real X server, driven by real key and button events: Xvfb and xdotool, where they are."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sim.io import recording

ROOT = Path(__file__).parents[2]
RUN = """
from demo import live
from tests.support.fakes import BENDS, fake_session
draw = live.Live.draw
def draw_and_say(self):
    draw(self)
    if self.pictures == 1:
        print("ready", flush=True)
live.Live.draw = draw_and_say
print(*live.run_live(fake_session(), tuple(BENDS), seconds=60).files, sep="\\n")
"""


@pytest.fixture
def display():
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
    server.wait(10)
    os.close(reading)


def test_keys_and_mouse_on_a_real_screen(display, tmp_path):
    environment = {**os.environ, "DISPLAY": display, "PATCHWALK_HOME": str(tmp_path), "PYTHONPATH": str(ROOT)}
    environment.pop("SDL_VIDEODRIVER", None)
    environment.pop("PYOPENGL_PLATFORM", None)
    window = subprocess.Popen(
        [sys.executable, "-c", RUN], cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True
    )

    def drive(*words: str, wait: float = 0.5) -> None:
        subprocess.run(["xdotool", *words], env=environment, check=True)
        time.sleep(wait)

    while (line := window.stdout.readline().strip()) != "ready":
        if window.poll() is not None:
            pytest.skip(f"no OpenGL on this X server: {line}")
    drive("mousemove", "600", "200")
    drive("key", "r")
    drive("keydown", "w")
    drive("key", "4")
    drive("key", "slash")
    drive("type", "flap")
    drive("key", "Return")
    drive("keyup", "w")
    drive("click", "4")
    drive("key", "r")
    drive("key", "F12", wait=1.0)
    drive("key", "Escape")
    files = [Path(line) for line in window.communicate(timeout=30)[0].split("\n") if line]
    assert sorted(path.suffix for path in files) == [".jsonl", ".png"] and all(path.exists() for path in files)
    commands = list(recording.read(next(path for path in files if path.suffix == ".jsonl")))
    assert any(command.move != (0, 0) for command in commands)
    assert commands[-1].style == {"left_arm": ("flapping", 1.0)} and commands[-1].move == (0, 0)
