"""A jump: when it takes off, how high it carries the root over the ground, when it has landed."""

import numpy as np

from controller.model.gait_phase import flight_lift, jump_weight
from sim.motion.clip import FPS

ANTICIPATION = 0.3  # seconds from the press to the take-off, in which the body gathers itself
FLIGHT = 0.64  # seconds in the air: gravity's parabola lifts the root by 50 cm, the hips rise by some 35
RECOVERY = 0.25  # seconds after the landing before the next jump begins
NEVER = -1e3  # seconds to a take-off that is not in sight
DT = 1 / FPS


class Jump:
    """One jump at a time. Any leading axes, of a crowd.

    A press while one is under way is kept, and answered once it is over."""

    STATE = "time", "waiting"

    def __init__(self, crowd: tuple[int, ...] = ()) -> None:
        self.time = np.full(crowd, NEVER)  # seconds since the take-off, negative before it
        self.waiting = np.zeros(crowd, bool)  # a press that is not answered yet

    def press(self, pressed: np.ndarray | bool) -> None:
        """Takes this frame's button (...)."""
        self.waiting = self.waiting | pressed
        free = (self.time == NEVER) | (self.time > FLIGHT + RECOVERY)
        begins = self.waiting & free
        self.time = np.where(begins, -ANTICIPATION, self.time)
        self.waiting = self.waiting & ~begins

    def advance(self) -> None:
        """Lets a frame pass."""
        over = self.time > FLIGHT + 1.0
        self.time = np.where((self.time == NEVER) | over, NEVER, self.time + DT)

    @property
    def airborne(self) -> np.ndarray:
        """(...) whether it flies, and no command can reach it."""
        return (self.time > DT / 2) & (self.time < FLIGHT)  # not by rounding does it take off a frame later

    @property
    def under_way(self) -> bool:
        """Whether anybody jumps, has just jumped or is about to."""
        return bool(np.any(self.time != NEVER))

    def lift(self, ahead: np.ndarray | float = 0.0) -> np.ndarray:
        """Metres (...) that the root is carried over the ground, so many seconds from now."""
        return flight_lift(self._time(ahead), FLIGHT)

    def weight(self, ahead: np.ndarray | float = 0.0) -> np.ndarray:
        """How far it is in a jump, the network's gait label (...) in 0..1, so many seconds from now."""
        return jump_weight(self._time(ahead), FLIGHT)

    def _time(self, ahead: np.ndarray | float) -> np.ndarray:
        """Seconds (...) since the take-off, so many from now."""
        return self.time[..., None] + ahead if np.ndim(ahead) else self.time + ahead
