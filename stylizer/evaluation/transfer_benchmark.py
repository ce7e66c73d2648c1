"""One row of the table of transfer (Table 2 and more): a network, offline or live, over source x style pairs."""

import time
from dataclasses import dataclass
from functools import cache
from typing import Callable, Sequence

import numpy as np

from sim.body.skeleton import PART_NAMES, TOES
from sim.motion.clip import Clip, root_frame
from sim.motion.features import clip_features
from sim.motion.metrics import foot_skate, frechet_distance, jerk
from stylizer.data.style_labels import SHORTEST, Take, draw_balanced, windows
from stylizer.evaluation.classifier import Classifier
from stylizer.evaluation.held_out_pairs import Pair
from stylizer.evaluation.metrics import geodesic
from stylizer.evaluation.playback import Styles, play_live
from stylizer.runtime.offline import Network, ResolvedStyle, apply_styled, encode_clip, evaluate
from stylizer.styles.own_style import OWN
from stylizer.styles.style_clips import StyleClips

TRIALS = 10
WARM_UP = 40  # frames before the judged window: a live stream has reached its strength by then
SEGMENT = WARM_UP + SHORTEST
CENTI = 100
TARGET = "target"
JUDGED = ("sra", "cra", "fmd", "style_fid")
# by whether the classifiers have seen that content in that style
SPLIT = ("sra_known", "cra_known", "sra_unknown", "cra_unknown")
FIGURES = (*JUDGED, *SPLIT, "geodesic", "skate_cm_s", "jitter_ratio", *(f"drawn_{name}" for name in JUDGED))

Figures = dict[str, list[float] | None]  # [mean, deviation] over the trials


@dataclass(frozen=True)
class Classifiers:
    content: Classifier
    style: Classifier
    known: frozenset[Pair] = frozenset()  # what they have seen


class Transfer:
    """A network at work, the same way for both modes: (source clip, source take, target take) -> what the network
    gives, as features (frames, 21, 15), and the clip that is drawn, its feet in order."""

    def __init__(self, model: Network, mode: str) -> None:
        self.model, self.mode, self.seconds, self.frames = model, mode, 0.0, 0
        self.style: Callable[[Take], StyleClips] = cache(lambda take: encode_clip(model, take.features, take.style))

    def __call__(self, content: Clip, source: Take, target: Take) -> tuple[np.ndarray, Clip]:
        own, style = self.style(source), self.style(target)
        if self.mode == "live":
            playback = play_live(
                Styles(self.model, {OWN: own, TARGET: style}),
                content,
                lambda _: {part: (TARGET, 1.0) for part in PART_NAMES},
            )
            self.seconds += playback.seconds * len(content)
            result = clip_features(playback.styled), playback.locked
        else:
            start = time.perf_counter()
            styled = evaluate(self.model, clip_features(content), {part: ResolvedStyle(style) for part in PART_NAMES})
            result = styled, apply_styled(content, styled, np.ones(len(PART_NAMES)))
            self.seconds += time.perf_counter() - start
        self.frames += len(content)
        return result


def measure_real(takes: Sequence[Take], classifiers: Classifiers, size: int) -> Figures:
    """The figures of real motion, measured alike; its distance is that of one random half from the other."""
    trials = []
    for trial in range(TRIALS):
        random = np.random.default_rng(trial)
        chosen = [takes[i] for i in _balanced(random, takes, "style", size)]
        clips = [_segment(random, take.clip) for take in chosen]
        recognised = _recognise(_windows_of(clips), [t.content for t in chosen], [t.style for t in chosen], classifiers)
        order = random.permutation(len(chosen))
        halves = [_windows_of([clips[i] for i in half]) for half in (order[::2], order[1::2])]
        distances = {
            name: frechet_distance(*(classifier.names(half)[1] for half in halves))
            for name, classifier in (("fmd", classifiers.content), ("style_fid", classifiers.style))
        }
        trials.append(recognised | distances | {"skate_cm_s": _drawn(clips, clips)["skate_cm_s"]})
    return _summary(trials)


