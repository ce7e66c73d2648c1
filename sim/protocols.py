"""What a session and a window call of a controller and of a stylizer: who has these can take their place."""

from pathlib import Path
from typing import Protocol, Sequence

import numpy as np

from sim.body.pose import Pose
from sim.command import Command, Commands
from sim.ground.ground import Ground
from sim.motion.clip import Clip
from sim.motion.playback_pace import OWN_PACE, Pace
from sim.style_spec import StyleSpec


class Trajectory(Protocol):
    """Where a character was and will be: world x, z and, of the future, yaw."""

    desired: np.ndarray  # (5, 3) what the stick asks for at the samples to come
    predicted: np.ndarray  # (5, 3) what the network predicts there

    @property
    def past_positions(self) -> np.ndarray:
        """(..., 61, 2), a frame each, the present last."""

    def translate(self, shift: np.ndarray) -> None:
        """Moves everything by (..., 2) metres."""


class Controller(Protocol):
    """Turns the player's commands into neutral motion, one 60 Hz frame a call."""

    @property
    def fingerprint(self) -> str | None:
        """Of its weights; None where it has none."""

    @property
    def trajectory(self) -> Trajectory | None:
        """To be drawn; None where it has none."""

    def step(self, command: Command | Commands, pace: Pace = OWN_PACE) -> Pose:
        """The next neutral pose, at the pace that styled legs ask for. Raises FloatingPointError where it is not
        finite and the controller cannot go on from it."""

    def stand_on(self, ground: Ground | None) -> None:
        """Starts again on another ground; None for level floor."""

    def restart(self) -> None:
        """Back to before the first step: the same commands give the same poses again, bit for bit."""

    def crowd(self, count: int) -> "Controller":
        """One that moves so many characters by one step of `Commands`: its poses have a leading axis."""


class Stylizer(Protocol):
    """Restyles the newest frame of a half-second window."""

    @property
    def own_of(self) -> str | None:
        """The fingerprint of the controller whose motion the own style is; None where it does not say."""

    def step(
        self,
        window: np.ndarray,
        neutral: Pose,
        style: StyleSpec | Sequence[StyleSpec],
        travel: np.ndarray | float = 1.0,
    ) -> Pose:
        """window: features (16, 21, 15) ending with `neutral`; style: what the parts are asked to show, of a crowd one
        for each; travel: how many times as fast as the window says the body really goes, carried by styled legs. Raises
        ValueError for a style that the bank does not hold."""

    def leg_strengths(self) -> np.ndarray:
        """(..., 2) how far the left and the right leg are styled now."""

    def pace(self, gaits: Sequence[str]) -> tuple[np.ndarray | float, np.ndarray | float]:
        """What the styles of the legs ask for in each character's gait: speed and playback rate of
        sim.motion.playback_pace.Pace, (...) each."""

    def restart(self) -> None:
        """Back to before the first step, as a Controller's."""

    def crowd(self, count: int) -> "Stylizer":
        """One for so many characters: windows and poses with a leading axis, a style for each."""


class NamedStylizer(Stylizer, Protocol):
    """A stylizer as a window offers it to choose from: with a name, styles, and what can be done with them."""

    @property
    def name(self) -> str:
        """As the window shows it."""

    @property
    def styles(self) -> tuple[str, ...]:
        """The names of its styles."""

    def learn(self, *paths: Path) -> tuple[str, Clip]:
        """Adds a style made of BVH clips, under a name made from the first file's, or finds the one that was learned
        from the same motion: the name, and that clip on our skeleton. Raises ValueError or OSError."""

    @property
    def users_own(self) -> tuple[str, ...]:
        """The styles that the user added, which can be renamed and removed."""

    def rename(self, style: str, new: str) -> None:
        """Calls a style of the user's something else, also where it is shown now. Raises ValueError for a name that is
        none or is taken, OSError where its file cannot be written."""

    def remove(self, style: str) -> None:
        """Forgets a style of the user's; parts that show it return to their own. Raises ValueError or OSError."""

    def movements(self, style: str) -> tuple[str, ...]:
        """What the clips of a style show, by the names of sim.motion.gait.MOVEMENTS. Raises ValueError for a style that
        there is not."""

    @property
    def noncommercial(self) -> tuple[str, ...]:
        """The styles that are for non-commercial use only."""

    @property
    def seed(self) -> int | None:
        """By which the styles that come from a prior are sampled; None where there are none."""

    def resample(self, seed: int | None = None) -> None:
        """Samples the styles that come from a prior again, by a seed or by the next one. Raises ValueError where it has
        none."""

    def attention(self, window: np.ndarray, part: str, one: int = 0) -> np.ndarray:
        """(content samples, style samples) of a body part's attention map, of one character (`one` of a
        crowd). Raises ValueError where it has none."""

    def transfer_state(self, other: "Stylizer") -> None:
        """Goes on from another stylizer's last step."""
