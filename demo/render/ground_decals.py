"""Marks for a frame: shades and rings under the feet, the arrow of the asked velocity, skeleton and ways as lines."""

from typing import Sequence

import numpy as np

from demo.render.view import Paths
from demo.ui.canvas import Colour
from sim.body.pose import Pose
from sim.body.skeleton import CONTACT_JOINTS, INDEX, PARENTS
from sim.session import Frame

DISC, RING, ARROW = 0, 1, 2
ARROW_SECONDS = 0.55  # the arrow is as long as the way of this time
SHADE_JOINTS = [INDEX[name] for name in ("LeftFoot", "LeftToe", "RightFoot", "RightToe")]
RING_RADII = (0.105, 0.085, 0.105, 0.085)  # metres, of CONTACT_JOINTS
SHADE = (0.10, 0.12, 0.16)
CONTACT = (0.13, 0.60, 0.56)
WISH = (0.97, 0.60, 0.16)
PREDICTED = (0.10, 0.55, 0.62)
PAST = (0.42, 0.46, 0.52)
WAY_HEIGHT = 0.012  # metres that ways lie above the floor


def shades(pose: Pose, shift: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> list[tuple]:
    """Soft dark discs under the hips and under feet near the ground."""
    hips = pose.positions[0] + shift
    result = [(hips[0], hips[2], 0.55, 0.0, *SHADE, 0.16, DISC, 0.0)]
    for x, height, z in pose.positions[SHADE_JOINTS] + shift:
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


def arrow(frame: Frame) -> list[tuple]:
    """From the character towards where the stick asks it to go; none while it is asked to stand."""
    displacement = frame.command.desired_velocity * ARROW_SECONDS
    reach = float(np.linalg.norm(displacement))
    if reach < 0.05:
        return []
    start = frame.styled.root_position[[0, 2]] + displacement / reach * 0.42
    return [(*start, *displacement, *WISH, 0.85, ARROW, 0.085)]


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


def paths(paths_: Paths, scale: float) -> list[tuple]:
    """The way gone, asked and predicted: a line each, with a dot at every sample of the two to come."""
    here = paths_.past[-1]
    rows = _polyline(paths_.past, PAST, scale)
    for points, colour, width in ((paths_.predicted, PREDICTED, 1.6), (paths_.desired, WISH, 1.0)):
        rows += _polyline([here, *points], colour, scale * width)
        rows += [_line(_on_floor(at), _on_floor(at), (*colour, 1.0), 4.0 * scale) for at in points]
    return rows


def _polyline(points: np.ndarray | Sequence[np.ndarray], colour: Colour, scale: float) -> list[tuple]:
    return [
        _line(_on_floor(a), _on_floor(b), (*colour, 0.9), 1.4 * scale) for a, b in zip(points, points[1:], strict=False)
    ]


def _on_floor(point: np.ndarray) -> tuple[float, float, float]:
    return point[0], WAY_HEIGHT, point[1]


def _line(start: Sequence[float], stop: Sequence[float], colour: Colour, half_width: float) -> tuple:
    """A row for the pass that draws lines: half_width in pixels."""
    return (*start, half_width, *stop, 0.0, *colour)
