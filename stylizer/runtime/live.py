"""The live stylizer: restyles the newest frame, body part by body part, sixty times a second.

Per joint, the rotation from the pose in the own style to the pose in the style is smoothed, scaled by the part's
strength and applied to the neutral pose. So the neutral motion passes through untouched, strength 0 is the neutral pose
exactly, and the network's noise is damped."""

from itertools import groupby
from pathlib import Path
from typing import Any, Callable, Mapping, Sequence

import numpy as np

from sim.body.pose import Pose
from sim.body.skeleton import JOINT_COUNT, PART_OF_JOINT
from sim.command import GAIT_SPEEDS
from sim.math import rotations as rot
from sim.math.springs import response, spring_step
from sim.motion.clip import FPS, Clip
from sim.motion.features import LAYOUT
from sim.protocols import Stylizer
from sim.style_spec import StyleSpec
from sim.torch_setup import set_up_torch
from stylizer.runtime.inertialization import Inertializer
from stylizer.runtime.pose_delta import (
    ARM_PARTS,
    LEG_PARTS,
    PART_OF_ROW,
    apply_delta,
    delta_weights,
    pose_delta,
    preserve_hands,
    rotations_of_delta,
    unwrap,
)
from stylizer.runtime.style_mixer import BODY, StyleMixer, amounts_of_styles
from stylizer.styles.bank import StyleBank
from stylizer.styles.own_style import OWN
from stylizer.styles.stride_residual import play_residual
from stylizer.systems.motion_puzzle.style_tensors import NumpyFeatures, unpack

GROUP = 16  # characters that are evaluated at a time: so many windows at once are quickest, for they stay in the caches
# joined styles that are kept for a group: of those whose turn it is, of all, and of a frame in which a style changes
KEPT = 6
FIRST, OTHER = 0, 1  # a part's style, and the other one that it is blended with


