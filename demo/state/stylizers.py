"""Changing the style-transfer system of a running session: each is loaded when it is first asked for, and kept."""

from sim.session import Session


class Stylizers:
    """The stylizers that come with the package, one of which the session uses."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._ready: dict[str, object] = {}

    def next(self) -> str:
        """Goes on to the next one; its name. Raises ValueError, and changes nothing, where there is no other or it is
        broken."""
        from stylizer.runtime import catalogue

        current = self._session.stylizer
        bank, names = getattr(current, "bank", None), catalogue.names()
        if bank is None or len(names) < 2:
            raise ValueError("there is no other stylizer: `patchwalk train stylizer --network NAME` makes one")
        self._ready[bank.name] = current
        name = names[(names.index(bank.name) + 1) % len(names)] if bank.name in names else names[0]
        self._session.stylizer = stylizer = self._ready.get(name) or catalogue.from_pretrained(name)
        self._ready[name] = stylizer
        stylizer.take_over(current)
        return name

    @property
    def other(self) -> str | None:
        """The name of the one in use; None for the one that is used unless another is named."""
        from stylizer.networks import checkpoint as weights

        name = getattr(getattr(self._session.stylizer, "bank", None), "name", weights.SLIM)
        return None if name == weights.SLIM else name

    def reroll(self) -> None:
        """Draws the styles of chance anew. Raises ValueError where the stylizer has none."""
        draw = getattr(self._session.stylizer, "reroll", None)
        if draw is None:
            raise ValueError("this stylizer draws no styles by chance")
        draw()
