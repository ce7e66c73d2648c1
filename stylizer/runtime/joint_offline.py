"""A whole clip through Motion Puzzle at the resolution of joints: every frame is looked up by the half second before
it."""

from typing import Mapping

import numpy as np
import torch

from sim.body.skeleton import PART_NAMES
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT, STRIDE, WINDOW, rotations_of
from stylizer.styles.joint_tokens import AHEAD
from stylizer.styles.style_clips import StyleClips
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures, interpolate, stack_parts

DELAY = round(AHEAD * FPS)  # frames: values come later than what they are looked up by, and no spring lags here
BATCH = 256  # frames


@torch.inference_mode()
def evaluate_joints(model: JointPuzzle, features: np.ndarray, own: StyleClips, style: Mapping) -> np.ndarray:
    """What the network makes of features (frames, 21, 15) whose own style is `own`, the same shape: style: part ->
    stylizer.runtime.offline.ResolvedStyle; what it says of other parts is not to be used."""
    result = features.copy()
    for frames in np.array_split(np.arange(len(features)), -(-len(features) // BATCH)):
        seen = frames[:, None] - DELAY + STRIDE * np.arange(1 - WINDOW, 1)
        windows = features[np.clip(seen, 0, len(features) - 1)]
        velocities = windows[:, :, 0, LAYOUT["root"]].mean(axis=1)
        motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
        outputs = model(
            motion, _combine(style, velocities), own.at(velocities), 1, torch.from_numpy(velocities.astype(np.float32))
        )
        result[frames] = _apply(features[frames], *(model.restore(each)[:, 0].double().numpy() for each in outputs))
    return result


def _combine(style: Mapping, velocities: np.ndarray) -> StyleFeatures:
    """One style of all parts for contents whose roots move at velocities (B, 3); the others get any."""
    some = next(iter(style.values()))
    all_parts = [style.get(part, some) for part in PART_NAMES]
    first, other = (
        stack_parts([style.at(velocities) for style in styles])
        for styles in ([part.style for part in all_parts], [part.other or part.style for part in all_parts])
    )
    return interpolate(first, other, [part.share for part in all_parts])


def _apply(content: np.ndarray, styled: np.ndarray, rebuilt: np.ndarray) -> np.ndarray:
    """The content's features (frames, 21, 15), turned and shifted as leads from what they are in their own style to the
    styled."""
    result = content.copy()
    after, before, now = rotations_of(np.array([styled, rebuilt, content]))
    result[..., LAYOUT["rotation"]] = rot.to_6d(rot.from_matrix(after @ before.swapaxes(-1, -2) @ now))
    result[..., LAYOUT["position"]] += (styled - rebuilt)[..., LAYOUT["position"]]
    return result
