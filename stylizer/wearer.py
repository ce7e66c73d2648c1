"""What one character wears, part by part: styles switch at once, strengths and shares glide; and when the network is asked."""

from typing import Callable, Collection, Mapping

from sim.clip import FPS
from sim.skeleton import PART_NAMES
from sim.springs import spring_step
from sim.worn import Worn
from stylizer.bank import Bank
from stylizer.blend import Style, interpolated, side_by_side

OWN = "neutral"  # the style that untouched parts wear inside the network
STRENGTH_HALFLIFE = 0.07  # seconds; a strength has then glided to its new value in about 0.2 s
GONE = 1e-3  # a strength this small, on its way out, is 0; a share this near to the wanted one is there
DT = 1 / FPS


class Wearer:
    """A character's five parts. It is answered every second frame, and at once where a part changes its style."""

    def __init__(self, late: bool = False) -> None:
        """late: its turn comes in the frame after; so one half of a crowd rests while the other half is answered."""
        self.parts = [_Part() for _ in PART_NAMES]
        self.changed = False  # whether it asks because of another style
        self._gliding = False  # whether all parts switch in the next step
        self._late = late
        self._asked_for: tuple | None = None  # what the parts wore when it asked last
        self._resting = False  # whether this frame makes do with the last answer
        self._kept: dict[str, tuple[tuple, Style]] = {}  # what was put together last, and of what

    @property
    def strengths(self) -> list[float]:
        """Of the five parts."""
        return [part.strength for part in self.parts]

    def step(self, style: Mapping[str, Worn]) -> list[bool]:
        """One frame; which of the five parts switched their style."""
        switched = [part.step(style.get(name)) or self._gliding for part, name in zip(self.parts, PART_NAMES)]
        self._gliding = False
        return switched

    def glide(self) -> None:
        """What the parts wear has changed under its name: all of them switch in the next step, and it asks at once."""
        self._asked_for, self._gliding = None, True
        self._kept.clear()

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
        asks = self.changed or not self._resting
        self._asked_for, self._resting = wanted, asks and not (self.changed and self._late)
        return asks

    def look(self, bank: Bank) -> Style:
        """Each part's own style or blend of two, put together once and kept until one of them changes."""
        first, other = (tuple(getattr(part, key) for part in self.parts) for key in ("name", "other"))
        shares = tuple(part.share for part in self.parts)

        def together(kind: str, names: tuple[str, ...]) -> Style:
            return self._remembered(kind, names, lambda: side_by_side([bank[name] for name in names]))

        style = together("first", first)
        if any(shares):
            style = self._remembered("blend", (first, other, shares),
                                     lambda: interpolated(style, together("other", other), shares))
        return style

    def _remembered(self, kind: str, made_of: tuple, make: Callable[[], Style]) -> Style:
        if kind not in self._kept or self._kept[kind][0] != made_of:
            self._kept[kind] = made_of, make()
        return self._kept[kind][1]


class _Part:
    """What one body part wears: a style, the other one it is blended with (itself if none), share and strength of these on
    their way to the wanted ones."""

    def __init__(self) -> None:
        self.name = self.other = OWN
        self.strength = self.velocity = self.share = self.share_rate = 0.0

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
        self.strength, self.velocity = spring_step(self.strength, self.velocity, strength, STRENGTH_HALFLIFE, DT)
        if strength == 0 and self.strength < GONE:
            self.__init__()
        return switched
