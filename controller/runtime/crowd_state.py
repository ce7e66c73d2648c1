"""The state of some of a crowd: taken out, moved on, and put back."""

import copy
from typing import Protocol, TypeVar

import numpy as np


class CrowdState(Protocol):
    """STATE names what a class keeps from frame to frame: arrays whose first axis is that of the characters, or another
    such state."""

    @property
    def STATE(self) -> tuple[str, ...]: ...


S = TypeVar("S", bound=CrowdState)


def select(state: S, which: np.ndarray) -> S:
    """The state of those of a crowd's characters (n,) who are meant; what is no state is shared."""
    some = copy.copy(state)
    for name in state.STATE:
        value = getattr(state, name)
        setattr(some, name, value[which] if isinstance(value, np.ndarray) else select(value, which))
    return some


def put_back(state: CrowdState, which: np.ndarray, some: CrowdState) -> None:
    """Gives those of a crowd's characters (n,) who are meant the state that `select` took out."""
    for name in state.STATE:
        value, new = getattr(state, name), getattr(some, name)
        if isinstance(value, np.ndarray):
            value = value.copy()  # somebody may hold the former one
            value[which] = new
            setattr(state, name, value)
        else:
            put_back(value, which, new)
