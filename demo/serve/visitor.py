"""One visitor: a session of its own, what is chosen and held, and what is said to the page. It takes the actions of
demo.live.actions that need no window, as the window does."""

import shutil
import time
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Callable, Iterator, Mapping, Sequence, cast

from demo.export import export_jobs
from demo.figure.character_model import DrawnCharacter
from demo.figure.colours import worn
from demo.live import actions, capture, users_styles
from demo.live.drop_import import DropImport
from demo.render.view import View
from demo.serve import packet, recordings
from demo.serve.options import DROP
from demo.serve.packing import Packed, Packing
from demo.serve.page_state import PageMessages
from demo.serve.remote_input import PRESSED, RemoteInput
from demo.state.grounds import Grounds
from demo.state.presets import Presets
from demo.state.style_choice import StyleChoice
from demo.state.stylizers import Stylizers
from demo.ui.canvas import ALERT, INK, Colour
from sim.character.character import Character
from sim.command import Command
from sim.ground.catalogue import FLAT
from sim.io.recording import Recorder
from sim.motion.clip import FPS
from sim.protocols import NamedStylizer
from sim.session import Frame, Session
from sim.style_spec import StyleSpec

if TYPE_CHECKING:
    from demo.live.live import Live

DONE = (  # the actions of demo.live.actions that a page may ask for
    "pick part_previous part_next style_previous style_next choose weaker stronger strength share blend pace own_style "
    "reset character stylizer_next reroll random ground preset save preset_next twin skeleton trajectory contacts "
    "onion phase attention times rename remove record"
).split()
ALONE = frozenset({"stylizer_next", "reroll"})  # what one of a crowd cannot have for itself
EXPORTED = ("bvh", "glb", "poses")  # no video: the page draws, not this machine
Place = tuple[Session[Any], int]  # a crowd, and who of it
WAKING = frozenset({*PRESSED, *DONE, "export", "replay"})


