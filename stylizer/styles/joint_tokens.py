"""From a style's clips to the tokens of Motion Puzzle at the resolution of joints.

Tokens of clips that make strides stand for the same moments of a stride in every clip and style, so that clips can be
interpolated and styles blended token by token. What attention finds is a mean over tokens near to each other, which
moves less than each of them; so values are fitted until what is found is the style's stride as it was captured."""

from typing import Iterable, Sequence

import numpy as np
import torch
from torch import Tensor

from sim.math.springs import lag
from sim.motion.clip import FPS
from sim.motion.features import STRIDE
from sim.motion.gait import cycle_at, gait_distance
from stylizer.styles.style_clips import WINDOW, Gait, OwnMotion
from stylizer.systems.motion_puzzle.joint_model import BODY, GAIT_WIDTH, ROOT, JointPuzzle
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures, cat_batch, take_batch

TOKENS = 24  # of each clip
SMOOTHING = 0.05  # half-life in seconds of the spring that follows what is looked up
AHEAD = lag(SMOOTHING)  # seconds by which values come later than what they are looked up by, because that spring lags
SAMPLES_AHEAD = round(AHEAD * FPS / STRIDE)
RIDGE = 0.05  # how much dearer it is to change a token that is never found than to miss the stride
ALIKE = 0.5  # of the controller's movements, those that stylizer.systems.motion_puzzle.joint_model.same_gait holds for
# this much like a clip are what it is fitted to
TURN = 2 * np.pi


@torch.inference_mode()
def encode_clip_tokens(
    model: JointPuzzle, windows: np.ndarray, cycle: np.ndarray, cadence: float, gait: np.ndarray
) -> StyleFeatures:
    """The style of one clip, as a batch of 1, from its windows (m, WINDOW, 21, 15), its cycle (coefficients, 21, 12),
    its strides a second and its gait (4,), see stylizer.styles.style_clips.Gait."""
    motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
    clip = motion.flatten(1, 2)[:, None]
    mean, deviation = model.statistics(clip)
    moving = torch.from_numpy(gait.astype(np.float32))[None]
    if not cycle.any():
        return model.style_side(mean, deviation, moving, *_sampled(model, motion, mean, deviation))
    mean = _normalized(model, cycle[None, 0])
    phases = TURN * np.arange(TOKENS) / TOKENS
    back = TURN * cadence * STRIDE / FPS * np.array(model.config.lags)
    seen = _normalized(model, cycle_at(cycle, (phases[:, None] - back).ravel())).unflatten(2, (TOKENS, -1))
    roots = clip[0, ..., ROOT].mean(1)[None, :, None, None].expand(*seen.shape[:-1], -1)
    keys = model.moments.at(torch.cat([seen, roots], dim=-1), mean, deviation)
    wanted = _strides(model, cycle, phases + TURN * cadence * AHEAD, mean)
    style = model.style_side(mean, deviation, moving, keys, wanted)
    return style | {"values": _fitted(wanted, model.attention(keys, style["keys"]), wanted)}


def _sampled(model: JointPuzzle, motion: Tensor, mean: Tensor, deviation: Tensor) -> tuple[Tensor, Tensor]:
    """As tokens, keys (1, TOKENS, code) and values (5, 1, TOKENS, n 12), samples of a clip that makes no strides, its
    windows normalized (21, m, WINDOW, 15)."""
    first = max(model.config.lags)  # the first sample before which all lags are known
    keys = model.moments(motion, mean, deviation, WINDOW - first)[:, : WINDOW - first - SAMPLES_AHEAD].flatten(0, 1)
    values = model.by_part(motion[:, :, first + SAMPLES_AHEAD :, BODY] - mean).flatten(1, 2)
    chosen = torch.linspace(0, len(keys) - 1, TOKENS).round().long()
    return keys[None, chosen], values[:, None, chosen]


def encode_own_tokens(model: JointPuzzle, own: OwnMotion) -> StyleFeatures:
    """The own style, clip by clip: what is found in it is the own motion."""
    clips = []
    for place, each in enumerate(_clips(own.windows, own.gait)):
        clip, cycle, found = encode_clip_tokens(model, *each), own.gait.cycles[place], _own_strides(model, own, place)
        clips.append(_refitted(model, clip, cycle, *found) if cycle.any() and found else clip)
    return cat_batch(clips)


def encode_style_tokens(model: JointPuzzle, windows: Sequence[np.ndarray], gait: Gait) -> StyleFeatures:
    """A style from the windows (m, WINDOW, 21, 15) of each of its clips."""
    return cat_batch([encode_clip_tokens(model, *each) for each in _clips(windows, gait)])


