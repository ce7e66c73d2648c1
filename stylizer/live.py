"""The live stylizer: restyles the newest frame, body part by body part, sixty times a second.

The network's answer is never drawn as it is. What is taken from it is, joint by joint, the turn from the neutral pose
to the styled one; that turn is smoothed, scaled by the part's strength and put on top of the neutral pose. So the
neutral motion passes through untouched, strength 0 is the neutral pose exactly, and the network's own noise is damped.
"""

from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Iterable, Mapping, Sequence

import numpy as np
import torch

from sim.clip import FPS, Clip
from sim.features import FEATURES, STRIDE
from sim.pose import Pose
from sim.skeleton import JOINT_COUNT, PART_NAMES
from sim.springs import decay, soft_spring_step, spring_step
from sim.worn import Worn, names
from stylizer.attention import attention_map
from stylizer.bank import Bank
from stylizer.blend import Style, for_batch, joined, put, side_by_side
from stylizer.last_sample import live_form
from stylizer.turns import (
    ARM_PARTS,
    PART_OF_ROW,
    asked,
    continued,
    feet_off,
    feet_raised,
    hands_kept,
    height_share,
    scales,
    turned,
)
from stylizer.wearer import OWN, Wearer

SWITCH_HALFLIFE = 0.15  # seconds in which half of the way from one style to another is gone
SMOOTHING_HALFLIFE = 0.05  # seconds; the turns that the network asks for follow a spring, and lag by as much
FLOOR_HALFLIFE = 0.08  # seconds, for the height that all legs are lengthened or shortened by
DT = 1 / FPS
GROUP = 16  # characters, of whom half are asked for at a time: so many windows at once are quickest, for they stay in the caches
KEPT = 3  # joined styles that are kept for a group: of its halves, and of a frame between in which a style changes
LOST_SHARE = 1 - decay(1.0, STRIDE * DT)  # of an answer in the average of what is lost: a half-life of a second, once it is past


