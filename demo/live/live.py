"""The live loop: devices, session, renderer, at 60 simulated frames a second whatever the picture costs."""

import gc
import time
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Callable, Iterable, Sequence

import numpy as np
import pygame

from demo.export import export_jobs
from demo.export.vmc import Sender
from demo.figure.character_model import DrawnCharacter
from demo.figure.colours import OWN_STYLE, part_colours, worn
from demo.input.devices import Devices, take_events
from demo.live import actions, capture, overlay
from demo.live.debug_overlay import DebugOverlay
from demo.live.drop_import import DropImport, describe_file, is_clip
from demo.live.labels import Labels
from demo.live.load import Load
from demo.render.camera import Camera
from demo.render.inset import Inset
from demo.render.quality import QUALITIES
from demo.render.renderer import Renderer
from demo.render.view import View
from demo.render.window import Window, open_window
from demo.state.bindings import DEFAULT, Bindings
from demo.state.crowd import Crowd
from demo.state.grounds import Grounds
from demo.state.presets import Presets
from demo.state.style_choice import StyleChoice
from demo.state.stylizers import Stylizers
from demo.ui import panels
from demo.ui.canvas import ALERT, INK, Colour
from demo.ui.hints import Hints
from demo.ui.hud import Pixels
from demo.ui.menu import Menu
from sim.character.character import Character
from sim.command import Command
from sim.io.recording import Recorder
from sim.motion.clip import FPS
from sim.protocols import NamedStylizer
from sim.session import Frame, Session
from sim.style_spec import StyleSpec

FRAME_SECONDS = 1 / FPS
MAX_CATCH_UP = 4  # simulated frames that one picture may make up for; a longer stop is counted, not raced after
TOAST_SECONDS = 4.0
READING_SPEED = 20.0  # letters a second
DISTANCE = 3.5  # metres from the figure to the camera, at first
# Where a crowd is to be seen: metres that the camera goes away for each that the crowd is wide to a side, and at least,
# and how far down it looks, in radians: whoever stands in front then covers little of who is steered.
CROWD_DISTANCE, LEAST_CROWD_DISTANCE, CROWD_PITCH = 1.25, 5.0, 0.5
PALER = 0.4  # how far a crowd's colours are on their way to that of no style, so that who is steered stands out
FIGURES_SECONDS = 0.25  # how often the figures of the status line change
ATTRACT_ORBIT = 0.12  # radians a second that the camera goes round while the window plays by itself

MakeRecorder = Callable[[Path, str | None, bool, str | None, int | None], Recorder]  # as the class itself


@dataclass(frozen=True)
class LiveReport:
    """What a live run was: simulated frames, pictures drawn, frames missed, files written."""

    frames: int
    pictures: int
    missed: int
    files: tuple[Path, ...]


def run_live(
    session: Session[NamedStylizer],
    styles: Sequence[str],
    seconds: float | None = None,
    window: Window | None = None,
    recorder_factory: MakeRecorder = Recorder,
    clock: Callable[[], float] = time.perf_counter,
    sleep: Callable[[float], None] = time.sleep,
    attract: Iterable[Command] = (),
    bindings: Bindings = DEFAULT,
    presets: Presets | None = None,
    stream: Sender | None = None,
    ground: str | None = None,
    notes: Sequence[str] = (),
    character: Character | None = None,
    crowd: Crowd | None = None,
) -> LiveReport:
    """Runs until the user leaves or `seconds` of simulated time are over, in `window` or one that it opens.

    styles: the names to choose from. attract: commands that are played, over and over, until somebody touches a
    control. stream: where each frame is sent as it is made. ground: its name, or its map's path. notes: sentences that
    are shown at the start. character: who is steered in place of the figure. crowd: who else walks about. Raises
    NoDisplay or NoGL where no window can be had, ValueError or OSError where that is no ground; what goes wrong later
    is shown on screen."""
    presets = presets or Presets()
    with window or open_window() as window:
        live = Live(
            session, styles, window, recorder_factory, clock, attract, bindings, presets, stream, ground, character
        )
        if crowd:
            live.join(crowd)
        for note in notes:
            live.say(note, ALERT)
        if stream:
            live.say(f"streaming poses to {stream.address[0]}:{stream.address[1]} (VMC)")
        try:
            live.run(seconds, sleep)
        finally:
            capture.stop_recording(live)
    if stream:
        stream.report()
    if live.takes.busy:
        print("Finishing the export.", flush=True)
        if written := live.takes.finished(wait=True):
            live.files += written.files
            for problem in written.problems:
                warnings.warn(problem, stacklevel=2)
    return LiveReport(live.frames, live.pictures, live.missed, tuple(live.files))