def _clips(windows: Sequence[np.ndarray], gait: Gait) -> Iterable[tuple]:
    """Clip by clip what `encode_clip_tokens` takes."""
    return zip(windows, gait.cycles, gait.cadences, gait.gaits)


def refit_tokens(model: JointPuzzle, style: StyleFeatures, gait: Gait, own: OwnMotion) -> StyleFeatures:
    """A style, whatever motion it was made for, for another one, `own`: in a live session the queries are that
    motion's, and what those find who move as a clip does is to be its stride."""
    strides = [_own_strides(model, own, place) for place in range(len(own.windows))]
    alike = np.exp(-np.square(gait_distance(gait.gaits[:, None], own.gait.gaits) / GAIT_WIDTH**2)) > ALIKE
    clips = []
    for place, cycle in enumerate(gait.cycles):
        clip, found = take_batch(style, [place]), [each for each, fits in zip(strides, alike[place]) if fits and each]
        if cycle.any() and found:
            queries, phases = zip(*found)
            clip = _refitted(model, clip, cycle, torch.cat(queries, dim=1), np.concatenate(phases))
        clips.append(clip)
    weights = torch.from_numpy(own.gait.weights(gait.root_velocities).astype(np.float32))  # (clips, own movements)
    means = torch.cat([_own_statistics(model, own, place)[0] for place in range(len(own.windows))], dim=1)
    own_mean = model.by_part(torch.einsum("co,votx->vctx", weights, means))[:, :, 0]
    return cat_batch(clips) | {"own_mean": own_mean}


@torch.inference_mode()
def _own_strides(model: JointPuzzle, own: OwnMotion, place: int) -> tuple[Tensor, np.ndarray] | None:
    """Of one movement of the controller: its queries (1, T, code), and the stride phases (T,) by the time that what
    they find is drawn. None where it makes no strides."""
    phases, first = own.phases[place], max(model.config.lags)
    if not np.isfinite(phases).all():
        return None
    motion = model.normalize(torch.from_numpy(own.windows[place].astype(np.float32)))
    queries = model.moments(motion, *_own_statistics(model, own, place), WINDOW - first)
    ahead = TURN * own.gait.cadences[place] * AHEAD
    return queries.flatten(0, 1)[None], phases[:, first:].ravel() + ahead


def _own_statistics(model: JointPuzzle, own: OwnMotion, place: int) -> tuple[Tensor, Tensor]:
    """Mean and deviation, (21, 1, 1, 12) each, as `encode_clip_tokens` has them of one movement of the controller."""
    motion = model.normalize(torch.from_numpy(own.windows[place].astype(np.float32)))
    mean, deviation = model.statistics(motion.flatten(1, 2)[:, None])
    cycle = own.gait.cycles[place]
    return (_normalized(model, cycle[None, 0]) if cycle.any() else mean), deviation


@torch.inference_mode()
def _refitted(
    model: JointPuzzle, style: StyleFeatures, cycle: np.ndarray, queries: Tensor, phases: np.ndarray
) -> StyleFeatures:
    """One clip whose values are such that queries (1, T, code) find its cycle at stride phases (T,)."""
    wanted = model.by_part(_normalized(model, cycle_at(cycle, phases))) - style["mean"][:, :, None]
    return style | {"values": _fitted(style["values"], model.attention(queries, style["keys"]), wanted)}


def _strides(model: JointPuzzle, cycle: np.ndarray, phases: np.ndarray, mean: Tensor) -> Tensor:
    """A cycle's movement about its mean (21, 1, 1, 12) at stride phases (T,): (5, 1, T, n 12)."""
    return model.by_part(_normalized(model, cycle_at(cycle, phases)) - mean)


def _normalized(model: JointPuzzle, poses: np.ndarray) -> Tensor:
    """Poses (T, 21, 12) as the network wants them, (21, 1, T, 12)."""
    given = torch.from_numpy(poses.astype(np.float32)).transpose(0, 1)[:, None]
    return (given - model.mean[..., BODY]) / model.deviation[..., BODY]


def _fitted(values: Tensor, found: Tensor, wanted: Tensor) -> Tensor:
    """Values (5, 1, S, n 12) changed so that attention (5, 1, T, S) finds poses (5, 1, T, n 12): ridge regression, from
    the values given."""
    missed = found.transpose(2, 3) @ (wanted - found @ values) / found.shape[2]
    together = found.transpose(2, 3) @ found / found.shape[2]
    dear = RIDGE / found.shape[3] * torch.eye(found.shape[3])
    return values + torch.linalg.solve(together + dear, missed)
