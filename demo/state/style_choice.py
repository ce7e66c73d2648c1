"""The style of each body part, as chosen by hand: a small state that keys, mouse, gamepad and tests change alike."""

import random
from typing import Callable, Collection, Mapping, Sequence

from demo.state.bindings import PARTS_BY_NUMBER
from sim.body.skeleton import PART_NAMES, expand_part
from sim.style_spec import MAX_STRENGTH, PartLike, PartSpec, StyleSpec

STEP = 0.1
OWN, MIXED = "no style", "mixed styles"  # no style of the bank is called so: its names have no spaces
HALF = 0.5  # the share with which a blend begins
RANDOM_STRENGTHS = (0.7, 0.85, 1.0, 1.15)


class StyleChoice:
    """The picked part or group, and the style of the parts that do not keep their own.

    `style` is never changed in place: each change makes a new mapping, so a Command may keep the one it was given.
    While `blending`, a style that is chosen is blended into the part's style, and the slider moves its share; that ends
    where another part is picked."""

    def __init__(
        self,
        styles: Sequence[str],
        chance: random.Random | None = None,
        noncommercial: Collection[str] = (),
        users_own: Collection[str] = (),
    ) -> None:
        """styles: their names; of these, noncommercial: those for non-commercial use only, users_own: those that the
        user added."""
        self.style = StyleSpec()
        self.offer(styles, noncommercial, users_own)
        self.picked = "all"
        self.blending = False
        self.search = ""  # only styles that hold these letters are shown, and cycled through
        self._strength = dict.fromkeys(PART_NAMES, 1.0)  # of each part, also while it keeps its own style
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
        """The strength of the picked parts that have a style, or else what they would get; the mean where they
        differ."""
        return sum(self._strengths) / len(self._strengths)

    @property
    def share(self) -> float:
        """How far the picked parts with a blend are on their way to the other style; the mean where they differ."""
        return sum(self._shares) / len(self._shares) if self._shares else 0.0

    @property
    def strengths_differ(self) -> bool:
        """Whether the picked parts differ in strength."""
        return len(set(self._strengths)) > 1

    @property
    def shares_differ(self) -> bool:
        """Whether the picked parts differ in share."""
        return len(set(self._shares)) > 1

    @property
    def _strengths(self) -> list[float]:
        styled = [part for part in self.parts if part in self.style]
        return [self._strength[part] for part in styled or self.parts]

    @property
    def _shares(self) -> list[float]:
        return [spec.share for part in self.parts if (spec := self.style.get(part)) and spec.other]

    @property
    def slot(self) -> str:
        """The style that the list changes: the blended one, or the part's."""
        return self.other if self.blending else self.name

    # ---- which part -----------------------------------------------------------

    def pick(self, part: str) -> None:
        """Picks a part or a group; another one ends the blending. Raises ValueError for an unknown one."""
        expand_part(part)
        self.blending = self.blending and part == self.picked
        self.picked = part

    def pick_next(self, step: int) -> None:
        """Picks the part `step` places on in the order of the number keys."""
        self.pick(PARTS_BY_NUMBER[(PARTS_BY_NUMBER.index(self.picked) + step) % len(PARTS_BY_NUMBER)])

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

    def replace_style(self, name: str) -> None:
        """Gives the picked parts a style in place of whatever they have, blends too, so that it is seen."""
        self.blending = False
        self._change(lambda part, spec: PartSpec(name, self._strength[part] or 1.0))

    def offer(
        self, styles: Sequence[str], noncommercial: Collection[str] = (), users_own: Collection[str] = ()
    ) -> None:
        """Another list of styles to choose from; parts with one that is not in it return to their own."""
        self.styles, self.noncommercial, self.users_own = tuple(styles), frozenset(noncommercial), frozenset(users_own)
        self.style = StyleSpec({part: spec for part, spec in self.style.items() if set(spec.names) <= set(styles)})

    def rename(self, name: str, new: str) -> None:
        """A style of the user's is called something else from now on."""

        def renamed(names: Collection[str]) -> list[str]:
            return [new if each == name else each for each in names]

        style = self.style
        self.offer(sorted(renamed(self.styles)), self.noncommercial, renamed(self.users_own))
        self.style = style.renamed(name, new)

    def reset(self, everything: bool = False) -> None:
        """Returns the picked parts, or the whole body, to their own style at full strength."""
        parts = PART_NAMES if everything else self.parts
        self.blending = False
        self._change(lambda part, spec: None, parts)
        self._strength.update(dict.fromkeys(parts, 1.0))

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
        self._take(style)

    # ---- how much -----------------------------------------------------------

    def change_strength(self, steps: int) -> None:
        """Makes the picked parts' styles stronger by tenths, or, while blending, moves the blend on by tenths; each
        from where it is."""
        if self.blending:
            self._set_shares(lambda share: share + STEP * steps)
        else:
            self._set_strengths(lambda strength: strength + STEP * steps)

    def set_strength(self, strength: float) -> None:
        """The strength of all picked parts, kept within 0 .. MAX_STRENGTH."""
        self._set_strengths(lambda _: strength)

    def set_share(self, share: float) -> None:
        """How far all picked parts with a blend are on the way to its other style, kept within 0 .. 1."""
        self._set_shares(lambda _: share)

    def _set_strengths(self, change: Callable[[float], float]) -> None:
        for part in self.parts:
            self._strength[part] = round(min(max(change(self._strength[part]), 0.0), MAX_STRENGTH), 3)
        self._change(lambda part, spec: spec and spec._replace(strength=self._strength[part]))

    def _set_shares(self, change: Callable[[float], float]) -> None:
        def changed(part: str, spec: PartSpec | None) -> PartSpec | None:
            return (
                spec._replace(share=round(min(max(change(spec.share), 0.0), 1.0), 3)) if spec and spec.other else spec
            )

        self._change(changed)

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
        self._take(StyleSpec({part: spec for part, spec in style.items() if spec}))

    def _take(self, style: StyleSpec) -> None:
        self.style = style
        self._strength.update({part: spec.strength for part, spec in style.items()})

    def _common(self, style_of: Callable[[PartSpec], str | None]) -> str:
        """The style that all picked parts have, by `style_of` their specs; OWN for none."""
        specs = (self.style.get(part) for part in self.parts)
        found = {(spec and style_of(spec)) or OWN for spec in specs}
        return found.pop() if len(found) == 1 else MIXED
