"""What an exported graph hands from frame to frame, the poses that graphs hand to each other, and the ground that they
ask for."""

import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Callable, NamedTuple, Sequence

import numpy as np

from demo.export.onnx_recorder import Graph, Recorded
from sim.body.pose import FLAT_SIZE
from sim.ground.ground import SLOPE_STEP

# Where the blurred ground is looked at about the root, x and z in metres: under it, and for its slope.
AROUND = np.concatenate([np.zeros((1, 2)), SLOPE_STEP * np.eye(2), -SLOPE_STEP * np.eye(2)])


@dataclass(frozen=True)
class Kept:
    """One array of a graph's state: whose attribute it is, and what it holds."""

    owner: Any
    name: str
    meaning: str


class State:
    """What a graph hands from frame to frame: the attributes of `kept`, one after the other."""

    def __init__(self, kept: Sequence[Kept], step: Callable[[], object]) -> None:
        """step: makes one frame as the program does, which shows the shapes; the state is as before it."""
        self.kept = kept
        before = copy.deepcopy([getattr(each.owner, each.name) for each in kept])
        step()
        self.initial, self.kinds = [], []
        for each, value in zip(kept, before):
            after = np.asarray(getattr(each.owner, each.name))
            self.initial.append(np.broadcast_to(np.asarray(value, float), after.shape))
            self.kinds.append(after.dtype.kind)

    @property
    def numbers(self) -> np.ndarray:
        """All of them at the start; NaN for what is not yet there."""
        return np.concatenate([value.ravel() for value in self.initial])

    @property
    def layout(self) -> list[dict[str, Any]]:
        """Name, first entry, shape and meaning of each array."""
        ends = np.cumsum([value.size for value in self.initial])
        return [
            {"name": each.name.strip("_"), "first": int(end - value.size), "shape": value.shape, "what": each.meaning}
            for each, value, end in zip(self.kept, self.initial, ends)
        ]

    def read(self, graph: Graph) -> None:
        """Sets every attribute to its part of the graph's input."""
        numbers, end = graph.input("state", self.numbers), 0
        for each, value, kind in zip(self.kept, self.initial, self.kinds):
            start, end = end, end + value.size
            part = numbers[start:end].reshape(value.shape).copy()
            setattr(each.owner, each.name, part.astype("b") if kind == "b" else part)

    def write(self, graph: Graph) -> None:
        """Makes the graph's output of them."""
        parts = [getattr(each.owner, each.name) for each in self.kept]
        flat = [part.astype("f").ravel() for part in parts]
        graph.output("next_state", np.concatenate(flat))


class Made(NamedTuple):
    """A graph, what it hands from frame to frame, and what it does."""

    graph: Graph
    state: State
    what: str


class Ask:
    """Ground that the player knows and the graph asks for: places are outputs of the graph, heights its inputs. How
    high it is AROUND the root the player knows from the frame before."""

    def __init__(self, graph: Graph) -> None:
        self.graph, self.asked = graph, 0
        self.places: dict[str, list[Recorded]] = {"heights": [], "smooth_heights": []}

    def __deepcopy__(self, memo: dict[int, object]) -> "Ask":
        return self

    def height_at(self, places: Recorded) -> Recorded:
        return self._asked("heights", places)

    def smooth_height_at(self, places: Recorded) -> Any:
        """Asked for under the root, then along its way, and at last where the root has gone: there it is 0, and the
        player adds what it is."""
        self.asked += 1
        return (lambda: self.around[0], lambda: self._asked("smooth_heights", places), lambda: 0.0)[self.asked - 1]()

    def slope_at(self, _: Recorded) -> Any:
        return (self.around[1:3] - self.around[3:5]) / (2 * SLOPE_STEP)

    @cached_property
    def around(self) -> Recorded:
        return self.graph.input("around", np.zeros(len(AROUND)))

    def _asked(self, kind: str, places: Recorded) -> Recorded:
        name = f"{kind}_{len(self.places[kind])}"
        self.places[kind].append(places)
        self.graph.output(f"places_of_{name}", places)
        return self.graph.input(name, np.zeros(places.shape[:-1]))


def moved_poses(numbers: Any, moved: Any) -> Any:
    """Flat poses (..., FLAT_SIZE), told from a root that has moved by (2,) since."""
    shift = np.zeros((FLAT_SIZE,))
    shift[0], shift[2], shift[4], shift[6] = moved[0], moved[1], moved[0], moved[1]
    return numbers - shift


def over_floor(moved: Any) -> Any:
    """(3,) of a way over the floor (2,)."""
    result = np.zeros((3,))
    result[0], result[2] = moved[0], moved[1]
    return result
