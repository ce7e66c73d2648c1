"""A gamepad that is plugged, pressed and pulled by a test, through SDL's own virtual joysticks."""

import ctypes
from pathlib import Path

import pygame
import pytest

GAME_CONTROLLER, AXES, BUTTONS = 1, 6, 15


class VirtualPad:
    """Exists from its making until `pull`. Axes and buttons are numbered as SDL's controllers are."""

    def __init__(self) -> None:
        self._sdl = _loaded_sdl()
        self._index = self._sdl.SDL_JoystickAttachVirtual(GAME_CONTROLLER, AXES, BUTTONS, 0)
        if self._index < 0:
            pytest.skip("this SDL has no virtual joysticks")
        self._sdl.SDL_JoystickOpen.restype = ctypes.c_void_p
        self._handle = ctypes.c_void_p(self._sdl.SDL_JoystickOpen(self._index))

    def move(self, axis: int, value: float) -> None:
        """Moves an axis to -1 .. 1."""
        self._sdl.SDL_JoystickSetVirtualAxis(self._handle, axis, ctypes.c_int16(round(value * 32767)))
        self._sdl.SDL_JoystickUpdate()

    def press(self, button: int) -> None:
        """Presses a button and lets it go."""
        for state in (1, 0):
            self._sdl.SDL_JoystickSetVirtualButton(self._handle, button, ctypes.c_uint8(state))
            self._sdl.SDL_JoystickUpdate()

    def pull(self) -> None:
        """Unplugs it."""
        self._sdl.SDL_JoystickClose(self._handle)
        self._sdl.SDL_JoystickDetachVirtual(self._index)
        self._sdl.SDL_JoystickUpdate()


def _loaded_sdl() -> ctypes.CDLL:
    """The very library that pygame runs on: a second copy would have joysticks of its own."""
    maps = Path("/proc/self/maps")
    if not maps.exists():
        pytest.skip("virtual gamepads are only tested on Linux")
    assert pygame.get_init() or pygame.display.get_init()
    paths = {line.split(maxsplit=5)[5] for line in maps.read_text().splitlines() if "libSDL2-2" in line}
    if not paths:
        pytest.skip("pygame's SDL library was not found in this process")
    return ctypes.CDLL(paths.pop())
