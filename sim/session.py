"""One frame of Patchwalk, from the command to the pose on the screen: window, replay, tests and export call `Session.step`."""

from dataclasses import dataclass
from typing import Mapping, Protocol, Sequence

import numpy as np

from sim.command import Command, Commands
from sim.foot_lock import FootLock
from sim.latency import Latency
from sim.pose import Pose
from sim.ring_buffer import RingBuffer
from sim.worn import Worn


class Controller(Protocol):
    """Turns the player's wish into neutral motion, one 60 Hz frame a call."""

    def step(self, command: Command | Commands) -> Pose: ...

    def restart(self) -> None:
        """Back to before the first step: the same commands give the same poses again, bit for bit."""

    def crowd(self, count: int) -> "Controller":
        """One that moves so many characters by one step of `Commands`: its poses have a leading axis."""


class Stylizer(Protocol):
    """Restyles the newest frame of a half-second window."""

    def step(self, window: np.ndarray, neutral: Pose, style: Mapping[str, Worn] | Sequence[Mapping[str, Worn]]) -> Pose:
        """window: features (16, 21, 15) ending with `neutral`; style: part -> what it wears (sim.worn).
        Raises ValueError for a style that the bank does not hold."""

    def restart(self) -> None:
        """Back to before the first step, as a Controller's."""

    def crowd(self, count: int) -> "Stylizer":
        """One for so many characters: windows and poses with a leading axis, a style for each."""


@dataclass(frozen=True)
class Frame:
    """What one step made: the command it answered, the neutral pose and the styled pose that is drawn; a crowd's poses have a
    leading axis of characters."""

    command: Command | Commands
    neutral: Pose
    styled: Pose


class Session:
    """The whole line but its two ends. A step is 1/60 s of simulated time, always; no clock is read inside."""

    def __init__(self, controller: Controller, stylizer: Stylizer, latency: Latency | None = None) -> None:
        self.controller = controller
        self.stylizer = stylizer
        self.latency = latency or Latency()
        self.history, self.foot_lock = RingBuffer(), FootLock()

    def restart(self) -> None:
        """Back to standing at the start point, as a new session would with the same models, and at once.

        A recording that begins here replays to the same poses; the latency report runs on."""
        self.controller.restart()
        self.stylizer.restart()
        self.history, self.foot_lock = RingBuffer(), FootLock()

    def crowd(self, count: int) -> "Session":
        """So many characters with the same models, standing at the start point, all moved by one step of `Commands`.

        Each moves as it would alone, for a fraction of what it would cost: the networks are asked for many at once."""
        return Session(self.controller.crowd(count), self.stylizer.crowd(count))

    def step(self, command: Command | Commands) -> Frame:
        """command -> controller -> ring buffer -> stylizer -> foot lock -> frame."""
        stage = self.latency.stage
        with stage("frame"):
            with stage("controller"):
                neutral = self.controller.step(command)
            with stage("features"):
                self.history.push(neutral)
                window = self.history.window()
            with stage("stylizer"):
                styled = self.stylizer.step(window, neutral, command.style)
            with stage("foot_lock"):
                styled = self.foot_lock.step(styled, neutral)
        return Frame(command, neutral, styled)