class Visitor:
    """What demo.live.live.Live is to the window, to one page. `take` what the page says, `step` once a frame, and send
    what `packet` and `told` give."""

    def __init__(
        self,
        session: Session[NamedStylizer],
        ground: str | None,
        attract: Sequence[Command],
        folder: Callable[[], Path],
        place: Place | None = None,
        character: Character | None = None,
    ) -> None:
        """session: one that has not been stepped. place: in a crowd, as one of whom the character moves until it has to
        start over; None to move alone from the beginning. attract: commands that are played, over and over, until
        somebody touches a control. folder: gives where its recordings and exports go. character: who is steered in
        place of the figure."""
        self.session, self.place = session, place
        self.grounds = Grounds(session, ground)
        self.devices, self.view = RemoteInput(), View()
        self.view.ground = session.ground
        self.choice = StyleChoice(())
        self.offer_styles()
        self.presets, self.preset = Presets(), 0
        self.stylizers, self.takes = Stylizers(session), export_jobs.ExportJobs()
        self.drop_import = DropImport(lambda: session.stylizer)
        self.inset = SimpleNamespace(play=lambda clip, name: None)
        self.own: DrawnCharacter | None = None  # the user's character, shown or not
        self._packing = Packing()
        self.seen = {"contacts"}
        self.clock = time.monotonic
        self.pace = True
        self.asked = "", 0.0  # what is done if it is asked for again until then (demo.live.confirm)
        self.asleep = False  # whether nobody looks at the page: then nothing moves
        self.recorder: Recorder | None = None
        self.recorder_factory = Recorder
        self.files: list[Path] = []  # written and not yet told of
        self.frame: Frame | None = None
        self.frames = 0
        self.changed = False  # whether what all visitors share has changed: styles and presets on the disk
        self.recorded: Path | None = None  # the recording that was made last
        # the commands that are played, None while somebody steers; and whether once, as a recording that is replayed
        self.playing: Iterator[Command] | None = self._attract(attract) if attract else None
        self.replaying = False
        self._folder = folder
        self._drops: set[Path] = set()  # folders of dropped files
        self._messages = PageMessages()
        if character:
            self._packing.begin(character)

    @property
    def folder(self) -> Path:
        """Where recordings and exports go; it is there."""
        return self._folder()

    # ---- what the page says ----------------------------------------------------

    def take(self, said: Mapping[str, Any]) -> None:
        """Takes in a message of the page."""
        if "hidden" in said:
            self.asleep = bool(said["hidden"])
            self.devices.let_go()
        elif "do" in said:
            self.do(str(said["do"])[:200])
        else:
            try:
                if self.devices.take(said):
                    self.wake()
            except ValueError as error:
                self.say(str(error), ALERT)

    def do(self, action: str) -> None:
        """Carries out an action."""
        name, _ = actions.parse(action)
        if name not in WAKING:
            return
        self.wake()
        if name in PRESSED:
            self.devices.press(name)
        elif name == "export":
            self._export()
        elif name == "replay":
            last = self.recorded
            self._try(lambda: self._replay(last)) if last else self.say("nothing has been recorded yet")
        elif name == "rename":
            self._try(lambda: users_styles.rename(self._live, action.partition(":")[2]))
        else:
            if name == "save":
                self.presets, self.changed = Presets(), True  # another page may have saved one
            if name in ALONE:
                self.place = None
            self._try(lambda: actions.do(self._live, action))

    def _try(self, act: Callable[[], None]) -> None:
        """Does what a page asks for; where it cannot be, the page says why."""
        try:
            act()
        except (ValueError, OSError) as error:
            self.say(str(error), ALERT)

    def drop(self, paths: Sequence[Path]) -> None:
        """Learns a style of files, or plays a recording."""
        self.wake()
        self._drops |= {path.parent for path in paths if path.parent.name.startswith(DROP)}
        if len(paths) != 1 or paths[0].suffix != ".jsonl":
            self.drop_import.learn(paths)
        else:
            self._try(lambda: self._replay(paths[0]))

    def refresh(self) -> None:
        """Styles or presets on the disk have changed."""
        self.presets = Presets()
        self.offer_styles()

    # ---- what actions call, as of a Live -----------------------------------------

    @property
    def _live(self) -> "Live":
        return cast("Live", self)  # as far as DONE and demo.live.capture need one

    def wake(self) -> None:
        """Somebody touched a control: the character is theirs."""
        if self.replaying:
            assert self.frame
            self.choice.style = worn(self.frame)
        self.playing, self.replaying = None, False

    def say(self, text: str, colour: Colour = INK) -> None:
        """Shows a sentence on the page."""
        self._messages.add(say=text, alert=colour != INK)

    def glow(self) -> None:
        """The page lights the picked parts by itself."""

    def start_over(self) -> None:
        """The character is back at the start point, and alone from now on: a replay makes the very poses of a session
        of one character, and those of a crowd up to rounding alone."""
        self.place = None
        self.session.restart()
        self.takes.frames.clear()
        self.view.ground = self.session.ground

    def offer_styles(self) -> None:
        """The list is that of the stylizer in use."""
        stylizer = self.session.stylizer
        self.choice.offer(stylizer.styles, stylizer.noncommercial, stylizer.users_own)

    def dress(self, own: DrawnCharacter | None) -> None:
        """Shows the user's character in place of the figure, as soon as its model is packed for the page; for None the
        figure."""
        self.own = own or self.own
        self.view.dress(None)
        self._packing.drop()
        if own:
            self._packing.begin(own)

    def model(self) -> bytes | None:
        """The model of a character that the page shows from now on, once."""
        result = self._packing.finished()
        if isinstance(result, Packed):
            self.own = result.drawn
            self.view.dress(self.own, self.frame)
            return result.model
        if result:
            self.say(result, ALERT)
        return None

    @property
    def shown(self) -> Character | None:
        """The character that is seen; None where it is the figure."""
        return self.view.character.character if self.view.character else None

    def guard(self, write: Callable[[], None]) -> bool:
        """Runs what writes a file, True if it could; else the page says why."""
        try:
            write()
        except OSError as error:
            self.say(f"cannot write: {error}")
            return False
        return True

    def _export(self) -> None:
        """Begins to write the last ten seconds."""
        if self.takes.busy:
            self.say("the last export is still being written")
        elif self.takes.frames:
            stem = capture.new_file(self.folder, *export_jobs.ENDINGS).with_suffix("")
            self.takes.export(stem, self.session.ground, self.shown, EXPORTED)
            self.say(f"exporting the last {len(self.takes.frames) / FPS:.1f} s as BVH, glTF and poses")

    # ---- a frame ------------------------------------------------------------------

    def step(self) -> None:
        """One simulated frame of a character that moves alone."""
        command = self.command()
        try:
            self.follow(self.session.step(command))
        except ValueError as error:
            self.refuse(error)

    def refuse(self, error: ValueError) -> None:
        """The bank refuses a style that is asked for."""
        self.say(str(error), ALERT)
        capture.stop_recording(self._live)
        self.wake()
        self.choice.style = worn(self.frame) if self.frame else StyleSpec()

    def follow(self, frame: Frame) -> None:
        """Takes in the frame that was made of the last command."""
        self.frame = frame
        command, recorder = frame.command, self.recorder
        assert isinstance(command, Command)
        if recorder and not self.guard(lambda: recorder.write(command)):
            self.recorder = None
        self.frames += 1
        self.takes.frames.append(self.frame)
        if self.view.character:
            self.view.character.follow(frame.styled, self.session.ground)

    def command(self) -> Command:
        """What is asked for in the next frame."""
        facing = float(self.frame.styled.root_facing) if self.frame else 0.0
        played = None if self.playing is None else next(self.playing, None)
        if self.playing is not None and played is None:
            self.wake()
            self.say("the recording is over: steer on")
        return played or self.devices.command(facing, self.choice.style, self.pace, 1 / FPS)

    def _attract(self, commands: Sequence[Command]) -> Iterator[Command]:
        """The commands, over and over: on uneven ground from the start point, for which they were recorded."""
        while True:
            yield from commands
            if self.session.ground and self.place is None:
                self.start_over()

    def _replay(self, path: Path) -> None:
        """Plays a recording from the start point, as `patchwalk replay` does. Raises ValueError or OSError for a file
        that is none, or was made with something else than is here."""
        recorded = recordings.read_for(path, self.session.stylizer)
        self.grounds.go_to(recorded.ground or FLAT)
        if recorded.seed:
            self.session.stylizer.resample(recorded.seed)
        self.start_over()
        self.playing, self.replaying = iter(recorded), True
        self.say(f"replaying {path.name}, {len(recorded) / FPS:.1f} s")

    def packet(self) -> bytes | None:
        """The newest frame, as the page reads it."""
        if self.frame is None:
            return None
        session, which = self.place or (self.session, ...)
        trajectory = session.controller.trajectory if "trajectory" in self.seen else None
        paths = None if trajectory is None else (trajectory.desired[which][:, :2], trajectory.predicted[which][:, :2])
        return packet.pack(
            self.frame,
            self.frames,
            self.devices.answers,
            session.latency,
            self.playing is not None,
            bool(self.view.twin),
            paths,
            self.session.ground,
            self._packing.pose(self.view.character, self.frame.styled.root_position),
        )

    def close(self) -> None:
        """The page is gone: a recording ends, whole, and what was dropped goes."""
        capture.stop_recording(self._live)
        for folder in self._drops:
            shutil.rmtree(folder, ignore_errors=True)

    # ---- what the page is told ------------------------------------------------------

    def told(self) -> list[str]:
        """Messages (JSON) for the page: what has changed since the last call."""
        before = self.choice.styles
        capture.apply_learned(self._live)
        self.changed |= self.choice.styles != before
        if written := self.takes.finished():
            self.files += written.files
            for problem in written.problems:
                self.say(problem)
        if self.recorder is None:
            for path in self.files:
                self._messages.add(file=path.name)
            self.recorded = next((path for path in self.files if path.suffix == ".jsonl"), self.recorded)
            self.files.clear()
        return self._messages.take(self)
