"""What one character wears, part by part: styles, strengths and shares glide; and when the network is asked."""

from typing import Callable, Collection, Mapping

import torch

from sim.clip import FPS
from sim.skeleton import PART_NAMES
from sim.springs import soft_spring_step, spring_step
from sim.worn import Worn
from stylizer.bank import Bank
from stylizer.blend import Style, interpolated, mix_parts, side_by_side

OWN = "neutral"  # the style that untouched parts wear inside the network
STRENGTH_HALFLIFE = 0.07  # seconds; a strength has then glided to its new value in about 0.2 s
SWITCH_HALFLIFE = 0.25  # seconds in which half of the way from one style to another is gone
GONE = 1e-3  # a strength this small, on its way out, is 0; a share this near to the wanted one is there
STILL = 0.0, 0.0, 0.0  # a fade that is over: where, how fast, how much faster
DT = 1 / FPS


class Wearer:
    """A character's five parts. It is answered every `period` frames, and at once where a part changes its style."""

    def __init__(self, period: int, turn: int = 0, fades: bool = True) -> None:
        """turn: so many frames later its turn comes; so most of a crowd rests while the others are answered. fades: what parts
        wear goes over into another style by itself (see `look`); False for those who do not look."""
        self.period, self._turn, self.fades = period, turn, fades
        self.parts = [_Part() for _ in PART_NAMES]
        self.changed = False  # whether it asks because of another style
        self._gliding = False  # whether all parts switch in the next step
        self._asked_for: tuple | None = None  # what the parts wore when it asked last
        self.waited = self._until = 0  # frames since it asked, and until it asks again
        self._kept: dict[str, tuple[tuple, Style]] = {}  # what was put together last, and of what
        self._look: Style | None = None  # what was worn when somebody looked last
        self._before: Style | None = None  # what parts wore before they switched

    @property
    def strengths(self) -> list[float]:
        """Of the five parts."""
        return [part.strength for part in self.parts]

    def step(self, style: Mapping[str, Worn]) -> list[bool]:
        """One frame; which of the five parts jump to another style. Those that fade into it do not."""
        switched = [part.step(style.get(name)) for part, name in zip(self.parts, PART_NAMES)]
        jumping, self._gliding = self._gliding, False
        if not self.fades or self._look is None:
            return [each or jumping for each in switched]
        if any(switched):
            self._before = mix_parts(self._before or self._look, self._look, torch.tensor(switched)[:, None])
            for part, fresh in zip(self.parts, switched):
                part.fade = (1.0, 0.0, 0.0) if fresh else part.fade
        return [jumping] * len(self.parts)

    def glide(self) -> None:
        """What the parts wear has changed under its name: all of them switch in the next step, and it asks at once."""
        self._asked_for, self._gliding = None, True
        self._look = self._before = None
        self._kept.clear()
        for part in self.parts:
            part.fade = STILL

    def keep(self, styles: Collection[str]) -> None:
        """A part that wears another style than these lets it go."""
        for part in self.parts:
            if not {part.name, part.other} <= set(styles):
                part.name = part.other = OWN

    def asks(self) -> bool:
        """Whether it needs an answer in this frame. To be called once a frame, after `step`."""
        if not any(self.strengths):
            self._asked_for = None
            return False
        wanted = tuple((part.name, part.other) for part in self.parts)
        self.changed = wanted != self._asked_for
        asks = self.changed or not self._until
        if asks:
            self._until = (self._turn or self.period) if self.changed else self.period
        self._asked_for, self.waited, self._until = wanted, 0 if asks else self.waited + 1, self._until - 1
        return asks

    def look(self, bank: Bank) -> Style:
        """Each part's own style or blend of two, put together once and kept until one of them changes; after a switch on its way
        there from what it wore before."""
        first, other = (tuple(getattr(part, key) for part in self.parts) for key in ("name", "other"))
        shares = tuple(part.share for part in self.parts)

        def together(kind: str, names: tuple[str, ...]) -> Style:
            return self._remembered(kind, names, lambda: side_by_side([bank[name] for name in names]))

        style = together("first", first)
        if any(shares):
            style = self._remembered("blend", (first, other, shares),
                                     lambda: interpolated(style, together("other", other), shares))
        fades = tuple(part.fade[0] for part in self.parts)
        if any(fades) and self._before:
            style = self._remembered("fade", (first, other, shares, fades), lambda: interpolated(style, self._before, fades))
        self._look = style
        return style

    def _remembered(self, kind: str, made_of: tuple, make: Callable[[], Style]) -> Style:
        if kind not in self._kept or self._kept[kind][0] != made_of:
            self._kept[kind] = made_of, make()
        return self._kept[kind][1]


class _Part:
    """What one body part wears: a style, the other one it is blended with (itself if none), share and strength of these on
    their way to the wanted ones; and how much it still is of what it wore before a switch, with its rate and acceleration."""

    def __init__(self) -> None:
        self.name = self.other = OWN
        self.strength = self.velocity = self.share = self.share_rate = 0.0
        self.fade = STILL

    def step(self, worn: Worn | None) -> bool:
        """One frame; whether the style was switched. A part let go keeps its style until it has faded."""
        name, strength, other, share = (worn if worn and len(worn) == 4 else
                                        (*worn, self.other, 0.0) if worn else (self.name, 0.0, self.other, self.share))
        switched = name != self.name or (other != self.other and self.share > 0)
        self.name, self.other = name, other
        if switched or not self.strength or abs(share - self.share) < GONE:  # in a switch the turns glide, so the share need not
            self.share, self.share_rate = share, 0.0
        self.share, self.share_rate = spring_step(self.share, self.share_rate, share, STRENGTH_HALFLIFE, DT)
        switched = switched and self.strength > 0
        self.fade = soft_spring_step(*self.fade, 0.0, SWITCH_HALFLIFE, DT) if abs(self.fade[0]) > GONE else STILL
        self.strength, self.velocity = spring_step(self.strength, self.velocity, strength, STRENGTH_HALFLIFE, DT)
        if strength == 0 and self.strength < GONE:
            self.__init__()
        return switched
