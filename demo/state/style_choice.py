"""What each body part wears, as chosen by hand: a small state that keys, mouse, gamepad and tests change alike."""

import random
from typing import Mapping, Sequence

from demo.state.bindings import PARTS_BY_NUMBER
from sim.body.skeleton import PART_NAMES, expand_part
from sim.style_spec import MAX_STRENGTH, Worn, names

STEP = 0.1
OWN = "own style"
HALF = 0.5  # the share with which a blend begins
RANDOM_STRENGTHS = (0.7, 0.85, 1.0, 1.15)


class StyleChoice:
    """The picked part or group, and part -> what it wears (sim.style_spec) for the parts that do not wear their own
    style.

    `style` is never changed in place: each change makes a new mapping, so a Command may keep the one it was given.
    While `blending`, a style that is chosen is blended into the one that is worn, and the slider moves its share."""

    def __init__(self, styles: Sequence[str], chance: random.Random | None = None) -> None:
        self.styles = tuple(styles)
        self.picked = "all"
        self.style: Mapping[str, Worn] = {}
        self.blending = False
        self.search = ""  # only styles that hold these letters are shown, and cycled through
        self._strength = dict.fromkeys(PART_NAMES, 1.0)  # kept for a part while it wears its own style
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
        return self._common(0)

    @property
    def other(self) -> str:
        """The style that is blended into the picked parts', or OWN where there is none."""
        return self._common(2)

    @property
    def strength(self) -> float:
        """The strength of the first picked part that wears a style, else what it would get."""
        return next((self.style[part][1] for part in self.parts if part in self.style), self._strength[self.parts[0]])

    @property
    def share(self) -> float:
        """How far the first picked part with a blend is on its way to the other style."""
        return next((self.style[part][3] for part in self.parts if len(self.style.get(part, ())) > 2), 0.0)

    @property
    def slot(self) -> str:
        """The style that the list changes: the blended one, or the one that is worn."""
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
        self._change(lambda part, worn: self._with_style(part, worn, name))

    def learn(self, name: str) -> None:
        """A new style is there to choose."""
        self.styles = tuple(sorted({*self.styles, name}))

    def offer(self, styles: Sequence[str]) -> None:
        """Another list of styles to choose from; parts that wear one that is not in it return to their own."""
        self.styles = tuple(styles)
        self.style = {part: worn for part, worn in self.style.items() if set(names(worn)) <= set(styles)}

    def reset(self, everything: bool = False) -> None:
        """Returns the picked parts, or the whole body, to their own style."""
        self._change(lambda part, worn: None, PART_NAMES if everything else self.parts)

    def mix(self) -> None:
        """Gives each body part a style and a strength by chance."""
        self.restore(
            {
                part: (self._chance.choice(self.styles), self._chance.choice(RANDOM_STRENGTHS))
                for part in PART_NAMES
                if self.styles
            }
        )

    def restore(self, style: Mapping[str, Worn]) -> None:
        """Wears a whole `style` as it is given. Raises ValueError where it names one that is not in the list."""
        for worn in style.values():
            if missing := [name for name in names(worn) if name not in self.styles]:
                raise ValueError(f"unknown style '{missing[0]}': `patchwalk styles list` shows what there is")
        self.style = {part: style[part] for part in PART_NAMES if part in style}

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
        self._change(lambda part, worn: worn and (worn[0], strength, *worn[2:]))

    def set_share(self, share: float) -> None:
        """How far the picked parts with a blend are on the way to its other style, kept within 0 .. 1."""
        share = round(min(max(share, 0.0), 1.0), 3)
        self._change(lambda part, worn: (*worn[:3], share) if worn and len(worn) > 2 else worn)

    # -----------------------------------------------------------------------

    def _with_style(self, part: str, worn: Worn | None, name: str) -> Worn | None:
        """What a part wears once a style is chosen for it."""
        if not self.blending or worn is None:
            return None if name == OWN else (name, self._strength[part], *(worn or ())[2:])
        share = worn[3] if len(worn) > 2 else HALF
        return worn[:2] if name == OWN else (*worn[:2], name, share)

    def _change(self, change, parts: Sequence[str] | None = None) -> None:
        """Lets `change(part, worn or None)` say what each picked part wears now."""
        style = dict(self.style)
        for part in parts or self.parts:
            style[part] = change(part, style.get(part))
        self.style = {part: style[part] for part in PART_NAMES if style.get(part)}

    def _common(self, place: int) -> str:
        """What all picked parts have at that place of what they wear."""
        wears = [self.style.get(part, ()) for part in self.parts]
        found = {worn[place] if len(worn) > place else OWN for worn in wears}
        return found.pop() if len(found) == 1 else "mixed"