class LiveStylizer:
    """Implements `sim.protocols.NamedStylizer`, for one character or for a crowd. Deterministic: the same calls give
    the same poses, bit for bit."""

    SMOOTHING = 0.05  # half-life in seconds of the spring that what the network changes follows
    BLENDS = True  # a part's two styles are evaluated each by itself, and their rotations are blended
    PERIOD = 4  # frames after which styles are interpolated anew, of a crowd not of all in the same frame
    _network: Any  # what evaluates windows; `prepare` says how it takes styles

    def __init__(self, bank: StyleBank, crowd: tuple[int, ...] = ()) -> None:
        """crowd: (N,) for N characters, with whom every array has one more axis in front; none for one character."""
        set_up_torch()
        self.bank = bank
        self._leading = crowd
        self._prepare()
        self.restart()

    def _prepare(self) -> None:
        """What the network needs before it is evaluated."""
        # by who is evaluated: each one's style, all their numbers, and those as the network takes them
        self._kept: dict[tuple, tuple[Sequence[np.ndarray | None], np.ndarray, Any]] = {}

    def _evaluate(self, windows: np.ndarray, ones: list[int], which: int) -> np.ndarray:
        """The newest poses of these characters' windows (n, 16, 21, 15) in their FIRST or OTHER styles, and in their
        own: features (2, n, 21, 15). What is put on is how the two differ."""
        raise NotImplementedError

    def crowd(self, count: int) -> "LiveStylizer":
        """So many characters side by side with the same bank. Where styles are interpolated every PERIOD frames, they
        are for some of the characters in every frame."""
        return type(self)(self.bank, (count,))

    @property
    def styles(self) -> tuple[str, ...]:
        """The names of all styles in the bank."""
        return self.bank.names

    @property
    def name(self) -> str:
        """Of its weights."""
        return self.bank.name

    @property
    def own_of(self) -> str | None:
        """The fingerprint of the controller whose motion the own style is; None where the bank does not say."""
        return self.bank.controller

    def learn(self, *paths: Path) -> tuple[str, Clip]:
        """Adds a style made of BVH clips to the bank under a name made from the first file's, or finds the one that was
        learned from the same motion: the name, and that clip on our skeleton.

        May run in another thread than `step`. Raises ValueError or OSError, in one sentence, for what is no style."""
        return self.bank.learn(*paths)

    @property
    def users_own(self) -> tuple[str, ...]:
        """The styles that the user added, which can be renamed and removed."""
        return self.bank.users_own

    def rename(self, style: str, new: str) -> None:
        """Calls a style of the user's something else, also where it is shown now. Raises ValueError or OSError."""
        self.bank.rename(style, new)
        for mixer in self.mixers:
            mixer.rename(style, new)

    def remove(self, style: str) -> None:
        """Forgets a style of the user's; parts that show it now glide to their own. Raises ValueError or OSError."""
        self.bank.remove(style)
        for mixer in self.mixers:
            mixer.keep(self.styles)
        self.switch()

    def movements(self, style: str) -> tuple[str, ...]:
        """What the clips of a style show. Raises ValueError for a style that the bank does not hold."""
        return self.bank[style].gait.movements

    @property
    def noncommercial(self) -> tuple[str, ...]:
        """The styles that are for non-commercial use only."""
        return tuple(filter(self.bank.is_noncommercial, self.styles))

    def restart(self) -> None:
        """Back to before the first step: every part has its own style."""
        count = int(np.prod(self._leading))
        self.mixers = [StyleMixer(self.PERIOD, one % self.PERIOD) for one in range(count)]
        self.inertializer = Inertializer(self._leading)
        self.frame = 0
        self._follow_parts()
        self._paces: dict[tuple[str, str], tuple[object, np.ndarray]] = {}  # by style and gait
        rows = *self._leading, JOINT_COUNT + 1, 3
        self._raw = np.zeros((2, *rows))  # the last deltas of FIRST and OTHER, unwrapped
        self._smoothing = response(spring_step, self.SMOOTHING, 1 / FPS)  # (2, 3) a frame of the spring
        self._follower = np.zeros((3, *rows))  # the delta smoothed, how fast it changes, and what it follows
        self._was_styled = np.zeros(rows[:-1], dtype=bool)

    def step(
        self,
        window: np.ndarray,
        neutral: Pose,
        style: StyleSpec | Sequence[StyleSpec],
        travel: np.ndarray | float = 1.0,
    ) -> Pose:
        """window: features (..., 16, 21, 15) ending with `neutral`; style: what the parts are asked to show, of a
        crowd one for each; travel: (...) how many times as fast as the window says the body really goes, for the styles
        are those of a body that goes so fast. Raises ValueError for a style that the bank does not hold."""
        styles = [StyleSpec.of(each) for each in ([style] if isinstance(style, Mapping) else style)]
        for name in {name for each in styles for name in each.names}:
            self.bank[name]
        switching = [mixer.step(each) for mixer, each in zip(self.mixers, styles, strict=True)]
        self._follow_parts()
        self._travel = np.asarray(travel).reshape(-1, 1)
        self.frame += 1
        if not self._worn.any() and not self.inertializer.offset.any():
            self._was_styled = self._worn
            self.inertializer = Inertializer(self._leading)
            return neutral
        jumping = np.array(switching).reshape(*self._leading, -1)[..., PART_OF_ROW] & self._was_styled
        fresh = self._worn & (~self._was_styled | jumping)  # these have no past to be smooth with
        self._was_styled = self._worn
        delta = self._smoothed(self._deltas(window, fresh), fresh) * self._weights
        turns = self._with_residual(rotations_of_delta(delta))
        turns, shift = self.inertializer.step(turns, delta[..., -1, :], jumping)
        return preserve_hands(apply_delta(neutral, turns, shift), neutral, self._styled[..., ARM_PARTS])

    def _follow_parts(self) -> None:
        """What depends on the styles and strengths of the parts alone, worked out anew where one changes."""
        if all(mixer.steady for mixer in self.mixers):
            return
        amounts = [(mixer.strengths, mixer.styled) for mixer in self.mixers]
        self._shown = amounts_of_styles(self.mixers)
        # (..., 5) strengths, and how far each part shows another style than its own
        strengths, self._styled = np.array(amounts).swapaxes(0, 1).reshape(2, *self._leading, -1)
        has_style = strengths > 0
        self._worn = has_style[..., PART_OF_ROW]  # (..., 22) which rows of a delta are
        self._worn[..., -1] |= has_style[..., LEG_PARTS].all(axis=-1)
        self._weights = delta_weights(strengths, self._styled[..., LEG_PARTS])

    def leg_strengths(self) -> np.ndarray:
        """(..., 2) how far the left and the right leg are styled now."""
        return self._styled[..., LEG_PARTS]

    def pace(self, gaits: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """What the styles of the legs ask for in each character's gait: speed and playback rate of
        sim.motion.playback_pace.Pace, (...) each, 1 for legs without a style."""
        paces = [self._pace_of(mixer, gait) for mixer, gait in zip(self.mixers, gaits, strict=True)]
        speed, rate = np.array(paces).reshape(*self._leading, 2).T if self._leading else paces[0]
        return np.asarray(speed), np.asarray(rate)

    def _pace_of(self, mixer: StyleMixer, gait: str) -> np.ndarray:
        """(2,) speed and rate for one character: both legs count alike, each as far as it is styled."""
        result = np.ones(2)
        for place in LEG_PARTS:
            part = mixer.parts[place]
            for name, share in part.shown:
                if name != OWN:
                    result += 0.5 * min(part.strength, 1.0) * share * (self._style_pace(name, gait) - 1)
        return result

    def _style_pace(self, name: str, gait: str) -> np.ndarray:
        """(2,) speed over the stick's and playback rate of a style in a gait; 1 where none of its clips shows it."""
        key = name, gait
        if key not in self._paces or self._paces[key][0] is not self.bank[name]:
            try:
                speed, rate = self.bank[name].gait.pace_of(gait, self.bank[OWN].gait)
                pace = np.array([speed / GAIT_SPEEDS[gait], rate])
            except KeyError:
                pace = np.ones(2)
            self._paces[key] = self.bank[name], pace
        return self._paces[key][1]

    def transfer_state(self, other: Stylizer) -> None:
        """Goes on from another stylizer's last step: strengths are kept, and the pose is inertialized from its
        styles to ours. A part whose style we do not have fades to its own."""
        assert isinstance(other, LiveStylizer)
        self.bank.refresh()
        self.restart()
        self.mixers, self.inertializer, self.frame = other.mixers, other.inertializer, other.frame
        self._was_styled = other._was_styled
        for mixer in self.mixers:
            mixer.keep(self.styles)
            mixer.period = self.PERIOD
        self.switch()

    @property
    def seed(self) -> int | None:
        """Motion Puzzle samples no styles."""
        return None

    def resample(self, seed: int | None = None) -> None:
        """Samples the styles that come from a prior again; Motion Puzzle has none. Raises ValueError."""
        raise ValueError("this stylizer takes styles from clips only: diverse and latent also draw them by chance")

    def switch(self) -> None:
        """Styles have changed under their names: they are evaluated at once, and the pose is inertialized."""
        for mixer in self.mixers:
            mixer.switch()

    def attention(self, window: np.ndarray, part: str, one: int = 0) -> np.ndarray:
        """What a body part's attention looks at now, of one character (`one` of a crowd): (samples of the
        window / 2, tokens of the style), rows that add up to 1. Changes nothing. Raises ValueError for weights without
        attention."""
        raise ValueError("this stylizer has no attention")

    def _mixer_of(self, one: int) -> StyleMixer:
        """The mixer of a character (`one` of a crowd). Raises ValueError where no part has had a style yet: then there
        is nothing that attention could look at."""
        mixer = self.mixers[one]
        if not np.isfinite(mixer.root_velocities).all():
            raise ValueError("choose a style first: attention shows what of it is used")
        return mixer

    def _smoothed(self, delta: np.ndarray, fresh: np.ndarray) -> np.ndarray:
        """The delta (..., 22, 3) smoothed in time; rows that are fresh (..., 22) start with what they are."""
        smoothed, rate, wanted = self._follower
        wanted[:] = delta
        if fresh.any():
            np.copyto(smoothed, delta, where=fresh[..., None])
            np.copyto(rate, 0.0, where=fresh[..., None])
        self._follower[:2] = (self._smoothing @ self._follower.reshape(3, -1)).reshape(2, *delta.shape)
        return smoothed

    def _deltas(self, window: np.ndarray, fresh: np.ndarray) -> np.ndarray:
        """The delta (..., 22, 3) that the styles ask for in this frame, where a part is blended with another style on
        its way from the one to the other."""
        windows = window.reshape(-1, *window.shape[-3:])
        self._velocities = self._root_velocities(windows)
        self._begin_frame(windows)
        raw = self._raw.reshape(2, len(windows), JOINT_COUNT + 1, 3)
        fresh = fresh.reshape(len(windows), -1, 1)
        worn = [one for one, mixer in enumerate(self.mixers) if any(mixer.strengths)]
        blended = [one for one in worn if self._evaluates(OTHER, self.mixers[one])]
        for which, ones in ((FIRST, worn), (OTHER, blended)):
            if ones:
                delta = pose_delta(*self._in_groups(self._evaluate, windows, ones, which))
                delta *= self._part_weights(ones)[:, PART_OF_ROW, None]
                first = raw[FIRST, ones] if which == OTHER else 0.0
                raw[which, ones] = unwrap(delta, np.where(fresh[ones], first, raw[which, ones]))
        result = raw[FIRST]
        if blended:
            shares = np.array([self.mixers[one].shares for one in blended])
            result = result.copy()
            result[blended] += shares[:, PART_OF_ROW, None] * (raw[OTHER, blended] - raw[FIRST, blended])
        return result.reshape(self._raw.shape[1:])

    def _evaluates(self, which: int, mixer: StyleMixer) -> bool:
        """Whether a character's FIRST or OTHER styles are evaluated by themselves."""
        return which == FIRST or (self.BLENDS and any(mixer.shares))

    def _part_weights(self, ones: list[int]) -> np.ndarray:
        """(n, 5) how far each part changes at all: not where it keeps the own style; and legs that side-step keep the
        controller's steps where no clip of their style shows any, for the steps of a walk are none to the side."""
        return np.array([self._part_weights_of(self.mixers[one]) for one in ones])

    def _part_weights_of(self, mixer: StyleMixer) -> list[float]:
        """Of the five parts of one character."""
        side, forward, _ = mixer.root_velocities[BODY].tolist()
        result = [0.0 if part.name == part.other == OWN else 1.0 for part in mixer.parts]
        if abs(side) > abs(forward):
            for place in LEG_PARTS:
                if not self._side_steps(mixer.parts[place].name):
                    result[place] *= (forward / side) ** 2
        return result

    def _side_steps(self, name: str) -> bool:
        """Whether a clip of a style shows side-steps."""
        return any(movement.startswith("strafe") for movement in self.bank[name].gait.movements)

    def _with_residual(self, turns: np.ndarray) -> np.ndarray:
        """Rotations (..., 21, 4) with what of the styles' movement is not locked to the stride on top, in its own
        time."""
        result = np.zeros((len(self.mixers), JOINT_COUNT, 3))
        for name, amounts in self._shown.items():
            loop = self.bank[name].gait.residual
            if loop is not None:
                result += amounts[:, PART_OF_JOINT, None] * play_residual(loop, self.frame)
        if not result.any():
            return turns
        return rot.multiply(rot.from_rotation_vector(result.reshape(*self._leading, JOINT_COUNT, 3)), turns)

    def _begin_frame(self, windows: np.ndarray) -> list[int]:
        """Styles are interpolated anew for those whose turn it is. Returns who is to be evaluated, for networks that
        are not evaluated in every frame."""
        due = [one for one, mixer in enumerate(self.mixers) if mixer.due()]
        for one, mixer in enumerate(self.mixers):
            if any(mixer.strengths) and mixer.updates_styles:
                mixer.move(*self._velocities[:, one])
        return due

    def _in_groups(self, evaluate: Callable, windows: np.ndarray, ones: list[int], which: int) -> np.ndarray:
        """What `evaluate` says of these characters, group by group."""
        groups = [list(group) for _, group in groupby(ones, lambda one: one // GROUP)]
        # neighbours' windows, which are many numbers, are seen and not copied
        of = [slice(group[0], group[-1] + 1) if group[-1] - group[0] < len(group) else group for group in groups]
        return np.concatenate([evaluate(windows[where], group, which) for where, group in zip(of, groups)], axis=-3)

    def _root_velocities(self, windows: np.ndarray) -> np.ndarray:
        """(2, n, 3) of the characters' bodies, and of the neutral motion that they make it from."""
        result = np.array([windows[:, :, 0, LAYOUT["root"]].sum(axis=1) / windows.shape[1]] * 2)
        result[BODY, :, :2] *= self._travel
        return result

    def _styles(self, ones: list[int], which: int) -> tuple[Any, Any]:
        """These characters' styles and their own styles, each side by side along the batch, as the network takes
        them."""
        mixers = [self.mixers[one] for one in ones]
        return (
            self._side_by_side(ones, which, [mixer.styles(self.bank)[which] for mixer in mixers]),
            self._side_by_side(ones, OWN, [mixer.own(self.bank) for mixer in mixers]),
        )

    def _side_by_side(self, ones: list[int], kind: int | str, styles: list[np.ndarray]) -> Any:
        """Styles of characters along the batch, put together once; after that those are written anew that change."""
        key = (kind, *ones)
        before, numbers, prepared = self._kept.pop(key, None) or ([None] * len(ones), np.concatenate(styles), None)
        changed = [place for place, (style, old) in enumerate(zip(styles, before)) if style is not old]
        for place in changed:
            numbers[place] = styles[place][0]
        if changed:
            prepared = self._network.prepare(self._features(numbers))
        self._kept[key] = styles, numbers, prepared
        if len(self._kept) > 2 * KEPT * (1 + len(self.mixers) // GROUP):
            del self._kept[next(iter(self._kept))]
        return prepared

    def _features(self, numbers: np.ndarray) -> NumpyFeatures:
        """The features of a style's numbers."""
        return unpack(numbers, self.bank[OWN].features)
