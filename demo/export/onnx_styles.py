"""The stylizer's part of the exported graphs: all styles of a bank as one table, and one frame of restyling."""

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from sim.body.pose import Pose
from sim.body.skeleton import JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from sim.command import GAIT_SPEEDS
from sim.math import rotations as rot
from sim.math.springs import response, spring_step
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT, STRIDE
from sim.motion.gait import gait_point, point_distance, with_run
from stylizer.runtime.inertialization import Inertializer
from stylizer.runtime.joint_live import JointStylizer
from stylizer.runtime.live import FIRST, OTHER, LiveStylizer
from stylizer.runtime.pose_delta import (
    ARM_PARTS,
    HIPS_ROW,
    LEG_PARTS,
    PART_OF_ROW,
    apply_delta,
    delta_weights,
    pose_delta,
    preserve_hands,
    rotations_of_delta,
    unwrap,
)
from stylizer.runtime.style_mixer import NEGLIGIBLE, STRENGTH_HALFLIFE
from stylizer.styles.own_style import OWN
from stylizer.styles.style_clips import LEAST_WEIGHT, NEAREST
from stylizer.systems.motion_puzzle.joint_inference import FastJointInference
from stylizer.systems.motion_puzzle.style_tensors import pack, unpack

PARTS = len(PART_NAMES)
ROWS = JOINT_COUNT + 1
GAITS = tuple(GAIT_SPEEDS)
DT = 1 / FPS


class StyleTable(NamedTuple):
    """All that the graph knows of S styles of C clips in all, the own style's clips first.

    numbers (5, C, N), see stylizer.systems.motion_puzzle.style_tensors.pack; points (C, 5) of their gaits; clips (S, C)
    1 where a clip is the style's; loops (T 21, 3) of all styles one after the other, see
    stylizer.styles.stride_residual; loop (S, 2) where its own begins and how long it is; paces (S, gaits, 2), see
    sim.motion.playback_pace.Pace; side_steps (S,) 1 where a clip shows side-steps; own: the own style's number."""

    names: tuple[str, ...]
    stylizer: JointStylizer
    numbers: np.ndarray
    points: np.ndarray
    clips: np.ndarray
    loops: np.ndarray
    loop: np.ndarray
    paces: np.ndarray
    side_steps: np.ndarray
    own: int = 0


def tabulate(stylizer: JointStylizer) -> StyleTable:
    """The styles of a stylizer's bank, the own style first. Raises ValueError for a stylizer that is not at the
    resolution of joints."""
    if not isinstance(stylizer, JointStylizer) or not FastJointInference.fits(stylizer.bank.model.config):
        raise ValueError(f"only the stylizer 'joints' is exported, and '{stylizer.name}' is another one")
    bank = stylizer.bank
    names = (OWN, *(name for name in bank.names if name != OWN))
    styles = [bank[name] for name in names]
    counts = [len(style.gait.movements) for style in styles]
    loops = [np.zeros((1, JOINT_COUNT, 3)) if s.gait.residual is None else s.gait.residual for s in styles]
    lengths = np.array([len(loop) for loop in loops])
    return StyleTable(
        names,
        stylizer,
        np.concatenate([pack(style.features) for style in styles]).swapaxes(0, 1),
        np.concatenate([gait_point(style.gait.gaits) for style in styles]),
        np.repeat(np.eye(len(names)), counts, axis=1),
        np.concatenate(loops).reshape(-1, 3),
        np.stack([np.cumsum(lengths) - lengths, lengths], axis=1).astype(float),
        np.array([[np.ones(2) if n == OWN else stylizer._style_pace(n, gait) for gait in GAITS] for n in names]),
        np.array([float(stylizer._side_steps(name)) for name in names]),
    )


class _Parts:
    """stylizer.runtime.style_mixer's parts, all five in arrays, their styles as numbers of the table's."""

    def __init__(self, own: int) -> None:
        self.own = float(own)
        self.name, self.other = np.full((2, PARTS), self.own)
        self.strength, self.velocity, self.share, self.share_rate, self.styled_share, self.styled_rate = np.zeros(
            (6, PARTS)
        )

    def step(self, request: Any) -> Any:
        """One frame; which (5,) switch their style. request (5, 4): style, strength, other style, share; a style of -1
        fades out, another style of -1 is none."""
        name, strength, other, share = request.T
        given = name >= 0
        name, strength = np.where(given, name, self.name), np.where(given, strength, 0.0)
        share = np.where(given, share, self.share)
        other = np.where(given & (other >= 0), other, self.other)
        switched = (name != self.name) | ((other != self.other) & (self.share > 0))
        self.name, self.other = name, other
        styled = (1 - share) * (name != self.own) + share * (other != self.own)
        hidden = self.strength == 0
        snap = switched | hidden | (np.abs(share - self.share) < NEGLIGIBLE)
        self.share, self.share_rate = np.where(snap, share, self.share), np.where(snap, 0.0, self.share_rate)
        snap = hidden | (np.abs(styled - self.styled_share) < NEGLIGIBLE)
        self.styled_share = np.where(snap, styled, self.styled_share)
        self.styled_rate = np.where(snap, 0.0, self.styled_rate)
        self.share, self.share_rate = _glide(self.share, self.share_rate, share)
        self.styled_share, self.styled_rate = _glide(self.styled_share, self.styled_rate, styled)
        switched = switched & ~hidden
        self.strength, self.velocity = _glide(self.strength, self.velocity, strength)
        gone = (strength == 0) & (self.strength < NEGLIGIBLE)
        for each, at_rest in vars(_Parts(int(self.own))).items():
            if each != "own":
                setattr(self, each, np.where(gone, at_rest, getattr(self, each)))
        return switched


