"""The body as a picture to click on, drawn from the figure's own capsules, and which part lies nearest to a point."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from demo.figure import forms
from demo.ui.canvas import ACCENT, FAINT, SMALL, Box, Canvas, Colour
from demo.ui.widgets import Region
from sim.body.skeleton import PARENTS, PART_NAMES, PART_OF_JOINT
from sim.math import rotations as rot

HEIGHT, WIDTH = 152.0, 128.0  # units
METRES = 1.78  # that fill the height
SLICES = 20  # discs that a capsule is drawn with
NEAR = 0.16  # metres from the bones within which a click means a part


@dataclass(frozen=True)
class Diagram:
    """The body from the front, as it stands in the bind pose: its left is on the right. colours: of the five parts."""

    colours: tuple[Colour, ...]
    picked: tuple[str, ...]

    def size(self) -> tuple[float, float]:
        return WIDTH, HEIGHT

    def paint(self, canvas: Canvas, box: Box) -> None:
        for grow, lit in ((2.6, True), (0.0, False)):  # what is picked gets a rim, drawn first
            for part, of_part in enumerate(discs()):
                if lit and PART_NAMES[part] not in self.picked:
                    continue
                for x, y, radius in of_part:
                    canvas.disc(box[0] + x, box[1] + y, radius + grow, ACCENT if lit else self.colours[part])
        canvas.text("R", box[0] + 6, box[1] + 24, FAINT, SMALL)
        canvas.text("L", box[0] + WIDTH - 12, box[1] + 24, FAINT, SMALL)

    def regions(self, box: Box) -> list[Region]:
        return [Region((box[0], box[1], WIDTH, HEIGHT), "diagram", "point")]


def part_at(x: float, y: float) -> str | None:
    """The part at shares (x, y) of the diagram."""
    at = np.array([(0.5 - x) * WIDTH, (1 - y) * HEIGHT]) * METRES / HEIGHT * [-1, 1]
    return nearest_part(forms.BIND.positions[:, :2], at, NEAR)


def nearest_part(joints: np.ndarray, at: np.ndarray, reach: float) -> str | None:
    """The part whose bones pass nearest to a point (2,), if any is within `reach`; joints: (21, 2) in the same
    plane."""
    start, stop = joints[PARENTS[1:]], joints[1:]
    along = stop - start
    share = np.clip(np.sum((at - start) * along, -1) / np.maximum(np.sum(along * along, -1), 1e-9), 0, 1)
    away = np.linalg.norm(start + share[:, None] * along - at, axis=-1)
    # A bone moves with the joint it starts from; the bones that leave the trunk for a limb are the trunk's.
    nearest = int(np.argmin(away))
    return PART_NAMES[PART_OF_JOINT[PARENTS[1:][nearest]]] if away[nearest] < reach else None


@cache
def discs() -> tuple[tuple[tuple[float, float, float], ...], ...]:
    """For each part, discs (x, y, radius) in units that fill its capsules' outlines."""
    turns, origins = forms.BIND.rotations[forms.FORM_JOINT], forms.BIND.positions[forms.FORM_JOINT]
    starts = origins + rot.rotate(turns, forms.FORM_START)
    along = rot.rotate(turns, forms.form_frames()[:, 1]) * forms.FORM_LENGTH[:, None]
    scale, result = HEIGHT / METRES, []
    for part in range(len(PART_NAMES)):
        discs = []
        for form in np.flatnonzero(PART_OF_JOINT[forms.FORM_JOINT] == part):
            for share in np.linspace(0, 1, SLICES):
                x, y, _ = starts[form] + share * along[form]
                radius = (
                    np.interp(share, forms.PROFILE, forms.FORM_RADII[form])
                    * scale
                    * min(1.15, forms.FORM_STRETCH[form][0])
                )
                discs.append((WIDTH / 2 + x * scale, HEIGHT - y * scale, radius))
        result.append(tuple(discs))
    return tuple(result)
