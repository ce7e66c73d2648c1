"""What goes into the controller's network and what comes out: names, sizes and order, in this one place.

Everything is expressed in the root frame of its own instant. The input at frame t is the trajectory around t and the
pose at t; the output is the pose at t + 1, the root's path from t to t + 1 (in the frame of t) and what the future
looks like from t + 1."""

import math
from typing import Mapping

from sim.body.skeleton import CONTACT_JOINTS, JOINT_COUNT

# Standing, walking and running share out 1 by the root's speed; a crouch and a jump, 0 to 1 each, lie on top.
GAITS = ("stand", "walk", "run", "crouch", "jump")
SIDES = (0.25, 0.0, -0.25)  # metres to the left of the root's way, at which the ground is looked at
SAMPLE_STEP = 10  # frames
OFFSETS = tuple(range(-60, 60, SAMPLE_STEP))  # frames: 12 samples over the second before and the second to come
FUTURE = tuple(o for o in OFFSETS if o > 0)
LAYOUT_VERSION = "patchwalk-controller-3"  # kept in weight files

INPUT = {
    "trajectory_positions": (len(OFFSETS), 3),  # x, height, z metres of the root, which a jump carries over the ground
    "trajectory_heights": (len(OFFSETS), len(SIDES)),  # metres of the ground there, over the root now
    "trajectory_directions": (len(OFFSETS), 2),  # x, z of the unit facing
    "trajectory_gaits": (len(OFFSETS), len(GAITS)),
    "positions": (JOINT_COUNT, 3),  # metres
    "velocities": (JOINT_COUNT, 3),  # metres a second
}
OUTPUT = {
    "positions": (JOINT_COUNT, 3),
    "velocities": (JOINT_COUNT, 3),
    "rotations": (JOINT_COUNT, 6),  # forward and up axes in the root frame
    "root": (3,),  # metres sideways and forward, radians of turn, from one frame to the next
    "phase": (1,),  # radians of phase advance
    "future_positions": (len(FUTURE), 2),
    "future_directions": (len(FUTURE), 2),
    "contacts": (len(CONTACT_JOINTS),),  # logits
}


def slices(layout: Mapping[str, tuple[int, ...]]) -> dict[str, slice]:
    """Where each part lies in the flat vector."""
    result, start = {}, 0
    for name, shape in layout.items():
        result[name] = slice(start, start + math.prod(shape))
        start = result[name].stop
    return result


INPUT_SLICES, OUTPUT_SLICES = slices(INPUT), slices(OUTPUT)
INPUT_SIZE = max(s.stop for s in INPUT_SLICES.values())
OUTPUT_SIZE = max(s.stop for s in OUTPUT_SLICES.values())
# the part of the input that the output's first entries become
POSE = slice(INPUT_SLICES["positions"].start, INPUT_SIZE)
POSE_SIZE = POSE.stop - POSE.start