def _glide(value: Any, rate: Any, wanted: Any) -> Any:
    return spring_step(value, rate, wanted, STRENGTH_HALFLIFE, DT)


class Styling:
    """One frame of restyling, as stylizer.runtime.live.LiveStylizer makes it, for a graph."""

    def __init__(self, table: StyleTable) -> None:
        self.table, self.parts, self.inertializer = table, _Parts(table.own), Inertializer()
        self.network = FastJointInference(table.stylizer.bank.model)
        self.raw, self.was_styled, self.frame = np.zeros((2, ROWS, 3)), np.zeros(ROWS, bool), np.zeros(())
        # what LiveStylizer._smoothed reads
        smoothing = response(spring_step, JointStylizer.SMOOTHING, DT)
        self.spring = SimpleNamespace(_smoothing=smoothing, _follower=np.zeros((3, ROWS, 3)))
        turns, shift = self.inertializer._last
        self.drawn = SimpleNamespace(last=turns, last_shift=shift, before=turns, before_shift=shift)

    @property
    def kept(self) -> list[tuple[Any, str, str]]:
        """What it hands from frame to frame: owner, attribute, meaning."""
        parts = "of the five parts: "
        return [
            (self.parts, "name", parts + "the style's number"),
            (self.parts, "other", parts + "the other style's number"),
            (self.parts, "strength", parts + "0..1.5"),
            (self.parts, "velocity", parts + "how fast the strength changes, 1/s"),
            (self.parts, "share", parts + "0..1 on the way to the other style"),
            (self.parts, "share_rate", parts + "1/s"),
            (self.parts, "styled_share", parts + "how far it is another style than the own one"),
            (self.parts, "styled_rate", parts + "1/s"),
            (self, "raw", "the last deltas of the first and of the other styles, rotation vectors and the hips' shift"),
            (self, "was_styled", "which rows of a delta were styled"),
            (self, "frame", "since the start"),
            (self.spring, "_follower", "the delta smoothed, how fast it changes, what it follows"),
            (self.inertializer, "offset", "the gap that a switch left: where, how fast, how much faster"),
            *(
                (self.drawn, name, "turns or shift as drawn, in the last frame or the one before")
                for name in ("last", "last_shift", "before", "before_shift")
            ),
        ]

    def step(self, window: Any, neutral: Pose, request: Any, travel: Any) -> Pose:
        """As LiveStylizer.step."""
        parts, drawn = self.parts, self.drawn
        switching = parts.step(request)
        self.frame = self.frame + 1
        self.styled = parts.strength * parts.styled_share
        has_style = parts.strength > 0
        worn = has_style[PART_OF_ROW].copy()
        worn[-1] = worn[-1] | has_style[LEG_PARTS].all(axis=-1)
        jumping = switching[PART_OF_ROW] & self.was_styled
        fresh = worn & (~self.was_styled | jumping)
        self.was_styled = worn
        weights = delta_weights(parts.strength, self.styled[LEG_PARTS])
        follow: Any = self.spring
        delta = LiveStylizer._smoothed(follow, self._deltas(window, travel, fresh), fresh) * weights
        turns = rot.multiply(rot.from_rotation_vector(self._residual()), rotations_of_delta(delta))
        self.inertializer._last = drawn.last, drawn.last_shift
        self.inertializer._before = drawn.before, drawn.before_shift
        turns, shift = self.inertializer.step(turns, delta[HIPS_ROW], jumping)
        drawn.before, drawn.before_shift, drawn.last, drawn.last_shift = drawn.last, drawn.last_shift, turns, shift
        return preserve_hands(apply_delta(neutral, turns, shift), neutral, self.styled[ARM_PARTS])

    def leg_strengths(self) -> Any:
        """(2,) as LiveStylizer.leg_strengths."""
        return self.styled[LEG_PARTS]

    def paces(self) -> Any:
        """(gaits, 2) speed and rate that the styles of the legs ask for in each gait, as LiveStylizer.pace."""
        parts, result = self.parts, np.ones((len(GAITS), 2))
        for place in LEG_PARTS:
            for name, share in ((parts.name, 1 - parts.share), (parts.other, parts.share)):
                pace = np.take(self.table.paces, name[place], axis=0)
                result = result + 0.5 * np.minimum(parts.strength[place], 1.0) * share[place] * (pace - 1)
        return result

    def _deltas(self, window: Any, travel: Any, fresh: Any) -> Any:
        """As LiveStylizer._deltas."""
        parts, raw = self.parts, self.raw
        neutral = window[:, 0, LAYOUT["root"]].sum(axis=0) / window.shape[0]
        body = neutral.copy()
        body[:2] = body[:2] * travel
        own, first, other = self._styles(body, neutral)
        weights = self._part_weights(body)[PART_OF_ROW][:, None]
        blended = parts.share.any()
        deltas = []
        for which, style, counts in ((FIRST, first, (parts.strength > 0).any()), (OTHER, other, blended)):
            delta = pose_delta(*self.network.restyle(window[None], body[None], style, own))[0] * weights
            start = raw[FIRST] if which == OTHER else 0.0
            delta = unwrap(delta, np.where(fresh[:, None], start, raw[which]))
            raw[which] = np.where(counts, delta, raw[which])
            deltas.append(raw[which].copy())
        shares = np.where(blended, parts.share, 0.0)[PART_OF_ROW][:, None]
        return deltas[FIRST] + shares * (deltas[OTHER] - deltas[FIRST])

    def _part_weights(self, body: Any) -> Any:
        """(5,) as LiveStylizer._part_weights_of."""
        parts, own = self.parts, self.parts.own
        result = 1.0 - ((parts.name == own) & (parts.other == own)).astype("f")
        sideways = np.abs(body[0]) > np.abs(body[1])
        kept = np.where(sideways, (body[1] / np.where(sideways, body[0], 1.0)) ** 2, 1.0)
        steps = np.take(self.table.side_steps, parts.name[LEG_PARTS], axis=0)
        result[LEG_PARTS] = result[LEG_PARTS] * (kept + steps * (1 - kept))
        return result

    def _styles(self, body: Any, neutral: Any) -> list[Any]:
        """The own style for a neutral motion at a root velocity (3,), the parts' styles and their other styles for a
        body at another, as the network takes them."""
        table, parts = self.table, self.parts
        owns = int(table.clips[table.own].sum())
        features = table.stylizer.bank[OWN].features
        own = self._weights(neutral, np.full(1, float(table.own)))[:, :owns] @ table.numbers[:, :owns]
        names = np.stack([parts.name, parts.other])
        weights = np.stack([self._weights(body, each) for each in names], axis=1)  # (5, 2, C)
        both = (weights @ table.numbers).swapaxes(0, 1)
        each = own[:, 0][None], both[:1], both[1:]
        return [self.network.prepare(unpack(numbers, features)) for numbers in each]

    def _weights(self, velocity: Any, names: Any) -> Any:
        """(n, C) how much each clip counts for styles (n,) at a root velocity (3,), as Gait.weights."""
        going = gait_point(with_run(velocity))[None]
        near = 1 / np.square(point_distance(going, self.table.points) + NEAREST**2)
        of_style = np.take(self.table.clips, np.asarray(names) + 0 * self.parts.name[:1], axis=0)
        weights = of_style * near
        weights = np.maximum(weights / weights.sum(axis=-1, keepdims=True) - LEAST_WEIGHT, 0.0)
        return weights / weights.sum(axis=-1, keepdims=True)

    def _residual(self) -> Any:
        """(21, 3) rotation vectors, as LiveStylizer._with_residual puts on."""
        parts, joints = self.parts, np.arange(JOINT_COUNT)
        sample = np.floor(self.frame / STRIDE)
        between = (self.frame - STRIDE * sample) > 0.5
        result: Any = 0.0
        for name, share in ((parts.name, 1 - parts.share), (parts.other, parts.share)):
            begin, length = np.take(self.table.loop, name, axis=0).T[:, PART_OF_JOINT]
            a, b, c, d = (
                np.take(self.table.loops, (begin + (sample + ahead) % length) * JOINT_COUNT + joints, axis=0)
                for ahead in (-1, 0, 1, 2)
            )
            turns = np.where(between, (9 * (b + c) - (a + d)) / 16, b)
            result = result + (share * parts.strength)[PART_OF_JOINT][:, None] * turns
        return result


def record_styling(table: StyleTable) -> Styling:
    """What restyles a frame in a graph that is being recorded."""
    return Styling(table)
