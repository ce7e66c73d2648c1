"""The windows that training draws from packed motion: mirrored, paced, and matched step by step with another clip."""

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.body.skeleton import JOINT_COUNT, MIRROR
from sim.io.provenance import CONTROLLER
from sim.motion.features import FEATURES, LAYOUT, STRIDE, WINDOW
from sim.motion.thresholds import MOVING_CLIP
from stylizer.data.dataset import CLIP_WINDOW, CONTENT_SPAN, LATER, STILL_SHARE, STYLE_WINDOW, MotionData, PackedClip
from stylizer.data.gait_matching import LAGS, OTHER_FOOT, best_match, closeness, gait_signal

CROPPING = 0.2  # share of the source windows that are played slower or faster (temporal random cropping, Sec. 3.1)
PACES = (0.6, 1.6)  # between which they are
ELSEWHERE = 0.5  # share of the sources whose own style is read from another place of their clip
# of those, share that is read from another clip of the same manner, as the controller's own style is
ELSEWHERE_STILL = 0.5
SAME_VELOCITY = (
    0.15  # m/s and rad/s, added up: clips whose mean root velocities differ by no more are takes of one action
)
CONTROLLER_SHARE = 0.4  # of the sources: what the network restyles live
RUNNING, RUNNING_SHARE = 1.8, 2.0  # metres a second above which sources are drawn so much more often, for they are rare
SLOWEST = 0.5  # metres a second; slower clips are drawn of the controller alone
CANDIDATES, LIKE_VELOCITY = 12, 0.5  # share of the targets at the root velocity of their source, the nearest of so many

# Mirroring in features: the x of every vector flips, and so does the turn rate.
MIRROR_SIGNS = np.where(np.isin(np.arange(FEATURES), (0, 3, 6, 9, 12, 14)), -1.0, 1.0).astype(np.float32)


def mirror(features: np.ndarray) -> np.ndarray:
    """Features (..., 21, 15) of the motion with left and right exchanged."""
    return features[..., MIRROR, :] * MIRROR_SIGNS


@dataclass
class Batch:
    """Windows (B, samples, 21, 15) of two clips, source and target.

    source ends with the content window; later is that window LATER frames on; own is the source's own style, seen in
    the source itself, elsewhere in its clip or in another clip of its manner; target is the style to take; exemplar is
    the same style at the source's root velocity (see `Sampler.exemplar`); match is where the exemplar's clip does what
    the content window does, match_later what later does; closeness says how much these are worth."""

    source: np.ndarray  # (B, STYLE_WINDOW, ...)
    own: np.ndarray  # (B, CLIP_WINDOW, ...)
    later: np.ndarray  # (B, WINDOW, ...)
    target: np.ndarray  # (B, CLIP_WINDOW, ...)
    exemplar: np.ndarray  # (B, STYLE_WINDOW, ...)
    match: np.ndarray  # (B, WINDOW, ...)
    match_later: np.ndarray  # (B, WINDOW, ...)
    closeness: np.ndarray  # (B,) 0..1


