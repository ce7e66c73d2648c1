"""The active styles of one character's body parts: strengths and shares on their way; and when the network is to be
evaluated."""

from typing import Collection, Sequence, final

import numpy as np

from sim.body.skeleton import PART_NAMES
from sim.math.springs import spring_step
from sim.motion.clip import FPS
from sim.style_spec import PartSpec, StyleSpec
from stylizer.styles.bank import StyleBank
from stylizer.styles.own_style import OWN

STRENGTH_HALFLIFE = 0.07  # seconds; a strength has then glided to its new value in about 0.2 s
NEGLIGIBLE = 1e-3  # a strength this small, on its way out, is 0; a share this near to the wanted one is there
ARRIVED = 1e-12  # a value as near as this to the wanted one, that changes as little, is there
SAME_VELOCITY = 0.01  # metres a second, radians a second: where styles wait, they are not interpolated anew for less
BODY, NEUTRAL = 0, 1  # whose root velocity
DT = 1 / FPS


class StyleMixer:
    """A character's five parts. The network is evaluated every `period` frames, and at once where a part changes its
    style."""

    def __init__(self, period: int, turn: int = 0) -> None:
        """turn: so many frames later its turn comes; so most of a crowd rests while the others are evaluated."""
        self.period, self._turn = period, turn
        self.parts = [_Part() for _ in PART_NAMES]
        self.steady = False  # whether no part was on its way to another strength, share or style in the last step
        self.changed = False  # whether it is evaluated because of another style
        self._switching = False  # whether all parts switch in the next step
        self._evaluated: tuple | None = None  # the styles of the parts when it was evaluated last
        self.waited = self._until = 0  # frames since it was evaluated, and until it is again
        # (2, 3) that styles are interpolated for: of the body, and of the neutral motion, whose own style is taken off.
        self.root_velocities = np.full((2, 3), np.inf)
        self._kept: dict[tuple, np.ndarray] = {}  # styles at that velocity, by the names of the five parts' styles

    @property
    def strengths(self) -> list[float]:
        """Of the five parts."""
        return [part.strength for part in self.parts]

    @property
    def styled(self) -> list[float]:
        """Of the five parts: the strength, as far as it is that of another style than the own one."""
        return [part.strength * part.styled_share for part in self.parts]

    @property
    def shares(self) -> list[float]:
        """Of the five parts: how far each is on the way from its style to the other one."""
        return [part.share for part in self.parts]

    @property
    def shown(self) -> dict[str, list[float]]:
        """By style: how much of it each of the five parts shows, its strength included."""
        result: dict[str, list[float]] = {}
        for place, part in enumerate(self.parts):
            for name, share in part.shown:
                result.setdefault(name, [0.0] * len(self.parts))[place] += share * part.strength
        return result

    def step(self, style: StyleSpec) -> list[bool]:
        """One frame; which of the five parts switch to another style."""
        wanted = [style.get(name) for name in PART_NAMES]
        self.steady = all(part.rests_at(spec) for part, spec in zip(self.parts, wanted))
        switched = [not self.steady and part.step(spec) for part, spec in zip(self.parts, wanted)]
        switching, self._switching = self._switching, False
        return [each or switching for each in switched]

    def switch(self) -> None:
        """Styles have changed under their names: all parts switch in the next step."""
        self._evaluated, self._switching = None, True
        self._kept.clear()
        for part in self.parts:
            part.disturb()

    def keep(self, styles: Collection[str]) -> None:
        """A part with another style than these fades to its own."""
        for part in self.parts:
            if not {part.name, part.other} <= set(styles):
                part.name = part.other = OWN
                part.disturb()

    def rename(self, name: str, new: str) -> None:
        """A style is called something else from now on."""
        for part in self.parts:
            part.name, part.other = (new if each == name else each for each in (part.name, part.other))
            part.disturb()
        self._kept.clear()

    def due(self) -> bool:
        """Whether the network is to be evaluated in this frame. To be called once a frame, after `step`."""
        if not any(self.strengths):
            self._evaluated = None
            return False
        wanted = tuple((part.name, part.other) for part in self.parts)
        self.changed = wanted != self._evaluated
        due = self.changed or not self._until
        if due:
            self._until = (self._turn or self.period) if self.changed else self.period
        self._evaluated, self.waited, self._until = wanted, 0 if due else self.waited + 1, self._until - 1
        return due

    @property
    def updates_styles(self) -> bool:
        """Whether styles are interpolated anew in this frame: midway between two evaluations, for both at once would be
        twice the work of any other frame."""
        return self.changed or self.waited == self.period // 2

    def move(self, body: np.ndarray, neutral: np.ndarray) -> None:
        """From now on styles are those of a body that moves at a root velocity (3,), the own style that of a neutral
        motion that moves at another (3,)."""
        same = SAME_VELOCITY if self.period > 1 else 0.0
        if np.abs(np.array([body, neutral]) - self.root_velocities).max() > same:
            self.root_velocities = np.array([body, neutral])
            self._kept.clear()

    def own(self, bank: StyleBank) -> np.ndarray:
        """The own style at this velocity, for all parts: numbers (1, 5, N), see
        stylizer.systems.motion_puzzle.style_tensors.pack."""
        return self._style(bank, (OWN,) * len(PART_NAMES), NEUTRAL)

    def styles(self, bank: StyleBank) -> list[np.ndarray]:
        """The styles of the five parts at this velocity, side by side in one (1, 5, N); where any of them is blended
        with another style, those as a second one."""
        keys = ("name", "other")[: 1 + any(self.shares)]
        return [self._style(bank, tuple(getattr(part, key) for part in self.parts), BODY) for key in keys]

    def _style(self, bank: StyleBank, names: tuple[str, ...], whose: int) -> np.ndarray:
        if (names, whose) not in self._kept:
            each = {name: bank[name].numbers_at(self.root_velocities[whose]) for name in dict.fromkeys(names)}
            parts = [each[name][:, part] for part, name in enumerate(names)]
            self._kept[names, whose] = np.stack(parts, axis=1) if len(each) > 1 else each[names[0]]
        return self._kept[names, whose]


