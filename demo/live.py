"""The live loop: devices, session, renderer, at 60 simulated frames a second whatever the picture costs."""

import time
import warnings
from dataclasses import dataclass
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Callable, Sequence

import numpy as np
import pygame

from demo import panels, takes
from demo.bindings import HINTS
from demo.devices import Devices
from demo.dropped import Dropped, Learned
from demo.hud import ALERT, INK
from demo.inset import Inset
from demo.renderer import Renderer
from demo.style_choice import StyleChoice
from demo.view import View
from demo.vmc import Sender
from demo.window import Window, open_window
from sim.clip import FPS
from sim.recording import Recorder
from sim.session import Frame, Session

FRAME_SECONDS = 1 / FPS
MAX_CATCH_UP = 4  # simulated frames that one picture may make up for; a longer stop is counted, not raced after
TOAST_SECONDS = 4.0
GLOW_SECONDS = 0.5
FIGURES_SECONDS = 0.25  # how often the figures of the status line change


@dataclass(frozen=True)
class LiveReport:
    """What a live run was: simulated frames, pictures drawn, frames missed, files written."""

    frames: int
    pictures: int
    missed: int
    files: tuple[Path, ...]


def run_live(session: Session, styles: Sequence[str], seconds: float | None = None, window: Window | None = None,
             recorder_factory: Callable[[Path], Recorder] = Recorder, clock: Callable[[], float] = time.perf_counter,
             sleep: Callable[[float], None] = time.sleep, stream: Sender | None = None) -> LiveReport:
    """Runs until the user leaves or `seconds` of simulated time are over, in `window` or one that it opens.

    styles: the names to choose from; stream: where each frame is sent as it is made.
    Raises NoDisplay or NoGL where no window can be had; what goes wrong later
    is shown on screen."""
    with window or open_window() as window:
        live = Live(session, styles, window, recorder_factory, clock, stream)
        if stream:
            live.say(f"streaming poses to {stream.address[0]}:{stream.address[1]} (VMC)")
        try:
            live.run(seconds, sleep)
        finally:
            live.stop_recording()
    if live.takes.busy:
        print("Finishing the export.", flush=True)
        written = live.takes.finished(wait=True)
        live.files += written.files
        for problem in written.problems:
            warnings.warn(problem, stacklevel=2)
    return LiveReport(live.frames, live.pictures, live.missed, tuple(live.files))


