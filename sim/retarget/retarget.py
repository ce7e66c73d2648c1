"""Retargeting: any humanoid motion onto our 21-joint skeleton, by global rotations.

Each of our joints turns as one joint of the source does: our global rotation = theirs x a constant, so joints that we
do not have fold in by themselves. sim/retarget/source_skeleton.py reads the source, sim/retarget/axis_alignment.py
finds the constants. Everything is scaled by leg length, so a file's length unit never matters."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from sim.body.kinematics import to_local
from sim.body.limb_ik import LEG_LENGTH
from sim.body.skeleton import BETWEEN_HIPS, JOINT_COUNT, JOINTS, PARENTS
from sim.io import bvh, motion_file
from sim.math import rotations as rot
from sim.motion.clip import Clip
from sim.retarget.axis_alignment import find_alignment
from sim.retarget.source_skeleton import SourceBody

FASTEST = 500.0  # metres a second: so far goes a cut between two takes, but no body


def load_clip(path: str | Path, name_map: dict[str, str] | None = None, fps: float | None = None) -> Clip:
    """A BVH, glTF or SMPL file as a clip on our skeleton at 60 fps, standing on a floor at 0; its place and heading are
    kept.

    name_map: our joint -> theirs (sim.retarget.joint_names.load), found from the names when None. fps: frames a
    second, believed in place of what the file says. Raises OSError, or ValueError in one sentence, for a file that
    cannot be read or mapped."""
    return to_clip(motion_file.read(path, fps), path, name_map)


def to_clip(motion: bvh.Motion, path: str | Path, name_map: dict[str, str] | None = None) -> Clip:
    """What `load_clip` makes of the motion that a file holds. Raises ValueError, naming the file, if it cannot be
    mapped."""
    try:
        clip = retarget(motion, name_map, f"{path}: ")
        return replace(clip, name=Path(path).stem).grounded().resampled()
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def retarget(motion: bvh.Motion, name_map: dict[str, str] | None = None, place: str = "") -> Clip:
    """The motion on our skeleton, Y up, at its own frame rate. Raises ValueError if the skeleton cannot be mapped, or
    moves as no person does; warns, each sentence beginning with `place`, of what had to be mended."""
    body = SourceBody(motion, name_map)
    for note in body.notes:
        warnings.warn(place + note, stacklevel=2)
    motion, constants = body.motion, find_alignment(body)
    rotations = np.empty((len(motion), JOINT_COUNT, 4))
    for joint, name in enumerate(JOINTS):
        rotations[:, joint] = (
            rot.multiply(body.rotations[:, body.index[name]], constants[name])
            if name in body.index
            else rotations[:, PARENTS[joint]]
        )  # what they lack keeps its parent's direction

    # The legs carry the body: what is scaled, by leg length, is the point between the hip joints, so that strides fit.
    hips = body.between_hips() * (LEG_LENGTH / body.leg_length()) - rot.rotate(rotations[:, 0], BETWEEN_HIPS)
    clip = Clip(hips, rot.make_continuous(to_local(rotations)), motion.fps)
    check_plausible(clip)
    return clip


def check_plausible(clip: Clip) -> None:
    """Raises ValueError where a clip is not finite, does not turn by rotations, or leaps as no body does."""
    unit = np.abs(np.linalg.norm(clip.rotations, axis=-1) - 1.0) < 1e-3
    if not (np.isfinite(clip.hips).all() and unit.all()):
        raise ValueError("this is no motion of a body: its bones have no direction, or its numbers are too large")
    speeds = np.linalg.norm(np.diff(clip.hips, axis=0), axis=-1) * clip.fps
    if (speeds > FASTEST).any():
        frame = int(speeds.argmax())
        raise ValueError(
            f"the body leaps {speeds[frame] / clip.fps:.0f} m within a frame at {frame / clip.fps:.2f} s: "
            "cut the file there"
        )
