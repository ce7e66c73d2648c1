"""The README's pictures: `python -m demo.tools.pictures` draws them again, with the product's own session, window and
renderer."""

import tempfile
from itertools import islice
from pathlib import Path
from typing import Generator

import numpy as np
import pygame

from demo import assemble
from demo.export import video
from demo.live.live import Live
from demo.render.camera import Camera
from demo.render.renderer import Renderer
from demo.render.view import View
from demo.render.window import Window, open_window
from demo.state.presets import Presets, describe
from demo.ui import panels
from sim.command import Command
from sim.ground.catalogue import load_ground
from sim.io import recording
from sim.motion.clip import FPS
from sim.session import Session
from stylizer.systems import weight_files

FOLDER = Path(__file__).parents[1] / "pictures"
STRIP_SIZE = (290, 360)  # pixels of each walker
STRIP_FRAMES = 204  # of a straight walk; the moment is chosen so that the step is wide
STRIP_DISTANCE = 3.0  # metres from the camera
# The styles of each walker of the strip, all of permissive motion: part or group -> style.
STRIP: tuple[dict[str, str], ...] = (
    {},
    {"all": "zombie"},
    {"all": "crouching"},
    {"all": "strutting"},
    {"all": "marching"},
    {"legs": "zombie", "spine": "leaning", "arms": "marching"},
)
SYSTEM_SIZE = (220, 280)
SYSTEM_STRIP: tuple[dict[str, str], ...] = (
    {},
    *({"all": style} for style in ("zombie", "prowling", "strutting", "marching", "hunched")),
)

WINDOW_SIZE = (1280, 720)
WINDOW_FRAMES = 150
WINDOW_ACTIONS = ("preset_1", "pick_left_arm", "skeleton", "trajectory", "phase", "times", "attention", "twin")

GIF_SIZE = (400, 280)
GIF_START, GIF_FRAMES = 1460, 500  # of the bundled recording: the frame of the first picture, and how many from there
GIF_DISTANCE = 4.2


def draw() -> None:
    """Writes every picture."""
    strip()
    systems()
    live_window()
    gif()


def strip() -> None:
    """styles.png: the same step of the same walk, in one style after another."""
    with open_window(STRIP_SIZE, visible=False) as window:
        _save("styles.png", np.concatenate([_walker(window, parts) for parts in STRIP], axis=1))


def systems() -> None:
    """systems.png: the same step in the same styles, as each stylizer of the package has them, one a row."""
    with open_window(SYSTEM_SIZE, visible=False) as window:
        rows = [[_walker(window, parts, name) for parts in SYSTEM_STRIP] for name in weight_files.names()]
        _save("systems.png", np.concatenate([np.concatenate(row, axis=1) for row in rows], axis=0))


def live_window() -> None:
    """window.png: the live window with its panels and what can be seen inside."""
    with open_window(WINDOW_SIZE, visible=False) as window, tempfile.TemporaryDirectory() as folder:
        session = assemble.build_session()
        live = Live(session, session.stylizer.styles, window, presets=Presets(Path(folder) / "none"))
        # nobody is at the keys
        live.devices.command = lambda yaw, facing, style, seconds: Command(  # type: ignore[method-assign, assignment]
            (0.45, 0.85), style=style, pace=True
        )
        live.view.camera.orbit(0.35, 0.02)
        for action in WINDOW_ACTIONS:
            live.do(action)
        for _ in range(WINDOW_FRAMES):
            live.step()
            live.draw()  # each one, because times and colours are of the pictures before
        _save("window.png", window.read_pixels())


def gif() -> None:
    """walk.gif: a stretch of the bundled recording."""
    video.write_gif(FOLDER / "walk.gif", _excerpt())


def _excerpt() -> Generator[np.ndarray, None, None]:
    recorded = recording.read(assemble.BUNDLED_RECORDING)
    session, ground = assemble.build_session(), load_ground(recorded.ground)
    session.stand_on(ground)
    view = View(Camera(distance=GIF_DISTANCE), arrow=False, contacts=False, ground=ground)
    with open_window(GIF_SIZE, visible=False) as window:
        renderer = Renderer(window.size, supersample=video.SUPERSAMPLE)
        for number, command in enumerate(islice(recorded, GIF_START + GIF_FRAMES), -GIF_START):
            frame = session.step(command)
            if number == -GIF_START:
                view.jump_to(frame)
            view.follow(frame, 1 / FPS)
            if number >= 0 and number % video.GIF_STEP == 0:
                view.panels = (panels.line(describe(command.style), "bottom"),)
                view.make_room(window.size)
                window.bind()
                renderer.draw(frame, view)
                yield window.read_pixels()


def _walker(window: Window, parts: dict[str, str], stylizer: str | None = None) -> np.ndarray:
    session: Session = assemble.build_session(stylizer)
    for _ in range(STRIP_FRAMES):
        frame = session.step(Command((0.0, 1.0), style=parts, pace=True))
    caption = ", ".join(f"{name} {group}" if len(parts) > 1 else name for group, name in parts.items()) or "neutral"
    caption = f"{stylizer}: {caption}" if stylizer else caption
    view = View(Camera(distance=STRIP_DISTANCE), arrow=False, contacts=False, panels=(panels.line(caption, "bottom"),))
    view.make_room(window.size)
    view.jump_to(frame)
    window.bind()
    Renderer(window.size, supersample=video.SUPERSAMPLE).draw(frame, view)
    return window.read_pixels()


def _save(name: str, pixels: np.ndarray) -> None:
    pygame.image.save(pygame.image.frombuffer(pixels.tobytes(), pixels.shape[1::-1], "RGB"), str(FOLDER / name))


if __name__ == "__main__":
    draw()