class Live:
    """The state of a live run, which demo.live.actions, demo.live.capture and demo.live.overlay read and change.

    `do` carries out an action; keys that are only held are the devices' affair."""

    window: Window
    devices: Devices
    choice: StyleChoice
    view: View
    presets: Presets
    menu: Menu

    def __init__(
        self,
        session: Session[NamedStylizer],
        styles: Sequence[str],
        window: Window,
        recorder_factory: MakeRecorder = Recorder,
        clock: Callable[[], float] = time.perf_counter,
        attract: Iterable[Command] = (),
        bindings: Bindings = DEFAULT,
        presets: Presets | None = None,
        stream: Sender | None = None,
        ground: str | None = None,
        character: Character | None = None,
    ) -> None:
        self.session, self.window = session, window
        self.grounds = Grounds(session, ground)
        self.devices, self.view = Devices(bindings), View(Camera(distance=DISTANCE), ground=session.ground)
        self.choice = StyleChoice(styles)
        self.offer_styles(styles)
        self.naming: tuple[str, str] | None = None  # a style of the user's, and its new name as far as it is typed
        self.asked = "", 0.0  # what is done if it is asked for again until then (demo.live.confirm)
        self.crowd: Crowd | None = None  # who else walks about
        self.presets, self.preset = presets or Presets(), 0
        self.menu, self.hints, self.debug_overlay = Menu(bindings), Hints(bindings), DebugOverlay(session)
        self.seen = {"contacts"}  # of demo.live.actions.SEEN
        self.hidden = self.leaving = False
        self.helping = 0  # the page of the help that is open, from 1
        self.pace = True  # whether the styles of the legs set speed, stride and cadence
        self._attract, self._played = tuple(attract), 0
        # the next command of the attract mode, None once somebody took over
        self.playing = self._attract[0] if self._attract else None
        self.renderer = Renderer(window.size)
        self.load = Load(len(QUALITIES) - 1)
        self.recorder: Recorder | None = None
        self.takes = export_jobs.ExportJobs()
        self.stylizers = Stylizers(session)
        self.drop_import = DropImport(lambda: session.stylizer)
        self.inset, self.labels = Inset(), Labels()
        self.stream = stream
        self.files: list[Path] = []
        self.frames = self.pictures = self.missed = 0
        self.recorder_factory, self.clock, self.bindings = recorder_factory, clock, bindings
        self.frame: Frame | None = None
        self.toasts: list[tuple[float, str, Colour]] = []  # when it goes, text, colour
        self.inset_box: Pixels | None = None  # where the clip of a style is played
        self.figures = panels.Figures(FIGURES_SECONDS)
        self.picked_at = float("-inf")  # when a part was picked last, which lights it up
        self.own: DrawnCharacter | None = None  # the user's character, shown or not
        if character:
            self.dress(DrawnCharacter(character))
        self.type(False)

    @property
    def folder(self) -> Path:
        """Where recordings, exports and pictures go."""
        return Path.cwd()

    # ---- the loop -----------------------------------------------------------

    def run(self, seconds: float | None, sleep: Callable[[float], None]) -> None:
        """Each turn: events, the simulated frames that are due, one picture; then sleep until the next is due."""
        last = None if seconds is None else round(seconds * FPS)
        begun, said, self.toasts = self.clock(), self.toasts, []
        self.step()
        self.draw()  # the first picture is slow: drivers finish compiling with it, so the clock starts after
        self.toasts = [(until + self.clock() - begun, text, colour) for until, text, colour in said] + self.toasts
        gc.collect()
        gc.freeze()  # what the window is made of is here to stay: the collector need not walk it between two pictures
        due_at = self.clock() + FRAME_SECONDS
        while not self.leaving and (last is None or self.frames < last):
            events = take_events()
            for paths in self.drop_import.take(events):
                self.wake()
                self.say(f"{'learning' if is_clip(paths[0]) else 'reading'} {describe_file(paths)}")
            for action in self.devices.handle(events):  # one by one: each may change what the next key means
                self.do(action)
            now = self.clock()
            if now < due_at:
                sleep(due_at - now)
                continue
            due = int((now - due_at) / FRAME_SECONDS) + 1
            due_at += due * FRAME_SECONDS
            steps = min(due, MAX_CATCH_UP)
            self.missed += due - steps
            for _ in range(steps if last is None else min(steps, last - self.frames)):
                self.step()
            before = self.clock()
            self.draw()
            now = self.clock()
            if self.load.turn(now, due, steps, now - before):
                self.renderer.simplify(self.load.level)

    def step(self) -> None:
        """One simulated frame."""
        command = self._command()
        try:
            self.frame = self.session.step(command)
        except ValueError as error:  # a style that the bank refuses
            self.say(str(error), ALERT)
            capture.stop_recording(self)  # the controller has gone on, and the recording must not say that it has not
            self.playing, self.choice.style = None, worn(self.frame) if self.frame else StyleSpec()
            return
        recorder = self.recorder
        if recorder and not self.guard(lambda: recorder.write(command)):
            self.recorder = None
        if self.crowd:
            self.crowd.step(self.frame.styled)
        self.frames += 1
        self.takes.frames.append(self.frame)
        self.inset.step()
        if self.stream:
            self.stream.send(self.frame)
        self.debug_overlay.follow(self.frame)
        self.view.camera.orbit(*self.devices.take_camera())
        self.view.follow(self.frame, FRAME_SECONDS)

    def _command(self) -> Command:
        """What is asked for in the next frame: by a person, or by the recording that plays until there is one."""
        facing = float(self.frame.styled.root_facing) if self.frame else 0.0
        style = StyleSpec() if self.devices.holds("compare") else self.choice.style
        command = replace(self.devices.command(self.view.camera.yaw, facing, style, FRAME_SECONDS), pace=self.pace)
        if self.playing is None:
            return command
        if self._played and self._played % len(self._attract) == 0 and self.session.ground:
            self.start_over()  # only from there does a recording fit uneven ground
        self._played += 1
        playing, self.playing = self.playing, self._attract[self._played % len(self._attract)]
        self.view.camera.orbit(ATTRACT_ORBIT * FRAME_SECONDS, 0.0)
        return playing

    def draw(self) -> None:
        """One picture of the newest frame."""
        capture.show_written(self, self.takes.finished())
        capture.apply_learned(self)
        now = self.clock()
        self.toasts = [toast for toast in self.toasts if toast[0] > now]
        latency = self.session.latency
        frame_ms = latency.last_ms("frame") + (self.crowd.last_ms if self.crowd else 0.0)
        self.figures.tick(now, frame_ms, latency.last_ms("render"))
        with latency.stage("render"):
            overlay.look(self, now)
            self.paint()
        self.window.show()
        self.pictures += 1

    def paint(self) -> None:
        """Draws the newest frame and what lies over it, without showing it yet."""
        self.window.bind()
        if self.frame:  # there is none as long as the bank refuses what is asked
            self.renderer.draw(self.frame, self.view)
        if self.inset_box:
            self.inset.draw(self.window.size, self.inset_box)

    # ---- what actions do -----------------------------------------------------------

    def do(self, action: str) -> None:
        """Carries out an action of demo.live.actions."""
        self.hints.done(action)
        actions.do(self, action)

    def dress(self, own: DrawnCharacter | None) -> None:
        """Shows the user's character in place of the figure, or, for None, the figure."""
        self.own = own or self.own
        self.view.dress(own, self.frame)

    @property
    def shown(self) -> Character | None:
        """The character that is seen; None where it is the figure."""
        return self.view.character.character if self.view.character else None

    def join(self, crowd: Crowd) -> None:
        """Others walk about from now on."""
        self.crowd = crowd
        colours = np.array([part_colours(style) for style in crowd.styles])
        self.crowd_colours = colours + PALER * (np.array(OWN_STYLE) - colours)
        self.view.camera.stand_at(max(CROWD_DISTANCE * crowd.half, LEAST_CROWD_DISTANCE), CROWD_PITCH)

    def wake(self) -> None:
        """Somebody touched a control: the attract mode ends, and the character is theirs."""
        self.playing = None

    def start_over(self) -> None:
        """The character is back at the start point, and what was kept of its past is forgotten."""
        self.session.restart()
        self.takes.frames.clear()
        self.debug_overlay.forget()
        self.view.ground = self.session.ground
        if self.crowd:
            self.crowd.stand_on(self.session.ground)
        self.view.camera.jump(np.zeros(3), self.view.ground)

    def say(self, text: str, colour: Colour = INK) -> None:
        """Shows a sentence for as long as it takes to read."""
        self.toasts.append((self.clock() + max(TOAST_SECONDS, len(text) / READING_SPEED), text, colour))

    def glow(self) -> None:
        """The picked parts light up for a moment."""
        self.picked_at = self.clock()

    def offer_styles(self, styles: Sequence[str] | None = None) -> None:
        """These styles, or those that the stylizer has now, are there to choose from."""
        stylizer = self.session.stylizer
        self.choice.offer(stylizer.styles if styles is None else styles, stylizer.noncommercial, stylizer.users_own)

    def type(self, on: bool, naming: str | None = None) -> None:
        """Keys go to the search line, or to the new name of a style, or back to steering."""
        self.menu.open = False
        self.devices.mode = "typing" if on else ""
        self.naming = (naming, naming) if on and naming else None
        if on:
            pygame.key.start_text_input()
        else:
            pygame.key.stop_text_input()  # else the key that opens the search would also be typed into it
            self.choice.search = ""

    def guard(self, write: Callable[[], None]) -> bool:
        """Runs what writes a file, True if it could; where it fails the screen says so, and the character walks on."""
        try:
            write()
        except (OSError, pygame.error) as error:
            self.say(f"cannot write: {error}", ALERT)
            return False
        return True

    def resize(self) -> None:
        """Follows the window."""
        if self.window.follow_size():
            self.renderer.resize(self.window.size)
