"""The workers of a server: who steps which visitor, and what goes to and fro between them."""

import asyncio
import itertools
import multiprocessing
import threading
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any, Callable, NamedTuple

from demo.serve.options import A_WORKER, Options


class Model(NamedTuple):
    """The packed model of a visitor's character, which its page fetches."""

    content: bytes


Message = bytes | str | Model | None  # what goes to a page: a frame, a text, a model; None: the worker is gone
Deliver = Callable[[Message], None]


def _work(connection: Connection, options: Options) -> None:
    """A worker's process; the server's own has no use for networks."""
    from demo.serve.worker import run

    run(connection, options)


@dataclass(eq=False)
class _Hand:
    """A worker as the server sees it."""

    process: SpawnProcess
    connection: Connection
    ready: asyncio.Event = field(default_factory=asyncio.Event)
    visitors: dict[int, Deliver] = field(default_factory=dict)


class Pool:
    """So many workers that each has A_WORKER visitors at most."""

    def __init__(self, visitors: int, options: Options) -> None:
        self.room = visitors
        self._options = options
        self._hands: list[_Hand] = []
        self._numbers = itertools.count(1)
        self._reports: asyncio.Queue[list[Any]] = asyncio.Queue()

    async def start(self) -> None:
        """Starts the workers; returns when the first is ready. Raises RuntimeError where it does not get so far."""
        self._loop = asyncio.get_running_loop()
        self._hands = [self._begin() for _ in range(-(-self.room // A_WORKER))]
        await self._hands[0].ready.wait()
        if not self._hands[0].process.is_alive():
            raise RuntimeError("the process that moves the characters ended while it started")

    def stop(self) -> None:
        """Ends the workers; recordings that run are ended first."""
        hands, self._hands = self._hands, []
        for hand in hands:
            self._send(hand, "stop", 0)
        for hand in hands:
            hand.process.join(10)
            hand.process.kill()

    @property
    def count(self) -> int:
        """Visitors now."""
        return sum(len(hand.visitors) for hand in self._hands)

    async def join(self, deliver: Deliver) -> int | None:
        """A visitor, whom a worker with the fewest takes on: their number, None where there is no room."""
        if self.count >= self.room:
            return None
        hand = min((hand for hand in self._hands if hand.process.is_alive()), key=lambda hand: len(hand.visitors))
        number = next(self._numbers)
        hand.visitors[number] = deliver
        await hand.ready.wait()
        self._send(hand, "join", number)
        return number

    def leave(self, number: int) -> None:
        """The visitor's page is gone."""
        if hand := self._hand_of(number):
            del hand.visitors[number]
            self._send(hand, "leave", number)

    def say(self, kind: str, number: int, content: object) -> None:
        """Passes on what the visitor's page said or dropped."""
        if hand := self._hand_of(number):
            self._send(hand, kind, number, content)

    async def report(self) -> list[list[Any]]:
        """Of each worker: how many seconds each frame of all its visitors took since it was last asked, and how many of
        them its processor worked; and the frames missed so far."""
        for hand in self._hands:
            self._send(hand, "report", 0)
        return [await self._reports.get() for _ in self._hands]

    def _hand_of(self, number: int) -> _Hand | None:
        return next((hand for hand in self._hands if number in hand.visitors), None)

    def _begin(self) -> _Hand:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs, self._options))
        process.start()
        theirs.close()
        hand = _Hand(process, ours)
        threading.Thread(target=self._listen, args=(hand,), daemon=True).start()
        return hand

    def _send(self, hand: _Hand, *message: object) -> None:
        try:
            hand.connection.send(message)
        except OSError:
            pass  # it is gone, which `_listen` says

    def _listen(self, hand: _Hand) -> None:
        """In a thread of its own: passes on what a worker says."""
        try:
            while True:
                self._loop.call_soon_threadsafe(self._take, hand, *hand.connection.recv())
        except (EOFError, OSError, RuntimeError):  # the last where the loop has ended
            if not self._loop.is_closed():
                self._loop.call_soon_threadsafe(self._end, hand)

    def _take(self, hand: _Hand, kind: str, *content: Any) -> None:
        if kind == "ready":
            hand.ready.set()
        elif kind == "frames":
            for messages in content:
                for number, message in messages:
                    if number in hand.visitors:
                        hand.visitors[number](message)
        elif kind == "model":
            if deliver := hand.visitors.get(content[0]):
                deliver(Model(content[1]))
        elif kind == "end":
            if deliver := hand.visitors.pop(content[0], None):
                deliver(None)
        elif kind == "changed":
            for each in self._hands:
                self._send(each, "refresh", 0)
        elif kind == "report":
            self._reports.put_nowait(list(content[1:]))

    def _end(self, hand: _Hand) -> None:
        """A worker has ended: its visitors are told, and another takes its place."""
        hand.ready.set()
        visitors, hand.visitors = hand.visitors, {}
        for deliver in visitors.values():
            deliver(None)
        if hand in self._hands and visitors:
            self._hands[self._hands.index(hand)] = self._begin()
