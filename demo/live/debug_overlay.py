"""What can be seen inside a session: its trajectory, the last half second, phase, attention, times. Nothing is
changed."""

from collections import deque
from typing import Callable

import numpy as np

from demo.figure.colours import PAST, PATHS
from demo.render.view import Paths
from demo.state.style_choice import StyleChoice
from demo.ui import panels
from demo.ui.hud import Panel
from sim.body.pose import Pose
from sim.motion.feature_window import SPAN
from sim.protocols import NamedStylizer
from sim.session import Frame, Session

GHOSTS = 5  # poses of the half second that are drawn
LOOK_FRAMES = 6  # times and attention are looked at in one of so many frames: both cost more than to draw them again


class DebugOverlay:
    """Reads a session beside its frames; what a stand-in does not have is simply not shown."""

    def __init__(self, session: Session[NamedStylizer]) -> None:
        self._session = session
        self._frames: deque[Frame] = deque(maxlen=SPAN)
        self._looks: dict[str, tuple[tuple, Panel]] = {}  # panel by name: when and at what it was looked, what was seen
        self._count = 0

    def follow(self, frame: Frame) -> None:
        """Takes in the newest frame."""
        self._frames.append(frame)
        self._count += 1

    def forget(self) -> None:
        """The character starts anew: its past is not this one's."""
        self._frames.clear()

    def paths(self) -> Paths | None:
        """The root's way; None for a controller that plans none."""
        trajectory = self._session.controller.trajectory
        if trajectory is None:
            return None
        return Paths(trajectory.past_positions[::4], trajectory.desired[:, :2], trajectory.predicted[:, :2])

    def past(self) -> tuple[Pose, ...]:
        """Neutral poses of the half second that the stylizer is given, the oldest first; none is newer than now."""
        step = SPAN // GHOSTS
        return tuple(frame.neutral for frame in list(self._frames)[: -step // 2 : step])

    def panels(self, seen: set[str], choice: StyleChoice) -> list[Panel]:
        """Those that are wanted."""
        part = choice.parts[0]
        spec = choice.style.get(part)
        shown = []
        colours = {**(PATHS if "trajectory" in seen else {}), **({"last half second": PAST} if "onion" in seen else {})}
        if colours:
            shown.append(panels.legend(colours))
        if "times" in seen:
            shown.append(self._look("times", (), lambda: panels.times(self._session.latency)))
        if "phase" in seen and self._frames:
            shown.append(panels.dial(self._frames[-1].neutral))
        if "attention" in seen:
            shown.append(
                self._look("attention", (part, spec), lambda: panels.attention(self._attend(part), part, spec))
            )
        return shown

    def _look(self, name: str, at: tuple, make: Callable[[], Panel]) -> Panel:
        """The panel as it was made last, made anew in every LOOK_FRAMES-th frame and when `at` changes."""
        when = (self._count // LOOK_FRAMES, *at)
        if name not in self._looks or self._looks[name][0] != when:
            self._looks[name] = when, make()
        return self._looks[name][1]

    def _attend(self, part: str) -> np.ndarray | str:
        """The part's attention map, or why there is none."""
        try:
            return self._session.stylizer.attention(self._session.history.window(), part)
        except ValueError as error:
            return str(error)
