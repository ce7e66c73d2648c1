"""Keyboard, mouse and gamepads: pygame's events become actions, camera motion and one immutable Command a frame.

Gamepads are read by SDL's controller mapping, so names of buttons mean the same on all of them. They may come and go
at any time; the one used last steers, and without one the keyboard does."""

from typing import Iterable, Mapping

import pygame
from pygame._sdl2 import controller

from demo import bindings, steering
from sim.command import Command

FULL_AXIS = 32767.0
TRIGGER_HELD = 0.35
ORBIT_PER_PIXEL = 0.006  # radians
ORBIT_RATE = 2.5  # radians a second at full stick
PAD_BUTTONS = {getattr(pygame, f"CONTROLLER_BUTTON_{name.upper()}"): action
               for name, action in bindings.PAD_BUTTONS.items()}
STICKS = {"left": (pygame.CONTROLLER_AXIS_LEFTX, pygame.CONTROLLER_AXIS_LEFTY),
          "right": (pygame.CONTROLLER_AXIS_RIGHTX, pygame.CONTROLLER_AXIS_RIGHTY)}
TRIGGERS = {"left": pygame.CONTROLLER_AXIS_TRIGGERLEFT, "right": pygame.CONTROLLER_AXIS_TRIGGERRIGHT}


class Devices:
    """Needs an open window. `handle` takes the events of a frame, `command` gives what they ask for."""

    def __init__(self) -> None:
        self._keys = {pygame.key.key_code(name): action for name, action in bindings.KEYS.items()}
        self._held: set[str] = set()
        self._facing: float | None = None  # the yaw that the facing keys hold
        self._pads: dict[int, controller.Controller] = {}
        self._pad: controller.Controller | None = None
        self.orbit, self.zoom = [0.0, 0.0], 0.0  # camera motion since it was last taken
        controller.init()
        for index in range(controller.get_count()):
            self._plug(index)

    @property
    def pad_name(self) -> str | None:
        """The name of the gamepad that steers."""
        return self._pad.name if self._pad else None

    @property
    def facing_held(self) -> bool:
        """Whether the facing keys hold a direction."""
        return self._facing is not None

    def handle(self, events: Iterable[pygame.event.Event]) -> list[str]:
        """The actions that a frame's events ask for, in order: names of demo.bindings, and those of `_HANDLERS`."""
        actions = []
        for event in events:
            handler = self._HANDLERS.get(event.type)
            action = handler(self, event) if handler else None
            if action:
                actions.append(action)
        return actions

    def command(self, camera_yaw: float, facing: float, style: Mapping[str, tuple[str, float]],
                seconds: float) -> Command:
        """What is asked for in a frame of `seconds`. camera_yaw: where the camera looks; facing: its own yaw."""
        stick = steering.stick_of_keys(self._held)
        if stick == (0.0, 0.0):
            stick = self._stick("left")
        turn = steering.turn_of_keys(self._held, seconds)
        if turn:
            self._facing = (facing if self._facing is None else self._facing) + turn
        face = None if self._facing is None else steering.direction(self._facing)
        look = self._stick("right")
        if look != (0.0, 0.0):
            if self._trigger("left"):
                self.orbit[0] -= look[0] * ORBIT_RATE * seconds
                self.orbit[1] -= look[1] * ORBIT_RATE * seconds
            else:
                face = steering.to_world(look, camera_yaw)
        running = "run" in self._held or self._trigger("right")
        return Command(steering.to_world(stick, camera_yaw), face, "run" if running else "walk", style)

    def take_camera(self) -> tuple[float, float, float]:
        """Orbit about the vertical and up, in radians, and zoom notches since the last call."""
        motion = (*self.orbit, self.zoom)
        self.orbit, self.zoom = [0.0, 0.0], 0.0
        return motion

    # ---- events -----------------------------------------------------------

    def _key_down(self, event) -> str | None:
        action = self._keys.get(event.key)
        if action:
            self._held.add(action)
        if action == "face_free":
            self._facing = None
        return action

    def _key_up(self, event) -> None:
        self._held.discard(self._keys.get(event.key))

    def _let_go(self, event) -> None:
        self._held.clear()  # keys released while another window has the keyboard are never reported

    def _wheel(self, event) -> str | None:
        if pygame.key.get_mods() & pygame.KMOD_CTRL:
            self.zoom += event.y
            return None
        return "style_previous" if event.y > 0 else "style_next" if event.y < 0 else None

    def _mouse_motion(self, event) -> None:
        if any(event.buttons):
            self.orbit[0] -= event.rel[0] * ORBIT_PER_PIXEL
            self.orbit[1] += event.rel[1] * ORBIT_PER_PIXEL

    def _pad_button(self, event) -> str | None:
        self._use(event)
        action = PAD_BUTTONS.get(event.button)
        if action == "face_free":
            self._facing = None
        return action

    def _pad_axis(self, event) -> str | None:
        if abs(event.value) < steering.DEAD_ZONE * FULL_AXIS:
            return None
        self._use(event)
        return "stick"

    def _use(self, event) -> None:
        self._pad = self._pads.get(event.instance_id, self._pad)

    def _pad_added(self, event) -> str | None:
        return "pad_added" if self._plug(event.device_index) else None

    def _pad_removed(self, event) -> str | None:
        pad = self._pads.pop(event.instance_id, None)
        if pad is None:
            return None
        if pad is self._pad:
            self._pad = next(iter(self._pads.values()), None)
        return "pad_removed"

    _HANDLERS = {
        pygame.KEYDOWN: _key_down, pygame.KEYUP: _key_up, pygame.WINDOWFOCUSLOST: _let_go,
        pygame.MOUSEWHEEL: _wheel, pygame.MOUSEMOTION: _mouse_motion,
        pygame.CONTROLLERBUTTONDOWN: _pad_button, pygame.CONTROLLERAXISMOTION: _pad_axis,
        pygame.CONTROLLERDEVICEADDED: _pad_added, pygame.CONTROLLERDEVICEREMOVED: _pad_removed,
        pygame.VIDEORESIZE: lambda self, event: "resized", pygame.WINDOWSIZECHANGED: lambda self, event: "resized",
        pygame.QUIT: lambda self, event: "leave",
    }

    # ---- gamepads -----------------------------------------------------------

    def _plug(self, index: int) -> bool:
        """Opens the gamepad at a device index; False for one that is open, or that SDL has no mapping for."""
        try:
            pad = controller.Controller(index)
            number = pad.as_joystick().get_instance_id()
        except pygame.error:  # gone again, or not a gamepad
            return False
        if number in self._pads:
            return False
        self._pads[number] = self._pad = pad
        return True

    def _axis(self, number: int) -> float:
        """-1 .. 1; 0 without a gamepad, or when it was just pulled."""
        try:
            return self._pad.get_axis(number) / FULL_AXIS if self._pad else 0.0
        except pygame.error:
            return 0.0

    def _stick(self, side: str) -> steering.Vector:
        x, y = (self._axis(number) for number in STICKS[side])
        return steering.dead_zone(x, -y)  # SDL's sticks count down the screen

    def _trigger(self, side: str) -> bool:
        return self._axis(TRIGGERS[side]) > TRIGGER_HELD