def amounts_of_styles(mixers: Sequence[StyleMixer]) -> dict[str, np.ndarray]:
    """By style: how much of it each character's parts show, (n, 5)."""
    result: dict[str, np.ndarray] = {}
    for one, mixer in enumerate(mixers):
        for name, amounts in mixer.shown.items():
            result.setdefault(name, np.zeros((len(mixers), len(PART_NAMES))))[one] = amounts
    return result


@final
class _Part:
    """The active style of one body part: the style, the other one it is blended with (itself if none), share and
    strength on their way to the wanted ones, and how far it is not the own style."""

    def __init__(self) -> None:
        self.name = self.other = OWN
        self.strength = self.velocity = self.share = self.share_rate = self.styled_share = self.styled_rate = 0.0
        self._arrived: PartSpec | None | bool = None  # what was asked, where it is there; False on its way

    @property
    def shown(self) -> list[tuple[str, float]]:
        """The styles that it shows and how much of it is each one's: none where it has no strength."""
        shares = ((self.name, 1 - self.share), (self.other, self.share))
        return [(name, share) for name, share in shares if self.strength and share]

    def rests_at(self, spec: PartSpec | None) -> bool:
        """Whether a step to what is asked changes nothing."""
        return self._arrived == spec

    def disturb(self) -> None:
        """It has changed otherwise than by a step: the next one is made in full."""
        self._arrived = False

    def step(self, spec: PartSpec | None) -> bool:
        """One frame; whether the style was switched. A part let go keeps its style until it has faded."""
        asked = spec
        spec = spec or PartSpec(self.name, 0.0, self.other, self.share)
        name, strength, share = spec.name, spec.strength, spec.share
        other = self.other if spec.other is None else spec.other
        switched = name != self.name or (other != self.other and self.share > 0)
        self.name, self.other = name, other
        styled_share = (1 - share) * (name != OWN) + share * (other != OWN)
        # a switch is smoothed, so the share need not be
        if switched or not self.strength or abs(share - self.share) < NEGLIGIBLE:
            self.share, self.share_rate = share, 0.0
        if not self.strength or abs(styled_share - self.styled_share) < NEGLIGIBLE:
            self.styled_share, self.styled_rate = styled_share, 0.0
        self.share, self.share_rate = _glide(self.share, self.share_rate, share)
        self.styled_share, self.styled_rate = _glide(self.styled_share, self.styled_rate, styled_share)
        switched = switched and self.strength > 0
        self.strength, self.velocity = _glide(self.strength, self.velocity, strength)
        there = (self.strength, self.share, self.styled_share) == (strength, share, styled_share)
        self._arrived = asked if there and not (self.velocity or self.share_rate or self.styled_rate) else False
        if strength == 0 and self.strength < NEGLIGIBLE:
            self.__init__()
        return switched


def _glide(value: float, rate: float, wanted: float) -> tuple[float, float]:
    """A frame's step on the way to the wanted value, which is arrived at in the end."""
    if max(abs(value - wanted), abs(rate)) < ARRIVED:
        return wanted, 0.0
    return spring_step(value, rate, wanted, STRENGTH_HALFLIFE, DT)
