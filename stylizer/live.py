"""The live stylizer: restyles the newest frame, body part by body part, sixty times a second.

The network's answer is never drawn as it is. What is taken from it is, joint by joint, the turn from the neutral pose
to the styled one; that turn is smoothed, scaled by the part's strength and put on top of the neutral pose. So the
neutral motion passes through untouched, strength 0 is the neutral pose exactly, and the network's own noise is damped.
"""

from typing import Mapping

import numpy as np
import torch

from sim import rotations as rot
from sim.clip import FPS
from sim.features import LAYOUT, rotations_of
from sim.limbs import ARMS, ELBOWS_BACK, reach
from sim.pose import Pose
from sim.skeleton import INDEX, JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from sim.springs import spring_step
from stylizer import weights
from stylizer.bank import Bank
from stylizer.layers import PartStyle

OWN = "neutral"  # the style that untouched parts wear inside the network
STRENGTH_HALFLIFE = 0.07  # seconds; a strength has then glided to its new value in about 0.2 s
SWITCH_HALFLIFE = 0.08  # seconds in which half of the way from one style to another is gone
SMOOTHING_HALFLIFE = 0.035  # seconds; the turns that the network asks for follow a spring, and lag by as much
ARM_REACH = 0.999  # share of an arm's length that is used
GONE = 1e-3  # a strength this small, on its way out, is 0
DT = 1 / FPS
SHOULDERS = np.array([INDEX["LeftShoulder"], INDEX["RightShoulder"]])  # their place is the spine's doing alone
ARM_PARTS = PART_OF_JOINT[SHOULDERS]

# What is kept of the network's answer: a rotation vector a joint, then the hips' shift on the floor in metres.
HIPS_ROW = JOINT_COUNT
PART_OF_ROW = np.append(PART_OF_JOINT, PART_OF_JOINT[INDEX["Hips"]])


class LiveStylizer:
    """Implements `sim.session.Stylizer`. Deterministic: the same calls give the same poses, bit for bit."""

    def __init__(self, bank: Bank) -> None:
        self.bank = bank
        self.restart()
        self._stacked: tuple[tuple[str, ...], dict[int, PartStyle]] | None = None

    @classmethod
    def from_pretrained(cls, name: str = weights.SLIM) -> "LiveStylizer":
        """The named weights and their bank, on one thread. Raises ValueError where they are missing or do not fit."""
        torch.set_num_threads(1)
        torch.set_flush_denormal(True)
        return cls(Bank(name))

    @property
    def styles(self) -> tuple[str, ...]:
        """The names of all styles in the bank."""
        return self.bank.names

    def restart(self) -> None:
        """Back to before the first step: nothing is worn."""
        self.parts = [_Part() for _ in PART_NAMES]
        self.turns = _Turns()

    def step(self, window: np.ndarray, neutral: Pose, style: Mapping[str, tuple[str, float]]) -> Pose:
        """window: features (16, 21, 15) ending with `neutral`; style: part -> (style name, strength 0 .. 1.5).
        Raises ValueError for a style that the bank does not hold."""
        for name, _ in style.values():
            self.bank[name]
        switched = [part.step(style.get(name)) for part, name in zip(self.parts, PART_NAMES)]
        strengths = np.array([part.strength for part in self.parts])
        if not strengths.any():
            self.turns.forget()
            return neutral
        turns = self.turns.step(self._ask(window), np.array(switched)[PART_OF_ROW], strengths[PART_OF_ROW] > 0)
        return _hands_kept(_turned(neutral, turns * strengths[PART_OF_ROW, None]), neutral, strengths[ARM_PARTS])

    def _ask(self, window: np.ndarray) -> np.ndarray:
        """The network's answer for the last sample, as rows (22, 3) in the character's own frame."""
        with torch.inference_mode():
            motion = self.bank.model.normalize(torch.from_numpy(window.astype(np.float32))[None])
            styled = self.bank.model.decoder(self.bank.model.content_encoder(motion), self._styles(), last=1)
            styled = self.bank.model.restore(styled)[0, 0].double().numpy()
        rows = np.zeros((len(PART_OF_ROW), 3))
        neutral = rot.inverse(rotations_of(window[-1]))
        rows[:HIPS_ROW] = rot.to_rotation_vector(rot.multiply(rotations_of(styled), neutral))
        shift = styled[INDEX["Hips"], LAYOUT["position"]] - window[-1, INDEX["Hips"], LAYOUT["position"]]
        rows[HIPS_ROW] = shift * (1.0, 0.0, 1.0)  # the height is settled by the legs and the floor (sim.foot_lock)
        return rows

    def _styles(self) -> dict[int, PartStyle]:
        """Each part's own style, put side by side (Eq. 5); kept until one of them changes."""
        names = tuple(part.name for part in self.parts)
        if self._stacked is None or self._stacked[0] != names:
            styles = [self.bank[name] for name in names]
            self._stacked = names, {
                level: PartStyle(*(torch.stack([getattr(style[level], key)[part] for part, style in enumerate(styles)])
                                   for key in PartStyle._fields)) for level in styles[0]}
        return self._stacked[1]


