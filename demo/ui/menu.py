"""The menu: every action on a few pages of rows, for whoever has only a gamepad, only a mouse, or forgot the key."""

from dataclasses import dataclass
from typing import Callable, Mapping

from demo.state.bindings import CONTROLS, MENU_PAGES, SLOTS, Bindings
from demo.state.presets import Preset


@dataclass(frozen=True)
class Row:
    """What it says, the action it does, the other one that X or the right button does, the key that does it at once."""

    text: str
    action: str
    other: str = ""
    key: str = ""


class Menu:
    """Which page is open and which row is chosen."""

    def __init__(self, bindings: Bindings) -> None:
        self._bindings = bindings
        self.open = False
        self.page, self.row = MENU_PAGES[0], 0

    def rows(self, presets: Mapping[int, Preset]) -> tuple[Row, ...]:
        """The rows of the open page."""
        if self.page == "presets":
            return tuple(
                Row(
                    presets[slot][0] if slot in presets else "(empty)",
                    f"preset_{slot}",
                    f"save_{slot}",
                    self._bindings.shown(f"preset_{slot}"),
                )
                for slot in SLOTS
            )
        controls = [control for control in CONTROLS if control.menu == self.page]
        return tuple(
            Row(control.help, action, "".join(other[:1]), self._bindings.shown(action))
            for control in controls
            for action, *other in [control.keys]
        )

    def turn(self, step: int) -> None:
        """Goes to another page."""
        self.turn_to(MENU_PAGES[(MENU_PAGES.index(self.page) + step) % len(MENU_PAGES)])

    def turn_to(self, page: str) -> None:
        """Opens a page by name."""
        self.page, self.row = page, 0

    def move(self, step: int, presets: Mapping[int, Preset]) -> None:
        """Goes to another row."""
        self.row = (self.row + step) % len(self.rows(presets))

    def do(self, do: Callable[[str], None], presets: Mapping[int, Preset], other: bool = False) -> None:
        """Does the chosen row's action, or its other one."""
        row = self.rows(presets)[self.row]
        if row.other or not other:
            do(row.other if other else row.action)
