"""The README's picture: `python -m demo.pictures` draws it again, with the product's own session and renderer."""

from pathlib import Path

import numpy as np
import pygame

from demo import assemble, panels
from demo.renderer import Renderer
from demo.view import View
from demo.window import Window, open_window
from sim.command import Command
from sim.skeleton import expand_part

PICTURE = Path(__file__).parent / "pictures" / "styles.png"
SIZE = (250, 360)  # pixels of each panel
FRAMES = 204  # of a straight walk; the moment is chosen so that the step is wide
DISTANCE = 2.7  # metres from the camera
# What each panel's walker wears: part or group -> style.
PANELS = ({}, {"all": "old"}, {"all": "proud"}, {"all": "childish"}, {"all": "marching"},
          {"legs": "old", "spine": "proud", "arms": "marching"})


def draw() -> None:
    """Writes PICTURE: the same step of the same walk, in one style after another."""
    with open_window(SIZE, visible=False) as window:
        strip = np.concatenate([_panel(window, wears) for wears in PANELS], axis=1)
    pygame.image.save(pygame.image.frombuffer(strip.tobytes(), strip.shape[1::-1], "RGB"), str(PICTURE))


def _panel(window: Window, wears: dict[str, str]) -> np.ndarray:
    style = {part: (name, 1.0) for group, name in wears.items() for part in expand_part(group)}
    session = assemble.build_session()
    for _ in range(FRAMES):
        frame = session.step(Command((0.0, 1.0), style=style))
    caption = ", ".join(f"{name} {group}" if len(wears) > 1 else name for group, name in wears.items()) or "neutral"
    view = View(arrow=False, contacts=False, panels=(panels.line(caption, "bottom"),))
    view.camera.distance = DISTANCE
    view.camera.jump(frame.styled.root_position)
    window.bind()
    renderer = Renderer(window.size)
    renderer.draw(frame, view)
    return window.read_pixels()


if __name__ == "__main__":
    draw()
