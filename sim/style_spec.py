"""What the player asks of styles: body part -> a style at a strength, or a blend of two, and how files write it
down."""

import json
from functools import cached_property
from typing import Any, Iterator, Mapping, NamedTuple, Sequence

from sim.body.skeleton import PART_NAMES, expand_part

MAX_STRENGTH = 1.5


class PartSpec(NamedTuple):
    """What one body part is asked to show.

    name: a style; strength: 0 (not at all) .. 1 (as captured) .. MAX_STRENGTH (exaggerated); other: a second style that
    it is blended with, None for none; share: 0 .. 1 of the way from `name` to `other`."""

    name: str
    strength: float = 1.0
    other: str | None = None
    share: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """The one or two styles."""
        return (self.name,) if self.other is None else (self.name, self.other)

    def to_json(self) -> list[str | float]:
        """["old", 1.0] or ["old", 1.0, "proud", 0.4]."""
        pair: list[str | float] = [self.name, float(self.strength)]
        return pair if self.other is None else [*pair, self.other, float(self.share)]


PartLike = PartSpec | str | Sequence[str | float]  # what StyleSpec takes for one part


class StyleSpec(Mapping[str, PartSpec]):
    """Body part -> PartSpec, for the parts that are restyled, in the order of PART_NAMES; the others keep their own
    style. Never changed in place."""

    def __init__(self, parts: Mapping[str, PartLike] | None = None) -> None:
        """parts: body part (left_leg, right_leg, spine, left_arm, right_arm) or group (legs, arms, upper, all) -> a
        style's name, (name, strength) or (name, strength, other name, share); of two that name one part the later
        counts.

        Raises ValueError, in one sentence, for an unknown part and for what is no style, strength or share."""
        if not isinstance(parts, Mapping | None):
            raise ValueError(f'style is {abbreviate(parts)}, but must look like {{"left_arm": ("old", 1.0)}}')
        found: dict[str, PartSpec] = {}
        for target, wanted in (parts or {}).items():
            spec = PartSpec(wanted) if isinstance(wanted, str) else _read_part(target, wanted)
            found |= dict.fromkeys(expand_part(target), spec)
        self._parts = {part: found[part] for part in PART_NAMES if part in found}

    @classmethod
    def of(cls, parts: "StyleSpec | Mapping[str, PartLike]") -> "StyleSpec":
        """The very spec that is given, or a new one of a plain mapping (see `__init__`)."""
        return parts if isinstance(parts, cls) else cls(parts)

    def __getitem__(self, part: str) -> PartSpec:
        return self._parts[part]

    def __iter__(self) -> Iterator[str]:
        return iter(self._parts)

    def __len__(self) -> int:
        return len(self._parts)

    def __eq__(self, other: object) -> bool:
        """A plain mapping equals the spec that is made of it."""
        if not isinstance(other, Mapping):
            return NotImplemented
        try:
            return self._parts == StyleSpec.of(other)._parts
        except ValueError:
            return False

    def __repr__(self) -> str:
        return f"StyleSpec({self.to_json()})"

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The styles of all parts, each once."""
        return tuple(dict.fromkeys(name for spec in self._parts.values() for name in spec.names))

    def renamed(self, name: str, new: str) -> "StyleSpec":
        """This spec where a style is called something else."""

        parts = {}
        for part, spec in self.items():
            first, *other = (new if each == name else each for each in spec.names)
            parts[part] = PartSpec(first, spec.strength, other[0] if other else None, spec.share)
        return StyleSpec(parts)

    def to_json(self) -> dict[str, list[str | float]]:
        """Part -> list, as recordings and presets hold it."""
        return {part: spec.to_json() for part, spec in self._parts.items()}

    def updated(self, value: object) -> "StyleSpec":
        """This spec changed by what a file holds: only the parts or groups that it names; null returns a part to its
        own style. Raises ValueError for anything else."""
        if not isinstance(value, dict):
            raise ValueError(
                f'style is {abbreviate(value)}, but must look like {{"left_arm": ["old", 1.0], "spine": null}}'
            )
        parts = dict(self._parts)
        for target, wanted in value.items():
            for part in expand_part(target):
                parts.pop(part, None)
                if wanted is not None:
                    parts[part] = _read_part(target, wanted)
        return StyleSpec(parts)


def _read_part(target: str, wanted: Any) -> PartSpec:
    if isinstance(wanted, PartSpec):
        wanted = wanted[: 2 * len(wanted.names)]
    if not (
        isinstance(wanted, (list, tuple))
        and len(wanted) in (2, 4)
        and all(isinstance(name, str) for name in wanted[::2])
        and all(map(is_number, wanted[1::2]))
    ):
        raise ValueError(
            f'the style of {target} is {abbreviate(wanted)}, but must be ["NAME", STRENGTH], '
            '["NAME", STRENGTH, "OTHER", SHARE] or null'
        )
    for number, what, highest in zip(wanted[1::2], ("strength", "share"), (MAX_STRENGTH, 1), strict=False):
        if not 0 <= number <= highest:
            raise ValueError(f"the {what} of {target} is {number}, but must lie in 0 .. {highest}")
    name, strength, other, share = wanted if len(wanted) == 4 else (*wanted, None, 0.0)
    return PartSpec(name, float(strength), other, float(share))


def is_number(value: object) -> bool:
    """A finite number; JSON as Python reads it also knows NaN and Infinity."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e9


def abbreviate(value: object) -> str:
    """A value as JSON, cut to a length that fits in a sentence."""
    text = json.dumps(value, default=str)
    return text if len(text) <= 40 else text[:37] + "..."
