"""The live stylizer: restyles the newest frame, body part by body part, sixty times a second.

The network's answer is never drawn as it is. What is taken from it is, joint by joint, the turn from the neutral pose
to the styled one; that turn is smoothed, scaled by the part's strength and put on top of the neutral pose. So the
neutral motion passes through untouched, strength 0 is the neutral pose exactly, and the network's own noise is damped.
"""

from pathlib import Path
from typing import Callable, Mapping

import numpy as np
import torch

from sim.clip import FPS, Clip
from sim.features import STRIDE
from sim.pose import Pose
from sim.skeleton import PART_NAMES
from sim.springs import decay, spring_step
from sim.worn import Worn, names
from stylizer.attention import attention_map
from stylizer.bank import Bank
from stylizer.blend import Style, interpolated, side_by_side
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

OWN = "neutral"  # the style that untouched parts wear inside the network
STRENGTH_HALFLIFE = 0.07  # seconds; a strength has then glided to its new value in about 0.2 s
SWITCH_HALFLIFE = 0.08  # seconds in which half of the way from one style to another is gone
SMOOTHING_HALFLIFE = 0.035  # seconds; the turns that the network asks for follow a spring, and lag by as much
GONE = 1e-3  # a strength this small, on its way out, is 0; a share this near to the wanted one is there
FLOOR_HALFLIFE = 0.08  # seconds, for the height that all legs are lengthened or shortened by
DT = 1 / FPS
LOST_SHARE = 1 - decay(1.0, STRIDE * DT)  # of an answer in that average: a half-life of a second


class LiveStylizer:
    """Implements `sim.session.Stylizer`. Deterministic: the same calls give the same poses, bit for bit."""

    def __init__(self, bank: Bank) -> None:
        self.bank = bank
        self.restart()
        self._kept: dict[str, tuple[tuple, Style]] = {}  # what was put together last, and of what

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
        self.parts = [_Part() for _ in PART_NAMES]
        self.turns = _Turns()
        self.raised = self.raised_rate = 0.0  # what both legs are shortened by to let the feet stand under the styled hips
        self.answer: np.ndarray | None = None  # the network's own, when it was last asked: features (21, 15)
        self._asked_for: tuple | None = None  # what the parts wore when the network was asked last
        self._newest: np.ndarray | None = None  # what it answered
        self._lost: np.ndarray | None = None  # what the decoder loses of the neutral motion, slow average: features (21, 15)
        self._gliding = False  # whether all parts switch in the next step
        self._resting = False  # whether this frame makes do with that answer

    def step(self, window: np.ndarray, neutral: Pose, style: Mapping[str, Worn]) -> Pose:
        """window: features (16, 21, 15) ending with `neutral`; style: part -> what it wears (sim.worn).
        Raises ValueError for a style that the bank does not hold."""
        for worn in style.values():
            for name in names(worn):
                self.bank[name]
        switched = [part.step(style.get(name)) or self._gliding for part, name in zip(self.parts, PART_NAMES)]
        self._gliding = False
        strengths = np.array([part.strength for part in self.parts])
        if not strengths.any():
            self.turns.forget()
            self.raised, self.raised_rate, self._asked_for = 0.0, 0.0, None
            return neutral
        turns = self.turns.step(self._answer(window), np.array(switched)[PART_OF_ROW], strengths[PART_OF_ROW] > 0)
        styled = hands_kept(turned(neutral, turns * scales(strengths)), neutral, strengths[ARM_PARTS])
        wanted = feet_off(styled, neutral) * min(height_share(strengths), 1.0)
        self.raised, self.raised_rate = spring_step(self.raised, self.raised_rate, wanted, FLOOR_HALFLIFE, DT)
        return feet_raised(styled, self.raised) if self.raised else styled

    def take_over(self, other: "LiveStylizer") -> None:
        """Goes on from another stylizer's last step: strengths are kept, and the pose glides from its styles to ours. A part
        whose style we do not have lets it go."""
        self.bank.refresh()
        self.restart()
        self.parts, self.turns = other.parts, other.turns
        self.raised, self.raised_rate = other.raised, other.raised_rate
        for part in self.parts:
            if not {part.name, part.other} <= set(self.styles):
                part.name = part.other = OWN
        self.glide()

    def reroll(self) -> None:
        """Draws the styles of chance anew; Motion Puzzle has none. Raises ValueError."""
        raise ValueError("this stylizer takes styles from clips only: diverse and latent also draw them by chance")

    def glide(self) -> None:
        """What parts wear has changed under its name: the next answer is asked for at once and glided into."""
        self._asked_for, self._gliding = None, True

    def attention(self, window: np.ndarray, part: str) -> np.ndarray:
        """What a body part's attention looks at now: (samples of the window / 2, samples of the style's clips), rows that
        add up to 1. Changes nothing. Raises ValueError for weights without attention."""
        with torch.inference_mode():
            motion = self.bank.model.normalize(torch.from_numpy(window.astype(np.float32))[None])
            return attention_map(self.bank.model, motion, self._styles(), PART_NAMES.index(part))

    def _answer(self, window: np.ndarray) -> np.ndarray:
        """Rows (22, 3) for this frame, from a network that is asked every second frame, or where a part changes its style.

        Then they are half way from its last answer to the new one, in the next frame the new one: a frame of lag for half the
        work, and windows that interleave (their samples are two frames apart) do not tremble against each other."""
        wanted = tuple((part.name, part.other) for part in self.parts)
        changed = wanted != self._asked_for
        if self._resting and not changed:
            self._resting = False
            return self._newest
        newest = self._ask(window)
        if self._newest is not None:
            newest = continued(newest, self._newest)
        before = newest if changed else self._newest
        self._asked_for, self._newest, self._resting = wanted, newest, True
        return (before + newest) / 2

    def _ask(self, window: np.ndarray) -> np.ndarray:
        """The network's answer for the last sample, as rows (22, 3) in the character's own frame."""
        with torch.inference_mode():
            model = self.bank.model
            motion = model.normalize(torch.from_numpy(window.astype(np.float32))[None])
            own = self._together("own", (OWN,) * len(PART_NAMES))
            self.answer, rebuilt = (answer if answer is None else model.restore(answer)[0, 0].double().numpy()
                                    for answer in model(motion, self._styles(), own, last=1))
        if rebuilt is not None:  # what the decoder loses of the neutral movement goes on top, but not what is lost steadily
            lost = window[-1] - rebuilt
            self._lost = lost if self._lost is None else self._lost + (lost - self._lost) * LOST_SHARE
            self.answer = self.answer + (lost - self._lost)
        return asked(self.answer, window[-1])

    def _styles(self) -> Style:
        """Each part's own style or blend of two, put together once and kept until one of them changes."""
        first, other = (tuple(getattr(part, key) for part in self.parts) for key in ("name", "other"))
        shares = tuple(part.share for part in self.parts)
        style = self._together("first", first)
        if any(shares):
            style = self._remembered("blend", (first, other, shares),
                                     lambda: interpolated(style, self._together("other", other), shares))
        return style

    def _together(self, kind: str, names: tuple[str, ...]) -> Style:
        return self._remembered(kind, names, lambda: side_by_side([self.bank[name] for name in names]))

    def _remembered(self, kind: str, made_of: tuple, make: Callable[[], Style]) -> Style:
        if kind not in self._kept or self._kept[kind][0] != made_of:
            self._kept[kind] = made_of, make()
        return self._kept[kind][1]