class _Part:
    """What one body part wears, and its strength on its way to the wanted one."""

    def __init__(self) -> None:
        self.name, self.strength, self.velocity = OWN, 0.0, 0.0

    def step(self, wanted: tuple[str, float] | None) -> bool:
        """One frame; whether the style was switched. A part let go keeps its style until it has faded."""
        name, target = wanted or (self.name, 0.0)
        switched = name != self.name and self.strength > 0
        self.name = name
        self.strength, self.velocity = spring_step(self.strength, self.velocity, target, STRENGTH_HALFLIFE, DT)
        if target == 0 and self.strength < GONE:
            self.name, self.strength, self.velocity = OWN, 0.0, 0.0
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
        self.smooth[fresh], self.rate[fresh], self.offset[fresh], self.velocity[fresh] = asked[fresh], 0.0, 0.0, 0.0
        self.worn = worn
        # Inertialization (Bollo 2018): the new style at once, and the gap to the old one on top, let go along a spring.
        self.offset[switched] += self.smooth[switched] - asked[switched]
        self.smooth[switched] = asked[switched]
        self.offset, self.velocity = spring_step(self.offset, self.velocity, 0.0, SWITCH_HALFLIFE, DT)
        self.smooth, self.rate = spring_step(self.smooth, self.rate, asked, SMOOTHING_HALFLIFE, DT)
        return self.smooth + self.offset


def _turned(neutral: Pose, rows: np.ndarray) -> Pose:
    """The pose with joints turned, hips shifted by rows (22, 3) in the character's frame. Zero rows change nothing."""
    rows = rot.rotate(rot.from_yaw(neutral.root_facing), rows)
    turned = rows[:HIPS_ROW].any(axis=1)
    rotations = neutral.rotations.copy()
    turns = rot.from_rotation_vector(rows[:HIPS_ROW][turned])
    rotations[turned] = rot.normalize(rot.multiply(turns, rotations[turned]))
    return neutral.with_body(neutral.hips + rows[HIPS_ROW], rotations)


def _hands_kept(styled: Pose, neutral: Pose, strengths: np.ndarray) -> Pose:
    """Hands of arms that keep their own style stay where they were beside the hips, however the spine leans above them.

    strengths: (2,) of the left and the right arm; an arm in between gives way in between."""
    carried = (styled.positions[SHOULDERS] - styled.hips) - (neutral.positions[SHOULDERS] - neutral.hips)
    carried *= np.clip(1 - strengths, 0, 1)[:, None]
    if np.abs(carried).max() < 1e-9:
        return styled
    return reach(styled, ARMS, styled.positions[ARMS[-1]] - carried, ELBOWS_BACK, ARM_REACH)
