"""The live loop: devices, session, renderer, at 60 simulated frames a second whatever the picture costs."""

import time
import warnings
from dataclasses import dataclass
from datetime import datetime
from itertools import count, cycle
from pathlib import Path
from typing import Callable, Iterable, Sequence

import numpy as np
import pygame

from demo import actions, hud, panels, takes
from demo.bindings import DEFAULT, Bindings
from demo.canvas import ALERT, INK
from demo.devices import Devices
from demo.diagram import nearest_part
from demo.dropped import Dropped, Learned
from demo.hints import Hints
from demo.inset import SIDES, Inset
from demo.insight import Insight
from demo.menu import Menu
from demo.presets import Presets
from demo.renderer import Renderer
from demo.style_choice import StyleChoice
from demo.view import View
from demo.vmc import Sender
from demo.widgets import Region
from demo.window import Window, open_window
from sim.clip import FPS
from sim.command import Command
from sim.recording import Recorder
from sim.session import Frame, Session

FRAME_SECONDS = 1 / FPS
MAX_CATCH_UP = 4  # simulated frames that one picture may make up for; a longer stop is counted, not raced after
TOAST_SECONDS = 4.0
READING_SPEED = 20.0  # letters a second
GLOW_SECONDS = 0.5
FIGURES_SECONDS = 0.25  # how often the figures of the status line change
ATTRACT_ORBIT = 0.12  # radians a second that the camera goes round while the window plays by itself


@dataclass(frozen=True)
class LiveReport:
    """What a live run was: simulated frames, pictures drawn, frames missed, files written."""

    frames: int
    pictures: int
    missed: int
    files: tuple[Path, ...]


