"""A crowd that walks about by itself, each in a mixture of styles of its own, and makes way for one another."""

import numpy as np

from sim.body.pose import Pose
from sim.command import GAIT_SPEEDS, Command, Commands
from sim.ground.ground import Ground
from sim.math import rotations as rot
from sim.math.vectors import limit_length
from sim.motion.clip import FPS
from sim.session import Session
from sim.style_spec import StyleSpec
from stylizer.styles.own_style import OWN

SEED = 1
ROOM = 7.0  # square metres of floor for each
NEAR = 0.8  # metres from where somebody wants to go, at which they want to go elsewhere
FREE = 1.8  # metres about somebody into which the others do not like to come
GIVE_WAY = 2.5  # how much more a meeting counts than the way to go, where two touch
ASIDE = 0.6  # of giving way, how much is to the side: two who meet head-on pass on their left
LOOK_AHEAD = 0.5  # seconds: people make way for where the others are about to be
PAUSES = (1.0, 4.0)  # seconds that somebody stands who has come to a place
PAUSE_SHARE = 0.35  # of the places that somebody comes to at which they stand a while
GAITS = {"walk": 0.75, "run": 0.15, "crouch": 0.1}  # how many of the ways are gone in each
FASTEST = 0.75  # of the stick: in a crowd nobody goes as fast as they can
GROUPS = ("legs", "spine", "arms")  # that wear a style each


class Crowd:
    """So many characters who go from place to place within a square about the start point. The same seed walks them
    the same ways."""

    def __init__(self, session: Session, count: int, seed: int = SEED) -> None:
        """session: whose models, styles and ground they share; it is not changed."""
        self.session, self.count, self.seed = session.crowd(count), count, seed
        self.half = np.sqrt(ROOM * (count + 1)) / 2  # metres from the start point to the square's sides
        self.stand_on(session.ground)

    def stand_on(self, ground: Ground | None) -> None:
        """Starts again on a ground; None for level floor."""
        self._random = np.random.default_rng(self.seed)
        self.session.stand_on(ground)
        bank = self.session.stylizer.bank  # type: ignore[attr-defined]
        names = [name for name in bank.names if name not in (OWN, *bank.users_own)]  # those may be renamed and removed
        self.styles = [
            StyleSpec({group: str(self._random.choice(names)) for group in GROUPS}) for _ in range(self.count)
        ]
        trajectory = self.session.controller.trajectory
        assert trajectory is not None
        trajectory.translate(self._starts())
        self._places = trajectory.past_positions[:, -1].copy()
        self._velocities = np.zeros((self.count, 2))
        self._goals = np.array([self._new_goal() for _ in range(self.count)])
        self._gaits = [self._new_gait() for _ in range(self.count)]
        self._pauses = np.zeros(self.count)  # frames
        self.poses: Pose | None = None

    def step(self, guest: Pose | None = None) -> Pose:
        """One frame; the poses, with a leading axis. guest: one more, for whom they make way."""
        commands = Commands(self._commands(guest))
        self.poses = self.session.step(commands).styled
        places = self.poses.root_position[:, [0, 2]]
        self._velocities = (places - self._places) * FPS
        self._places = places
        return self.poses

    @property
    def last_ms(self) -> float:
        """How long the newest frame took."""
        return self.session.latency.last_ms("frame")

    def _commands(self, guest: Pose | None) -> list[Command]:
        there = rot.length(self._goals - self._places)[:, 0] < NEAR
        for one in np.flatnonzero(there):
            self._goals[one], self._gaits[one] = self._new_goal(), self._new_gait()
            if self._random.random() < PAUSE_SHARE:
                self._pauses[one] = FPS * self._random.uniform(*PAUSES)
        self._pauses = np.maximum(self._pauses - 1, 0)
        wish = FASTEST * rot.normalize(self._goals - self._places) * (self._pauses == 0)[:, None]
        sticks = limit_length(wish + self._way_out(guest), FASTEST)
        return [
            Command((float(stick[0]), float(stick[1])), None, gait, style, pace=True)
            for stick, gait, style in zip(sticks, self._gaits, self.styles, strict=True)
        ]

    def _way_out(self, guest: Pose | None) -> np.ndarray:
        """(count, 2) where each is drawn to, away from all who are about to be near."""
        ahead = self._places + LOOK_AHEAD * self._velocities
        others = ahead if guest is None else np.concatenate([ahead, guest.root_position[None, [0, 2]]])
        away = ahead[:, None] - others
        distance = rot.length(away)
        push = np.square(np.maximum(1 - distance / FREE, 0.0)) * rot.normalize(away)
        aside = push[..., ::-1] * (-1.0, 1.0)
        return GIVE_WAY * (push + ASIDE * aside).sum(axis=1)

    def _starts(self) -> np.ndarray:
        """(count, 2) the middles of a square's cells, of all but the one in its middle, which is the guest's."""
        side = int(np.ceil(np.sqrt(self.count + 1)))
        middles = (np.arange(side) - (side - 1) / 2) * 2 * self.half / side
        cells = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
        order = np.argsort(rot.length(cells)[:, 0], kind="stable")
        return cells[order[1 : self.count + 1]]

    def _new_goal(self) -> np.ndarray:
        return self._random.uniform(-self.half, self.half, 2)

    def _new_gait(self) -> str:
        return str(self._random.choice(list(GAITS), p=list(GAITS.values())))


assert set(GAITS) <= set(GAIT_SPEEDS)
