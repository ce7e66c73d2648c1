"""The live stylizer of Motion Puzzle at the resolution of joints: one network, evaluated in every frame."""

import numpy as np
import torch

from sim.body.skeleton import PART_NAMES
from sim.motion.clip import FPS
from sim.motion.features import STRIDE, WINDOW
from stylizer.runtime.live import FIRST, LiveStylizer
from stylizer.runtime.style_mixer import BODY
from stylizer.styles.joint_tokens import AHEAD, SMOOTHING
from stylizer.systems.motion_puzzle.joint_inference import to_joint_inference
from stylizer.systems.motion_puzzle.style_tensors import to_tensors

STEADY = 2  # samples over which a pose's velocity is measured


class JointStylizer(LiveStylizer):
    """A `LiveStylizer` whose network is evaluated in every frame: the pose is what attention finds."""

    SMOOTHING = SMOOTHING
    PERIOD = 1  # styles are interpolated in every frame too, so that each of a crowd moves as it would alone

    def _prepare(self) -> None:
        super()._prepare()
        self._network = to_joint_inference(self.bank.model)

    def _evaluate(self, windows: np.ndarray, ones: list[int], which: int) -> np.ndarray:
        """The poses that the spring, which lags, will have caught up with."""
        if not self.bank.model.config.attention:  # nothing is looked up that could come later
            windows = windows.copy()
            windows[:, -1] += AHEAD * FPS / STRIDE / STEADY * (windows[:, -1] - windows[:, -1 - STEADY])
        return self._network.restyle(windows, self._velocities[BODY, ones], *self._styles(ones, which))

    def attention(self, window: np.ndarray, part: str) -> np.ndarray:
        """The attention map of a body part now, of one character: (WINDOW / 2, tokens of the style), rows that add up
        to 1. Changes nothing. Raises ValueError for weights without attention."""
        model = self.bank.model
        if not model.config.attention:
            raise ValueError("these stylizer weights were trained without attention")
        with torch.inference_mode():
            motion = model.normalize(torch.from_numpy(window.astype(np.float32))[None])
            mixer = self.mixers[0]
            numbers = mixer.styles(self.bank)[FIRST], mixer.own(self.bank)
            style, own = (to_tensors(self._features(each)) for each in numbers)
            weights = model.attention(model.queries(motion, own, WINDOW), style["keys"])
            return weights[PART_NAMES.index(part), 0, 1::2].numpy()