class _Part:
    """What one body part wears: a style, the other one it is blended with (itself if none), share and strength of these on
    their way to the wanted ones."""

    def __init__(self) -> None:
        self.name = self.other = OWN
        self.strength = self.velocity = self.share = self.share_rate = 0.0

    def step(self, worn: Worn | None) -> bool:
        """One frame; whether the style was switched. A part let go keeps its style until it has faded."""
        name, strength, other, share = (worn if worn and len(worn) == 4 else
                                        (*worn, self.other, 0.0) if worn else (self.name, 0.0, self.other, self.share))
        switched = name != self.name or (other != self.other and self.share > 0)
        self.name, self.other = name, other
        if switched or not self.strength or abs(share - self.share) < GONE:  # in a switch the turns glide, so the share need not
            self.share, self.share_rate = share, 0.0
        self.share, self.share_rate = spring_step(self.share, self.share_rate, share, STRENGTH_HALFLIFE, DT)
        switched = switched and self.strength > 0
        self.strength, self.velocity = spring_step(self.strength, self.velocity, strength, STRENGTH_HALFLIFE, DT)
        if strength == 0 and self.strength < GONE:
            self.__init__()
        return switched


class _Turns:
    """The rows (22, 3) that the network asks for, smoothed in time, without a jump where a part switches its style."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Nothing is worn: the next answer starts afresh."""
        self.smooth, self.rate, self.offset, self.velocity = np.zeros((4, len(PART_OF_ROW), 3))
        self.worn = np.zeros(len(PART_OF_ROW), dtype=bool)

    def step(self, asked: np.ndarray, switched: np.ndarray, worn: np.ndarray) -> np.ndarray:
        """The rows to put on. switched, worn: (22,) of bool."""
        fresh = worn & ~self.worn  # a part that begins now has no past to be smooth with
        if fresh.any():
            self.smooth[fresh], self.rate[fresh], self.offset[fresh], self.velocity[fresh] = asked[fresh], 0.0, 0.0, 0.0
        self.worn = worn
        if switched.any():
            # Inertialization (Bollo 2018): the new style at once, and the gap to the old one on top, let go along a spring.
            self.offset[switched] += self.smooth[switched] - asked[switched]
            self.smooth[switched] = asked[switched]
        self.offset, self.velocity = spring_step(self.offset, self.velocity, 0.0, SWITCH_HALFLIFE, DT)
        self.smooth, self.rate = spring_step(self.smooth, self.rate, asked, SMOOTHING_HALFLIFE, DT)
        return self.smooth + self.offset
