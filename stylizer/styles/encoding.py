"""From the windows of a style's clips to what the decoder needs to know of them."""

from typing import Sequence

import numpy as np
import torch

from sim.math import rotations as rot
from sim.motion.features import LAYOUT
from sim.motion.gait import cycle_at
from stylizer.networks.layers import BlockFeatures
from stylizer.styles import joint_tokens
from stylizer.styles.style_clips import BODY, SHORTEST, Gait, OwnMotion, StyleClips, movements_in
from stylizer.systems.motion_puzzle.config import KEY_POSES
from stylizer.systems.motion_puzzle.joint_config import JOINTS
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.motion_puzzle.key_poses import KeyPoses
from stylizer.systems.motion_puzzle.model import MotionPuzzle
from stylizer.systems.motion_puzzle.style_tensors import cat_batch

FAR_APART = 0.5  # of the area that the two axes of a joint, halfway between two clips, span where the clips agree
TOKEN_WINDOWS = 3  # windows of a clip that attention looks at: as many for every clip, so that different styles stack


@torch.inference_mode()
def encode(model: MotionPuzzle, windows: np.ndarray) -> dict[int, BlockFeatures]:
    """The style of one clip from its windows (m, WINDOW, 21, 15), as a batch of 1: AdaIN scale and bias averaged over
    them, key poses of all, attention tokens of TOKEN_WINDOWS."""
    motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
    style = model.encode_style(motion, motion.flatten(1, 2)[:, None])
    seen = torch.from_numpy(np.linspace(0, len(windows) - 1, TOKEN_WINDOWS).round().astype(int))
    return {
        level: BlockFeatures(
            s.scale.mean(1, keepdim=True),
            s.bias.mean(1, keepdim=True),
            *(tokens[:, seen % tokens.shape[1]].flatten(1, 2)[:, None] for tokens in (s.keys, s.values)),
        )
        for level, s in style.items()
    }


def encode_clips(
    model: MotionPuzzle | JointPuzzle, windows: Sequence[np.ndarray], gait: Gait, own: OwnMotion | None = None
) -> StyleClips:
    """A style from the windows (m, WINDOW, 21, 15) of each of its clips.

    own: the motion that will be restyled, to whose strides its key poses are fitted; None for that motion's own
    style."""
    if isinstance(model, JointPuzzle):
        style = StyleClips(joint_tokens.encode_style_tokens(model, windows, gait), gait)
    else:
        style = StyleClips(cat_batch([encode(model, each) for each in windows]), gait)
    return refit_clips(model, style, own) if own else style


def encode_motion(model: JointPuzzle, features: np.ndarray) -> StyleClips:
    """A style from all that features (frames, 21, 15) show; ones shorter than a window are repeated."""
    features = np.tile(features, (-(-SHORTEST // len(features)), 1, 1))
    movements = movements_in(features)
    return encode_clips(model, [m.windows for m in movements], Gait.of(movements))


def encode_own(model: MotionPuzzle | JointPuzzle, own: OwnMotion) -> StyleClips:
    """The own style of the motion `own`."""
    if isinstance(model, JointPuzzle):
        return StyleClips(joint_tokens.encode_own_tokens(model, own), own.gait)
    return encode_clips(model, own.windows, own.gait)


def refit_clips(model: MotionPuzzle | JointPuzzle, style: StyleClips, own: OwnMotion) -> StyleClips:
    """A style, whatever motion it was made for, for another one, `own`: its key poses are fitted to that one's
    strides."""
    if isinstance(model, JointPuzzle):
        fitted = joint_tokens.refit_tokens(model, style.features[JOINTS], style.gait, own)
        return StyleClips({JOINTS: _reconcile_clips(model, fitted, style.gait)}, style.gait)
    if not model.key_poses:
        return style
    strides = {name: _own_strides(model, name, own) for name in dict.fromkeys(style.gait.movements)}
    key_poses = []
    for place, (name, cycle) in enumerate(zip(style.gait.movements, style.gait.cycles)):
        clip = BlockFeatures(*(t[:, place : place + 1] for t in style.features[KEY_POSES]))
        found = strides[name] if cycle.any() else None
        key_poses.append(_refine(model, clip, cycle, *found) if found else clip)
    fitted = cat_batch([{KEY_POSES: clip} for clip in key_poses])[KEY_POSES]
    return StyleClips(style.features | {KEY_POSES: _reconcile_clips(model.key_poses, fitted, style.gait)}, style.gait)


def _reconcile_clips(model: KeyPoses | JointPuzzle, style: BlockFeatures, gait: Gait) -> BlockFeatures:
    """Key poses of n clips in which clips that show one movement hold every joint alike enough to be interpolated: a
    joint that they hold in turns far apart, as who dances with the arms does, is taken from the first of them in
    all."""
    for place, name in enumerate(gait.movements):
        first = gait.movements.index(name)
        halfway = gait.cycles[[first, place], 0][..., LAYOUT["rotation"]].mean(axis=0)
        joints = rot.length(rot.cross(halfway[:, :3], halfway[:, 3:]))[:, 0] < FAR_APART
        if first < place and joints.any() and gait.cycles[place].any():
            style = model.take_joints(style, place, first, torch.from_numpy(joints))
    return style


@torch.inference_mode()
def _own_strides(model: MotionPuzzle, movement: str, own: OwnMotion) -> tuple[torch.Tensor, np.ndarray] | None:
    """Of the controller's motion of one kind: which moments (5, 1, T, prototypes) it passes through, and at which
    stride phases (T,). None where it makes no strides of that kind."""
    assert model.key_poses
    moments, phases = [], []
    for name, windows, phase in zip(own.gait.movements, own.windows, own.phases):
        if name.replace("_", " ").startswith(movement) and np.isfinite(phase).all():
            motion = model.normalize(torch.from_numpy(windows.astype(np.float32))).flatten(1, 2)[:, None]
            moments.append(model.key_poses.attend(motion, encode(model, windows)[KEY_POSES]))
            phases.append(phase.ravel())
    return (torch.cat(moments, dim=2), np.concatenate(phases)) if moments else None


@torch.inference_mode()
def _refine(
    model: MotionPuzzle, style: BlockFeatures, cycle: np.ndarray, moments: torch.Tensor, phases: np.ndarray
) -> BlockFeatures:
    """Key poses that give a style's cycle (coefficients, 21, 12) back where the controller's moments (5, 1, T,
    prototypes) pass at stride phases (T,): in a live session the moments are the controller's, not the clip's own."""
    assert model.key_poses
    poses = torch.from_numpy(cycle_at(cycle, phases).astype(np.float32))[None]
    mean, deviation = (values[..., BODY] for values in (model.mean, model.deviation))
    return model.key_poses.refit(style, moments, (poses.permute(2, 0, 1, 3) - mean) / deviation)
