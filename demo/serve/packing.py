"""The user's character of a visitor, made ready for its page in a thread while the visitor walks on."""

from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from demo.figure.character_model import DrawnCharacter
from demo.serve.model_file import Bones
from sim.character.character import Character


class Packed(NamedTuple):
    """A character, its bones as packets carry them, and its model for the page."""

    drawn: DrawnCharacter
    bones: Bones
    model: bytes


class Packing:
    """One character after the other."""

    def __init__(self) -> None:
        self._bones: Bones | None = None  # of the character that was finished last
        self._thread = ThreadPoolExecutor(1, "pack a character")
        self._waiting: list[Future[Packed | str]] = []

    def begin(self, character: Character | DrawnCharacter) -> None:
        """Packs a character from now on; one that was asked for before is of no interest any more."""
        self.drop()
        self._waiting = [self._thread.submit(self._pack, character)]

    def drop(self) -> None:
        """None is wanted."""
        self._bones = None
        self._waiting.clear()

    def finished(self) -> Packed | str | None:
        """The character, once; or why the page cannot show it."""
        if not self._waiting or not self._waiting[0].done():
            return None
        result = self._waiting.pop().result()
        self._bones = result.bones if isinstance(result, Packed) else None
        return result

    def pose(self, shown: DrawnCharacter | None, root: np.ndarray) -> bytes:
        """The bones of the character's newest pose, for a packet; none where it is not finished or not shown."""
        return self._bones.packed(shown.newest, root) if self._bones and shown else b""

    def _pack(self, character: Character | DrawnCharacter) -> Packed | str:
        drawn = DrawnCharacter(character) if isinstance(character, Character) else character
        try:
            bones = Bones(drawn.character)
        except ValueError as error:
            return str(error)
        return Packed(drawn, bones, bones.model(drawn.model))
