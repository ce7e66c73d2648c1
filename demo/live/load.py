"""Whether the window keeps up: how simple the picture has to be, and whether the world goes slower than time."""

from collections import deque
from statistics import median

TOO_SLOW = 0.040  # seconds: a picture that takes longer is made simpler, well before the world slows down
EASY = 0.6  # of that: what a richer picture is expected to take, at most, where it is tried again
WATCHED = 0.5  # seconds over which pictures are judged
PATIENCE, LONGEST_PATIENCE = (
    3.0,
    60.0,
)  # seconds of ease before a richer picture is tried; doubled where it was too soon
JUDGED = 3  # pictures, at least, by which anything is judged: a single stop means nothing
SLOW_SHARE = 0.9  # of its time that the world makes up at least, or else it is slow


class Load:
    """Told of every turn of the window's loop. `level`: how many steps simpler the picture is; `slow`: whether the
    world is slower than time, because a turn takes longer than what it may make up for."""

    def __init__(self, levels: int) -> None:
        """levels: how many steps the picture can be made simpler."""
        self._levels = levels
        self.level = 0
        self.slow = False
        # when, frames that were due, frames that were made, seconds that the picture took
        self._turns: deque[tuple[float, int, int, float]] = deque()
        self._drawn: list[float] = []  # seconds of each picture since they were judged last
        self._since = self._eased = 0.0  # when that was; since when it has been easy
        self._gains = [1.0] * (levels + 1)  # by level: how many times as long the next richer picture took
        self._before: float | None = None  # what a picture took before the last step
        self._patience, self._tried = PATIENCE, -LONGEST_PATIENCE  # when a richer picture was tried last

    def turn(self, now: float, due: int, made: int, drawing: float) -> bool:
        """One turn, over at `now` in seconds: frames due and frames made, and the seconds that the picture took. True
        where `level` has changed."""
        self._turns.append((now, due, made, drawing))
        while now - self._turns[0][0] > 2 * WATCHED and len(self._turns) > JUDGED:
            self._turns.popleft()
        _, dues, mades, _ = zip(*self._turns)
        short = sum(made < due for due, made in zip(dues, mades))
        self.slow = short >= JUDGED and sum(mades) < SLOW_SHARE * sum(dues)
        if not self._drawn:
            self._since = now - drawing
        self._drawn.append(drawing)
        if now - self._since < WATCHED or len(self._drawn) < JUDGED:
            return False
        taken, self._drawn = median(self._drawn), []
        return self._judge(now, taken)

    def describe(self, step: float) -> str:
        """Why the world is slow; step: the seconds that a simulated frame takes. Empty where it is not."""
        if not self.slow:
            return ""
        drawing, made = (median(turn[place] for turn in self._turns) for place in (3, 2))
        if drawing >= made * step:
            return f"slow motion: drawing takes {1000 * drawing:.0f} ms"
        return f"slow motion: a frame's motion takes {1000 * step:.0f} ms"

    def _judge(self, now: float, taken: float) -> bool:
        """Chooses the level by what a picture takes now."""
        if self._before is not None:
            self._gains[self.level], self._before = max(1.0, self._before / max(taken, 1e-6)), None
        if taken > TOO_SLOW or self.slow:
            self._eased = now
            if self.level == self._levels:
                return False
            if now - self._tried < 2 * self._patience:
                self._patience = min(2 * self._patience, LONGEST_PATIENCE)
            self.level, self._before = self.level + 1, taken
            return True
        if not self.level or taken * self._gains[self.level] > EASY * TOO_SLOW:
            self._eased = now
        if not self.level or now - self._eased < self._patience:
            return False
        self.level, self._eased, self._tried = self.level - 1, now, now
        return True