class Live:
    """The state of a live run. `do` carries out an action of demo.bindings; held keys are the devices' affair."""

    def __init__(self, session: Session, styles: Sequence[str], window: Window,
                 recorder_factory: Callable[[Path], Recorder] = Recorder,
                 clock: Callable[[], float] = time.perf_counter, stream: Sender | None = None) -> None:
        self.session, self.window = session, window
        self.devices, self.choice, self.view = Devices(), StyleChoice(styles), View()
        self.renderer = Renderer(window.size)
        self.recorder: Recorder | None = None
        self.takes = takes.Takes()
        self.dropped = Dropped(lambda path: session.stylizer.learn(path))
        self.inset = Inset()
        self.stream = stream
        self.files: list[Path] = []
        self.frames = self.pictures = self.missed = 0
        self.leaving = self.helping = False
        self._recorder_factory, self._clock = recorder_factory, clock
        self._frame: Frame | None = None
        self._hints = list(HINTS)
        self._toasts: list[tuple[float, str, tuple]] = []  # when it goes, text, colour
        self._figures = panels.Figures(FIGURES_SECONDS)
        self._picked_at = -GLOW_SECONDS

    # ---- the loop -----------------------------------------------------------

    def run(self, seconds: float | None, sleep: Callable[[float], None]) -> None:
        """Each turn: events, the simulated frames that are due, one picture; then sleep until the next is due."""
        last = None if seconds is None else round(seconds * FPS)
        self.step()
        self.draw()  # the first picture is slow: drivers finish compiling with it, so the clock starts after
        due_at = self._clock() + FRAME_SECONDS
        while not self.leaving and (last is None or self.frames < last):
            events = pygame.event.get()
            for path in self.dropped.take(events):
                self.say(f"learning {path.name}")
            for action in self.devices.handle(events):
                self.do(action)
            now = self._clock()
            if now < due_at:
                sleep(due_at - now)
                continue
            due = int((now - due_at) / FRAME_SECONDS) + 1
            due_at += due * FRAME_SECONDS
            steps = min(due, MAX_CATCH_UP)
            self.missed += due - steps
            for _ in range(steps if last is None else min(steps, last - self.frames)):
                self.step()
            self.draw()

    def step(self) -> None:
        """One simulated frame."""
        facing = self._frame.styled.root_facing if self._frame else 0.0
        command = self.devices.command(self.view.camera.yaw, facing, self.choice.style, FRAME_SECONDS)
        try:
            self._frame = self.session.step(command)
        except ValueError as error:  # a style that the bank refuses
            self.say(str(error), ALERT)
            self.stop_recording()  # the controller has gone on, and the recording must not say that it has not
            self.choice.restore(self._frame.command.style if self._frame else {})
            return
        if self.recorder and not self._guard(lambda: self.recorder.write(command)):
            self.recorder = None
        self.frames += 1
        self.takes.frames.append(self._frame)
        self.inset.step()
        if self.stream:
            self.stream.send(self._frame)
        orbit, lift, zoom = self.devices.take_camera()
        self.view.camera.orbit(orbit, lift)
        self.view.camera.zoom(zoom)
        self.view.follow(self._frame, FRAME_SECONDS)

    def draw(self) -> None:
        """One picture of the newest frame."""
        self.show_written(self.takes.finished())
        self.wear_learned()
        now = self._clock()
        latency = self.session.latency
        self._figures.tick(now, latency.last_ms("frame"), latency.last_ms("render"))
        glow = max(0.0, 1 - (now - self._picked_at) / GLOW_SECONDS)
        self.view.glow = dict.fromkeys(self.choice.parts, glow) if glow else {}
        self.view.panels = self._panels(now)
        with latency.stage("render"):
            self._paint()
        self.window.show()
        self.pictures += 1

    def _paint(self) -> None:
        self.window.bind()
        self.renderer.draw(self._frame, self.view)
        self.inset.draw(self.window.size)

    def _panels(self, now: float) -> tuple:
        self._toasts = [toast for toast in self._toasts if toast[0] > now]
        status = panels.status(self.choice, self._figures, self.missed, self.devices.facing_held, self.recorder)
        result = [panels.parts(self.choice.style, self.choice.parts), status]
        if self._hints and not self.helping:
            result.append(panels.line(self._hints[0][1], "bottom"))
        result += [panels.line(text, "top", colour) for _, text, colour in self._toasts]
        if self.helping:
            result.append(panels.controls())
        return tuple(result)

    # ---- actions -----------------------------------------------------------

    def do(self, action: str) -> None:
        """Carries out an action; one that is only held, such as walking, needs nothing here."""
        if self._hints and action in self._hints[0][0]:
            self._hints.pop(0)
        if action.startswith("pick_"):
            self.choice.pick(action.removeprefix("pick_"))
        elif action in self._ACTIONS:
            self._ACTIONS[action](self)
        if action.startswith(("pick_", "part_")):
            self._picked_at = self._clock()

    def say(self, text: str, colour=INK) -> None:
        """Shows a sentence for a few seconds."""
        self._toasts.append((self._clock() + TOAST_SECONDS, text, colour))

    def toggle_recording(self) -> None:
        """Starts a recording in the current folder, or ends the one that runs.

        The character goes back to standing at the start point, in the styles it wears, because that is where a replay
        starts: so it makes equal poses."""
        if self.recorder:
            self.stop_recording()
            return
        path = self._new_file("jsonl")

        def start() -> None:
            self.recorder = self._recorder_factory(path)
            self.files.append(path)
            self.session.restart()
            self.takes.frames.clear()
            self.view.camera.jump(np.zeros(3))
            self.say(f"recording into {path}")

        self._guard(start)

    def stop_recording(self) -> None:
        """Ends the recording, if one runs."""
        if self.recorder:
            recorder, self.recorder = self.recorder, None
            self._guard(recorder.close)
            self.say(f"recorded into {recorder.path}")

    def export(self) -> None:
        """Begins to write the last ten seconds as BVH, glTF and video into the current folder."""
        if self.takes.busy:
            self.say("the last export is still being written; press F9 again when it is done")
        elif self.takes.frames and self._guard(lambda: self.takes.export(self._new_file(*takes.ENDINGS).with_suffix(""))):
            self.say(f"exporting the last {len(self.takes.frames) / FPS:.1f} s as BVH, glTF and video; walk on")

    def show_written(self, written: takes.Written | None) -> None:
        """Says what came of an export."""
        if written:
            self.files += written.files
            if written.files:
                self.say(f"exported {', '.join(path.name for path in written.files)} into {written.files[0].parent}")
            for problem in written.problems:
                self.say(problem, ALERT)

    def wear_learned(self) -> None:
        """Puts styles that were learned from dropped files on the picked part, and says what could not be learned."""
        for result in self.dropped.finished():
            if isinstance(result, Learned):
                self.choice.styles = tuple(sorted((*self.choice.styles, result.style)))
                self.choice.wear(result.style)
                self.inset.play(result.clip, result.style)
                self.say(f"learned “{result.style}”: worn by {panels.readable(self.choice.picked)}, kept for the next start")
            else:
                self.say(result.reason, ALERT)

    def screenshot(self) -> None:
        """Saves the picture as it is, with the text, in the current folder."""
        path = self._new_file("png")

        def save() -> None:
            self._paint()
            pixels = self.window.read_pixels()
            pygame.image.save(pygame.image.frombuffer(pixels.tobytes(), self.window.size, "RGB"), str(path))
            self.files.append(path)
            self.say(f"saved {path}")

        self._guard(save)

    def _guard(self, write: Callable[[], None]) -> bool:
        """Runs what writes a file, True if it could; where it fails the screen says so, and the character walks on."""
        try:
            write()
        except (OSError, pygame.error) as error:
            self.say(f"cannot write: {error}", ALERT)
            return False
        return True

    def _new_file(self, *suffixes: str) -> Path:
        """A path in the current folder with the first suffix, whose name is free with all of them."""
        now = f"patchwalk-{datetime.now():%Y%m%d-%H%M%S}"
        for number in count(1):
            paths = [Path.cwd() / f"{now}{f'-{number}' if number > 1 else ''}.{suffix}" for suffix in suffixes]
            if not any(path.exists() for path in paths):
                return paths[0]

    def _resize(self) -> None:
        if self.window.follow_size():
            self.renderer.resize(self.window.size)

    def _toggle(self, name: str) -> None:
        owner = self.view if name == "twin" else self
        setattr(owner, name, not getattr(owner, name))

    def _leave(self) -> None:
        self.leaving = True

    _ACTIONS: dict[str, Callable[["Live"], None]] = {
        "part_previous": lambda self: self.choice.pick_next(-1),
        "part_next": lambda self: self.choice.pick_next(1),
        "style_previous": lambda self: self.choice.cycle(-1),
        "style_next": lambda self: self.choice.cycle(1),
        "own_style": lambda self: self.choice.reset(),
        "weaker": lambda self: self.choice.change_strength(-1),
        "stronger": lambda self: self.choice.change_strength(1),
        "zoom_in": lambda self: self.view.camera.zoom(1),
        "zoom_out": lambda self: self.view.camera.zoom(-1),
        "twin": lambda self: self._toggle("twin"),
        "help": lambda self: self._toggle("helping"),
        "record": toggle_recording,
        "export": export,
        "screenshot": screenshot,
        "full_screen": lambda self: self.window.toggle_full_screen(),
        "resized": _resize,
        "leave": _leave,
        "pad_added": lambda self: self.say(f"gamepad plugged in: {self.devices.pad_name}"),
        "pad_removed": lambda self: self.say(f"gamepad unplugged; {self.devices.pad_name or 'the keyboard'} steers"),
    }
