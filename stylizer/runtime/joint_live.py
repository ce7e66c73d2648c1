"""The live stylizer of Motion Puzzle at the resolution of joints: one network, evaluated in every frame."""

from typing import Any

import numpy as np
import torch

from sim.body.skeleton import PART_NAMES
from sim.motion.clip import FPS
from sim.motion.features import STRIDE, WINDOW
from stylizer.runtime.live import FIRST, LiveStylizer
from stylizer.runtime.style_mixer import BODY, NEUTRAL
from stylizer.styles.joint_tokens import AHEAD, SMOOTHING
from stylizer.styles.own_style import OWN
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

    def _styles(self, ones: list[int], which: int) -> tuple[Any, Any]:
        """As LiveStylizer._styles, each style interpolated once for all who wear it."""
        parts = [self.mixers[one].parts for one in ones]
        names = np.array([[part.name if which == FIRST else part.other for part in each] for each in parts])
        both = self._mixed(names, BODY, ones), self._mixed(np.full(names.shape, OWN), NEUTRAL, ones)
        return self._network.prepare(self._features(both[0])), self._network.prepare(self._features(both[1]))

    def _mixed(self, names: np.ndarray, whose: int, ones: list[int]) -> np.ndarray:
        """The numbers (n, 5, N) of the styles of these names (n, 5), for root velocities of BODY or NEUTRAL."""
        velocities, result = self._velocities[whose, ones], None
        for name in np.unique(names):
            worn = names == name
            wearers = worn.any(axis=1)
            numbers = self.bank[str(name)].numbers_at(velocities[wearers])
            if worn.all():
                return numbers
            if result is None:
                result = np.empty((*names.shape, numbers.shape[-1]), numbers.dtype)
            result[worn] = numbers[worn[wearers]]
        assert result is not None
        return result

    def attention(self, window: np.ndarray, part: str, one: int = 0) -> np.ndarray:
        """The attention map of a body part now, of one character (`one` of a crowd): (WINDOW / 2, tokens of
        the style), rows that add up to 1. Changes nothing. Raises ValueError for weights without attention."""
        model = self.bank.model
        if not model.config.attention:
            raise ValueError("these stylizer weights were trained without attention")
        with torch.inference_mode():
            motion = model.normalize(torch.from_numpy(window.astype(np.float32))[None])
            mixer = self._mixer_of(one)
            numbers = mixer.styles(self.bank)[FIRST], mixer.own(self.bank)
            style, own = (to_tensors(self._features(each)) for each in numbers)
            weights = model.attention(model.queries(motion, own, WINDOW), style["keys"])
            return weights[PART_NAMES.index(part), 0, 1::2].numpy()