def measure_transfer(
    transfer: Transfer,
    takes: Sequence[Take],
    classifiers: Classifiers,
    size: int,
    tick: Callable[[], object],
    targets: Sequence[Take] | None = None,
    same_content: bool = False,
) -> Figures:
    """TRIALS times `size` pairs, sources balanced over contents and targets over styles; calls tick once a pair.

    targets: the takes whose styles are put on (None: all). same_content: a source walks where its target walks."""
    targets = takes if targets is None else targets
    sources = [take for take in takes if len(take.clip) >= SEGMENT]
    real = np.concatenate([windows(t.features, np.unique([0, len(t.features) - SHORTEST])) for t in takes])
    reference = classifiers.content.names(real)[1], classifiers.style.names(real)[1]
    trials = []
    for trial in range(TRIALS):
        random = np.random.default_rng(trial)
        wanted = [targets[i] for i in _balanced(random, targets, "style", size)]
        if same_content:
            fitting = [[take for take in sources if take.content == target.content] or sources for target in wanted]
            chosen = [choice[int(random.integers(len(choice)))] for choice in fitting]
        else:
            chosen = [sources[i] for i in _balanced(random, sources, "content", size)]
        pairs = list(zip(chosen, wanted))
        contents, answers, outputs = [], [], []
        for source, target in pairs:
            contents.append(_segment(random, source.clip))
            features, drawn = transfer(contents[-1], source, target)
            answers.append(windows(features, [len(features) - SHORTEST])[0])
            outputs.append(drawn)
            tick()
        labels = [s.content for s, _ in pairs], [t.style for _, t in pairs]
        of_drawn = _recognise(_windows_of(outputs), *labels, classifiers, reference)
        trials.append(
            _recognise(np.stack(answers), *labels, classifiers, reference)
            | _drawn(outputs, contents)
            | {f"drawn_{name}": value for name, value in of_drawn.items()}
        )
    return _summary(trials)


def _recognise(
    motion: np.ndarray,
    content: Sequence[str],
    style: Sequence[str],
    classifiers: Classifiers,
    reference: tuple[np.ndarray, np.ndarray] | None = None,
) -> dict[str, float | None]:
    """JUDGED of windows (n, SAMPLES, 21, 15), with their labels and what both classifiers see in real ones."""
    named_content, of_content = classifiers.content.names(motion)
    named_style, of_style = classifiers.style.names(motion)
    distances = {
        name: None if real is None else frechet_distance(features, real)
        for name, features, real in zip(("fmd", "style_fid"), (of_content, of_style), reference or (None, None))
    }
    right = {"sra": np.array(named_style) == style, "cra": np.array(named_content) == content}
    known = np.array([pair in classifiers.known for pair in zip(content, style)])
    split = {
        f"{name}_{kind}": float(hits[which].mean()) if which.any() else None
        for kind, which in (("known", known), ("unknown", ~known))
        for name, hits in right.items()
    }
    return {**{name: float(hits.mean()) for name, hits in right.items()}, **distances, **split}


def _drawn(outputs: Sequence[Clip], contents: Sequence[Clip]) -> dict[str, float]:
    """The figures of drawn clips beside their contents, over the last SHORTEST frames."""
    last = slice(-SHORTEST, None)
    roots = [root_frame(clip.positions()).positions[last] for clip in contents]
    jerks = [
        [np.nanmean(jerk(clip.positions()[last], root)) for clip, root in zip(clips, roots)]
        for clips in (outputs, contents)
    ]
    skates = np.concatenate([foot_skate(clip.positions()[last][:, TOES]).ravel() for clip in outputs])
    return {
        "geodesic": float(np.mean([geodesic(o.rotations[last], c.rotations[last]) for o, c in zip(outputs, contents)])),
        "skate_cm_s": float(np.nanmean(skates)) * CENTI,
        "jitter_ratio": float(np.mean(jerks[0]) / np.mean(jerks[1])),
    }


def _windows_of(clips: Sequence[Clip]) -> np.ndarray:
    return np.concatenate([windows(clip_features(clip), [len(clip) - SHORTEST]) for clip in clips])


def _segment(random: np.random.Generator, clip: Clip) -> Clip:
    length = min(SEGMENT, len(clip))
    start = int(random.integers(0, len(clip) - length + 1))
    return clip[start : start + length]


def _balanced(random: np.random.Generator, takes: Sequence[Take], label: str, size: int) -> list[int]:
    """`size` indices, the values of a label in turn, shuffled."""
    chosen: list[int] = []
    while len(chosen) < size:
        chosen += random.permutation(draw_balanced(random, takes, label)).tolist()
    return random.permutation(chosen[:size]).tolist()


def _summary(trials: Sequence[dict[str, float | None]]) -> Figures:
    """[mean, deviation] of every figure over the trials, None where it does not apply."""
    result: Figures = {}
    for name in FIGURES:
        values = [value for trial in trials if (value := trial.get(name)) is not None]
        result[name] = [float(np.mean(values)), float(np.std(values))] if values else None
    return result


def measure_milliseconds(transfer: Transfer) -> list[float]:
    """What a frame took, as [mean, 0]: it is measured over all trials together."""
    return [1000 * transfer.seconds / max(transfer.frames, 1), 0.0]
