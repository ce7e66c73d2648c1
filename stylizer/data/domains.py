"""Style labels: which domain a clip belongs to, by its file name, and the labelled windows that training draws."""

from collections import defaultdict
from dataclasses import dataclass, fields
from typing import Generic, TypeVar

import numpy as np
import torch
from torch import Tensor

from sim.io.provenance import CONTROLLER
from sim.motion.features import STRIDE
from stylizer.data import style_labels
from stylizer.data.dataset import MotionData, PackedClip
from stylizer.data.sampler import Sampler
from stylizer.networks.normalization import Scaled

A = TypeVar("A", np.ndarray, Tensor)
NEUTRAL = "neutral"  # of motion without a style, the controller's own among it
NEUTRAL_FOLDERS = (CONTROLLER, "100style-neutral")
NOISE = 64  # standard normal numbers for each row of a batch
POSE_WINDOWS = 32  # from which a domain's mean pose is measured


def label_of(name: str) -> str | None:
    """The domain of a clip of that name (its path without an ending): `old 1` for Bandai-Namco's old of set 1, None
    where the name tells none."""
    folder, _, stem = name.rpartition("/")
    if found := style_labels.labels(stem):
        return found[1]
    return NEUTRAL if folder.rpartition("/")[2] in NEUTRAL_FOLDERS else None


def labels_of(data: MotionData) -> tuple[str, ...]:
    """The domains of a pack, alphabetically. Raises ValueError where there are fewer than two."""
    labels = sorted({label for clip in data.clips if (label := label_of(clip.name))})
    if len(labels) < 2:
        raise ValueError(
            "this stylizer learns from style labels, which file names such as dataset-1_walk_old_001.bvh tell, and "
            f"there are {len(labels)}: unpack bandai-namco into the data folder"
        )
    return tuple(labels)


@dataclass
class DomainBatch(Generic[A]):
    """Windows of motion with their domains (B,), and random numbers (B, NOISE) that the losses use in turn.

    The windows are arrays (B, T, 21, 15), or, normalized for a network by `as_inputs`, tensors (21, B, T, 15). sibling
    is another window of source's clip, kin a window of another clip of source's domain; target is of any domain,
    target_kin a window of another clip of that one; any is of any clip, labelled or not."""

    source: A
    sibling: A
    kin: A
    target: A
    target_kin: A
    any: A
    source_domain: A
    target_domain: A
    noise: A


def as_inputs(batch: DomainBatch[np.ndarray], model: Scaled, device: torch.device) -> DomainBatch[Tensor]:
    """The batch as tensors, its windows normalized."""
    tensors = {field.name: torch.from_numpy(getattr(batch, field.name)).to(device) for field in fields(batch)}
    return DomainBatch(**{name: model.normalize(x) if x.dim() == 4 else x for name, x in tensors.items()})


class LabelledSampler(Sampler):
    """Draws labelled windows of `samples`; every domain is drawn as often as any other."""

    def __init__(self, data: MotionData, labels: tuple[str, ...], samples: int, seed: int) -> None:
        super().__init__(data, seed)
        self.labels, self.samples = labels, samples
        self.by_domain: dict[int, list[int]] = defaultdict(list)
        for index, clip in enumerate(data.clips):
            if (label := label_of(clip.name)) in labels:
                self.by_domain[labels.index(label)].append(index)
        # Those with a clip that moves: all of a small set's may stand.
        moving = [name for name, clips in sorted(self.by_domain.items()) if self.target_weights[clips].any()]
        self.domains = moving or sorted(self.by_domain)

    def batch(self, size: int) -> DomainBatch[np.ndarray]:
        """Random windows, half of them mirrored."""
        domains = self.random.choice(self.domains, (2, size))
        rows = zip(*(self._row(source, target) for source, target in domains.T))
        source, sibling, kin, target, target_kin, anything = (np.stack(column).astype(np.float32) for column in rows)
        noise = self.random.standard_normal((size, NOISE)).astype(np.float32)
        source_domain, target_domain = domains.astype(np.int64)
        return DomainBatch(source, sibling, kin, target, target_kin, anything, source_domain, target_domain, noise)

    def of_domain(self, domain: int, size: int) -> np.ndarray:
        """(size, T, 21, 15) random windows of one domain."""
        return np.stack([self._anywhere(self._clip(domain)) for _ in range(size)]).astype(np.float32)

    def _row(self, source: int, target: int) -> tuple[np.ndarray, ...]:  # type: ignore[override]  # see `batch`
        clip, target_clip = self._clip(source), self._clip(target)
        anything = self.data.clips[self.random.choice(len(self.data.clips), p=self.source_weights)]
        chosen = (clip, clip, self._clip(source), target_clip, self._clip(target), anything)
        flips = self.random.random(6) < 0.5
        flips[1] = flips[0]  # a sibling is the same performance
        return tuple(self._anywhere(one, bool(flip)) for one, flip in zip(chosen, flips))

    def _clip(self, domain: int) -> PackedClip:
        chosen = self.by_domain[domain]
        weights = self.target_weights[chosen]
        weights = weights if weights.any() else np.ones(len(chosen))
        return self.data.clips[self.random.choice(chosen, p=weights / weights.sum())]

    def _anywhere(self, clip: PackedClip, flip: bool | None = None) -> np.ndarray:
        span = STRIDE * (self.samples - 1)
        end = self.random.uniform(min(span, clip.frames - 1), clip.frames - 1)
        flip = bool(self.random.random() < 0.5) if flip is None else flip
        return self._window(clip, end, self.samples, 1.0, flip)


def mean_poses(model: Scaled, sampler: LabelledSampler, channels: slice) -> Tensor:
    """(domains, 21, channels) mean of the normalized motion of each domain."""
    windows = (torch.from_numpy(sampler.of_domain(domain, POSE_WINDOWS)) for domain in range(len(sampler.labels)))
    return torch.stack([model.normalize(some)[..., channels].mean(dim=(1, 2)) for some in windows])
