"""The live stylizer of Motion Puzzle's own form: a decoder that makes the newest pose from half a second."""

import numpy as np
import torch

from sim.body.skeleton import JOINT_COUNT, PART_NAMES
from sim.motion.features import FEATURES
from stylizer.runtime.attention import attention_map
from stylizer.runtime.live import FIRST, OTHER, LiveStylizer
from stylizer.systems.motion_puzzle.fast_inference import to_inference
from stylizer.systems.motion_puzzle.style_tensors import to_tensors


class DecoderStylizer(LiveStylizer):
    """A `LiveStylizer` whose network is evaluated every PERIOD frames, or where a part changes its style.

    Until it is evaluated again its part goes from where it is to what it says in equal steps: a little lag for a
    fraction of the work, and windows that interleave (their samples are two frames apart) do not tremble against each
    other."""

    def _prepare(self) -> None:
        super()._prepare()
        self._network = to_inference(self.bank.model)

    def restart(self) -> None:
        super().restart()
        # What the network changes: at its last evaluation, and now; of FIRST and OTHER.
        self._change = np.zeros((2, 2, len(self.mixers), JOINT_COUNT, FEATURES))

    def _begin_frame(self, windows: np.ndarray) -> list[int]:
        due = super()._begin_frame(windows)
        newest, now = self._change
        for which in (FIRST, OTHER):
            ones = [one for one in due if self._evaluates(which, self.mixers[one])]
            if ones:
                newest[which, ones] = self._in_groups(self._decode, windows, ones, which)
        jumps = [one for one in due if self.mixers[one].changed]
        now[:, jumps] = newest[:, jumps]
        left = np.array([max(mixer.period - mixer.waited, 1) for mixer in self.mixers])[:, None, None]
        now += (newest - now) / left
        return due

    def _decode(self, windows: np.ndarray, ones: list[int], which: int) -> np.ndarray:
        """By how much the newest poses change, features (n, 21, 15), of windows (n, 16, 21, 15)."""
        return self._network.change(windows, *self._styles(ones, which))

    def _evaluate(self, windows: np.ndarray, ones: list[int], which: int) -> np.ndarray:
        newest = windows[:, -1]
        return np.array([newest + self._change[1, which, ones], newest])

    def attention(self, window: np.ndarray, part: str, one: int = 0) -> np.ndarray:
        with torch.inference_mode():
            motion = self.bank.model.normalize(torch.from_numpy(window.astype(np.float32))[None])
            style = to_tensors(self._features(self._mixer_of(one).styles(self.bank)[FIRST]))
            return attention_map(self.bank.model, motion, style, PART_NAMES.index(part))
