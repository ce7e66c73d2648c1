"""The live stylizer: restyles the newest frame, body part by body part, sixty times a second.

What is taken from the network is how a style differs from the neutral one; that is smoothed. Of the neutral pose changed by it,
joint by joint, the turn away from the neutral pose is scaled by the part's strength and put on top. So the neutral motion
passes through untouched, strength 0 is the neutral pose exactly, and the network's own noise is damped.
"""

from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Callable, Iterable, Mapping, Sequence

import numpy as np
import torch

from sim.clip import FPS, Clip
from sim.features import FEATURES, LAYOUT, STRIDE
from sim.pose import Pose
from sim.skeleton import JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from sim.springs import lag, soft_spring_step, spring_step
from sim.worn import Worn, names
from stylizer.attention import attention_map
from stylizer.bank import Bank
from stylizer.blend import Style, for_batch, joined, put, side_by_side
from stylizer.last_sample import live_form
from stylizer.turns import (
    ARM_PARTS,
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

GLIDE_HALFLIFE = 0.15  # seconds in which half of a jump is gone: to another system's answer, to a style under the same name
FLOOR_HALFLIFE = 0.08  # seconds, for the height that all legs are lengthened or shortened by
DT = 1 / FPS
GROUP = 16  # characters, of whom a part is asked for at a time: so many windows at once are quickest, for they stay in the caches
KEPT = 6  # joined styles that are kept for a group: of those whose turn it is, of all, and of a frame in which a style changes
STEADY = 2  # samples over which a pose's velocity is measured


class LiveStylizer:
    """Implements `sim.session.Stylizer`, for one character or for a crowd. Deterministic: the same calls give the same poses,
    bit for bit."""

    FADES = True  # whether styles themselves can be blended, so that a part fades into another
    SMOOTHING = 0.07  # half-life in seconds of the spring that what the network changes follows
    PERIOD = 4  # frames between two questions to the decoder, which says little beside key poses, and nothing quickly

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
        """So many characters side by side with the same bank. The decoder is asked for some of them in every frame."""
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
        self.wearers = [Wearer(self.PERIOD, one % self.PERIOD, self.FADES) for one in range(count)]
        self.change = _Change(self._leading)
        self.raised, self.raised_rate = np.zeros((2, *self._leading))  # what legs are shortened by, feet under the styled hips
        self._decoded = np.zeros((2, count, JOINT_COUNT, FEATURES))  # what the decoder changes: when each was last asked, and now
        self._rows = np.zeros((*self._leading, JOINT_COUNT + 1, 3))  # what was put on last (see stylizer.turns)
        self.answer: np.ndarray | None = None  # the neutral pose as changed: features (..., 21, 15)

    def step(self, window: np.ndarray, neutral: Pose, style: Mapping[str, Worn] | Sequence[Mapping[str, Worn]]) -> Pose:
        """window: features (..., 16, 21, 15) ending with `neutral`; style: part -> what it wears (sim.worn), of a crowd one for
        each. Raises ValueError for a style that the bank does not hold."""
        styles = style if self._leading else (style,)
        for name in {name for each in styles for worn in each.values() for name in names(worn)}:
            self.bank[name]
        jumping = self._together(wearer.step(each) for wearer, each in zip(self.wearers, styles, strict=True))
        strengths = self._together(wearer.strengths for wearer in self.wearers)
        worn = strengths.any(axis=-1)
        change = self._changed(window)
        if not worn.any():
            self.change.worn[:] = False
            self.raised, self.raised_rate = np.zeros((2, *self._leading))
            return neutral
        content = window[..., -1, :, :]
        self.answer = content + self.change.step(change, jumping[..., PART_OF_JOINT], strengths[..., PART_OF_JOINT] > 0,
                                                 self.SMOOTHING)
        self._rows = continued(asked(self.answer, content), self._rows)
        styled = hands_kept(turned(neutral, self._rows * scales(strengths)), neutral, strengths[..., ARM_PARTS])
        wanted = feet_off(styled, neutral) * np.minimum(height_share(strengths), 1.0)
        raised, rate = spring_step(self.raised, self.raised_rate, wanted, FLOOR_HALFLIFE, DT)
        self.raised, self.raised_rate = raised * worn, rate * worn
        return feet_raised(styled, self.raised)

    def take_over(self, other: "LiveStylizer") -> None:
        """Goes on from another stylizer's last step: strengths are kept, and the pose glides from its styles to ours. A part
        whose style we do not have lets it go."""
        self.bank.refresh()
        self.restart()
        self.wearers, self.change = other.wearers, other.change
        self.raised, self.raised_rate = other.raised, other.raised_rate
        for wearer in self.wearers:
            wearer.keep(self.styles)
            wearer.fades, wearer.period = self.FADES, self.PERIOD
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

    def _changed(self, window: np.ndarray) -> np.ndarray:
        """By how much features (..., 21, 15) change in this frame: key poses say so in every one, the decoder every PERIOD, or
        where a part changes its style.

        Until it is asked again its part goes from where it is to what it says in equal steps: a little lag for a fraction of the
        work, and windows that interleave (their samples are two frames apart) do not tremble against each other."""
        windows = window.reshape(-1, *window.shape[-3:])
        asking = [one for one, wearer in enumerate(self.wearers) if wearer.asks()]
        newest, now = self._decoded
        if asking:
            newest[asking] = self._of_groups(self._decoder, windows, asking)
            jumps = [one for one in asking if self.wearers[one].changed and not self.FADES]
            now[jumps] = newest[jumps]
        left = np.array([max(wearer.period - wearer.waited, 1) for wearer in self.wearers])[:, None, None]
        now += (newest - now) / left
        change = now.copy()
        styled = [one for one, wearer in enumerate(self.wearers) if any(wearer.strengths)]
        if styled:
            change[styled] += self._of_groups(self._key_poses, windows, styled)
        return change.reshape(*self._leading, *change.shape[1:])

    def _of_groups(self, ask: Callable, windows: np.ndarray, ones: list[int]) -> np.ndarray:
        """What `ask` says of these characters, group by group."""
        groups = [list(group) for _, group in groupby(ones, lambda one: one // GROUP)]
        return np.concatenate([ask(windows[group], group) for group in groups])

    def _decoder(self, windows: np.ndarray, ones: list[int]) -> np.ndarray:
        """What the decoder changes, features (n, 21, 15), at the end of windows (n, 16, 21, 15)."""
        return self._network.decoded(windows, self._styles(ones), self._own(len(ones)))

    def _key_poses(self, windows: np.ndarray, ones: list[int]) -> np.ndarray:
        """Likewise, what key poses change.

        They are asked for the pose that is to come when the spring, which lags, has caught up, so that a style's arm is forward
        when the neutral one is. A pose changes so steadily that its own velocity tells where it will be."""
        newest = windows[:, -1]
        ahead = newest + lag(self.SMOOTHING) * FPS / STRIDE / STEADY * (newest - windows[:, -1 - STEADY])
        ways = windows[:, :, 0, LAYOUT["root"]].mean(axis=1)
        return self._network.key_poses(ahead, ways, self._styles(ones), self._own(len(ones)))

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


class _Change:
    """By how much features (..., 21, 15) change, smoothed in time, without a jump."""

    def __init__(self, crowd: tuple[int, ...]) -> None:
        self.smooth, self.rate, *self.gap = np.zeros((5, *crowd, JOINT_COUNT, FEATURES))  # gap: its width, rate, acceleration
        self.worn = np.zeros((*crowd, JOINT_COUNT), dtype=bool)

    def step(self, asked: np.ndarray, jumping: np.ndarray, worn: np.ndarray, halflife: float) -> np.ndarray:
        """What to change. jumping, worn: (..., 21) of bool; what is worn after a pause starts afresh. halflife: of the spring."""
        fresh = worn & ~self.worn  # a part that begins now has no past to be smooth with
        if fresh.any():
            self.smooth[fresh] = asked[fresh]
            for state in (self.rate, *self.gap):
                state[fresh] = 0.0
        self.worn = worn
        if jumping.any():
            # Inertialization (Bollo 2018): what is new at once, and the gap to what was on top, let go along a spring.
            self.gap[0][jumping] += self.smooth[jumping] - asked[jumping]
            self.smooth[jumping] = asked[jumping]
        self.gap = soft_spring_step(*self.gap, 0.0, GLIDE_HALFLIFE, DT)
        self.smooth, self.rate = spring_step(self.smooth, self.rate, asked, halflife, DT)
        return self.smooth + self.gap[0]
