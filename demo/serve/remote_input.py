"""What the keys, sticks and buttons of a page far away ask for: as demo.input.devices, but that the page says what is
held."""

import math
from typing import Any, Collection, Mapping

from demo.render.camera import Camera
from demo.state import steering
from sim.command import Command
from sim.style_spec import StyleSpec

HELD = frozenset(
    {"forward", "left", "back", "right", "run", "crouch", "face_left", "face_right", "compare"}  # that count while held
)
PRESSED = frozenset({"jump", "crouch_toggle", "face_free"})  # that count once


class RemoteInput:
    """`take` what the page says, `press` what is pressed, `command` gives what is asked for in a frame."""

    def __init__(self) -> None:
        self.mode = ""  # the page keeps its menus and its search to itself
        self.answers = 0  # number of the newest input taken
        self.held: Collection[str] = ()
        self.facing_held: float | None = None  # the yaw that the facing keys hold
        self.crouching = False  # until the toggle is pressed again
        self._stick = self._look = (0.0, 0.0)
        self._yaw = Camera().yaw  # where the page's camera looks
        self._jump = False  # pressed since the last command

    def take(self, said: Mapping[str, Any]) -> bool:
        """Takes in a message; whether somebody touched a control. Raises ValueError for what is no such message."""
        number, yaw = said.get("n", self.answers), said.get("yaw", self._yaw)
        stick, look = (_stick(said.get(name, (0, 0))) for name in ("stick", "look"))
        held = said.get("held", [])
        if type(number) is not int or not 0 <= number < 2**32 or not _is_finite(yaw) or not isinstance(held, list):
            raise ValueError("the page says what no page of ours says: load it anew")
        self.answers, self._yaw = number, math.remainder(yaw, 2 * math.pi)
        self._stick, self._look = stick, look
        self.held = HELD & {action for action in held if isinstance(action, str)}
        return bool(self.held) or (stick, look) != ((0.0, 0.0), (0.0, 0.0))

    def press(self, action: str) -> None:
        """Takes in an action of PRESSED."""
        if action == "face_free":
            self.facing_held = None
        elif action == "crouch_toggle":
            self.crouching = not self.crouching
        elif action == "jump":
            self._jump = True

    def let_go(self) -> None:
        """Nothing is held any more."""
        self.held, self._stick, self._look = (), (0.0, 0.0), (0.0, 0.0)

    def command(self, facing: float, style: StyleSpec, pace: bool, seconds: float) -> Command:
        """What is asked for in a frame of `seconds`; a jump once for each press. facing: the character's own yaw."""
        stick = steering.stick_of_keys(self.held)
        if stick == (0.0, 0.0):
            stick = steering.walking_stick(self._stick)
        turn = steering.turn_of_keys(self.held, seconds)
        if turn:
            self.facing_held = (facing if self.facing_held is None else self.facing_held) + turn
        face = None if self.facing_held is None else steering.direction(self.facing_held)
        if self._look != (0.0, 0.0):
            face = steering.to_world(self._look, self._yaw)
        gait = "crouch" if self.crouching or "crouch" in self.held else "run" if "run" in self.held else "walk"
        style = StyleSpec() if "compare" in self.held else style
        jump, self._jump = self._jump, False
        return Command(steering.to_world(stick, self._yaw), face, gait, style, pace, jump)


def _stick(value: Any) -> steering.Vector:
    """A stick (right, away from the camera) without its dead zone."""
    if not (isinstance(value, list | tuple) and len(value) == 2 and all(map(_is_finite, value))):
        raise ValueError("the page says what no page of ours says: load it anew")
    return steering.dead_zone(float(value[0]), float(value[1]))


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | float) and abs(value) < 1e6
