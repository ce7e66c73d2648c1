"""The evaluation classifiers: spatial-temporal graph convolutional networks (Yan et al. 2018) that name a motion's
content or its style.

They see where the joints are and how they move about the hips, but not the root motion, which a restyled motion
keeps in any case and which would give the content away."""

import hashlib
import json
from pathlib import Path
from typing import Callable, Sequence

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from sim.body.skeleton import PART_NAMES, PART_OF_JOINT
from sim.io import tensor_file
from sim.motion.features import LAYOUT, STRIDE
from stylizer.data.style_labels import SAMPLES, Take, draw_balanced
from stylizer.networks.graph import LEVELS
from stylizer.networks.layers import M, Pool, STConv
from stylizer.systems import checkpoint

SEEN = np.r_[LAYOUT["position"], LAYOUT["velocity"]]
WIDTHS = (24, 48, 48)  # channels at G1, G2, G3
TAPS = (9, 5, 3)  # samples that a temporal convolution sees there
STEPS, BATCH = 600, 48
LEARNING_RATE = 3e-3
DROPOUT = 0.3
# What a classifier must not lean on, so training varies it: millimetres, the cadence (it is the content's), one part
# alone.
NOISE = 0.25  # of the normalized input
PACES = (0.8, 1.25)
HIDDEN = 0.3  # probability that a body part is hidden


class Classifier(nn.Module):
    """Windows (B, SAMPLES, 21, 15) -> the logits of `labels`. Three graph convolutions, the last pooled to one
    feature."""

    mean: Tensor
    deviation: Tensor

    def __init__(self, labels: Sequence[str]) -> None:
        super().__init__()
        self.labels = tuple(labels)
        widths = (len(SEEN), *WIDTHS)
        self.convs = nn.ModuleList(
            STConv(graph, widths[level - 1], widths[level], 2, TAPS[level - 1]) for level, graph in LEVELS.items()
        )
        self.norms = nn.ModuleList(nn.BatchNorm1d(width) for width in WIDTHS)
        self.pools = nn.ModuleList([nn.Identity(), Pool(LEVELS[1], LEVELS[2]), Pool(LEVELS[2], LEVELS[3])])
        self.head = nn.Linear(WIDTHS[-1], len(labels))
        self.register_buffer("mean", torch.zeros(21, 1, 1, len(SEEN)))
        self.register_buffer("deviation", torch.ones(21, 1, 1, len(SEEN)))

    def feature(self, motion: Tensor) -> Tensor:
        """(B, SAMPLES, 21, 15) -> (B, WIDTHS[-1]), what the final pooling gives: the feature of the Frechet motion
        distance."""
        x = (motion[..., SEEN].permute(2, 0, 1, 3) - self.mean) / self.deviation
        if self.training:
            x = self._hidden(x + NOISE * torch.randn_like(x))
        for pool, conv, norm in zip(self.pools, self.convs, self.norms):
            x = conv(pool(x))
            x = F.relu(norm(x.reshape(-1, x.shape[-1])).view_as(x))
        return x.mean(dim=(0, 2))

    def _hidden(self, x: Tensor) -> Tensor:
        """(21, B, SAMPLES, C) with a random body part at rest in some of the batch."""
        part = torch.randint(len(PART_NAMES), x.shape[1:2])
        hide = (torch.rand(x.shape[1]) < HIDDEN) & (torch.as_tensor(PART_OF_JOINT)[:, None] == part)
        return x * ~hide[:, :, None, None]

    def forward(self, motion: Tensor) -> Tensor:
        """(B, SAMPLES, 21, 15) -> logits (B, labels)"""
        return self.head(F.dropout(self.feature(motion), DROPOUT, self.training))

    @torch.inference_mode()
    def names(self, motion: np.ndarray) -> tuple[list[str], np.ndarray]:
        """The label that each of windows (B, SAMPLES, 21, 15) gets, and their features (B, WIDTHS[-1])."""
        feature = self.feature(torch.from_numpy(motion.astype(np.float32)))
        return [self.labels[i] for i in self.head(feature).argmax(dim=1).tolist()], feature.numpy()


