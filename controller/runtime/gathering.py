"""A body gathers before it leaves the floor from the spot: hips sink, the trunk leans forward, the arms swing back.

People squat for a second before they jump. A game gives them ANTICIPATION, and a network that never sees a squat begin
that late stays upright. So it is laid on its pose: down, then up again as legs do that push evenly and leave the floor
as fast as the flight begins."""

import numpy as np

from controller.model.gait_phase import GRAVITY
from controller.runtime.jump import ANTICIPATION, FLIGHT
from sim.body.limb_ik import ARMS, KNEES_FORWARD, LEGS, reach
from sim.body.pose import Pose
from sim.body.skeleton import INDEX, PART_NAMES, PART_OF_JOINT
from sim.math import rotations as rot
from sim.math.easing import ramp, smooth_step
from sim.math.vectors import LEFT, UP

PUSH = 0.12  # seconds in which the legs push
DEPTH = GRAVITY * FLIGHT / 2 * PUSH / 2  # metres that the hips sink: an even push from there is as fast as the flight
LEAN, HEAD_LEAN, SWING = np.radians((25.0, 8.0, 30.0))  # of the trunk, of the head with it, of the arms backwards
SPEEDS = (0.3, 1.5)  # metres a second, between which a jump is less and less from the spot
REACH = 0.9995  # share of a leg's length that is used
NONE = 1e-6  # a share this small is none, and rounding is smaller

_UPPER = np.flatnonzero(PART_OF_JOINT >= PART_NAMES.index("spine"))[1:]  # all joints above the hips
_PITCH = np.zeros(len(PART_OF_JOINT))  # radians forward, about the character's left
_PITCH[_UPPER] = LEAN
_PITCH[INDEX["Head"]] = HEAD_LEAN
for _joints in ARMS:
    _PITCH[_joints] = LEAN + SWING


def gathered(time: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """How far (...) a body is gathered, 0 to 1, at a time (...) in seconds from the take-off, negative before it, which
    goes at so many metres a second (...)."""
    down = smooth_step(time, -ANTICIPATION, -PUSH)
    up = 1 - ramp(time, -PUSH, 0.0) ** 2
    return down * up * (1 - ramp(speed, *SPEEDS))


def gather(pose: Pose, share: np.ndarray) -> Pose:
    """The pose gathered by a share (...), its feet where they are; of one who is not, the pose as it is: inverse
    kinematics would bend a leg that is straight."""
    ankles = pose.positions[..., LEGS[-1], :]
    axis = pose.to_world(LEFT[None])
    lean = rot.from_rotation_vector((share[..., None] * _PITCH)[..., None] * axis)
    low = pose.with_body(pose.hips - (DEPTH * share)[..., None] * UP, rot.multiply(lean, pose.rotations))
    rotations = reach(low, LEGS, ankles, KNEES_FORWARD, REACH).rotations
    return pose.with_body(low.hips, np.where(share[..., None, None] > NONE, rotations, pose.rotations))
