"""The style of each body part, as chosen by hand: a small state that keys, mouse, gamepad and tests change alike."""

import random
from typing import Callable, Collection, Mapping, Sequence

from demo.state.bindings import PARTS_BY_NUMBER
from sim.body.skeleton import PART_NAMES, expand_part
from sim.style_spec import MAX_STRENGTH, PartLike, PartSpec, StyleSpec

STEP = 0.1
OWN = "no style"
HALF = 0.5  # the share with which a blend begins
RANDOM_STRENGTHS = (0.7, 0.85, 1.0, 1.15)


class StyleChoice:
    """The picked part or group, and the style of the parts that do not keep their own.

    `style` is never changed in place: each change makes a new mapping, so a Command may keep the one it was given.
    While `blending`, a style that is chosen is blended into the part's style, and the slider moves its share."""

    def __init__(
        self, styles: Sequence[str], chance: random.Random | None = None, noncommercial: Collection[str] = ()
    ) -> None:
        self.styles = tuple(styles)
        self.noncommercial = frozenset(noncommercial)  # of the styles, those for non-commercial use only
        self.picked = "all"
        self.style = StyleSpec()
        self.blending = False
        self.search = ""  # only styles that hold these letters are shown, and cycled through
        self._strength = dict.fromkeys(PART_NAMES, 1.0)  # kept for a part while it keeps its own style
        self._chance = chance or random.Random()

    @property
    def parts(self) -> tuple[str, ...]:
        """The body parts that the pick stands for."""
        return expand_part(self.picked)

    @property
    def shown(self) -> tuple[str, ...]:
        """The styles that the search leaves."""
        return tuple(style for style in self.styles if self.search.strip().lower() in style.lower())

    @property
    def name(self) -> str:
        """The style of the picked parts, or that they differ."""
        return self._common(lambda spec: spec.name)

    @property
    def other(self) -> str:
        """The style that is blended into the picked parts', or OWN where there is none."""
        return self._common(lambda spec: spec.other)

    @property
    def strength(self) -> float:
        """The strength of the first picked part that has a style, else what it would get."""
        return next(
            (self.style[part].strength for part in self.parts if part in self.style), self._strength[self.parts[0]]
        )

    @property
    def share(self) -> float:
        """How far the first picked part with a blend is on its way to the other style."""
        specs = (self.style.get(part) for part in self.parts)
        return next((spec.share for spec in specs if spec and spec.other), 0.0)

    @property
    def slot(self) -> str:
        """The style that the list changes: the blended one, or the part's."""
        return self.other if self.blending else self.name

    # ---- which part -----------------------------------------------------------

    def pick(self, part: str) -> None:
        """Picks a part or a group. Raises ValueError for an unknown one."""
        expand_part(part)
        self.picked = part

    def pick_next(self, step: int) -> None:
        """Picks the part `step` places on in the order of the number keys."""
        self.picked = PARTS_BY_NUMBER[(PARTS_BY_NUMBER.index(self.picked) + step) % len(PARTS_BY_NUMBER)]

    # ---- which style -----------------------------------------------------------

    def cycle(self, step: int) -> None:
        """Gives the picked parts the style `step` places on; their own style lies between the last and the first."""
        ring = (OWN, *self.shown)
        place = ring.index(self.slot) if self.slot in ring else 0
        self.choose(ring[(place + step) % len(ring)])

    def choose(self, name: str) -> None:
        """Gives the picked parts a style by name, or OWN; while blending, blends it in. Raises ValueError for a name
        that is not in the list."""
        if name != OWN and name not in self.styles:
            raise ValueError(f"unknown style '{name}': `patchwalk styles list` shows what there is")
        self._change(lambda part, spec: self._with_style(part, spec, name))

    def learn(self, name: str) -> None:
        """A new style is there to choose."""
        self.styles = tuple(sorted({*self.styles, name}))

    def offer(self, styles: Sequence[str], noncommercial: Collection[str] = ()) -> None:
        """Another list of styles to choose from; parts with one that is not in it return to their own."""
        self.styles, self.noncommercial = tuple(styles), frozenset(noncommercial)
        self.style = StyleSpec({part: spec for part, spec in self.style.items() if set(spec.names) <= set(styles)})

    def reset(self, everything: bool = False) -> None:
        """Returns the picked parts, or the whole body, to their own style."""
        self._change(lambda part, spec: None, PART_NAMES if everything else self.parts)

    def mix(self) -> None:
        """Gives each body part a style and a strength by chance."""
        self.restore(
            {
                part: PartSpec(self._chance.choice(self.styles), self._chance.choice(RANDOM_STRENGTHS))
                for part in PART_NAMES
                if self.styles
            }
        )

    def restore(self, style: Mapping[str, PartLike]) -> None:
        """Takes on a whole `style` as it is given. Raises ValueError where it names one that is not in the list."""
        style = StyleSpec.of(style)
        if missing := [name for name in style.names if name not in self.styles]:
            raise ValueError(f"unknown style '{missing[0]}': `patchwalk styles list` shows what there is")
        self.style = style

    # ---- how much -----------------------------------------------------------

    def change_strength(self, steps: int) -> None:
        """Makes the picked parts' styles stronger by tenths, or, while blending, moves the blend on by tenths."""
        if self.blending:
            self.set_share(self.share + STEP * steps)
        else:
            self.set_strength(self.strength + STEP * steps)

    def set_strength(self, strength: float) -> None:
        """The picked parts' strength, kept within 0 .. MAX_STRENGTH."""
        strength = round(min(max(strength, 0.0), MAX_STRENGTH), 3)
        self._strength.update(dict.fromkeys(self.parts, strength))
        self._change(lambda part, spec: spec and spec._replace(strength=strength))

    def set_share(self, share: float) -> None:
        """How far the picked parts with a blend are on the way to its other style, kept within 0 .. 1."""
        share = round(min(max(share, 0.0), 1.0), 3)
        self._change(lambda part, spec: spec._replace(share=share) if spec and spec.other else spec)

    # -----------------------------------------------------------------------

    def _with_style(self, part: str, spec: PartSpec | None, name: str) -> PartSpec | None:
        """The spec of a part once a style is chosen for it; None for its own style."""
        if self.blending and spec is not None:
            if name == OWN:
                return spec._replace(other=None, share=0.0)
            return spec._replace(other=name, share=spec.share if spec.other else HALF)
        if name == OWN:
            return None
        return (spec or PartSpec(name))._replace(name=name, strength=self._strength[part])

    def _change(
        self,
        change: Callable[[str, PartSpec | None], PartSpec | None],
        parts: Sequence[str] | None = None,
    ) -> None:
        """Lets `change(part, its spec or None)` say what is asked of each picked part now."""
        style: dict[str, PartSpec | None] = dict(self.style)
        for part in parts or self.parts:
            style[part] = change(part, style.get(part))
        self.style = StyleSpec({part: spec for part, spec in style.items() if spec})

    def _common(self, style_of: Callable[[PartSpec], str | None]) -> str:
        """The style that all picked parts have, by `style_of` their specs; OWN for none."""
        specs = (self.style.get(part) for part in self.parts)
        found = {(spec and style_of(spec)) or OWN for spec in specs}
        return found.pop() if len(found) == 1 else "mixed"