def load_classifier(
    kind: str, takes: Sequence[Take], folder: Path, seed: int = 0, tick: Callable[[], object] = lambda: None
) -> Classifier:
    """The classifier of `kind`, "content" or "style", trained on these takes: from `folder` where the same was trained
    before.

    Calls tick once a step of training. Deterministic for a seed."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        model = Classifier(sorted({getattr(take, kind) for take in takes}))
    path = folder / f"{kind}-{_fingerprint(model, kind, takes, seed)}.safetensors"
    return train_once(model, path, lambda: _train(model, kind, takes, seed, tick), STEPS, tick)


def train_once(model: M, path: Path, train: Callable[[], object], steps: int, tick: Callable[[], object]) -> M:
    """The model with the weights of a file, or trained, which takes `steps` steps, and kept there; ready to run.
    Calls tick once a step either way, `train` doing so itself."""
    if path.exists():
        model.load_state_dict(checkpoint.read(path)[1])
        for _ in range(steps):
            tick()
        return model.eval()
    train()
    tensor_file.write(path, {name: value.numpy() for name, value in model.state_dict().items()}, {})
    return model.eval()


def _train(model: Classifier, kind: str, takes: Sequence[Take], seed: int, tick: Callable[[], object]) -> None:
    """Adam with a learning rate that falls along a cosine; every label is drawn equally often."""
    random = np.random.default_rng(seed)
    everything = np.concatenate([take.features[..., SEEN] for take in takes])
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        model.mean.copy_(torch.as_tensor(everything.mean(axis=0))[:, None, None])
        model.deviation.copy_(torch.as_tensor(np.maximum(everything.std(axis=0), 0.02))[:, None, None])
        optimizer = torch.optim.AdamW(model.parameters(), LEARNING_RATE, weight_decay=1e-2)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, STEPS)
        model.train()
        for _ in range(STEPS):
            batch, labels = _batch(random, takes, kind, model.labels)
            loss = F.cross_entropy(model(batch), labels, label_smoothing=0.05)
            optimizer.zero_grad(set_to_none=True)
            loss.backward()
            optimizer.step()
            schedule.step()
            tick()
    model.eval()


def _batch(
    random: np.random.Generator, takes: Sequence[Take], kind: str, labels: tuple[str, ...]
) -> tuple[Tensor, Tensor]:
    chosen: list[int] = []
    while len(chosen) < BATCH:
        chosen += draw_balanced(random, takes, kind)
    drawn = random.permutation(chosen)[:BATCH]
    motion = [_paced(random, takes[i].features) for i in drawn]
    return (
        torch.from_numpy(np.stack(motion).astype(np.float32)),
        torch.tensor([labels.index(getattr(takes[i], kind)) for i in drawn]),
    )


def _paced(random: np.random.Generator, features: np.ndarray) -> np.ndarray:
    """A random window (SAMPLES, 21, 15) of a take's features at 60 Hz, played at a random pace, velocities and all."""
    pace = min(random.uniform(*PACES), (len(features) - 1) / (STRIDE * (SAMPLES - 1)))
    frames = random.uniform(0, len(features) - 1 - pace * STRIDE * (SAMPLES - 1)) + pace * STRIDE * np.arange(SAMPLES)
    window = features[np.minimum(frames.round().astype(int), len(features) - 1)].copy()
    window[..., LAYOUT["velocity"]] *= pace
    return window


def _fingerprint(model: Classifier, kind: str, takes: Sequence[Take], seed: int) -> str:
    """What a trained classifier depends on, so that a kept one is never used for something else."""
    described = [
        kind,
        seed,
        STEPS,
        BATCH,
        LEARNING_RATE,
        DROPOUT,
        NOISE,
        PACES,
        HIDDEN,
        SEEN.tolist(),
        [(name, list(value.shape)) for name, value in model.state_dict().items()],
        [(take.path.name, len(take.clip), round(float(take.clip.rotations.sum()), 3)) for take in takes],
    ]
    return hashlib.sha256(json.dumps(described).encode()).hexdigest()[:16]
