"""Keyboard, mouse and gamepads: pygame's events become actions, camera motion and one immutable Command a frame.

Gamepads are read by SDL's controller mapping, so names of buttons mean the same on all of them. They may come and go
at any time; the one used last steers, and without one the keyboard does."""

from typing import Iterable, Iterator

import pygame
from pygame._sdl2 import controller, sdl2

from demo.input.pointer import Pointer
from demo.state import bindings, steering
from demo.state.bindings import DEFAULT, Bindings
from sim.command import Command
from sim.style_spec import StyleSpec

FULL_AXIS = 32767.0
PAD_ERRORS = (pygame.error, sdl2.error)  # of a gamepad that is gone: SDL's own module raises its own kind
TRIGGER_HELD = 0.35
ORBIT_RATE = 2.5  # radians a second at full stick
STICKS = {
    "left stick": (pygame.CONTROLLER_AXIS_LEFTX, pygame.CONTROLLER_AXIS_LEFTY),
    "right stick": (pygame.CONTROLLER_AXIS_RIGHTX, pygame.CONTROLLER_AXIS_RIGHTY),
}
TRIGGERS = {"lefttrigger": pygame.CONTROLLER_AXIS_TRIGGERLEFT, "righttrigger": pygame.CONTROLLER_AXIS_TRIGGERRIGHT}
SHIFT_TRIGGER = "lefttrigger+"
KEY_PREFIXES = ("ctrl+", "shift+")  # in this order before the name of a key
KEY_MASKS = (pygame.KMOD_CTRL | pygame.KMOD_META, pygame.KMOD_SHIFT)  # Command on a Mac does as Ctrl elsewhere
MODES = {"menu": (bindings.MENU_KEYS, bindings.MENU_PAD), "typing": (bindings.TYPING_KEYS, bindings.TYPING_PAD)}
# Any of these is a person who wants to do something; so is a stick out of its dead zone (the action `stick`).
WAKING = (pygame.KEYDOWN, pygame.MOUSEBUTTONDOWN, pygame.MOUSEWHEEL, pygame.CONTROLLERBUTTONDOWN)


def take_events() -> list[pygame.event.Event]:
    """The events since the last call; none where pygame stumbles over a gamepad that came and went in between."""
    try:
        return pygame.event.get()
    except (*PAD_ERRORS, SystemError):
        return []


def gamepad_names() -> list[str]:
    """The gamepads that a window would open, each by its name."""
    controller.init()
    pads = filter(controller.is_controller, range(controller.get_count()))
    return [controller.name_forindex(index) or "a gamepad without a name" for index in pads]


