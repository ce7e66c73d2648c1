"""Which style each body part wears, as chosen by hand: a small state that keys, gamepad and tests change alike."""

from typing import Mapping, Sequence

from demo.bindings import PARTS_BY_NUMBER
from sim.skeleton import PART_NAMES, expand_part
from sim.worn import MAX_STRENGTH

STEP = 0.1
OWN = "own style"


class StyleChoice:
    """The picked part or group, and part -> (style, strength) for the parts that do not wear their own.

    `style` is never changed in place: each change makes a new mapping, so a Command may keep the one it was given."""

    def __init__(self, styles: Sequence[str]) -> None:
        self.styles = tuple(styles)
        self.picked = "all"
        self.style: Mapping[str, tuple[str, float]] = {}
        self._strength = dict.fromkeys(PART_NAMES, 1.0)  # kept for a part while it wears its own style

    @property
    def parts(self) -> tuple[str, ...]:
        """The body parts that the pick stands for."""
        return expand_part(self.picked)

    @property
    def name(self) -> str:
        """The style of the picked parts, or that they differ."""
        names = {self.style.get(part, (OWN,))[0] for part in self.parts}
        return names.pop() if len(names) == 1 else "mixed"

    @property
    def strength(self) -> float:
        """The strength of the first picked part that wears a style, else what it would get."""
        return next((self.style[part][1] for part in self.parts if part in self.style), self._strength[self.parts[0]])

    def pick(self, part: str) -> None:
        """Picks a part or a group. Raises ValueError for an unknown one."""
        expand_part(part)
        self.picked = part

    def pick_next(self, step: int) -> None:
        """Picks the part `step` places on in the order of the number keys."""
        self.picked = PARTS_BY_NUMBER[(PARTS_BY_NUMBER.index(self.picked) + step) % len(PARTS_BY_NUMBER)]

    def cycle(self, step: int) -> None:
        """Gives the picked parts the style `step` places on; their own style lies between the last and the first."""
        ring = (OWN, *self.styles)
        place = ring.index(self.name) if self.name in ring else 0
        self.wear(ring[(place + step) % len(ring)])

    def wear(self, name: str) -> None:
        """Gives the picked parts a style by name, or OWN. Raises ValueError for a name that is not in the list."""
        if name != OWN and name not in self.styles:
            raise ValueError(f"unknown style '{name}': `patchwalk styles list` shows what there is")
        style = {part: worn for part, worn in self.style.items() if part not in self.parts}
        if name != OWN:
            style.update((part, (name, self._strength[part])) for part in self.parts)
        self.style = _in_order(style)

    def reset(self) -> None:
        """Returns the picked parts to their own style."""
        self.wear(OWN)

    def change_strength(self, steps: int) -> None:
        """Makes the picked parts' styles stronger by tenths, within 0 .. MAX_STRENGTH; they end equally strong."""
        strength = round(min(max(self.strength + STEP * steps, 0.0), MAX_STRENGTH), 3)
        self._strength.update(dict.fromkeys(self.parts, strength))
        self.style = {part: (name, strength if part in self.parts else old) for part, (name, old) in self.style.items()}

    def restore(self, style: Mapping[str, tuple[str, float]]) -> None:
        """Goes back to an earlier `style`."""
        self.style = style


def _in_order(style: dict) -> dict:
    return {part: style[part] for part in PART_NAMES if part in style}
