"""Words beside the figure: the style of what has just changed, and which one is the neutral twin."""

from functools import partial
from typing import Callable, Iterator, Sequence

import numpy as np

from demo.figure.colours import OWN_STYLE, TWIN, spec_colour, worn
from demo.render.view import View
from demo.state.style_choice import OWN
from demo.ui import panels
from demo.ui.canvas import ACCENT, Box
from demo.ui.hud import Panel, Placed, scale_for
from sim.body.pose import Pose
from sim.body.skeleton import GROUPS, INDEX, PART_NAMES, PARTS, expand_part
from sim.math.vectors import UP
from sim.session import Frame
from sim.style_spec import PartSpec, StyleSpec

SECONDS = 2.0  # that a change is named
AWAY = 8  # units between the figure and its words
REACH = 0.5  # metres from the middle of the figure that words beside it keep away, lest they swing with its arms
STEPS = (0, -1, 1, -2, 2, -3, 3, -4, 4)  # lines up and down from its part that words look for room
# Where words of some width and height go that keep a distance from the figure: left and top, all in pixels.
Corner = Callable[[float, float, float], tuple[float, float]]
NEAR, MOST_TOLD = 3.0, 4  # metres from who is steered within which others of a crowd are told, and how many at most
HEAD, CROWN = INDEX["Head"], 0.22  # the joint, and metres from it to over the top of the head
CAPTIONS = {"beside": "neutral", "ghost": "neutral, see-through"}


class Labels:
    """Remembers what each part's style was, to name what changes."""

    def __init__(self) -> None:
        self._before: StyleSpec | None = None
        self._until = dict.fromkeys(PART_NAMES, float("-inf"))

    def follow(self, frame: Frame, now: float) -> None:
        """Takes in the newest frame at time `now` in seconds."""
        style = worn(frame)
        if self._before is not None:
            for part in PART_NAMES:
                if style.get(part) != self._before.get(part):
                    self._until[part] = now + SECONDS
        self._before = style

    def place(
        self, frame: Frame, view: View, size: tuple[int, int], now: float, others: Sequence[StyleSpec] = ()
    ) -> list[Placed]:
        """The words in a picture of that size, each where the panels, the figures and the words before it leave room;
        none where there is no room at all. others: what each of the crowd in the view moves in: who is steered is
        pointed out, and those that come near are told."""
        changes = list(self._changes(worn(frame), now))
        if not (view.twin or view.crowd or changes):
            return []
        room = _Room(view.free_area(size), scale_for(size))
        figure = view.own_box(frame, size)
        room.taken.append(figure)
        if view.crowd:
            self._tell_crowd(room, frame, view, size, others)
        if view.twin:
            twin = view.figure_box(frame.neutral, size, view.twin_shift(frame))
            room.taken.append(twin)
            room.put([panels.label(CAPTIONS[view.twin], TWIN)], [partial(_over, twin, 1)])
        middle = view.pixels(frame.styled.root_position[None], size)[0, 0]
        reach = REACH / (view.camera.metres_a_pixel(size) * view.camera.distance)
        right, left = max(figure[0] + figure[2], middle + reach), min(figure[0], middle - reach)
        if view.twin == "ghost":
            right, left = max(right, twin[0] + twin[2]), min(left, twin[0])
        for text, name, spec in changes:
            colour = tuple(spec_colour(spec).round(3).tolist()) if spec else OWN_STYLE
            texts = (text,) if name == "all" else (f"{panels.readable(name)}: {text}", text)
            joints = frame.styled.positions[np.concatenate([PARTS[part] for part in expand_part(name)])]
            at = float(view.pixels(joints, size)[:, 1].mean())
            beside: list[Corner] = [partial(_right_of, right, at, step) for step in STEPS]
            if view.twin != "beside":
                beside += [partial(_left_of, left, at, step) for step in STEPS]
            words = [panels.label(each, colour) for each in texts]
            lines = range(1, len(STEPS))
            ends: list[Corner] = [partial(each, figure, step) for each in (_over, _under) for step in lines]
            if not room.put(words, beside):
                room.put(words, ends)
        return room.placed

    def _tell_crowd(
        self, room: "_Room", frame: Frame, view: View, size: tuple[int, int], styles: Sequence[StyleSpec]
    ) -> None:
        """Over the heads: who is steered, and what those who are near it move in."""
        assert view.crowd
        poses, _ = view.crowd
        figure, head = view.own_box(frame, size), _head(view, frame.styled, size)
        over: list[Corner] = [partial(_over, head, 1), *(partial(_over, figure, step) for step in range(1, len(STEPS)))]
        room.put([panels.label("you", ACCENT)], over)  # over its hands, where it lifts them over its head
        away = np.linalg.norm(poses.root_position - frame.styled.root_position, axis=-1)
        for one in [each for each in np.argsort(away)[:MOST_TOLD] if away[each] < NEAR]:
            room.put([panels.mixture(styles[one])], [partial(_over, _head(view, poses[one], size), 1)])

    def _changes(self, style: StyleSpec, now: float) -> Iterator[tuple[str, str, PartSpec | None]]:
        """What is to be said, of which part or group, and its style: parts of a group in one style go together."""
        left = [part for part in PART_NAMES if self._until[part] > now]
        for name in (*reversed(GROUPS), *PART_NAMES):
            parts = expand_part(name)
            specs = {style.get(part) for part in parts}
            if len(specs) == 1 and all(part in left for part in parts):
                (spec,) = specs
                left = [part for part in left if part not in parts]
                yield f"{panels.spec_text(spec)} {spec.strength:.0%}" if spec else OWN, name, spec