def run_live(session: Session, styles: Sequence[str], seconds: float | None = None, window: Window | None = None,
             recorder_factory: Callable[[Path], Recorder] = Recorder, clock: Callable[[], float] = time.perf_counter,
             sleep: Callable[[float], None] = time.sleep, attract: Iterable[Command] = (),
             bindings: Bindings = DEFAULT, presets: Presets | None = None, stream: Sender | None = None) -> LiveReport:
    """Runs until the user leaves or `seconds` of simulated time are over, in `window` or one that it opens.

    styles: the names to choose from. attract: commands that are played, over and over, until somebody touches a control.
    stream: where each frame is sent as it is made.
    Raises NoDisplay or NoGL where no window can be had; what goes wrong later is shown on screen."""
    presets = presets or Presets()
    with window or open_window() as window:
        live = Live(session, styles, window, recorder_factory, clock, attract, bindings, presets, stream)
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
    """The state of a live run. `do` carries out an action of demo.actions; held keys are the devices' affair."""

    def __init__(self, session: Session, styles: Sequence[str], window: Window,
                 recorder_factory: Callable[[Path], Recorder] = Recorder,
                 clock: Callable[[], float] = time.perf_counter, attract: Iterable[Command] = (),
                 bindings: Bindings = DEFAULT, presets: Presets | None = None, stream: Sender | None = None) -> None:
        self.session, self.window = session, window
        self.devices, self.choice, self.view = Devices(bindings), StyleChoice(styles), View()
        self.presets, self.preset = presets or Presets(), 0
        self.menu, self.hints, self.insight = Menu(bindings), Hints(bindings), Insight(session)
        self.seen = {"contacts"}  # of demo.actions.SEEN
        self.hidden = self.leaving = self.helping = False
        self._attract = cycle(attract)
        self.playing = next(self._attract, None)  # the next command of the attract mode, None once somebody took over
        self.renderer = Renderer(window.size)
        self.recorder: Recorder | None = None
        self.takes = takes.Takes()
        self.dropped = Dropped(lambda path: session.stylizer.learn(path))
        self.inset = Inset()
        self.stream = stream
        self.files: list[Path] = []
        self.frames = self.pictures = self.missed = 0
        self._recorder_factory, self._clock, self._bindings = recorder_factory, clock, bindings
        self._frame: Frame | None = None
        self._toasts: list[tuple[float, str, tuple]] = []  # when it goes, text, colour
        self._figures = panels.Figures(FIGURES_SECONDS)
        self._picked_at = -GLOW_SECONDS
        self.type(False)

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
                self.wake()
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
        command = self._command()
        try:
            self._frame = self.session.step(command)
        except ValueError as error:  # a style that the bank refuses
            self.say(str(error), ALERT)
            self.stop_recording()  # the controller has gone on, and the recording must not say that it has not
            self.playing, self.choice.style = None, self._frame.command.style if self._frame else {}
            return
        if self.recorder and not self.guard(lambda: self.recorder.write(command)):
            self.recorder = None
        self.frames += 1
        self.takes.frames.append(self._frame)
        self.inset.step()
        if self.stream:
            self.stream.send(self._frame)
        self.insight.follow(self._frame)
        self.view.camera.orbit(*self.devices.take_camera())
        self.view.follow(self._frame, FRAME_SECONDS)

    def _command(self) -> Command:
        """What is asked for in the next frame: by a person, or by the recording that plays until there is one."""
        facing = self._frame.styled.root_facing if self._frame else 0.0
        style = {} if self.devices.holds("compare") else self.choice.style
        command = self.devices.command(self.view.camera.yaw, facing, style, FRAME_SECONDS)
        if self.playing is None:
            return command
        playing, self.playing = self.playing, next(self._attract)
        self.view.camera.orbit(ATTRACT_ORBIT * FRAME_SECONDS, 0.0)
        return playing

    def draw(self) -> None:
        """One picture of the newest frame."""
        self.show_written(self.takes.finished())
        self.wear_learned()
        now = self._clock()
        latency = self.session.latency
        self._figures.tick(now, latency.last_ms("frame"), latency.last_ms("render"))
        with latency.stage("render"):
            self._look(now)
            self._paint()
        self.window.show()
        self.pictures += 1

    def _look(self, now: float) -> None:
        """Puts what is to be seen besides the frame into the view."""
        view = self.view
        glow = max(0.0, 1 - (now - self._picked_at) / GLOW_SECONDS)
        view.glow = dict.fromkeys(self.choice.parts, glow) if glow else {}
        view.skeleton, view.contacts = "skeleton" in self.seen, "contacts" in self.seen
        view.paths = self.insight.paths() if "trajectory" in self.seen else None
        view.past = self.insight.past() if "onion" in self.seen else ()
        view.panels = tuple(self._panels(now))
        placed = hud.place(view.panels, self.window.size)
        self.devices.pointer.regions = [region for panel in placed for region in (Region(panel.box, ""), *panel.regions())]
        under = self.devices.pointer.under()
        view.over = (hud.highlight(under, self.window.size),) if under and under.action else ()

    def _paint(self) -> None:
        self.window.bind()
        self.renderer.draw(self._frame, self.view)
        self.inset.draw(self.window.size)

    def _panels(self, now: float) -> Iterable[hud.Panel]:
        self._toasts = [toast for toast in self._toasts if toast[0] > now]
        toasts = [panels.line(text, "top", colour) for _, text, colour in self._toasts]
        if self.playing is not None:
            return [panels.parts(self._frame.command.style), *panels.title(), *toasts]
        shown = [panels.corner(self.menu.open, self.helping, self.hidden)]
        if self.helping:
            return [*shown, panels.help_of(self._bindings), *toasts]
        if not self.hidden:
            shown += [panels.wardrobe(self.choice, self.devices.mode == "typing", self.devices.holds("compare")),
                      panels.presets(self.presets)]
        shown.append(panels.status(self.choice, self._figures, self.missed, self.devices.facing_held, self.recorder,
                                   brief=not self.hidden))
        if self.hints.text:
            shown.append(panels.line(self.hints.text, "bottom"))
        lift = SIDES[1] * 720 + 20 if self.inset.playing else 0  # the inset lies in that corner
        shown += [panels.lifted(panel, lift) for panel in self.insight.panels(self.seen, self.choice)]
        if self.menu.open:
            shown.append(panels.menu(self.menu, self.presets, lambda action: actions.is_on(self, action)))
        return shown + toasts

    # ---- what actions do -----------------------------------------------------------

    def do(self, action: str) -> None:
        """Carries out an action of demo.actions."""
        self.hints.done(action)
        actions.do(self, action)

    def wake(self) -> None:
        """Somebody touched a control: the attract mode ends, and the character is theirs."""
        self.playing = None

    def say(self, text: str, colour=INK) -> None:
        """Shows a sentence for as long as it takes to read."""
        self._toasts.append((self._clock() + max(TOAST_SECONDS, len(text) / READING_SPEED), text, colour))

    def glow(self) -> None:
        """The picked parts light up for a moment."""
        self._picked_at = self._clock()

    def type(self, on: bool) -> None:
        """Keys go to the search line, or back to steering."""
        self.menu.open = False
        self.devices.mode = "typing" if on else ""
        if on:
            pygame.key.start_text_input()
        else:
            pygame.key.stop_text_input()  # else the key that opens the search would also be typed into it
            self.choice.search = ""

    def part_at(self, at: tuple[float, float], reach: float) -> str | None:
        """The part of the figure that is drawn at a point in pixels, or within `reach` metres of it."""
        camera, (width, height) = self.view.camera, self.window.size
        joints = np.column_stack([self._frame.styled.positions, np.ones(len(self._frame.styled.positions))])
        clip = joints @ camera.world_to_clip(width / height).T
        places = (clip[:, :2] / clip[:, 3:] * [1, -1] + 1) / 2 * self.window.size
        pixel = 2 * np.tan(camera.field_of_view / 2) / min(width, height) * camera.distance
        return nearest_part(places, np.array(at), reach / pixel)

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

        self.guard(start)

    def stop_recording(self) -> None:
        """Ends the recording, if one runs."""
        if self.recorder:
            recorder, self.recorder = self.recorder, None
            self.guard(recorder.close)
            self.say(f"recorded into {recorder.path}")

    def export(self) -> None:
        """Begins to write the last ten seconds as BVH, glTF and video into the current folder."""
        if self.takes.busy:
            self.say("the last export is still being written; press F9 again when it is done")
        elif self.takes.frames and self.guard(lambda: self.takes.export(self._new_file(*takes.ENDINGS).with_suffix(""))):
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
                self.choice.learn(result.style)
                self.choice.choose(result.style)
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

        self.guard(save)

    def guard(self, write: Callable[[], None]) -> bool:
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

    def resize(self) -> None:
        """Follows the window."""
        if self.window.follow_size():
            self.renderer.resize(self.window.size)
