"""The window on a real X server, driven by real key and button events: Xvfb and xdotool, where they are."""

import json
import os
import subprocess
import sys
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import Callable

import pytest

from sim.io import recording

ROOT = Path(__file__).parents[2]
PATIENCE = 120  # seconds without a word from the program after which it is given up; nothing is measured by it
# Says what a user could see of the window, in a line of JSON whenever that has changed, and last the files it wrote.
# With the word `slow` a turn waits until its input is closed: as much as one likes happens between two pictures.
RUN = """
import json
import sys
import pygame
from demo.live import live
from demo.render.window import NoGL
from tests.support.fakes import BENDS, fake_session

class Telling(live.Live):
    told = None

    def draw(self):
        super().draw()
        if "slow" in sys.argv and self.pictures > 1:
            sys.stdin.readline()
        seen = {"pointer": pygame.mouse.get_pos(), "recording": self.recorder is not None, "picked": self.choice.picked,
                "mode": self.devices.mode, "search": self.choice.search, "walks": self.frame.command.move != (0, 0),
                "wears": self.choice.name, "inside": sorted(self.seen),
                "distance": self.view.camera._wanted["distance"], "files": len(self.files)}
        if seen != self.told:
            self.told = seen
            print(json.dumps(seen), flush=True)

live.Live = Telling
try:
    report = live.run_live(fake_session(), tuple(BENDS))
    print(json.dumps({"written": [str(path) for path in report.files]}), flush=True)
except NoGL as error:
    print(json.dumps({"no_gl": str(error)}), flush=True)
"""


class Program:
    """The window in a process of its own, and a user who waits to see what each key does before pressing the next."""

    def __init__(self, display: str, folder: Path, *words: str) -> None:
        self.environment = {**os.environ, "DISPLAY": display, "PATCHWALK_HOME": str(folder), "PYTHONPATH": str(ROOT)}
        self.environment.pop("SDL_VIDEODRIVER", None)
        self.environment.pop("PYOPENGL_PLATFORM", None)
        self.errors = folder / "stderr.txt"
        with self.errors.open("w") as errors:
            self.process = subprocess.Popen(
                [sys.executable, "-c", RUN, *words],
                cwd=folder,
                env=self.environment,
                text=True,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
            )
        self.lines, self.last = Queue(), None
        Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        for line in self.process.stdout:
            if line.startswith("{"):
                self.lines.put(json.loads(line))
        self.lines.put(None)

    def wait_for(self, is_there: Callable[[dict], bool]) -> dict:
        """The next line of the program in which something is there."""
        while True:
            try:
                said = self.lines.get(timeout=PATIENCE)
            except Empty:
                pytest.fail(f"nothing more happened; last it was {self.last}")
            self.last = said
            assert said is not None, f"the program ended: {self.errors.read_text()}"
            if "no_gl" in said:
                pytest.skip(f"no OpenGL on this X server: {said['no_gl']}")
            if is_there(said):
                return said

    def turn(self, *scripts: str) -> None:
        """Does all of this with xdotool within one turn of the slow window, which then runs freely."""
        for script in scripts:
            subprocess.run(["xdotool", *script.split()], env=self.environment, check=True)
        self.process.stdin.close()

    def drive(self, *words: str, until: Callable[[dict], bool]) -> dict:
        """Does something with xdotool and waits until it shows."""
        subprocess.run(["xdotool", *words], env=self.environment, check=True)
        return self.wait_for(until)


@pytest.fixture
def start(display, tmp_path):
    started = []

    def start(*words: str) -> Program:
        started.append(Program(display, tmp_path, *words))
        return started[-1]

    yield start
    for program in started:
        program.process.kill()
        program.process.wait()


def test_keys_and_mouse_on_a_real_screen(start):
    program = start()
    before = program.wait_for(lambda seen: "pointer" in seen)
    program.drive("mousemove", "600", "200", until=lambda seen: seen["pointer"] not in ([0, 0], before["pointer"]))
    program.drive("key", "r", until=lambda seen: seen["recording"])
    program.drive("keydown", "w", until=lambda seen: seen["walks"])
    program.drive("key", "4", until=lambda seen: seen["picked"] == "left_arm")
    program.drive("key", "slash", until=lambda seen: seen["mode"] == "typing")
    program.drive("type", "flap", until=lambda seen: seen["search"] == "flap")
    program.drive("key", "Return", until=lambda seen: seen["mode"] == "" and seen["wears"] == "flapping")
    program.drive("keyup", "w", until=lambda seen: not seen["walks"])
    program.drive("click", "4", until=lambda seen: seen["distance"] < before["distance"])
    program.drive("key", "r", until=lambda seen: not seen["recording"] and seen["files"] == 1)
    program.drive("key", "F12", until=lambda seen: seen["files"] == 2)
    last = program.drive("key", "Escape", until=lambda said: "written" in said)
    files = [Path(path) for path in last["written"]]
    assert sorted(path.suffix for path in files) == [".jsonl", ".png"] and all(path.exists() for path in files)
    commands = list(recording.read(next(path for path in files if path.suffix == ".jsonl")))
    assert any(command.move != (0, 0) for command in commands)
    assert commands[-1].style == {"left_arm": ("flapping", 1.0)} and commands[-1].move == (0, 0)


def test_a_word_that_is_typed_between_two_pictures_fires_no_shortcut(start):
    """Of `/flap` the letters p, l and a would show the phase dial, wear a preset and walk."""
    program = start("slow")
    before = program.wait_for(lambda seen: "pointer" in seen)
    program.turn("type /flap", "key Return", "key 4")
    after = program.wait_for(lambda seen: seen["picked"] == "left_arm")
    assert (
        after["wears"] == "flapping"
        and after["inside"] == before["inside"]
        and after["mode"] == ""
        and not after["walks"]
    )