def _head(view: View, pose: Pose, size: tuple[int, int]) -> Box:
    """The box of no width and no height at the top of a figure's head, in pixels."""
    left, top, _ = view.pixels(pose.positions[HEAD][None] + CROWN * UP, size)[0]
    return float(left), float(top), 0.0, 0.0


class _Room:
    """The free area (left, top, width, height in pixels), and what takes some of it."""

    def __init__(self, free: Box, scale: float) -> None:
        self.taken: list[Box] = []
        self.placed: list[Placed] = []
        self._free, self._scale = free, scale

    def put(self, words: Sequence[Panel], corners: Sequence[Corner]) -> bool:
        """Puts the first of some words that find room at one of some places; False where there is none for any."""
        for panel in words:
            width, height = (round(side * self._scale) for side in panel.size())
            for corner in corners:
                left, top = corner(width, height, AWAY * self._scale)
                box = round(left), round(top), width, height
                if _holds(self._free, box) and not any(
                    _meet(box, other, AWAY * self._scale / 2) for other in self.taken
                ):
                    self.placed.append(Placed(panel, box, self._scale))
                    self.taken.append(box)
                    return True
        return False


def _right_of(border: float, at: float, step: int, width: float, height: float, away: float) -> tuple[float, float]:
    return border + away, at - height / 2 + step * (height + away * 0.6)


def _left_of(border: float, at: float, step: int, width: float, height: float, away: float) -> tuple[float, float]:
    return border - away - width, at - height / 2 + step * (height + away * 0.6)


def _over(figure: Box, step: int, width: float, height: float, away: float) -> tuple[float, float]:
    return figure[0] + (figure[2] - width) / 2, figure[1] - away * 0.6 - height - (step - 1) * (height + away * 0.6)


def _under(figure: Box, step: int, width: float, height: float, away: float) -> tuple[float, float]:
    gap = away * 0.6
    return figure[0] + (figure[2] - width) / 2, figure[1] + figure[3] + gap + (step - 1) * (height + gap)


def _meet(one: Box, other: Box, gap: float) -> bool:
    """Whether two boxes are nearer to each other than a gap."""
    return all(
        one[axis] < other[axis] + other[axis + 2] + gap and other[axis] < one[axis] + one[axis + 2] + gap
        for axis in (0, 1)
    )


def _holds(outer: Box, inner: Box) -> bool:
    return all(
        outer[axis] <= inner[axis] and inner[axis] + inner[axis + 2] <= outer[axis] + outer[axis + 2] for axis in (0, 1)
    )
