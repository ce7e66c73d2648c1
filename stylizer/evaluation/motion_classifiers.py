"""Judges of drawn motion: temporal convolutional networks that know a style, or what is done, by where joints are.

They are trained on captured motion alone and never used in a loss. Of each kind there are two, one for either half of
the labelled motion (stylizer.data.style_labels): on the other half it is known how good they are, and drawn motion is
judged by both together."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Sequence

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from sim.body.skeleton import JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from sim.motion.features import LAYOUT, STRIDE
from stylizer.data.style_labels import SAMPLES, SHORTEST, LabelledTakes, Take
from stylizer.evaluation.classifier import train_once

# Classifier: which label it names, and the joints that it sees. Arms and spine tell a style where no clip shows its
# legs.
KINDS = {
    "style": ("style", np.arange(JOINT_COUNT)),
    "content": ("content", np.arange(JOINT_COUNT)),
    "upper_style": ("style", np.flatnonzero(PART_OF_JOINT >= PART_NAMES.index("spine"))),
}
WIDTH, KERNELS, STRIDES = 64, (5, 5, 3), (2, 2, 1)  # channels, and what each of three convolutions sees and steps over
STEPS, BATCH = 900, 64
LEARNING_RATE, WEIGHT_DECAY, DROPOUT, SMOOTHING = 3e-3, 1e-2, 0.3, 0.05
NOISE = 0.2  # of the normalized input
PACES = (0.6, 1.7)  # played so much slower or quicker in training: a cadence is no style
LEAST_DEVIATION = 0.02  # metres
HOP = 32  # frames between two windows that are judged
TOP = 3


class MotionClassifier(nn.Module):
    """Joint positions (B, SAMPLES, n 3) -> logits (B, labels)."""

    mean: Tensor
    deviation: Tensor

    def __init__(self, labels: Sequence[str], joints: np.ndarray) -> None:
        super().__init__()
        self.labels, self.joints = tuple(labels), joints
        widths = (3 * len(joints), WIDTH, WIDTH, WIDTH)
        self.convs = nn.ModuleList(
            nn.Conv1d(widths[i], widths[i + 1], kernel, stride, kernel // 2)
            for i, (kernel, stride) in enumerate(zip(KERNELS, STRIDES))
        )
        self.norms = nn.ModuleList(nn.BatchNorm1d(WIDTH) for _ in KERNELS)
        self.head = nn.Linear(WIDTH, len(labels))
        self.register_buffer("mean", torch.zeros(widths[0]))
        self.register_buffer("deviation", torch.ones(widths[0]))

    def forward(self, x: Tensor) -> Tensor:
        x = (x - self.mean) / self.deviation
        if self.training:
            x = x + NOISE * torch.randn_like(x)
        x = x.transpose(1, 2)
        for conv, norm in zip(self.convs, self.norms):
            x = F.relu(norm(conv(x)))
        return self.head(F.dropout(x.mean(dim=2), DROPOUT, self.training))

    @torch.inference_mode()
    def probabilities(self, windows: np.ndarray) -> np.ndarray:
        """(B, labels) of windows of features (B, SAMPLES, 21, 15)."""
        return self(torch.from_numpy(places(windows, self.joints))).softmax(dim=1).numpy()


def places(features: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """Where joints are about the hips, and how high the hips are: (..., n 3) of features (..., 21, 15)."""
    positions = features[..., LAYOUT["position"]]
    hips = positions[..., :1, :]
    result = positions - hips
    result[..., 0, 1] = hips[..., 0, 1]
    return result[..., joints, :].reshape(*features.shape[:-2], -1).astype(np.float32)


def windows_of(features: np.ndarray) -> np.ndarray:
    """(n, SAMPLES, 21, 15) at 30 Hz, HOP frames apart, of features (frames, 21, 15) at 60 Hz."""
    starts = np.arange(0, max(len(features) - SHORTEST, 0) + 1, HOP)
    return features[starts[:, None] + STRIDE * np.arange(SAMPLES)]


@dataclass(frozen=True)
class Panel:
    """Two classifiers of one kind, and how often each is right about the half of the labelled motion that it has not
    seen."""

    classifiers: tuple[MotionClassifier, ...]
    held_out: float

    def ranks(self, features: np.ndarray) -> list[list[str]]:
        """For each window of features (frames, 21, 15) the labels, the likeliest first."""
        windows = windows_of(features)
        both = np.mean([classifier.probabilities(windows) for classifier in self.classifiers], axis=0)
        return [[self.classifiers[0].labels[i] for i in order] for order in (-both).argsort(axis=1)]

    def knows(self, label: str | None) -> bool:
        """Whether this is one of the labels that it tells apart."""
        return label in self.classifiers[0].labels

    def share(self, features: np.ndarray, wanted: Sequence[str | None], top: int = 1) -> float:
        """The share of a motion's windows in which a wanted label is among the `top` likeliest."""
        return float(np.mean([bool(set(names[:top]) & set(wanted)) for names in self.ranks(features)]))


