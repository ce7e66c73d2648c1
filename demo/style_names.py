"""Style names as users write them: PART=NAME[:STRENGTH], and the sentence for a name that the bank does not hold."""

from difflib import get_close_matches
from typing import Collection, Iterable

from sim.skeleton import expand_part
from sim.worn import MAX_STRENGTH


def parse_style(text: str) -> tuple[tuple[str, ...], str, float]:
    """`arms=old:0.8` as (body parts, style name or clip, strength); the strength is 1 where none is given.

    Raises ValueError for anything else. A name may hold colons: only a number after the last one is a strength."""
    target, equals, wanted = text.partition("=")
    if not (target and equals and wanted):
        raise ValueError(f"'{text}' is no style: write PART=NAME or PART=NAME:STRENGTH, such as arms=old:0.8")
    name, colon, last = wanted.rpartition(":")
    strength = _number(last) if colon and name else None
    if strength is None:
        name, strength = wanted, 1.0
    if not 0 <= strength <= MAX_STRENGTH:
        raise ValueError(f"the strength in '{text}' must lie in 0 .. {MAX_STRENGTH}")
    return expand_part(target), name, strength


def check_styles(wanted: Iterable[str], known: Collection[str]) -> None:
    """Raises ValueError for the first style that is not known, naming those that are spelt like it."""
    for name in wanted:
        if name not in known:
            near = get_close_matches(name, known, 3)
            hint = f"did you mean {' or '.join(near)}?" if near else "`patchwalk styles list` shows what there is"
            raise ValueError(f"unknown style '{name}': {hint}")


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
