"""The windows that Motion Puzzle at the resolution of joints learns from: moving bodies, the controller's own motion
among them."""

from dataclasses import dataclass

import numpy as np

from sim.io.provenance import CONTROLLER
from sim.motion.features import LAYOUT, WINDOW
from stylizer.data.dataset import CONTENT_SPAN, LATER, STILL_SHARE, STYLE_WINDOW, MotionData, PackedClip
from stylizer.data.gait_matching import LAGS, best_match, closeness
from stylizer.data.sampler import MIRROR_SIGNS, Sampler

CLIP_SAMPLES = 128  # of a style clip: some strides
CONTROLLER_SHARE = 0.4  # of the sources: what the network restyles live
RUNNING, RUNNING_SHARE = 1.8, 2.0  # metres a second above which sources are drawn so much more often, for they are rare
SLOWEST = 0.5  # metres a second; slower clips are drawn of the controller alone
EXEMPLARS = 0.8  # share of the labelled targets that are judged by a clip of their style at the source's root velocity
CANDIDATES, LIKE_VELOCITY = 12, 0.5  # share of the targets at the root velocity of their source, the nearest of so many


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

    OWN_SAMPLES = CLIP_SAMPLES

    def __init__(self, data: MotionData, seed: int) -> None:
        super().__init__(data, seed)
        own = np.array([clip.performer_style == CONTROLLER for clip in data.clips])
        moving = self.speeds > SLOWEST
        drawn = self.source_weights * np.where(moving, 1.0, STILL_SHARE * own)
        drawn *= np.where(self.speeds > RUNNING, RUNNING_SHARE, 1.0)
        share = CONTROLLER_SHARE if own.any() and not own.all() else own.mean()
        self.source_weights = _shares(_shares(drawn * own) * share + _shares(drawn * ~own) * (1 - share))
        self.target_weights = _shares(self.target_weights * moving)
        self.mean_velocities = np.array([self._root_velocity(clip) for clip in data.clips])

    def batch(self, size: int) -> JointBatch:  # type: ignore[override]  # nobody takes either kind
        """Random windows, half of them mirrored."""
        sources = self.random.choice(len(self.speeds), size, p=self.source_weights)
        candidates = self.random.choice(len(self.speeds), (size, CANDIDATES), p=self.target_weights)
        apart = np.abs(self.mean_velocities[candidates] - self.mean_velocities[sources][:, None]).sum(axis=2)
        targets = candidates[
            np.arange(size), np.where(self.random.random(size) < LIKE_VELOCITY, apart.argmin(axis=1), 0)
        ]
        rows = zip(*(self._row(self.data.clips[i], self.data.clips[j]) for i, j in zip(sources, targets)))
        return JointBatch(*(np.stack(column).astype(np.float32) for column in rows))

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


def _shares(weights: np.ndarray) -> np.ndarray:
    """Weights that add up to 1, or none at all."""
    return weights / max(weights.sum(), 1e-9)
