"""What the body parts wear, each a style with its strength or two styles blended, and how files write it down.

A part wears `(style, strength)`, or `(style, strength, other style, share)`: share 0 is the first style, 1 the
other."""

import json
from typing import Mapping

from sim.body.skeleton import expand_part

Worn = tuple[str, float] | tuple[str, float, str, float]
MAX_STRENGTH = 1.5


def names(worn: Worn) -> tuple[str, ...]:
    """The one or two styles of which it is made."""
    return worn[::2]


def encode(style: Mapping[str, Worn]) -> dict[str, list]:
    """Part -> what it wears, as JSON writes it: ["old", 1.0] or ["old", 1.0, "proud", 0.4]."""
    return {part: [value if isinstance(value, str) else float(value) for value in worn] for part, worn in style.items()}


def decode(value, before: Mapping[str, Worn]) -> dict[str, Worn]:
    """`before` changed by what a file says: only the parts that change; null returns a part to its own style.

    A group such as `arms` stands for its parts. Raises ValueError for anything else."""
    if not isinstance(value, dict):
        raise ValueError(f'style is {shown(value)}, but must look like {{"left_arm": ["old", 1.0], "spine": null}}')
    style = dict(before)
    for target, wanted in value.items():
        for part in expand_part(target):
            style.pop(part, None)
            if wanted is not None:
                style[part] = _decode_one(target, wanted)
    return style


def expand_style(style: Mapping[str, Worn]) -> dict[str, Worn]:
    """Part -> what it wears, groups such as `arms` replaced by their parts. Raises ValueError, in the sentences of
    `decode`."""
    result = {}
    for target, wanted in style.items():
        result |= dict.fromkeys(expand_part(target), _decode_one(target, wanted))
    return result


def _decode_one(target: str, wanted) -> Worn:
    if not (
        isinstance(wanted, (list, tuple))
        and len(wanted) in (2, 4)
        and all(isinstance(name, str) for name in wanted[::2])
        and all(map(is_number, wanted[1::2]))
    ):
        raise ValueError(
            f'the style of {target} is {shown(wanted)}, but must be ["NAME", STRENGTH], '
            '["NAME", STRENGTH, "OTHER", SHARE] or null'
        )
    for number, what, highest in zip(wanted[1::2], ("strength", "share"), (MAX_STRENGTH, 1), strict=False):
        if not 0 <= number <= highest:
            raise ValueError(f"the {what} of {target} is {number}, but must lie in 0 .. {highest}")
    return tuple(value if isinstance(value, str) else float(value) for value in wanted)


def is_number(value) -> bool:
    """A finite number; JSON as Python reads it also knows NaN and Infinity."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e9


def shown(value) -> str:
    """A value as JSON, cut to a length that fits in a sentence."""
    text = json.dumps(value, default=str)
    return text if len(text) <= 40 else text[:37] + "..."
