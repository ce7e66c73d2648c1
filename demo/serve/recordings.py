"""Recordings that a page replays."""

from pathlib import Path

from sim.io import recording
from sim.io.provenance import SHIPPED
from sim.io.recording import Recording
from sim.protocols import NamedStylizer


def read_for(path: Path, stylizer: NamedStylizer) -> Recording:
    """A recording that was made with a stylizer. Raises ValueError, naming the file without its folder, or OSError for
    one that was made with another, asks for styles that are not there, or is none."""
    try:
        recorded = recording.read(path)
    except ValueError as error:
        raise ValueError(str(error).replace(str(path), path.name)) from None
    name = recorded.stylizer or SHIPPED
    if name != stylizer.name:
        raise ValueError(f"{path.name} was made with the stylizer {name}: choose that first")
    for style in recorded.styles:
        stylizer.movements(style)  # raises for one that is not there
    return recorded