def load_panels(data: LabelledTakes, folder: Path, tick: Callable[[], object] = lambda: None) -> dict[str, Panel]:
    """The evaluation classifiers of KINDS, trained on the two halves of the labelled motion, or found in `folder` where
    they have been.

    Calls tick once a step of training. Deterministic."""
    halves = data.classify, data.generate
    result = {}
    for kind, (label, joints) in KINDS.items():
        labels = sorted({getattr(take, label) for half in halves for take in half})
        classifiers = tuple(
            _trained(kind, MotionClassifier(labels, joints), label, half, folder, tick) for half in halves
        )
        right = [
            np.mean(
                [
                    np.mean(
                        [
                            classifier.labels[i] == getattr(take, label)
                            for i in classifier.probabilities(windows_of(take.features)).argmax(axis=1)
                        ]
                    )
                    for take in other
                ]
            )
            for classifier, other in zip(classifiers, halves[::-1])
        ]
        result[kind] = Panel(classifiers, float(np.mean(right)))
    return result


def _trained(
    kind: str, classifier: MotionClassifier, label: str, takes: Sequence[Take], folder: Path, tick: Callable[[], object]
) -> MotionClassifier:
    described = [
        kind,
        classifier.labels,
        classifier.joints.tolist(),
        WIDTH,
        KERNELS,
        STRIDES,
        STEPS,
        BATCH,
        LEARNING_RATE,
        WEIGHT_DECAY,
        DROPOUT,
        SMOOTHING,
        NOISE,
        PACES,
        [(take.path.name, len(take.clip), round(float(take.clip.rotations.sum()), 3)) for take in takes],
    ]
    path = folder / f"{kind}-{hashlib.sha256(json.dumps(described).encode()).hexdigest()[:16]}.safetensors"
    return train_once(classifier, path, lambda: _train(classifier, label, takes, tick), STEPS, tick)


def _train(classifier: MotionClassifier, label: str, takes: Sequence[Take], tick: Callable[[], object]) -> None:
    """AdamW with a learning rate that falls along a cosine; every label that these takes show is drawn equally
    often."""
    random = np.random.default_rng(0)
    by_label = {name: [take for take in takes if getattr(take, label) == name] for name in classifier.labels}
    shown = [name for name, found in by_label.items() if found]
    everything = np.concatenate([places(take.features, classifier.joints) for take in takes])
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        for module in (*classifier.convs, classifier.head):
            module.reset_parameters()
        classifier.mean.copy_(torch.from_numpy(everything.mean(axis=0)))
        classifier.deviation.copy_(torch.from_numpy(np.maximum(everything.std(axis=0), LEAST_DEVIATION)))
        optimizer = torch.optim.AdamW(classifier.parameters(), LEARNING_RATE, weight_decay=WEIGHT_DECAY)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, STEPS)
        classifier.train()
        for _ in range(STEPS):
            names = random.choice(shown, BATCH)
            takes_drawn = [by_label[name][random.integers(len(by_label[name]))] for name in names]
            batch = np.stack([_paced(random, take.features, classifier.joints) for take in takes_drawn])
            answers = torch.tensor([classifier.labels.index(name) for name in names])
            loss = F.cross_entropy(classifier(torch.from_numpy(batch)), answers, label_smoothing=SMOOTHING)
            optimizer.zero_grad(set_to_none=True)
            loss.backward()
            optimizer.step()
            schedule.step()
            tick()


def _paced(random: np.random.Generator, features: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """A random window (SAMPLES, n 3) of features (frames, 21, 15), played at a random pace."""
    span = STRIDE * (SAMPLES - 1)
    pace = min(np.exp(random.uniform(*np.log(PACES))), (len(features) - 1) / span)
    frames = random.uniform(0, len(features) - 1 - pace * span) + pace * STRIDE * np.arange(SAMPLES)
    return places(features[np.minimum(frames.round().astype(int), len(features) - 1)], joints)
