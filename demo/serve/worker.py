"""A worker: a process that steps the sessions of some visitors, sixty times a second."""

import gc
import time
import traceback
from collections import deque
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Callable, Iterator

from demo import assemble
from demo.serve.options import A_WORKER, Options, own_folder
from demo.serve.page_state import TOLD_FRAMES
from demo.serve.visitor import Place, Visitor
from demo.state import characters
from demo.state.grounds import ground_of
from sim.command import Command, Commands
from sim.ground.catalogue import load_ground
from sim.io import recording
from sim.motion.clip import FPS
from sim.session import Frame
from stylizer.runtime.live import LiveStylizer

FRAME_SECONDS = 1 / FPS
PLACES = A_WORKER - 1  # in a crowd: the first to come moves alone
MAX_CATCH_UP = 2  # frames that one turn may make up for; a longer stop is counted, not raced after
MOST_MESSAGES = 200  # that are taken in a turn
REPORTED = 60 * FPS  # turns whose times are kept for a report


def run(connection: Connection, options: Options) -> None:
    """The process: begins, says that it is ready, and runs until the server is gone."""
    try:
        worker = Worker(connection, options)
        connection.send(("ready",))
        worker.run()
    except (EOFError, OSError, KeyboardInterrupt):
        return  # the server is gone, and with it whoever looked


class Worker:
    """Messages in: (kind, visitor, content), see `_take`. Messages out: ("frames", packets, texts), with pairs of a
    visitor and what goes to its page, and ("changed",) where styles or presets of all have."""

    def __init__(
        self, connection: Connection, options: Options, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._connection, self._options, self._clock = connection, options, clock
        self._base = assemble.build_session(options.stylizer)
        bundled = recording.read(assemble.BUNDLED_RECORDING)
        own_ground = ground_of(bundled, assemble.BUNDLED_RECORDING.parent)
        self._ground = options.ground if options.ground is not None else own_ground
        self._attract = tuple(bundled)
        self._visitors: dict[int, Visitor] = {}
        # Characters that stand where those before left them until somebody comes: so many side by side take the time of
        # two that move alone. Who is first, or has to start over, moves alone.
        self._crowd = self._base.crowd(PLACES)
        self._crowd.stand_on(load_ground(self._ground))
        self._character = characters.kept() if options.character else None
        self.missed = 0  # frames that were not made, because those before took too long
        self._turns: deque[tuple[float, float]] = deque(maxlen=REPORTED)  # seconds of a frame, and of processor in it
        gc.collect()
        gc.freeze()

    def run(self) -> None:
        """Each turn: messages until the next frame is due, then one frame of every visitor. Raises EOFError when the
        server is gone."""
        due_at = self._clock()
        while True:
            if not self._awake():
                self._take(*self._connection.recv())
                due_at = self._clock()
                continue
            taken = 0  # those that wait are taken even where the next frame is late
            while taken < MOST_MESSAGES and self._connection.poll(max(due_at - self._clock(), 0.0)):
                self._take(*self._connection.recv())
                taken += 1
            due = int((self._clock() - due_at) / FRAME_SECONDS) + 1
            due_at += due * FRAME_SECONDS
            self.missed += max(due - MAX_CATCH_UP, 0)
            self.turn(min(due, MAX_CATCH_UP))

    def turn(self, frames: int = 1) -> None:
        """So many frames of every visitor, and what its page gets of them."""
        start, worked = self._clock(), time.process_time()
        packets, texts = [], []
        for _ in range(frames):
            self._step_crowd()
        for number, visitor in list(self._awake().items()):
            with self._alone(number):
                for _ in range(frames if visitor.place is None else 0):
                    visitor.step()
                if visitor.frames % TOLD_FRAMES < frames:
                    if model := visitor.model():
                        self._connection.send(("model", number, model))
                    texts += [(number, text) for text in visitor.told()]
                if block := visitor.packet():
                    packets.append((number, block))
        self._connection.send(("frames", packets, texts))
        self._turns.append(((self._clock() - start) / frames, (time.process_time() - worked) / frames))
        self._pass_on_changes()

    def _step_crowd(self) -> None:
        """One frame of those who move side by side, if there is anybody."""
        members = {visitor.place[1]: visitor for visitor in self._awake().values() if visitor.place}
        if not members:
            return
        commands = [members[slot].command() if slot in members else Command() for slot in range(PLACES)]
        try:
            frame = self._crowd.step(Commands(commands))
        except ValueError:  # somebody's style is refused: whose, and then on without it
            for slot, visitor in members.items():
                try:
                    for name in commands[slot].style.names:
                        self._base.stylizer.movements(name)
                except ValueError as error:
                    visitor.refuse(error)
            return
        for slot, visitor in members.items():
            visitor.follow(Frame(commands[slot], frame.neutral[slot], frame.styled[slot]))

    def _free_place(self) -> Place | None:
        """A place in the crowd; None for who is the first, and where styles are drawn for each by chance."""
        taken = {visitor.place[1] for visitor in self._visitors.values() if visitor.place}
        free = next((slot for slot in range(PLACES) if slot not in taken), None)
        if not self._visitors or free is None or self._base.stylizer.seed is not None:
            return None
        return self._crowd, free

    def _pass_on_changes(self) -> None:
        """The other workers read styles and presets anew."""
        changed = [visitor for visitor in self._visitors.values() if visitor.changed]
        for visitor in changed:
            visitor.changed = False
        if changed:
            self._connection.send(("changed",))

    def _awake(self) -> dict[int, Visitor]:
        """Those whose page is looked at."""
        return {number: visitor for number, visitor in self._visitors.items() if not visitor.asleep}

    def _take(self, kind: str, number: int, content: Any = None) -> None:
        visitor = self._visitors.get(number)
        if kind == "join":
            session = assemble.another_session(self._base)
            self._visitors[number] = Visitor(
                session, self._ground, self._attract, own_folder, self._free_place(), self._character
            )
        elif kind == "stop":
            for each in self._visitors.values():
                each.close()
            raise EOFError
        elif kind == "refresh":
            assert isinstance(self._base.stylizer, LiveStylizer)
            self._base.stylizer.bank.refresh()
            for each in self._visitors.values():
                each.refresh()
        elif kind == "report":
            self._connection.send(("report", number, list(self._turns), self.missed))
            self._turns.clear()
        elif visitor and kind == "leave":
            self._visitors.pop(number).close()
        elif visitor:
            with self._alone(number):
                if kind == "drop":
                    visitor.drop([Path(path) for path in content])
                else:
                    visitor.take(content)
                self._connection.send(("frames", [], [(number, text) for text in visitor.told()]))
            self._pass_on_changes()

    @contextmanager
    def _alone(self, number: int) -> Iterator[None]:
        """A mistake of ours ends the visitor whom it befalls, and nobody else."""
        try:
            yield
        except (OSError, EOFError):
            raise
        except Exception:
            traceback.print_exc()
            self._visitors.pop(number).close()
            self._connection.send(("end", number))