class LiveStylizer:
    """Implements `sim.session.Stylizer`, for one character or for a crowd. Deterministic: the same calls give the same poses,
    bit for bit."""

    def __init__(self, bank: Bank, crowd: tuple[int, ...] = ()) -> None:
        """crowd: (N,) for N characters, with whom every array has one more axis in front; none for one character."""
        self.bank = bank
        self._leading = crowd
        self._prepare()
        self.restart()

    def _prepare(self) -> None:
        """What the network needs before it is asked."""
        self._network = live_form(self.bank.model)
        own = side_by_side([self.bank[OWN]] * len(PART_NAMES))
        self._own = cache(lambda count: for_batch(own, count))  # what so many characters wear of their own
        self._kept: dict[tuple, tuple[list[Style], Style]] = {}  # by who asked: each one's style, and those side by side

    def crowd(self, count: int) -> "LiveStylizer":
        """So many characters side by side with the same bank. The network is asked for half of them in every frame."""
        return type(self)(self.bank, (count,))

    @property
    def styles(self) -> tuple[str, ...]:
        """The names of all styles in the bank."""
        return self.bank.names

    def learn(self, path: Path) -> tuple[str, Clip]:
        """Adds a BVH clip to the bank under a name made from the file's: the name, and the clip on our skeleton.

        May run in another thread than `step`. Raises ValueError or OSError, in one sentence, for what is no style."""
        name = self.bank.free_name(path)
        return name, self.bank.add(path, name)

    def restart(self) -> None:
        """Back to before the first step: nothing is worn."""
        count = int(np.prod(self._leading))
        self.wearers = [Wearer(late=one % 2 == 1) for one in range(count)]
        self.turns = _Turns(self._leading)
        self.raised, self.raised_rate = np.zeros((2, *self._leading))  # what legs are shortened by, feet under the styled hips
        self._answers = np.zeros((count, JOINT_COUNT, FEATURES))  # the network's own, when each was last asked for
        self._newest = np.zeros((count, len(PART_OF_ROW), 3))  # the same as rows
        self._lost, self._asked = np.zeros((count, JOINT_COUNT, FEATURES)), np.zeros(count, int)  # on average; how often asked

    def step(self, window: np.ndarray, neutral: Pose, style: Mapping[str, Worn] | Sequence[Mapping[str, Worn]]) -> Pose:
        """window: features (..., 16, 21, 15) ending with `neutral`; style: part -> what it wears (sim.worn), of a crowd one for
        each. Raises ValueError for a style that the bank does not hold."""
        styles = style if self._leading else (style,)
        for name in {name for each in styles for worn in each.values() for name in names(worn)}:
            self.bank[name]
        switched = self._together(wearer.step(each) for wearer, each in zip(self.wearers, styles, strict=True))
        strengths = self._together(wearer.strengths for wearer in self.wearers)
        worn = strengths.any(axis=-1)
        rows = self._answer(window)
        if not worn.any():
            self.turns.worn[:] = False
            self.raised, self.raised_rate = np.zeros((2, *self._leading))
            return neutral
        turns = self.turns.step(rows, switched[..., PART_OF_ROW], strengths[..., PART_OF_ROW] > 0)
        styled = hands_kept(turned(neutral, turns * scales(strengths)), neutral, strengths[..., ARM_PARTS])
        wanted = feet_off(styled, neutral) * np.minimum(height_share(strengths), 1.0)
        raised, rate = spring_step(self.raised, self.raised_rate, wanted, FLOOR_HALFLIFE, DT)
        self.raised, self.raised_rate = raised * worn, rate * worn
        return feet_raised(styled, self.raised)

    @property
    def answer(self) -> np.ndarray | None:
        """The network's own when it was last asked: features (..., 21, 15); None before."""
        return self._answers.reshape(*self._leading, *self._answers.shape[1:]) if self._asked.all() else None

    def take_over(self, other: "LiveStylizer") -> None:
        """Goes on from another stylizer's last step: strengths are kept, and the pose glides from its styles to ours. A part
        whose style we do not have lets it go."""
        self.bank.refresh()
        self.restart()
        self.wearers, self.turns = other.wearers, other.turns
        self.raised, self.raised_rate = other.raised, other.raised_rate
        for wearer in self.wearers:
            wearer.keep(self.styles)
        self.glide()

    def reroll(self) -> None:
        """Draws the styles of chance anew; Motion Puzzle has none. Raises ValueError."""
        raise ValueError("this stylizer takes styles from clips only: diverse and latent also draw them by chance")

    def glide(self) -> None:
        """What parts wear has changed under its name: the next answer is asked for at once and glided into."""
        for wearer in self.wearers:
            wearer.glide()

    def attention(self, window: np.ndarray, part: str) -> np.ndarray:
        """What a body part's attention looks at now, of one character: (samples of the window / 2, samples of the style's
        clips), rows that add up to 1. Changes nothing. Raises ValueError for weights without attention."""
        with torch.inference_mode():
            motion = self.bank.model.normalize(torch.from_numpy(window.astype(np.float32))[None])
            return attention_map(self.bank.model, motion, self.wearers[0].look(self.bank), PART_NAMES.index(part))

    def _together(self, values: Iterable[Sequence]) -> np.ndarray:
        """What each character has, as one array (..., n)."""
        return np.array(list(values)).reshape(*self._leading, -1)

    def _answer(self, window: np.ndarray) -> np.ndarray:
        """Rows (..., 22, 3) for this frame, from a network that is asked every second frame, or where a part changes its style.

        Then they are half way from its last answer to the new one, in the next frame the new one: a frame of lag for half the
        work, and windows that interleave (their samples are two frames apart) do not tremble against each other."""
        asking = [one for one, wearer in enumerate(self.wearers) if wearer.asks()]
        rows = self._newest.copy()
        if asking:
            before = rows[asking]
            windows = window.reshape(-1, *window.shape[-3:])
            groups = [list(group) for _, group in groupby(asking, lambda one: one // GROUP)]
            newest = continued(np.concatenate([self._ask(windows[group], group) for group in groups]), before)
            changed = np.array([self.wearers[one].changed for one in asking])[:, None, None]
            rows[asking], self._newest[asking] = (np.where(changed, newest, before) + newest) / 2, newest
        return rows.reshape(*self._leading, *rows.shape[1:])

    def _ask(self, windows: np.ndarray, asking: list[int]) -> np.ndarray:
        """The network's answer for the last sample of windows (n, 16, 21, 15), as rows (n, 22, 3) in the characters' own
        frame."""
        with torch.inference_mode():
            answer = self._restyled(windows, asking)
        self._asked[asking] += 1
        self._answers = self._answers.copy()
        self._answers[asking] = answer
        return asked(answer, windows[:, -1])

    def _restyled(self, windows: np.ndarray, asking: list[int]) -> np.ndarray:
        """What it answers, as features (n, 21, 15)."""
        answer, rebuilt = self._network(windows, self._styles(asking), self._own(len(asking)))
        if rebuilt is not None:  # what the decoder loses of the neutral movement goes on top, but not what is lost steadily
            lost = windows[:, -1] - rebuilt
            share = np.maximum(1 / (1 + self._asked[asking]), LOST_SHARE)[:, None, None]  # at first the mean of all
            self._lost[asking] += (lost - self._lost[asking]) * share
            answer = answer + (lost - self._lost[asking])
        return answer

    def _styles(self, asking: list[int]) -> Style:
        """What these characters wear, side by side along the batch, put together once and kept until one changes its look."""
        looks = [self.wearers[one].look(self.bank) for one in asking]
        if len(looks) == 1:
            return looks[0]
        before, style = self._kept.pop(tuple(asking), (looks, None))
        style = style or joined(looks)
        for place, (look, worn) in enumerate(zip(looks, before)):
            if look is not worn:
                put(look, style, place)
        self._kept[tuple(asking)] = looks, style
        if len(self._kept) > KEPT * (1 + len(self.wearers) // GROUP):
            del self._kept[next(iter(self._kept))]
        return style


class _Turns:
    """The rows (..., 22, 3) that the network asks for, smoothed in time, without a jump where a part switches its style."""

    def __init__(self, crowd: tuple[int, ...]) -> None:
        self.smooth, self.rate, *self.gap = np.zeros((5, *crowd, len(PART_OF_ROW), 3))  # gap: its width, rate, acceleration
        self.worn = np.zeros((*crowd, len(PART_OF_ROW)), dtype=bool)

    def step(self, asked: np.ndarray, switched: np.ndarray, worn: np.ndarray) -> np.ndarray:
        """The rows to put on. switched, worn: (..., 22) of bool; what is worn after a pause starts afresh."""
        fresh = worn & ~self.worn  # a part that begins now has no past to be smooth with
        if fresh.any():
            self.smooth[fresh] = asked[fresh]
            for state in (self.rate, *self.gap):
                state[fresh] = 0.0
        self.worn = worn
        if switched.any():
            # Inertialization (Bollo 2018): the new style at once, and the gap to the old one on top, let go along a spring.
            self.gap[0][switched] += self.smooth[switched] - asked[switched]
            self.smooth[switched] = asked[switched]
        self.gap = soft_spring_step(*self.gap, 0.0, SWITCH_HALFLIFE, DT)
        self.smooth, self.rate = spring_step(self.smooth, self.rate, asked, SMOOTHING_HALFLIFE, DT)
        return self.smooth + self.gap[0]
