"""How truly a character follows our poses: directions of its limbs, heights of planted soles, how far these slide."""

from typing import Sequence

import numpy as np

from sim.body.pose import Pose
from sim.body.skeleton import ANKLE_HEIGHT, INDEX, TOE_HEIGHT
from sim.character.character import Character
from sim.character.fit import CharacterFit, Fitted
from sim.math import rotations as rot
from sim.math.vectors import FLOOR
from sim.motion.clip import FPS
from sim.motion.thresholds import PLANTED
from sim.retarget.plausibility import SIDES

LIMBS = {
    "thighs": ("UpLeg", "Leg"),
    "shins": ("Leg", "Foot"),
    "arms": ("Arm", "ForeArm"),
    "forearms": ("ForeArm", "Hand"),
}


def measure(character: Character, poses: Sequence[Pose]) -> dict[str, float]:
    """Of poses on level floor, one frame of 1/60 s after the other: degrees between the directions of our limbs and of
    its, mean and 95th percentile; centimetres that planted soles are off the floor, ours and its, at the 95th and the
    99th percentile and at most; centimetres a second by which what is planted slides, ours and its, mean."""
    fit = CharacterFit(character)
    fitted = [fit.step(pose) for pose in poses]
    result = {}
    for limb, angles in degrees_off(character, poses, fitted).items():
        result[f"{limb}_degrees_mean"] = float(angles.mean())
        result[f"{limb}_degrees_p95"] = float(np.percentile(angles, 95))
    contacts = np.array([pose.contacts for pose in poses]).reshape(-1, 2, 2)
    planted = contacts.max(axis=-1) > PLANTED
    on_ankle = contacts[..., 0] >= contacts[..., 1]
    for who, (heights, ankles, toes) in {"our": _own_feet(poses), "its": _feet(character, fitted)}.items():
        off = 100 * np.abs(heights[planted])
        carries = np.where(on_ankle[1:, :, None], np.diff(ankles, axis=0), np.diff(toes, axis=0)) * FLOOR
        speeds = 100 * FPS * rot.length(carries)[..., 0][planted[1:] & planted[:-1]]
        result |= (
            {f"{who}_soles_cm_p{part}": float(np.percentile(off, part)) for part in (95, 99, 100)} if off.size else {}
        )
        result |= {f"{who}_skate_cm_s": float(speeds.mean())} if speeds.size else {}
    return result


def degrees_off(character: Character, poses: Sequence[Pose], fitted: Sequence[Fitted]) -> dict[str, np.ndarray]:
    """(frames, 2) for each of LIMBS: between the direction of ours and of its, left and right."""
    ours, its = np.array([pose.positions for pose in poses]), np.array([one.positions for one in fitted])
    result = {}
    for limb, (start, end) in LIMBS.items():
        ends = [(side + start, side + end) for side in SIDES]
        wanted, got = (
            rot.normalize(np.stack([places[:, of[b]] - places[:, of[a]] for a, b in ends], axis=1))
            for places, of in ((ours, INDEX), (its, character.index))
        )
        result[limb] = np.degrees(np.arccos(np.clip(np.vecdot(wanted, got), -1.0, 1.0)))
    return result


def _own_feet(poses: Sequence[Pose]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heights (frames, 2) of our soles, and where ankles and toes are (frames, 2, 3)."""
    places = np.array([pose.positions for pose in poses])
    ankles, toes = (places[:, [INDEX[side + joint] for side in SIDES]] for joint in ("Foot", "Toe"))
    return np.minimum(ankles[..., 1] - ANKLE_HEIGHT, toes[..., 1] - TOE_HEIGHT), ankles, toes


def _feet(character: Character, fitted: Sequence[Fitted]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of a character: what is lowest of its soles, ankles, and where its feet bend."""
    places, rotations = (np.array([getattr(one, name) for one in fitted]) for name in ("positions", "rotations"))
    heights, ankles, balls = [], [], []
    for side, sole in zip(SIDES, character.soles):
        foot = character.index[side + "Foot"]
        toe = character.index.get(side + "Toe", foot)
        joints = np.where(sole.on_toe, toe, foot)
        points = places[:, joints] + rot.rotate(rotations[:, joints], sole.points)
        heights.append(points[..., 1].min(axis=-1))
        ankles.append(places[:, foot])
        balls.append(places[:, foot] + rot.rotate(rotations[:, foot], sole.ball))
    return np.stack(heights, axis=1), np.stack(ankles, axis=1), np.stack(balls, axis=1)
