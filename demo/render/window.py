"""Windows with OpenGL 3.3, on the screen or off it; nothing of OpenGL is imported before one is open."""

import os
import sys
import warnings
from pathlib import Path
from types import ModuleType

import numpy as np
import pygame

TITLE = "Patchwalk"
ICON = Path(__file__).parents[1] / "icon.png"  # demo.tools.icon draws it
GL_VERSION = (3, 3)
BASE_SIZE = (1280, 720)
PACKAGES = "on Debian or Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri"
# PyOpenGL asks this platform which context is current: it must be the one that SDL made the context with.
PYOPENGL_PLATFORMS = {"x11": "glx", "wayland": "egl", "offscreen": "egl", "KMSDRM": "egl"}


class NoDisplay(RuntimeError):
    """There is no screen to open a window on."""


class NoGL(RuntimeError):
    """OpenGL 3.3 is missing or does not work."""


class Window:
    """An open window: bind it, draw, show it. `size` is (width, height) in pixels and follows the user's resizing."""

    def __init__(self, size: tuple[int, int]) -> None:
        pygame.display.set_caption(TITLE)
        pygame.display.set_icon(pygame.image.load(ICON))
        self.size = size[0], size[1]
        self._gl = _load_gl()

    framebuffer = 0

    def bind(self) -> None:
        """Draws go to this window from now on."""
        self._gl.bind_framebuffer(self.framebuffer, self.size)

    def show(self) -> None:
        """Puts what was drawn on the screen."""
        pygame.display.flip()

    def read_pixels(self) -> np.ndarray:
        """What was drawn and not shown yet: (height, width, 3) uint8, top row first."""
        self.bind()
        return self._gl.read_pixels(*self.size)

    @property
    def renderer_name(self) -> str:
        """What draws, in the driver's words."""
        return self._gl.renderer_name()

    def follow_size(self) -> bool:
        """Takes over the size the user gave the window; True if it changed."""
        return False

    def toggle_full_screen(self) -> None:
        """Fills the screen or goes back."""

    def close(self) -> None:
        """Closes it and leaves SDL's video."""
        pygame.display.quit()

    def __enter__(self) -> "Window":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class ScreenWindow(Window):
    """A window on the screen that can be resized and fill it."""

    def follow_size(self) -> bool:
        """Takes over the size the user gave the window; True if it changed."""
        width, height = (max(side, 1) for side in pygame.display.get_window_size())  # a minimised window has none
        changed, self.size = (width, height) != self.size, (width, height)
        return changed

    def toggle_full_screen(self) -> None:
        """Fills the screen or goes back."""
        pygame.display.toggle_fullscreen()


class OffscreenWindow(Window):
    """The same without a screen: it has a framebuffer of its own, so no other window can cover its pixels."""

    def __init__(self, size: tuple[int, int]) -> None:
        super().__init__(size)
        self._target = self._gl.Target(*self.size, depth=False)
        self.framebuffer = self._target.handle
        self.bind()

    def show(self) -> None:
        """Nothing to show: the pixels stay to be read."""

    def follow_size(self) -> bool:
        """Its size is as it was opened."""
        return False

    def toggle_full_screen(self) -> None:
        """There is no screen to fill."""


def open_window(size: tuple[int, int] | None = None, visible: bool = True) -> Window:
    """Opens a window of (width, height) pixels, on the screen or off it, with a current OpenGL 3.3 context bound to it.

    Without a size it takes two thirds of the screen.

    Raises NoDisplay where there is no screen (visible windows only) and NoGL where OpenGL cannot be had; each says in
    one sentence what is missing and which package brings it."""
    if visible and not has_display():
        raise NoDisplay("there is no display to open a window on: set DISPLAY or WAYLAND_DISPLAY, or run headless")
    pygame.display.quit()
    os.environ["SDL_VIDEO_X11_WMCLASS"] = TITLE  # what a taskbar files the window under; pygame set another
    os.environ.setdefault("SDL_WINDOWS_DPI_AWARENESS", "permonitorv2")  # else Windows magnifies the picture, blurred
    with _video_driver(None if visible else _offscreen_driver()):
        try:
            pygame.display.init()
        except pygame.error as error:
            raise NoDisplay(
                f"the display cannot be opened ({error}): check DISPLAY or WAYLAND_DISPLAY, or run headless"
            ) from None
    size = size or size_for(pygame.display.get_desktop_sizes()[0])
    try:
        _make_context(size if visible else (16, 16), visible)
        return (ScreenWindow if visible else OffscreenWindow)(size)
    except NoGL:
        pygame.display.quit()
        raise


