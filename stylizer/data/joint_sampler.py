"""The windows that Motion Puzzle at the resolution of joints learns from: moving bodies, the controller's own motion
among them."""

from dataclasses import dataclass

import numpy as np

from sim.motion.features import LAYOUT, WINDOW
from stylizer.data.dataset import CONTENT_SPAN, LATER, STYLE_WINDOW, PackedClip
from stylizer.data.gait_matching import LAGS, best_match, closeness
from stylizer.data.sampler import MIRROR_SIGNS, Sampler

CLIP_SAMPLES = 128  # of a style clip: some strides
EXEMPLARS = 0.8  # share of the labelled targets that are judged by a clip of their style at the source's root velocity


@dataclass
class JointBatch:
    """Windows (B, samples, 21, 15) of two clips, source and target.

    source ends with the content window; own is the source's own style, seen in the source itself, elsewhere in its clip
    or in another clip of its performer style; target is the style to take; exemplar is the same style at the source's
    root velocity; match is where the exemplar's clip does what the content window does, closeness how much that is
    worth."""

    source: np.ndarray  # (B, STYLE_WINDOW, ...)
    own: np.ndarray  # (B, CLIP_SAMPLES, ...)
    target: np.ndarray  # (B, CLIP_SAMPLES, ...)
    exemplar: np.ndarray  # (B, CLIP_SAMPLES, ...)
    match: np.ndarray  # (B, WINDOW, ...)
    closeness: np.ndarray  # (B,) 0..1


class JointSampler(Sampler):
    """Draws batches; its random state can be saved, so that training resumes exactly."""

    BATCH, OWN_SAMPLES = JointBatch, CLIP_SAMPLES

    def _row(self, source: PackedClip, target: PackedClip) -> tuple[np.ndarray | float, ...]:
        flip_source, flip_target = (bool(flip) for flip in self.random.random(2) < 0.5)
        pace = self._pace(source)
        end = float(self.random.uniform(CONTENT_SPAN * pace, source.frames - 1 - LATER * pace))
        velocity = (
            self._root_velocity(source) * pace * (MIRROR_SIGNS[LAYOUT["root"]] if flip_source != flip_target else 1.0)
        )
        exemplar = self.exemplar(target, velocity) if self.random.random() < EXEMPLARS else target
        shown = self._window(target, self.random.uniform(0, target.frames - 1), CLIP_SAMPLES, 1.0, flip_target)
        like = (
            shown
            if exemplar is target
            else self._window(exemplar, self.random.uniform(0, exemplar.frames - 1), CLIP_SAMPLES, 1.0, flip_target)
        )
        gait = self._gait(source, flip_source)[np.maximum(np.round(end - LAGS * pace), 0).astype(int)]
        match, match_pace, apart = best_match(gait, self._gait(exemplar, flip_target))
        return (
            self._window(source, end, STYLE_WINDOW, pace, flip_source),
            self._own(source, end, pace, flip_source),
            shown,
            like,
            self._window(exemplar, match, WINDOW, match_pace, flip_target),
            closeness(apart, source.speed * pace, exemplar.speed * match_pace),
        )
