"""One frame of Patchwalk, from the command to the pose on the screen: window, replay, tests and export call
`Session.step`."""

from dataclasses import dataclass
from typing import Generic, NoReturn, TypeVar

import numpy as np

from sim.body.pose import Pose
from sim.command import Command, Commands
from sim.feet.foot_lock import FootLock
from sim.ground.ground import Ground
from sim.hands.hand_clearance import HandClearance
from sim.latency import Latency
from sim.motion.feature_window import RingBuffer
from sim.motion.playback_pace import OWN_PACE, Pace, PaceFollower
from sim.protocols import Controller, Stylizer

S = TypeVar("S", bound=Stylizer)


@dataclass(frozen=True)
class Frame:
    """What one step made: the command it answered, the neutral pose and the styled pose that is drawn; a crowd's poses
    have a leading axis of characters."""

    command: Command | Commands
    neutral: Pose
    styled: Pose


def check_own_style(own_of: str | None, controller: str | None) -> None:
    """Raises ValueError where the own style, which is taken off the live motion, is that of another controller than the
    one that runs: fingerprints of weights, None for one that does not say."""
    if own_of is not None and controller is not None and own_of != controller:
        raise ValueError(
            "the own style was captured from another controller than the one that runs: "
            "run 'patchwalk styles capture' to capture it again, or reinstall Patchwalk"
        )


def _checked(ground: Ground | None) -> Ground | None:
    if not isinstance(ground, Ground | None):
        raise ValueError(f"{ground!r:.40} is no ground: make one with load_ground")
    return ground


class Session(Generic[S]):
    """The whole line but its two ends. A step is 1/60 s of simulated time, always; no clock is read inside."""

    def __init__(
        self, controller: Controller, stylizer: S, latency: Latency | None = None, ground: Ground | None = None
    ) -> None:
        """ground: what the character walks on, None for level floor. Raises ValueError where the stylizer's own style
        is that of another controller."""
        self.controller = controller
        self.stylizer = stylizer
        self.latency = latency or Latency()
        self.characters = 0  # of a crowd; 0 for one who is stepped alone
        self.healed = 0  # frames that were not finite, of which the neutral pose is shown
        self.ground = _checked(ground)
        controller.stand_on(ground)
        self._begin()

    def stand_on(self, ground: Ground | None) -> None:
        """Starts again on another ground; None for level floor. Raises ValueError for what is no ground."""
        self.ground = _checked(ground)
        self.controller.stand_on(ground)
        self.restart()

    def _begin(self) -> None:
        self.history, self.pace = RingBuffer(), PaceFollower()
        self.foot_lock, self.hand_clearance = FootLock(self.ground), HandClearance()

    @property
    def stylizer(self) -> S:
        """What restyles the motion; another one that is set goes on from the next frame."""
        return self._stylizer

    @stylizer.setter
    def stylizer(self, stylizer: S) -> None:
        check_own_style(stylizer.own_of, self.controller.fingerprint)
        self._stylizer = stylizer

    def restart(self) -> None:
        """Back to standing at the start point, as a new session would with the same models, and at once.

        A recording that begins here replays to the same poses; the latency report runs on."""
        self.controller.restart()
        self.stylizer.restart()
        self._begin()

    def crowd(self, count: int) -> "Session[Stylizer]":
        """So many characters with the same models, standing at the start point, all moved by one step of `Commands`.

        Each moves as it would alone, up to rounding, for a fraction of what it would cost: the networks are asked for
        many at once. Of a stylizer that is not evaluated in every frame (`--stylizer slim`, unpaired, diverse, latent)
        some are evaluated in this frame and some in the next, and a restyled limb differs by a few centimetres while
        the character changes its speed.
        Raises ValueError for less than one, and where this is a crowd already."""
        if self.characters:
            raise ValueError("this is a crowd already: make another from the session of one character")
        if not isinstance(count, int | np.integer) or isinstance(count, bool) or count < 1:
            raise ValueError(f"a crowd of {count!r:.40}: give a whole number from 1 on")
        crowd: Session[Stylizer] = Session(self.controller.crowd(count), self.stylizer.crowd(count), ground=self.ground)
        crowd.characters = int(count)
        return crowd

    def step(self, command: Command | Commands) -> Frame:
        """command -> controller -> ring buffer -> stylizer -> foot lock, hand clearance -> frame.

        Raises ValueError for a style that the stylizer does not hold, and where a crowd is not given one command for
        each."""
        self._check_count(command)
        stage = self.latency.stage
        with stage("frame"):
            with stage("controller"):
                pace = self._pace(command)
                neutral = self._next_neutral(command, pace)
            with stage("features"):
                self.history.push(neutral, pace)
                window = self.history.window()
            with stage("stylizer"):
                styled = self.stylizer.step(window, neutral, command.style, pace.travel)
            with stage("foot_lock"):
                if styled.is_finite():
                    styled = self.foot_lock.step(styled, neutral, self.stylizer.leg_strengths(), command.pace)
                    styled = self.hand_clearance.step(styled)
            if not styled.is_finite():
                styled = self._heal(neutral)
        return Frame(command, neutral, styled)

    def _check_count(self, command: Command | Commands) -> None:
        given = len(command.each) if isinstance(command, Commands) else 0
        if given != self.characters:
            wanted = f"Commands of {self.characters}" if self.characters else "a Command"
            raise ValueError(
                f"a session of {self.characters or 'one'} takes {wanted}, but was given "
                + (f"Commands of {given}" if given else "a Command")
            )

    def _next_neutral(self, command: Command | Commands, pace: Pace) -> Pose:
        """The controller's next pose. Raises ValueError where it cannot go on (see `_put_back`)."""
        try:
            return self.controller.step(command, pace)
        except FloatingPointError:
            self._put_back()

    def _put_back(self) -> NoReturn:
        """Starts again where the controller gives nothing to go on from. Raises ValueError saying so."""
        self.healed += 1
        self.restart()
        raise ValueError(
            "the controller's motion is not finite: it was put back at the start; reinstall Patchwalk"
        ) from None

    def _heal(self, neutral: Pose) -> Pose:
        """In place of a styled pose that is not finite: the neutral one, with styling begun anew.

        Raises ValueError where the neutral pose itself is not finite; the session has then been restarted."""
        if not neutral.is_finite():
            self._put_back()
        self.healed += 1
        self.stylizer.restart()
        self._begin()
        return neutral

    def _pace(self, command: Command | Commands) -> Pace:
        """The pace of this frame. The root goes as far as the strides of the last frame carry it; where the command
        leaves the pace to the styles of the legs, at their speed and playback rate, and otherwise at the speed that is
        asked for."""
        stride = self.foot_lock.stride.scale
        speed, rate = self.stylizer.pace(command.gaits)
        pace = Pace(
            *self.pace.step(np.where(command.pace, speed, 1 / stride), np.where(command.pace, rate, 1.0)), stride
        )
        return OWN_PACE if all(np.equal(value, 1).all() for value in pace) else pace
