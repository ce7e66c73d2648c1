"""From the windows of a style's clips to what a network of Motion Puzzle keeps of them."""

from typing import Sequence

import numpy as np
import torch

from sim.math import rotations as rot
from sim.motion.features import LAYOUT
from stylizer.styles import joint_tokens
from stylizer.styles.style_clips import SHORTEST, Gait, OwnMotion, StyleClips, movements_in
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.motion_puzzle.model import MotionPuzzle
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures, cat_batch

FAR_APART = 0.5  # of the area that the two axes of a joint, halfway between two clips, span where the clips agree
TOKEN_WINDOWS = 1  # windows of a clip that attention looks at: as many for every clip, so that different styles stack


@torch.inference_mode()
def encode(model: MotionPuzzle, windows: np.ndarray) -> StyleFeatures:
    """The style of one clip from its windows (m, WINDOW, 21, 15), as a batch of 1: AdaIN scale and bias averaged over
    them, attention tokens of TOKEN_WINDOWS."""
    style = model.encode_style(model.normalize(torch.from_numpy(windows.astype(np.float32))))
    seen = torch.from_numpy(np.linspace(0, len(windows) - 1, TOKEN_WINDOWS + 2)[1:-1].round().astype(int))
    return {
        name: values[:, seen % values.shape[1]].flatten(1, 2)[:, None]
        if values.dim() > 3
        else values.mean(1, keepdim=True)
        for name, values in style.items()
    }


def encode_clips(
    model: MotionPuzzle | JointPuzzle, windows: Sequence[np.ndarray], gait: Gait, own: OwnMotion | None = None
) -> StyleClips:
    """A style from the windows (m, WINDOW, 21, 15) of each of its clips.

    own: the motion that will be restyled, to whose strides the tokens are fitted; None for that motion's own style."""
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
    """A style, whatever motion it was made for, for another one, `own`: the tokens of joints are fitted to that one's
    strides. The paper's own features do not depend on it."""
    if not isinstance(model, JointPuzzle):
        return style
    fitted = joint_tokens.refit_tokens(model, style.features, style.gait, own)
    return StyleClips(_reconcile_clips(model, fitted, style.gait), style.gait)


def _reconcile_clips(model: JointPuzzle, style: StyleFeatures, gait: Gait) -> StyleFeatures:
    """A style in whose clips that show one movement every joint is held alike enough to be interpolated: a joint that
    they hold in turns far apart, as who dances with the arms does, is taken from the first of them in all."""
    for place, name in enumerate(gait.movements):
        first = gait.movements.index(name)
        halfway = gait.cycles[[first, place], 0][..., LAYOUT["rotation"]].mean(axis=0)
        joints = rot.length(rot.cross(halfway[:, :3], halfway[:, 3:]))[:, 0] < FAR_APART
        if first < place and joints.any() and gait.cycles[place].any():
            style = model.take_joints(style, place, first, torch.from_numpy(joints))
    return style
