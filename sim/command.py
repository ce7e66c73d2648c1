"""What the player asks for in one frame."""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Mapping, Sequence

import numpy as np

from sim.style_spec import PartLike, StyleSpec, abbreviate

FULL_STICK = 1.001  # the longest stick: rounding may make a full one longer than 1
GAIT_SPEEDS = {"walk": 1.3, "run": 3.5, "crouch": 1.0}  # metres a second at full stick


def check_pair(name: str, value: object) -> None:
    """Raises ValueError for what is not two finite numbers."""
    try:
        x, z = (float(each) for each in value)  # type: ignore[attr-defined]
        if not isinstance(value, str) and math.isfinite(x) and math.isfinite(z):
            return
    except (TypeError, ValueError):
        pass
    raise ValueError(f"{name} is {abbreviate(value)}, but must be two numbers (x, z)")


def check_length(move: Sequence[float]) -> None:
    """Raises ValueError for a stick (x, z) that is longer than a full one."""
    if math.hypot(*move) > FULL_STICK:
        raise ValueError(f"move is {abbreviate(move)}, longer than 1, the full stick; scale it down")


def check_gait(gait: object) -> None:
    """Raises ValueError for what is no name of GAIT_SPEEDS."""
    if not isinstance(gait, str) or gait not in GAIT_SPEEDS:
        raise ValueError(f"gait is {abbreviate(gait)}, but must be one of {', '.join(GAIT_SPEEDS)}")


@dataclass(frozen=True)
class Command:
    """One frame of input, in world axes. Raises ValueError, in one sentence, for what is none.

    move: (x, z) stick, length at most 1, (0, 0) to stand; +x is to the left of who faces +z.
    face: (x, z) wanted facing direction, or None to face where it goes.
    gait: walk, run or crouch; one who stands crouches too.
    style: body part or group name -> a style's name, (style name, strength 0 .. 1.5) or (style name, strength, other
        style, share 0 .. 1 of the way to the other), for the parts that are restyled; the others keep their own style.
    pace: whether the styles of the legs set speed, stride and cadence.
    jump: whether the jump is pressed in this frame.
    """

    move: tuple[float, float] = (0.0, 0.0)
    face: tuple[float, float] | None = None
    gait: str = "walk"
    style: StyleSpec = field(default_factory=StyleSpec)
    pace: bool = False
    jump: bool = False

    if TYPE_CHECKING:  # the same, but that a plain mapping is taken for a style too

        def __init__(
            self,
            move: tuple[float, float] = (0.0, 0.0),
            face: tuple[float, float] | None = None,
            gait: str = "walk",
            style: StyleSpec | Mapping[str, PartLike] = ...,
            pace: bool = False,
            jump: bool = False,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_pair("move", self.move)
        if self.face is not None:
            check_pair("face", self.face)
        check_length(self.move)
        check_gait(self.gait)
        for name, switch in (("pace", self.pace), ("jump", self.jump)):
            if not isinstance(switch, bool | np.bool_):
                raise ValueError(f"{name} is {abbreviate(switch)}, but must be True or False")
        object.__setattr__(self, "style", StyleSpec.of(self.style))

    @property
    def gaits(self) -> tuple[str, ...]:
        """The gait, as a crowd has it."""
        return (self.gait,)

    @property
    def crouch(self) -> float:
        """How far it is to crouch, 0 or 1."""
        return float(self.gait == "crouch")

    @property
    def desired_velocity(self) -> np.ndarray:
        """What the stick asks, before any spring: (2,) world x, z in metres a second."""
        return np.array(self.move) * GAIT_SPEEDS[self.gait]

    @property
    def heading(self) -> np.ndarray:
        """Where it is to face: (2,) world x, z of any length, next to none for no wish."""
        return np.array(self.move if self.face is None else self.face)


@dataclass(frozen=True)
class Commands:
    """What is asked of each of a crowd in one frame: as of one, with the characters as leading axis. Raises ValueError
    for what is no list of commands."""

    each: Sequence[Command]

    def __post_init__(self) -> None:
        if not (isinstance(self.each, Sequence) and self.each and all(isinstance(each, Command) for each in self.each)):
            raise ValueError(f"a crowd is given {abbreviate(self.each)}, but needs a list of Command, one for each")

    def of(self, which: np.ndarray) -> "Commands":
        """Those of some characters, (characters,) of bool."""
        return Commands([command for command, meant in zip(self.each, which) if meant])

    @property
    def desired_velocity(self) -> np.ndarray:
        """(characters, 2)"""
        return np.array([command.desired_velocity for command in self.each])

    @property
    def gaits(self) -> tuple[str, ...]:
        """One for each character."""
        return tuple(command.gait for command in self.each)

    @property
    def pace(self) -> np.ndarray:
        """(characters,) of bool"""
        return np.array([command.pace for command in self.each])

    @property
    def jump(self) -> np.ndarray:
        """(characters,) of bool"""
        return np.array([command.jump for command in self.each])

    @property
    def crouch(self) -> np.ndarray:
        """(characters,) of 0 or 1"""
        return np.array([command.crouch for command in self.each])

    @property
    def heading(self) -> np.ndarray:
        """(characters, 2)"""
        return np.array([command.heading for command in self.each])

    @property
    def style(self) -> list[StyleSpec]:
        """One for each character."""
        return [command.style for command in self.each]
