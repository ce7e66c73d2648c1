"""Marks for a frame: shades and rings under the feet, the arrow of the asked velocity, skeleton and ways as lines."""

from typing import Sequence

import numpy as np

from demo.figure.colours import PATHS
from demo.render.view import Paths
from demo.ui.canvas import Colour
from sim.body.pose import Pose
from sim.body.skeleton import CONTACT_JOINTS, INDEX, PARENTS
from sim.ground.ground import Ground
from sim.session import Frame

DISC, RING, ARROW = 0, 1, 2
ARROW_SECONDS = 0.55  # the arrow is as long as the way of this time
SHADE_JOINTS = [INDEX[name] for name in ("LeftFoot", "LeftToe", "RightFoot", "RightToe")]
RING_RADII = (0.105, 0.085, 0.105, 0.085)  # metres, of CONTACT_JOINTS
SHADE = (0.10, 0.12, 0.16)
CONTACT = (0.13, 0.60, 0.56)
WAY_HEIGHT = 0.012  # metres that ways lie above the floor
WAY_STEP = 0.1  # metres between the points of a way that follows uneven ground
STEERED, STEERED_RADIUS = (1.0, 0.72, 0.20), 0.5  # of the ring round who is steered in a crowd; metres
ARROW_MARGIN = 0.05  # metres about an arrow within which it is drawn


def shades(
    pose: Pose,
    ground: Ground | None = None,
    shift: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> list[tuple]:
    """Soft dark discs under the hips and under feet near the ground; None: level floor."""
    hips = pose.positions[0] + shift
    result = [(hips[0], hips[2], 0.55, 0.0, *SHADE, 0.16, DISC, 0.0)]
    feet = pose.positions[SHADE_JOINTS] + shift
    heights = feet[:, 1] if ground is None else feet[:, 1] - ground.height_at(feet[:, [0, 2]])
    for (x, _, z), height in zip(feet, heights, strict=True):
        strength = 0.50 * float(np.clip(1.0 - (height - 0.02) / 0.25, 0.0, 1.0)) ** 2
        result.append((x, z, 0.15, 0.0, *SHADE, strength, DISC, 0.0))
    return result


def contacts(pose: Pose) -> list[tuple]:
    """A ring round each foot joint on the ground, as strong as the contact."""
    return [
        (*pose.positions[joint, [0, 2]], radius, 0.0, *CONTACT, 0.85 * float(contact), RING, 0.012)
        for joint, contact, radius in zip(CONTACT_JOINTS, pose.contacts, RING_RADII, strict=True)
        if contact > 0.05
    ]


def steered(pose: Pose) -> list[tuple]:
    """A ring round who is steered, to be found in a crowd."""
    return [(*pose.root_position[[0, 2]], STEERED_RADIUS, 0.0, *STEERED, 0.95, RING, 0.03)]


def arrow(frame: Frame) -> list[tuple]:
    """From the character towards where the stick asks it to go; none while it is asked to stand."""
    displacement = frame.command.desired_velocity * ARROW_SECONDS
    reach = float(np.linalg.norm(displacement))
    if reach < 0.05:
        return []
    start = frame.styled.root_position[[0, 2]] + displacement / reach * 0.42
    return [(*start, *displacement, *PATHS["asked"], 0.85, ARROW, 0.085)]


def skeleton(
    pose: Pose, colour: Colour, scale: float, shift: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> list[tuple]:
    """Lines from joint to joint and a dot on each, `scale` pixels a unit."""
    places = pose.positions + shift
    rows = [
        _line(places[parent], place, (*colour, 0.85), 1.3 * scale)
        for parent, place in zip(PARENTS[1:], places[1:], strict=True)
    ]
    return rows + [_line(place, place, (*colour, 1.0), 3.2 * scale) for place in places]


def paths(paths_: Paths, scale: float, ground: Ground | None = None) -> list[tuple]:
    """The way gone, asked and predicted: a line each, with a dot at every sample of the two to come."""
    here = paths_.past[-1:]
    rows = _polyline(paths_.past, PATHS["walked"], scale, ground)
    for points, colour, width in ((paths_.predicted, PATHS["predicted"], 1.6), (paths_.desired, PATHS["asked"], 1.0)):
        rows += _polyline(np.concatenate([here, points]), colour, scale * width, ground)
        rows += [_line(at, at, (*colour, 1.0), 4.0 * scale) for at in _on_ground(points, ground)]
    return rows


def boxes(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rectangles that marks, rows (n, 10), lie in: world x and z (n, 2) of opposite corners."""
    start, displacement = rows[:, :2], rows[:, 2:4]
    is_arrow = rows[:, 8:9] == ARROW
    tip = start + displacement * is_arrow
    margin = np.where(is_arrow, rows[:, 9:] + ARROW_MARGIN, np.linalg.norm(displacement, axis=-1, keepdims=True))
    return np.minimum(start, tip) - margin, np.maximum(start, tip) + margin


def _polyline(points: np.ndarray, colour: Colour, scale: float, ground: Ground | None) -> list[tuple]:
    """Through points (n, 2) on the floor, on uneven ground over all that lies between them."""
    if ground is not None:
        lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=-1)))
        along = np.union1d(lengths, np.arange(0.0, lengths[-1], WAY_STEP))
        points = np.stack([np.interp(along, lengths, points[:, axis]) for axis in (0, 1)], axis=-1)
    places = _on_ground(points, ground)
    return [_line(a, b, (*colour, 0.9), 1.4 * scale) for a, b in zip(places, places[1:], strict=False)]


def _on_ground(points: np.ndarray, ground: Ground | None) -> np.ndarray:
    """(n, 3) a little over the ground at points (n, 2)."""
    height = np.zeros(len(points)) if ground is None else ground.height_at(points)
    return np.stack([points[:, 0], height + WAY_HEIGHT, points[:, 1]], axis=-1)


def _line(start: Sequence[float], stop: Sequence[float], colour: Colour, half_width: float) -> tuple:
    """A row for the pass that draws lines: half_width in pixels."""
    return (*start, half_width, *stop, 0.0, *colour)
