"""Motion Puzzle at the resolution of joints as it runs live: the newest sample alone, in numpy, equal to
stylizer.systems.motion_puzzle.joint_model up to rounding."""

from typing import Sequence

import numpy as np
import torch

from sim.math.easing import ramp
from sim.motion.features import WINDOW
from sim.motion.gait import gait_point, point_distance, with_run
from sim.motion.thresholds import STANDING_STYLE
from stylizer.systems.motion_puzzle.joint_config import JointConfig
from stylizer.systems.motion_puzzle.joint_model import (
    BODY,
    GAIT_WIDTH,
    LEGS,
    QUIET,
    ROOT,
    SIDEWAYS_OF_PART,
    JointPuzzle,
)
from stylizer.systems.motion_puzzle.style_tensors import NumpyFeatures, StyleFeatures, to_tensors

SIDEWAYS = SIDEWAYS_OF_PART[:, 0].double().numpy()
OF_LEGS = LEGS[:, 0].numpy()  # (5, 1) of bool


class TorchJointInference:
    """The network for the live stylizer, whatever its configuration."""

    def __init__(self, model: JointPuzzle) -> None:
        self.model = model

    def prepare(self, style: NumpyFeatures) -> StyleFeatures:
        """A style as the network takes it; to be prepared anew where its numbers change."""
        return to_tensors(style)

    @torch.inference_mode()
    def restyle(
        self, windows: np.ndarray, velocities: np.ndarray, style: StyleFeatures, own: StyleFeatures
    ) -> np.ndarray:
        """What the newest sample of windows (batch, WINDOW, 21, 15) is in a style, of bodies whose roots move at mean
        velocities (batch, 3), and what it is in its own: features (2, batch, 21, 15)."""
        motion = self.model.normalize(torch.from_numpy(windows.astype(np.float32)))
        both = self.model(motion, style, own, 1, torch.from_numpy(with_run(velocities).astype(np.float32)))
        return np.array([self.model.restore(each)[:, 0].double().numpy() for each in both])


class FastJointInference:
    """The shipped network, made for speed: arrays are batch first."""

    def __init__(self, model: JointPuzzle) -> None:
        """model: one that `fits`."""
        self.joints = model.parts.back.numpy()
        self.mean, self.deviation = (values.numpy()[:, 0, 0] for values in (model.mean, model.deviation))
        self.seen = WINDOW - 1 - np.array(model.config.lags)
        moments = model.moments
        body = moments.body.weight.detach().numpy().reshape(len(model.config.lags), -1, moments.body.in_features)
        self.body = body.swapaxes(1, 2).reshape(-1, body.shape[1]).copy()  # (lags 252, hidden)
        self.root, self.code = (
            (layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy())
            for layer in (moments.root, moments.code)
        )
        self.sharpness = np.float32(model.config.sharpness)

    @staticmethod
    def fits(config: JointConfig) -> bool:
        return config.attention and config.by_part

    def prepare(self, style: NumpyFeatures) -> NumpyFeatures:
        """As TorchJointInference.prepare, with what each frame would compute anew: the point of its gait, and joint by
        joint its mean and what its movement is divided by."""
        return style | {
            "gait_point": gait_point(style["gait"]),
            "mean_of_joints": self._of_joints(style["mean"])[:, None],
            "scale_of_joints": self._of_joints(style["deviation"])[:, None] + np.float32(QUIET),
        }

    def restyle(
        self, windows: np.ndarray, velocities: np.ndarray, style: NumpyFeatures, own: NumpyFeatures
    ) -> np.ndarray:
        """As TorchJointInference.restyle."""
        moves, own_moves = self._found(self._query(windows[:, self.seen], own), (style, own))  # BP-ATN
        going = gait_point(with_run(velocities))[:, None]
        apart = point_distance(style["gait_point"], going, SIDEWAYS) / GAIT_WIDTH**2
        same = np.exp(-np.square(apart))[..., None].astype(np.float32)
        translated = own["mean"] + style["mean"] - style["own_mean"]
        mean = np.where(OF_LEGS, translated + same * (style["mean"] - translated), style["mean"])  # BP-AdaIN
        moving = ramp(np.hypot(velocities[:, 0], velocities[:, 1]), *STANDING_STYLE)[:, None, None].astype(np.float32)
        own_moves = moving * own_moves
        styled_moves = own_moves + moving * same * (moves - own_moves)
        poses = np.zeros((2, *windows[:, -1].shape))
        poses[..., BODY] = self._of_joints(np.array([mean + styled_moves, own["mean"] + own_moves]))
        return poses * self.deviation + self.mean

    def _query(self, poses: np.ndarray, own: NumpyFeatures) -> np.ndarray:
        """(batch, code) of poses (batch, lags, 21, 15) in a style."""
        poses = ((poses - self.mean) / self.deviation).astype(np.float32)
        bare = (poses[..., BODY] - own["mean_of_joints"]) / own["scale_of_joints"]
        bare = bare.reshape(*poses.shape[:2], -1)
        bare /= np.sqrt(1 + np.square(bare).sum(axis=-1, keepdims=True) / bare.shape[-1])
        (root, root_bias), (weight, bias) = self.root, self.code
        hidden = bare.reshape(len(bare), -1) @ self.body + (poses[:, 0, 0, ROOT] @ root + root_bias)
        code = np.maximum(hidden, np.float32(0.2) * hidden) @ weight + bias
        return code / np.sqrt(np.square(code).sum(axis=-1, keepdims=True))

    def _found(self, query: np.ndarray, styles: Sequence[NumpyFeatures]) -> list[np.ndarray]:
        """What queries (batch, code) find in the tokens of each style: (batch, 5, n 12)."""
        score = self.sharpness * np.array([style["keys"] @ query[:, None, :, None] for style in styles])[..., 0]
        weight = np.exp(score - score.max(axis=-1, keepdims=True))
        weight /= weight.sum(axis=-1, keepdims=True)
        return [(of_one @ style["values"])[..., 0, :] for of_one, style in zip(weight[..., None, :], styles)]

    def _of_joints(self, values: np.ndarray) -> np.ndarray:
        """(..., 5, n 12) -> (..., 21, 12)"""
        return values.reshape(*values.shape[:-2], -1, BODY.stop).take(self.joints, axis=-2)


def to_joint_inference(model: JointPuzzle) -> "TorchJointInference | FastJointInference":
    """The quick one for a network of the shape that is shipped; another one runs as it is."""
    return FastJointInference(model) if FastJointInference.fits(model.config) else TorchJointInference(model)
