"""What a visitor's attention map shows, small enough to be told ten times a second."""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from demo.serve.visitor import Visitor


def look(visitor: "Visitor") -> dict[str, Any]:
    """Of the first part that is picked: its map as hexadecimal bytes, row by row, 255 where most is used, or why there
    is none; part, and the styles that are looked at."""
    session, which = visitor.place or (visitor.session, ...)
    part = visitor.choice.parts[0]
    spec = visitor.frame.command.style.get(part) if visitor.frame else None  # type: ignore[union-attr]
    about: dict[str, Any] = {"part": part, "styles": spec.names if spec else []}
    try:
        window = session.history.window()[which]
        values = session.stylizer.attention(window, part, 0 if which is ... else which)
    except (ValueError, IndexError) as error:
        return {**about, "why": str(error) or "the character has not moved yet"}
    shades = np.round(255 * values / max(float(values.max()), 1e-9)).astype(np.uint8)
    return {**about, "columns": shades.shape[1], "map": shades.tobytes().hex()}
