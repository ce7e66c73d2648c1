"""A recording watched in a window: the live window's picture at the recording's own pace; the mouse turns the
camera."""

import time
from typing import Iterable, Iterator

import pygame

from demo.figure.character_model import DrawnCharacter
from demo.figure.colours import worn
from demo.input.devices import take_events
from demo.input.pointer import Pointer
from demo.render.camera import Camera
from demo.render.renderer import Renderer
from demo.render.view import View
from demo.render.window import open_window
from demo.state.bindings import DEFAULT
from demo.ui import panels
from sim.character.character import Character
from sim.command import Command
from sim.motion.clip import FPS
from sim.session import Frame, Session


def watch(session: Session, commands: Iterable[Command], character: Character | None = None) -> Iterator[Frame]:
    """Every frame of the replay, by the figure or by a character, each shown when its time has come; a slow machine
    shows fewer, and steps them all.

    After Esc, or with the window closed, the rest comes as fast as it goes. Raises NoDisplay and NoGL
    (demo.render.window)."""
    with open_window() as window:
        renderer, view, pointer = Renderer(window.size), View(ground=session.ground), Pointer(DEFAULT.mouse)
        view.dress(DrawnCharacter(character) if character else None)
        watching, start = True, time.perf_counter()
        for number, command in enumerate(commands):
            frame = session.step(command)
            yield frame
            if not watching:
                continue
            events = take_events()
            watching = not any(_leaves(event) for event in events)
            _turn(view.camera, pointer, events)
            if window.follow_size():
                renderer.resize(window.size)
            view.panels = (panels.parts(worn(frame)),)
            view.make_room(window.size)
            view.follow(frame, 1 / FPS)
            ahead = start + number / FPS - time.perf_counter()
            if ahead < -1 / FPS and number % FPS:  # late: skip the picture, but show one a second however late
                continue
            time.sleep(max(0.0, ahead))
            with session.latency.stage("render"):
                window.bind()
                renderer.draw(frame, view)
            window.show()


def _turn(camera: Camera, pointer: Pointer, events: Iterable[pygame.event.Event]) -> None:
    """Lets the mouse orbit and zoom, as in the live window."""
    handlers = {
        pygame.MOUSEBUTTONDOWN: pointer.down,
        pygame.MOUSEBUTTONUP: pointer.up,
        pygame.MOUSEMOTION: pointer.motion,
        pygame.MOUSEWHEEL: pointer.wheel,
    }
    actions = [action for event in events if event.type in handlers for action in handlers[event.type](event)]
    camera.zoom(actions.count("zoom_in") - actions.count("zoom_out"))
    camera.orbit(*pointer.orbit)
    pointer.orbit = [0.0, 0.0]


def _leaves(event: pygame.event.Event) -> bool:
    return event.type == pygame.QUIT or (event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE)
