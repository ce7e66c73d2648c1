"""Stand-ins that need no weights: a procedural walker and a stylizer that bends the joints of each part."""

from dataclasses import replace

import numpy as np
import pygame
import pytest

from demo.render.window import NoDisplay, NoGL, Window, open_window
from sim.body.kinematics import to_global
from sim.body.pose import Pose
from sim.body.skeleton import CONTACT_JOINTS, INDEX, JOINT_COUNT, PARTS, REST_HIPS_HEIGHT
from sim.command import Command
from sim.ground.ground import Ground
from sim.math import rotations as rot
from sim.motion.playback_pace import OWN_PACE, Pace
from sim.session import Session
from tests.conftest import FakeStylizer

DT = 1 / 60
X, Z = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
STRIDE_PHASE = 2 * np.pi / 1.4  # radians a metre
BENDS = {"bent": 0.35, "flapping": -0.6, "marching": 0.2}  # style name -> radians


class Walker:
    """Goes where the stick points and swings legs and arms as sines of a phase that advances with the way."""

    fingerprint = trajectory = ground = None

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        self.position, self.velocity, self.facing, self.phase = np.zeros(3), np.zeros(2), 0.0, 0.0

    def stand_on(self, ground: Ground | None) -> None:
        self.ground = ground
        self.restart()

    def step(self, command: Command, pace: Pace = OWN_PACE) -> Pose:
        self.velocity = self.velocity + (command.desired_velocity - self.velocity) * 0.12
        speed = float(np.linalg.norm(self.velocity))
        self.position = self.position + np.array([self.velocity[0], 0, self.velocity[1]]) * DT
        if self.ground:
            self.position[1] = self.ground.smooth_height_at(self.position[[0, 2]])
        self.phase = (self.phase + speed * STRIDE_PHASE * DT) % (2 * np.pi)
        wanted = command.face or (self.velocity if speed > 0.1 else None)
        if wanted is not None:
            self.facing += 0.15 * float(rot.wrap_angle(np.arctan2(wanted[0], wanted[1]) - self.facing))
        return self._pose(min(speed / 1.3, 1.6))

    def _pose(self, effort: float) -> Pose:
        turns = {}  # joint -> angles about its x and z axes
        for side, sign, phase in (("Left", 1, self.phase), ("Right", -1, self.phase + np.pi)):
            swing = np.sin(phase)
            turns[f"{side}UpLeg"] = np.array([-0.45 * swing * effort - 0.1 * effort, 0.02 * sign])
            turns[f"{side}Leg"] = np.array([(0.15 + 0.65 * max(0.0, np.cos(phase))) * effort, 0])
            turns[f"{side}Foot"] = np.array([-0.12 * effort * swing, 0])
            turns[f"{side}Arm"] = np.array([0.5 * swing * effort, -1.28 * sign])
        turns["Spine"] = np.array([0.05 * effort, 0])
        local = np.tile(rot.IDENTITY, (JOINT_COUNT, 1))
        for name, (about_x, about_z) in turns.items():
            local[INDEX[name]] = rot.multiply(rot.from_axis_angle(X, about_x), rot.from_axis_angle(Z, about_z))
        for side, sign in (("Left", 1), ("Right", -1)):
            local[INDEX[f"{side}ForeArm"]] = rot.from_axis_angle(np.array([0, 1.0, 0]), -sign * (0.25 + 0.35 * effort))
        local[0] = rot.from_yaw(self.facing)
        hips = self.position + [0, REST_HIPS_HEIGHT, 0]
        pose = Pose(self.position, self.facing, hips, to_global(local), np.zeros(4), self.phase)
        feet = pose.positions[CONTACT_JOINTS, 1]
        lowest = min(feet[1], feet[3], feet[0] - 0.05, feet[2] - 0.05) - self.position[1]
        pose = pose.with_body(pose.hips - [0, lowest - 0.02, 0], pose.rotations)
        heights = pose.positions[CONTACT_JOINTS, 1] - self.position[1] - [0.07, 0.02, 0.07, 0.02]
        return replace(pose, contacts=np.clip(1 - heights / 0.04, 0, 1))


class Bender(FakeStylizer):
    """Turns the joints of each styled part about their x axis. Raises ValueError for a style that is not in BENDS."""

    def step(self, window: np.ndarray, neutral: Pose, style, travel=1.0) -> Pose:
        local = neutral.local_rotations.copy()
        for part, spec in style.items():
            if spec.name not in BENDS:
                raise ValueError(f"unknown style '{spec.name}'")
            joints = [joint for joint in PARTS[part] if joint != 0]
            bend = rot.from_axis_angle(X, np.array(BENDS[spec.name] * spec.strength * 0.5))
            local[joints] = rot.multiply(local[joints], np.tile(bend, (len(joints), 1)))
        return neutral.with_body(neutral.hips, to_global(local))


def fake_session(ground: Ground | None = None) -> Session:
    """A session that needs no weights."""
    return Session(Walker(), Bender(), ground=ground)


def key(name: str, down: bool = True, mod: int = 0) -> pygame.event.Event:
    """The event of a key going down or up, by pygame's name of it, with modifiers such as pygame.KMOD_CTRL."""
    return pygame.event.Event(pygame.KEYDOWN if down else pygame.KEYUP, key=pygame.key.key_code(name), mod=mod)


def text(letters: str) -> pygame.event.Event:
    """The event of letters that were typed."""
    return pygame.event.Event(pygame.TEXTINPUT, text=letters)


def mouse(kind: int, at: tuple[float, float], **more) -> pygame.event.Event:
    """An event of the mouse at a point in pixels: pygame.MOUSEBUTTONDOWN, ..UP (button=1), MOUSEMOTION (rel,
    buttons)."""
    return pygame.event.Event(kind, pos=(round(at[0]), round(at[1])), **more)


def click(at: tuple[float, float], button: int = 1) -> list[pygame.event.Event]:
    """A button pressed and let go at a point."""
    return [mouse(pygame.MOUSEBUTTONDOWN, at, button=button), mouse(pygame.MOUSEBUTTONUP, at, button=button)]


def offscreen(size: tuple[int, int]) -> Window:
    """A window that nobody sees; where there is no OpenGL the test is skipped, with the reason."""
    try:
        return open_window(size, visible=False)
    except (NoGL, NoDisplay) as error:
        pytest.skip(f"no pictures on this machine: {error}")
