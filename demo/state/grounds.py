"""Changing the ground of a running session: the named ones in turn, and the user's own map."""

from pathlib import Path

from sim.ground.catalogue import FLAT, NAMES, load_ground
from sim.ground.ground import Ground
from sim.io.recording import Recording
from sim.protocols import NamedStylizer
from sim.session import Session


def ground_of(recorded: Recording, folder: Path) -> str | None:
    """The ground that a recording in a folder names: a map lies where it did for whoever recorded, beside the
    recording."""
    name = recorded.ground
    return name if name is None or Path(name).suffix.lower() != ".png" else str(folder / name)


class Grounds:
    """The grounds, on one of which the session stands."""

    def __init__(self, session: Session[NamedStylizer], name: str | None = None) -> None:
        """Puts the session on a ground by its name or its map's path. Raises ValueError or OSError where that is
        none."""
        self._session = session
        self.name = name or FLAT
        self._names = tuple(dict.fromkeys((*NAMES, self.name)))
        self._loaded: dict[str, Ground | None] = {}
        self._stand_on(self.name)

    def next(self) -> str:
        """Starts again on the next one; its name."""
        self._stand_on(self._names[(self._names.index(self.name) + 1) % len(self._names)])
        return self.name

    def go_to(self, name: str) -> None:
        """Starts again on one of them by its name. Raises ValueError for another one."""
        if name not in self._names:
            raise ValueError(f"the ground {name} is not here: start with --ground {name}")
        self._stand_on(name)

    @property
    def other(self) -> str | None:
        """The name of the one in use; None for level floor."""
        return None if self.name == FLAT else self.name

    def _stand_on(self, name: str) -> None:
        if name not in self._loaded:
            self._loaded[name] = load_ground(name)
        self.name = name
        self._session.stand_on(self._loaded[name])
