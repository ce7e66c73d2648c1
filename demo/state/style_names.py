"""Styles as users write them, PART=NAME[+OTHER@SHARE][:STRENGTH], and the movements that a style knows."""

import re
from typing import Iterable

from sim.body.skeleton import expand_part
from sim.style_spec import MAX_STRENGTH, PartSpec


def parse_style(text: str) -> tuple[tuple[str, ...], PartSpec]:
    """`arms=old:0.8` as (body parts, PartSpec("old", 0.8)); the strength is 1 where none is given.
    `arms=old+proud@0.4:0.8` goes 0.4 of the way from old to proud, as (body parts, PartSpec("old", 0.8, "proud", 0.4)).

    Raises ValueError for anything else. A name may hold :, + and @: only where a number follows do they mean
    anything."""
    target, equals, wanted = text.partition("=")
    if not (target and equals and wanted):
        raise ValueError(f"'{text}' is no style: write PART=NAME or PART=NAME:STRENGTH, such as arms=old:0.8")
    name, strength = _with_number(wanted, ":")
    if strength is None:
        strength = 1.0
    if not 0 <= strength <= MAX_STRENGTH:
        raise ValueError(f"the strength in '{text}' must lie in 0 .. {MAX_STRENGTH}")
    both, share = _with_number(name, "@")
    first, plus, other = both.partition("+")
    if share is None or not (first and plus and other):
        return expand_part(target), PartSpec(name, strength)
    if not 0 <= share <= 1:
        raise ValueError(
            f"the share in '{text}' must lie in 0 .. 1: it says how much of the way from {first} to {other}"
        )
    return expand_part(target), PartSpec(first, strength, other, share)


def movement_names(movements: Iterable[str]) -> tuple[str, ...]:
    """The kinds of movement among the clips of a style, each once: the own style has several speeds of one, as
    `walk_0.85`."""
    return tuple(dict.fromkeys(re.sub(r"_[\d.]+$", "", name).replace("_", " ") for name in movements))


def _with_number(text: str, sign: str) -> tuple[str, float | None]:
    """What stands before the last `sign`, and the number after it; the whole text and None where there is none."""
    name, found, last = text.rpartition(sign)
    try:
        return (name, float(last)) if found and name else (text, None)
    except ValueError:
        return text, None
