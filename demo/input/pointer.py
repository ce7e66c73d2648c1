"""The mouse: what it touches on the panels, and what it does to the camera where there are none."""

from typing import Mapping, Sequence

import pygame

from demo.state.bindings import Names
from demo.ui.widgets import Region

BUTTONS = {1: "left", 2: "middle", 3: "right", 6: "back", 7: "forward"}
ORBIT_PER_PIXEL = 0.006  # radians
STILL = 5  # pixels that a click may move


class Pointer:
    """Give it the `regions` of each picture, later ones lying over earlier ones; each event gives actions."""

    def __init__(self, table: Mapping[str, Names]) -> None:
        """table: action -> names of buttons and wheel's turns, of which `touch` and `orbit` are the pointer's own.

        A button may do both: it orbits when it is dragged and touches when it is clicked."""
        self._touching, self._orbiting = set(table.get("touch", ())), set(table.get("orbit", ()))
        self._actions = {
            name: action for action, names in table.items() if action not in ("touch", "orbit") for name in names
        }
        self.regions: Sequence[Region] = ()
        self.position = (-1, -1)
        self.orbit = [0.0, 0.0]  # radians since it was last taken
        self.held = ""  # the action of the `hold` region that is pressed
        self._sliding: Region | None = None
        self._dragging = ""  # the button that was pressed on the scene
        self._moved = 0.0

    def under(self) -> Region | None:
        """What lies under the mouse; a panel's own background counts, with an empty action."""
        x, y = self.position
        return next(
            (
                region
                for region in reversed(self.regions)
                if region.box[0] <= x < region.box[0] + region.box[2]
                and region.box[1] <= y < region.box[1] + region.box[3]
            ),
            None,
        )

    def down(self, event: pygame.event.Event) -> list[str]:
        """A button goes down."""
        self.position = event.pos
        name, region = BUTTONS.get(event.button, ""), self.under()
        if region is None:
            if name in self._orbiting | self._touching:
                self._dragging, self._moved = name, 0.0
                return []
            return [self._actions[name]] if name in self._actions else []
        if name not in self._touching:
            return [region.other] if region.other and name == "right" else []
        if not region.action:
            return []
        if region.kind == "hold":
            self.held = region.action
            return []
        if region.kind == "slide":
            self._sliding = region
            return [self._slid(region)]
        return [
            f"{region.action}:{self._share(region, 0):.3f},{self._share(region, 1):.3f}"
            if region.kind == "point"
            else region.action
        ]

    def up(self, event: pygame.event.Event) -> list[str]:
        """A button is let go: on the scene, where it did not move, it touches what is there."""
        name = BUTTONS.get(event.button, "")
        clicked = self._dragging == name != "" and self._moved < STILL
        if name in self._touching:
            self._sliding, self.held = None, ""
        if self._dragging == name:
            self._dragging = ""
        if clicked and name in self._touching:
            return [f"touch:{event.pos[0]},{event.pos[1]}"]
        return [self._actions[name]] if clicked and name in self._actions else []

    def motion(self, event: pygame.event.Event) -> list[str]:
        """The mouse moves."""
        self.position = event.pos
        if self._sliding:
            return [self._slid(self._sliding)]
        if self._dragging:
            self._moved += abs(event.rel[0]) + abs(event.rel[1])
            if self._moved >= STILL and self._dragging in self._orbiting:
                self.orbit[0] -= event.rel[0] * ORBIT_PER_PIXEL
                self.orbit[1] += event.rel[1] * ORBIT_PER_PIXEL
        return []

    def wheel(self, event: pygame.event.Event) -> list[str]:
        """The wheel turns, by event.y notches away from the hand."""
        self.position = pygame.mouse.get_pos() if getattr(event, "pos", None) is None else event.pos
        region = self.under()
        if region is None:
            action = self._actions.get("wheel up" if event.y > 0 else "wheel down")
        else:
            action = dict(enumerate(region.wheel or ())).get(0 if event.y > 0 else 1)
        return [action] * abs(event.y) if action else []

    def let_go(self) -> None:
        """Nothing is held any more."""
        self._sliding, self.held, self._dragging = None, "", ""

    def _share(self, region: Region, axis: int) -> float:
        return min(max((self.position[axis] - region.box[axis]) / region.box[2 + axis], 0.0), 1.0)

    def _slid(self, region: Region) -> str:
        return f"{region.action}:{self._share(region, 0):.3f}"