class Devices:
    """Needs an open window. `handle` takes the events of a turn, `command` gives what they ask for."""

    def __init__(self, table: Bindings = DEFAULT) -> None:
        self.mode = ""  # or one of MODES, whose keys and buttons go first
        self.pointer = Pointer(table.mouse)
        self._keys = {_key(name): action for name, action in table.actions("keys").items()}
        self._modes = {
            mode: ({_key(name)[1]: action for name, action in keys.items()}, buttons)
            for mode, (keys, buttons) in MODES.items()
        }
        self._buttons = table.actions("pad")
        self._held: dict[int | str, str] = {}  # code of a key or name of a button that is down -> its action
        self._tapped: set[str] = set()  # actions pressed in this turn, which count in it however soon they were let go
        self._answered = False  # whether a command was given since the last turn's events
        self._letters_come = False  # whether SDL reports letters beside the keys of this turn
        self._opened_by_key = False  # whether the key before this event began the typing: its letter is none of it
        self._facing: float | None = None  # the yaw that the facing keys hold
        self.crouching = False  # until the toggle is pressed again
        self._jump = False  # pressed since the last command
        self._pads: dict[int, controller.Controller] = {}
        self._pulled: dict[int, bool] = {}  # whether the left trigger is, by the events so far
        self._pad: controller.Controller | None = None
        controller.init()
        self._plug_new()

    @property
    def pad_name(self) -> str | None:
        """The name of the gamepad that steers."""
        try:
            return self._pad.name if self._pad else None
        except PAD_ERRORS:
            return None

    @property
    def facing_held(self) -> bool:
        """Whether the facing keys hold a direction."""
        return self._facing is not None

    def holds(self, action: str) -> bool:
        """Whether a key, a button, a trigger or the mouse holds an action."""
        trigger = next((name for name in TRIGGERS if self._buttons.get(name) == action), None)
        pressed = action in self._held.values() or action in self._tapped or action == self.pointer.held
        return pressed or bool(trigger and self._trigger(trigger))

    def handle(self, events: Iterable[pygame.event.Event]) -> Iterator[str]:
        """The actions that a turn's events ask for, in order: names of demo.state.bindings, and those of `_HANDLERS`.

        Each is to be carried out before the next is asked for: it may change the mode that the next key is understood
        in, and at three pictures a second a whole word is typed within a turn."""
        if self._answered:
            self._tapped.clear()
            self._answered = False
        self._letters_come = self.mode == "typing"  # SDL was told so in the turn before
        for event in events:
            if event.type in WAKING:
                yield "wake"
            before, handler = self.mode, self._HANDLERS.get(event.type)
            asked = handler(self, event) if handler else None
            yield from [asked] if isinstance(asked, str) else asked or []
            opened = event.type == pygame.KEYDOWN and before != self.mode == "typing"
            self._opened_by_key = opened and self._letters_come

    def command(self, camera_yaw: float, facing: float, style: StyleSpec, seconds: float) -> Command:
        """What is asked for in a frame of `seconds`; a jump once for each press. camera_yaw: where the camera looks;
        facing: the character's own yaw."""
        held = {*self._held.values(), *self._tapped}
        self._answered = True
        stick = steering.stick_of_keys(held)
        if stick == (0.0, 0.0):
            stick = steering.walking_stick(self._stick("walk"))
        turn = steering.turn_of_keys(held, seconds)
        if turn:
            self._facing = (facing if self._facing is None else self._facing) + turn
        face = None if self._facing is None else steering.direction(self._facing)
        look = self._stick("face")
        if look != (0.0, 0.0):
            face = steering.to_world(look, camera_yaw)
        orbit = self._stick("orbit")
        self.pointer.orbit[0] -= orbit[0] * ORBIT_RATE * seconds
        self.pointer.orbit[1] -= orbit[1] * ORBIT_RATE * seconds
        gait = "crouch" if self.crouching or self.holds("crouch") else "run" if self.holds("run") else "walk"
        jump, self._jump = self._jump, False
        return Command(steering.to_world(stick, camera_yaw), face, gait, style, jump=jump)

    def take_camera(self) -> tuple[float, float]:
        """Orbit about the vertical and up, in radians, since the last call."""
        (yaw, pitch), self.pointer.orbit = self.pointer.orbit, [0.0, 0.0]
        return yaw, pitch

    # ---- events -----------------------------------------------------------

    def _key_down(self, event: pygame.event.Event) -> str | None:
        if self.mode and event.key in self._modes[self.mode][0]:
            return self._modes[self.mode][0][event.key]
        ctrl, shift = (KEY_PREFIXES[place] if event.mod & mask else "" for place, mask in enumerate(KEY_MASKS))
        if self.mode == "typing" and not ctrl:
            letter = "" if self._letters_come else getattr(event, "unicode", "")
            return f"text:{letter}" if letter.isprintable() and letter else None
        # Shift alone is also how one runs: a key that means nothing with it means what it does without.
        return self._press(event.key, self._keys.get((ctrl + shift, event.key)) or self._keys.get((ctrl, event.key)))

    def _key_up(self, event: pygame.event.Event) -> None:
        self._held.pop(event.key, None)

    def _text(self, event: pygame.event.Event) -> str | None:
        return f"text:{event.text}" if self.mode == "typing" and not self._opened_by_key else None

    def _let_go(self, event: pygame.event.Event) -> None:
        self._tapped.clear()
        self._held.clear()  # keys released while another window has the keyboard are never reported
        self.pointer.let_go()

    def _pad_button(self, event: pygame.event.Event) -> str | None:
        self._use(event)
        name = _button_name(event.button)
        if self.mode and name in self._modes[self.mode][1]:
            return self._modes[self.mode][1][name]
        shifted = SHIFT_TRIGGER + name
        # as it was when the button was pressed: by now, which is the end of the turn, it may be let go
        pulled = self._pulled.get(event.instance_id, self._trigger("lefttrigger"))
        plain = not pulled or shifted not in self._buttons
        return self._press(name, self._buttons.get(name if plain else shifted))

    def _pad_button_up(self, event: pygame.event.Event) -> None:
        self._held.pop(_button_name(event.button), None)

    def _pad_axis(self, event: pygame.event.Event) -> str | None:
        if event.axis == TRIGGERS["lefttrigger"]:
            self._pulled[event.instance_id] = event.value / FULL_AXIS > TRIGGER_HELD
        if abs(event.value) < steering.DEAD_ZONE * FULL_AXIS:
            return None
        self._use(event)
        return "stick"

    def _press(self, control: int | str, action: str | None) -> str | None:
        """Takes in the action of a key or button that goes down."""
        if action:
            self._held[control] = action
            self._tapped.add(action)
        if action == "face_free":
            self._facing = None
        elif action == "crouch_toggle":
            self.crouching = not self.crouching
        elif action == "jump":
            self._jump = True
        return action

    def _use(self, event: pygame.event.Event) -> None:
        self._pad = self._pads.get(event.instance_id, self._pad)

    def _pad_added(self, event: pygame.event.Event) -> str | None:
        return "pad_added" if self._plug_new() else None

    def _pad_removed(self, event: pygame.event.Event) -> str | None:
        pad = self._pads.pop(event.instance_id, None)
        self._pulled.pop(event.instance_id, None)
        self._plug_new()  # one that came in the same turn may have been announced under an index that is another's now
        if pad is None:
            return None
        self._held = {name: action for name, action in self._held.items() if isinstance(name, int)}
        if pad is self._pad:
            self._pad = next(iter(self._pads.values()), None)
        return "pad_removed"

    _HANDLERS = {
        pygame.KEYDOWN: _key_down,
        pygame.KEYUP: _key_up,
        pygame.TEXTINPUT: _text,
        pygame.WINDOWFOCUSLOST: _let_go,
        pygame.MOUSEBUTTONDOWN: lambda self, event: self.pointer.down(event),
        pygame.MOUSEBUTTONUP: lambda self, event: self.pointer.up(event),
        pygame.MOUSEMOTION: lambda self, event: self.pointer.motion(event),
        pygame.MOUSEWHEEL: lambda self, event: self.pointer.wheel(event),
        pygame.CONTROLLERBUTTONDOWN: _pad_button,
        pygame.CONTROLLERBUTTONUP: _pad_button_up,
        pygame.CONTROLLERAXISMOTION: _pad_axis,
        pygame.CONTROLLERDEVICEADDED: _pad_added,
        pygame.CONTROLLERDEVICEREMOVED: _pad_removed,
        pygame.VIDEORESIZE: lambda self, event: "resized",
        pygame.WINDOWSIZECHANGED: lambda self, event: "resized",
        pygame.QUIT: lambda self, event: "quit",
    }

    # ---- gamepads -----------------------------------------------------------

    def _plug_new(self) -> bool:
        """Opens every gamepad that is not open yet; True if there was one."""
        return any([self._plug(index) for index in range(controller.get_count())])

    def _plug(self, index: int) -> bool:
        """Opens the gamepad at a device index; False for one that is open, or that SDL has no mapping for."""
        try:
            pad = controller.Controller(index)
            number = pad.as_joystick().get_instance_id()
        except PAD_ERRORS:  # gone again, or not a gamepad
            return False
        if number in self._pads:
            return False
        self._pads[number] = self._pad = pad
        return True

    def _axis(self, number: int) -> float:
        """-1 .. 1; 0 without a gamepad, or when it was just pulled."""
        try:
            return self._pad.get_axis(number) / FULL_AXIS if self._pad else 0.0
        except PAD_ERRORS:
            return 0.0

    def _stick(self, action: str) -> steering.Vector:
        """What the stick that is bound to an action says: with the left trigger held, one bound to `lefttrigger+`."""
        for name, bound in self._buttons.items():
            plain = name.removeprefix(SHIFT_TRIGGER)
            if bound == action and plain in STICKS:
                shifted = self._trigger("lefttrigger") and SHIFT_TRIGGER + plain in self._buttons
                if shifted == name.startswith(SHIFT_TRIGGER):
                    x, y = (self._axis(number) for number in STICKS[plain])
                    return steering.dead_zone(x, -y)  # SDL's sticks count down the screen
        return 0.0, 0.0

    def _trigger(self, name: str) -> bool:
        return self._axis(TRIGGERS[name]) > TRIGGER_HELD


def _key(name: str) -> tuple[str, int]:
    """Its prefixes and the code of a key: `ctrl+1` -> ("ctrl+", 49)."""
    plain = name
    for prefix in KEY_PREFIXES:
        plain = plain.removeprefix(prefix)
    return name[: len(name) - len(plain)], pygame.key.key_code(plain)


_BUTTON_NAMES = {
    getattr(pygame, name): name.removeprefix("CONTROLLER_BUTTON_").lower()
    for name in vars(pygame)
    if name.startswith("CONTROLLER_BUTTON_")
}


def _button_name(number: int) -> str:
    return _BUTTON_NAMES.get(number, "")
