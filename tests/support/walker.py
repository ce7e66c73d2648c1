"""A synthetic walk with known answers: speed, steps and contacts are what the formula says."""

import numpy as np

from controller.model.gait_phase import GRAVITY
from sim.body.skeleton import INDEX, JOINT_COUNT, REST_HIPS_HEIGHT
from sim.math import rotations as rot
from sim.math.vectors import UP
from sim.motion.clip import FPS, Clip

SPEED = 1.2
CYCLE = 60  # frames


def walking_clip(frames: int = 240, yaw: float = 0.0) -> Clip:
    """Straight walk along `yaw` at SPEED, thighs swinging as a sine, knees bent while the thigh swings forward."""
    t = np.arange(frames)
    turn = rot.from_yaw(np.full(frames, yaw))
    way = np.stack([np.zeros(frames), np.full(frames, REST_HIPS_HEIGHT), t * SPEED / FPS], axis=-1)
    rotations = np.tile(rot.IDENTITY, (frames, JOINT_COUNT, 1))
    rotations[:, 0] = turn
    for side, shift in (("Left", 0.0), ("Right", np.pi)):
        angle = 2 * np.pi * t / CYCLE + shift
        pitch = np.array([1.0, 0.0, 0.0])
        rotations[:, INDEX[side + "UpLeg"]] = rot.from_axis_angle(np.tile(pitch, (frames, 1)), 0.4 * np.sin(angle))
        rotations[:, INDEX[side + "Leg"]] = rot.from_axis_angle(np.tile(pitch, (frames, 1)), 0.4 * (1 - np.cos(angle)))
    return Clip(rot.rotate(turn, way), rotations)


def planted_clip(frames: int = 120) -> Clip:
    """Standing still in the rest pose."""
    return Clip(np.tile([0.0, REST_HIPS_HEIGHT, 0.0], (frames, 1)), np.tile(rot.IDENTITY, (frames, JOINT_COUNT, 1)))


def leaping_clip(start: int, seconds: float, gravity: float = GRAVITY) -> Clip:
    """Three seconds of the rest pose, thrown up once: from a frame on, for so long, by metres a second squared."""
    clip = planted_clip(180)
    time = (np.arange(180) - start) / FPS
    lift = np.maximum(0, gravity / 2 * time * (seconds - time))
    return Clip(clip.hips + lift[:, None] * UP, clip.rotations)
