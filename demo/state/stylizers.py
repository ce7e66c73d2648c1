"""Changing the style-transfer system of a running session: each is loaded when it is first asked for, and kept."""

from sim.io.provenance import SHIPPED
from sim.protocols import NamedStylizer
from sim.session import Session


class Stylizers:
    """The stylizers that come with the package, one of which the session uses."""

    def __init__(self, session: Session[NamedStylizer]) -> None:
        self._session = session
        self._ready: dict[str, NamedStylizer] = {}

    def next(self) -> str:
        """Goes on to the next one; its name. Raises ValueError, and changes nothing, where there is no other or it is
        broken."""
        from stylizer.runtime import catalogue
        from stylizer.systems import weight_files

        current, names = self._current, weight_files.names()
        if len(names) < 2:
            raise ValueError("there is no other stylizer: `patchwalk train stylizer --network NAME` makes one")
        self._ready[current.name] = current
        name = names[(names.index(current.name) + 1) % len(names)] if current.name in names else names[0]
        stylizer: NamedStylizer = self._ready.get(name) or catalogue.from_pretrained(name)
        self._session.stylizer = self._ready[name] = stylizer
        stylizer.transfer_state(current)
        return name

    @property
    def other(self) -> str | None:
        """The name of the one in use; None for the one that is used unless another is named."""
        return None if self._current.name == SHIPPED else self._current.name

    def resample(self) -> None:
        """Samples the styles of a prior again. Raises ValueError where the stylizer has none."""
        self._current.resample()

    @property
    def _current(self) -> NamedStylizer:
        return self._session.stylizer
