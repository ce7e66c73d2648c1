"""The live stylizer of a whole-body system: evaluated once for each style, over more than the ring
buffer's past."""

from collections import deque
from typing import TYPE_CHECKING, Sequence

import numpy as np
import torch
from torch import Tensor

from sim.body.pose import Pose
from sim.motion.features import STRIDE
from sim.style_spec import StyleSpec
from stylizer.runtime.decoder_live import DecoderStylizer
from stylizer.runtime.live import LiveStylizer
from stylizer.runtime.style_mixer import BODY, StyleMixer
from stylizer.systems.whole_body import combine_joints, joints_by_code, stylize_windows

if TYPE_CHECKING:
    from stylizer.styles.code_bank import CodeBank


class WholeBodyStylizer(DecoderStylizer):
    """Windowed inference: these systems look ahead as well as back, so each output is the last sample of a window that
    ends now.

    What is done with it - turns, strengths, smoothing, switches - is the same as for Motion Puzzle."""

    SMOOTHING = 0.05  # seconds; nothing says to these systems what is to come, so they must not lag far behind
    BLENDS = False  # codes are blended instead
    PERIOD = 2  # frames: as the samples of their windows lie
    bank: "CodeBank"

    def _prepare(self) -> None:
        """Codes are all that these systems need, and the bank has them."""

    def restart(self) -> None:
        super().restart()
        self._span = self.bank.model.newest * STRIDE + 1
        # features (..., 21, 15) of the last frames, the newest last
        self._past: deque[np.ndarray] = deque(maxlen=self._span)

    def step(
        self,
        window: np.ndarray,
        neutral: Pose,
        style: StyleSpec | Sequence[StyleSpec],
        travel: np.ndarray | float = 1.0,
    ) -> Pose:
        samples = np.moveaxis(window, -3, 0)
        if not self._past:  # what the ring buffer has, and before that its oldest pose
            self._past.extend(samples[:1].repeat(self._span, axis=0))
            self._past.extend(samples[:-1].repeat(STRIDE, axis=0))
        self._past.append(samples[-1])
        return super().step(window, neutral, style, travel)

    def attention(self, window: np.ndarray, part: str, one: int = 0) -> np.ndarray:
        return LiveStylizer.attention(self, window, part, one)

    @property
    def seed(self) -> int | None:
        return self.bank.seed if self.bank.sampled else None

    def resample(self, seed: int | None = None) -> None:
        """Samples the styles of the prior again; parts that show one are inertialized. Raises ValueError where there
        are none."""
        if not self.bank.sampled:
            super().resample()
        self.bank.resample(seed)
        self.switch()

    def _decode(self, windows: np.ndarray, ones: list[int], which: int) -> np.ndarray:
        past = np.stack([sample.reshape(-1, *sample.shape[-2:])[ones] for sample in list(self._past)[::STRIDE]], axis=1)
        return np.stack([self._last(of_one, self.mixers[one]) for of_one, one in zip(past, ones)])

    def _last(self, past: np.ndarray, mixer: StyleMixer) -> np.ndarray:
        """By how much the last sample (21, 15) of a character's past (T, 21, 15) changes, each part as the output in
        its own style says. These systems make the whole pose, so there is no own style to take off: their output in
        it says less."""
        model = self.bank.model
        joints = joints_by_code(
            [(part.name, part.other, part.share) if part.strength else None for part in mixer.parts]
        )
        codes = torch.stack([self._code(mixer.root_velocities[BODY], *blend) for blend in joints])
        window = past[model.live_samples()]
        styled = stylize_windows(model, window[None], codes, last=1 + model.LOOK_AHEAD)[:, 0]
        return combine_joints(past[-1], dict(zip(joints, styled)), joints) - past[-1]

    def _code(self, root_velocity: np.ndarray, name: str, other: str, share: float) -> Tensor:
        code = self.bank[name].at(root_velocity)
        return code if not share else torch.lerp(code, self.bank[other].at(root_velocity), share)