def size_for(screen: tuple[int, int]) -> tuple[int, int]:
    """The size of a window on a screen of that size: 1280 x 720 where it is 1920 x 1080, more on a denser one."""
    share = min(screen[0] / 1920, screen[1] / 1080)
    scale = round(4 * share) / 4 if share >= 1 else min(1.0, 1.35 * share)
    return round(BASE_SIZE[0] * scale), round(BASE_SIZE[1] * scale)


def has_display() -> bool:
    """Whether a visible window can be tried: macOS and Windows have a screen, elsewhere the environment names it."""
    if sys.platform in ("darwin", "win32"):
        return True
    driver, named = os.environ.get("SDL_VIDEODRIVER"), os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return driver == "offscreen" or (driver != "dummy" and bool(named))


def _offscreen_driver() -> str | None:
    return None if sys.platform in ("darwin", "win32") else "offscreen"  # there, a hidden window of the usual kind


class _video_driver:
    """Names SDL's video driver while the block runs; None leaves the user's choice."""

    def __init__(self, name: str | None) -> None:
        self._name, self._before = name, os.environ.get("SDL_VIDEODRIVER")

    def __enter__(self) -> None:
        if self._name:
            os.environ["SDL_VIDEODRIVER"] = self._name

    def __exit__(self, *_: object) -> None:
        if self._name:
            os.environ.pop("SDL_VIDEODRIVER")
            if self._before is not None:
                os.environ["SDL_VIDEODRIVER"] = self._before


def _make_context(size: tuple[int, int], visible: bool) -> None:
    for attribute, value in (
        (pygame.GL_CONTEXT_MAJOR_VERSION, GL_VERSION[0]),
        (pygame.GL_CONTEXT_MINOR_VERSION, GL_VERSION[1]),
        (pygame.GL_CONTEXT_PROFILE_MASK, pygame.GL_CONTEXT_PROFILE_CORE),
        (pygame.GL_CONTEXT_FLAGS, pygame.GL_CONTEXT_FORWARD_COMPATIBLE_FLAG),
    ):
        pygame.display.gl_set_attribute(attribute, value)
    flags = pygame.OPENGL | pygame.DOUBLEBUF | (pygame.RESIZABLE if visible else pygame.HIDDEN)
    try:
        with warnings.catch_warnings(action="ignore"):  # pygame warns where it cannot wait for the screen; no harm done
            pygame.display.set_mode(size, flags, vsync=1 if visible else 0)
    except pygame.error as error:
        if not visible:
            raise NoGL(f"OpenGL 3.3 cannot be had ({error}); {PACKAGES}") from None
        try:
            pygame.display.set_mode(size, flags)  # some drivers refuse to wait for the screen
        except pygame.error as second:
            raise NoGL(f"OpenGL 3.3 cannot be had ({second}); {PACKAGES}") from None


def _load_gl() -> ModuleType:
    """demo.render.gl, imported for the platform the open window runs on. Raises NoGL."""
    platform = PYOPENGL_PLATFORMS.get(pygame.display.get_driver())
    if platform and "OpenGL" not in sys.modules:
        os.environ["PYOPENGL_PLATFORM"] = platform
    try:
        import OpenGL

        OpenGL.ERROR_CHECKING = False  # a question to the driver after every call; tests ask once at the end instead
        from demo.render import gl

        if gl.version() < GL_VERSION:
            needed, found = (".".join(map(str, version)) for version in (GL_VERSION, gl.version()))
            raise NoGL(f"OpenGL {needed} is needed but this machine offers {found}; {PACKAGES}")
    except (ImportError, AttributeError, TypeError) as error:  # what PyOpenGL raises where libraries are missing
        raise NoGL(f"OpenGL's libraries cannot be loaded ({error}); {PACKAGES}") from None
    return gl