class Sampler:
    """Draws batches; its random state can be saved, so that training resumes exactly."""

    BATCH: type = Batch
    OWN_SAMPLES = CLIP_WINDOW  # in which the source's own style is seen

    def __init__(self, data: MotionData, seed: int) -> None:
        self.data = data
        self.source_weights, self.target_weights = data.weights()
        self.speeds = np.array([clip.speed for clip in data.clips])
        self._prefer_movement()
        self.random = np.random.default_rng(seed)
        self.gaits: dict[str, np.ndarray] = {}  # of clips that were drawn before
        self.root_velocities: dict[str, np.ndarray] = {}  # likewise
        self.alike: dict[str | None, list[PackedClip]] = defaultdict(list)  # the clips of a performer style
        for clip in data.clips:
            self.alike[clip.performer_style].append(clip)
        self.mean_velocities = np.array([self._root_velocity(clip) for clip in data.clips])

    def _prefer_movement(self) -> None:
        """Sources and targets move; of the sources, CONTROLLER_SHARE is the controller's own motion."""
        own = np.array([clip.performer_style == CONTROLLER for clip in self.data.clips])
        moving = self.speeds > SLOWEST
        drawn = self.source_weights * np.where(moving, 1.0, STILL_SHARE * own)
        drawn *= np.where(self.speeds > RUNNING, RUNNING_SHARE, 1.0)
        share = CONTROLLER_SHARE if own.any() and not own.all() else own.mean()
        self.source_weights = _shares(_shares(drawn * own) * share + _shares(drawn * ~own) * (1 - share))
        self.target_weights = _shares(self.target_weights * moving)

    def batch(self, size: int) -> Any:
        """Random windows, half of them mirrored: a BATCH."""
        sources = self.random.choice(len(self.speeds), size, p=self.source_weights)
        candidates = self.random.choice(len(self.speeds), (size, CANDIDATES), p=self.target_weights)
        apart = np.abs(self.mean_velocities[candidates] - self.mean_velocities[sources][:, None]).sum(axis=2)
        closest = np.where(self.random.random(size) < LIKE_VELOCITY, apart.argmin(axis=1), 0)
        targets = candidates[np.arange(size), closest]
        rows = zip(*(self._row(self.data.clips[i], self.data.clips[j]) for i, j in zip(sources, targets)))
        return self.BATCH(*(np.stack(column).astype(np.float32) for column in rows))

    def _row(self, source: PackedClip, target: PackedClip) -> tuple[np.ndarray | float, ...]:
        flip_source, flip_target = (bool(flip) for flip in self.random.random(2) < 0.5)
        pace = self._pace(source)
        end, later = float(self.random.uniform(CONTENT_SPAN * pace, source.frames - 1 - LATER * pace)), LATER * pace
        root_velocity = (
            self._root_velocity(source) * pace * (MIRROR_SIGNS[LAYOUT["root"]] if flip_source != flip_target else 1.0)
        )
        exemplar = self.exemplar(target, root_velocity)
        windows = [
            self._window(source, end, STYLE_WINDOW, pace, flip_source),
            self._own(source, end, pace, flip_source),
            self._window(source, end + later, WINDOW, pace, flip_source),
            *(
                self._window(clip, self.random.uniform(0, clip.frames - 1), samples, 1.0, flip_target)
                for clip, samples in ((target, CLIP_WINDOW), (exemplar, STYLE_WINDOW))
            ),
        ]
        gait = self._gait(source, flip_source)[np.maximum(np.round(end - LAGS * pace), 0).astype(int)]
        match, match_pace, apart = best_match(gait, self._gait(exemplar, flip_target))
        later = LATER * match_pace
        windows += [self._window(exemplar, match + shift, WINDOW, match_pace, flip_target) for shift in (0.0, later)]
        fits = match + later <= exemplar.frames - 1
        return *windows, closeness(apart, source.speed * pace, exemplar.speed * match_pace) * fits

    def _own(self, source: PackedClip, end: float, pace: float, flip: bool) -> np.ndarray:
        """Where the source's own style is read."""
        if self.random.random() < ELSEWHERE:
            if source.performer_style and self.random.random() < ELSEWHERE_STILL:
                alike = self.alike[source.performer_style]
                source, pace = alike[self.random.choice(len(alike))], 1.0
            end = self.random.uniform(0, source.frames - 1)
        return self._window(source, end, self.OWN_SAMPLES, pace, flip)

    def exemplar(self, target: PackedClip, root_velocity: np.ndarray) -> PackedClip:
        """A clip of the target's style whose mean root velocity (see `_root_velocity`) is about `root_velocity`:
        how one who runs, backs or turns looks in a style that the network is shown walking. The target itself where no
        label tells the style, and for one who stands: labelled clips that stay in place are gestures."""
        if target.performer_style is None or np.hypot(*root_velocity[:2]) < MOVING_CLIP:
            return target
        clips = self.alike[target.performer_style]
        apart = {clip.name: np.abs(self._root_velocity(clip) - root_velocity).sum() for clip in clips}
        limit = min(apart.values()) + SAME_VELOCITY
        if apart[target.name] <= limit:  # what the network is shown is the best lesson in it
            return target
        near = [clip for clip in clips if apart[clip.name] <= limit]
        return near[self.random.choice(len(near))]

    def _root_velocity(self, clip: PackedClip) -> np.ndarray:
        """(3,) mean velocity sideways and forward in m/s, and turn rate in rad/s."""
        if clip.name not in self.root_velocities:
            root = self.data.motion[clip.start : clip.start + clip.frames, 0, LAYOUT["root"]]
            self.root_velocities[clip.name] = root.astype(np.float32).mean(axis=0)
        return self.root_velocities[clip.name]

    def _pace(self, clip: PackedClip) -> float:
        """Of a source window; 1 mostly, and never so quick that the clip is too short."""
        pace = np.exp(self.random.uniform(*np.log(PACES))) if self.random.random() < CROPPING else 1.0
        return min(float(pace), (clip.frames - 1) / (CONTENT_SPAN + LATER))

    def _gait(self, clip: PackedClip, flip: bool) -> np.ndarray:
        if clip.name not in self.gaits:
            self.gaits[clip.name] = gait_signal(self.data.motion[clip.start : clip.start + clip.frames])
        gait = self.gaits[clip.name]
        return gait[:, OTHER_FOOT] if flip else gait

    def _window(self, clip: PackedClip, end: float, samples: int, pace: float, flip: bool) -> np.ndarray:
        """`samples` at 30 Hz that end at frame `end`, played `pace` times as fast; a clip too short for them is
        repeated."""
        frames = end - STRIDE * pace * np.arange(samples)[::-1]
        last = clip.frames - 1
        frames = np.where((frames < 0) | (frames > last), frames % last, frames)
        whole = np.minimum(frames.astype(int), last - 1)
        between = (frames - whole).astype(np.float32)[:, None, None]
        before, after = (self.data.motion[clip.start + whole + i].astype(np.float32) for i in (0, 1))
        window = before + (after - before) * between
        window[..., LAYOUT["velocity"].start :] *= pace
        return mirror(window) if flip else window


def measure_statistics(sampler: Sampler, batches: int = 64) -> tuple[np.ndarray, np.ndarray]:
    """Mean and deviation (21, 15) of what the sampler draws.

    Deviations are shared by the axes of a quantity and kept off zero: a joint that hardly moves counts little."""
    windows = np.concatenate([sampler.batch(32).source for _ in range(batches)]).reshape(-1, JOINT_COUNT, FEATURES)
    mean, variance = windows.mean(axis=0), windows.var(axis=0)
    deviation = np.empty_like(mean)
    for channels in LAYOUT.values():
        shared = np.sqrt(variance[:, channels].mean(axis=1, keepdims=True))
        deviation[:, channels] = np.maximum(shared, 0.3 * shared.mean())
    return mean, deviation


def _shares(weights: np.ndarray) -> np.ndarray:
    """Weights that add up to 1, or none at all."""
    return weights / max(weights.sum(), 1e-9)
