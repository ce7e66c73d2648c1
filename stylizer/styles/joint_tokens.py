"""From a style's clips to the tokens of Motion Puzzle at the resolution of joints.

Tokens of clips that make strides stand for the same moments of a stride in every clip and style, so that clips can be
interpolated and styles blended token by token. What attention finds is a mean over tokens near to each other, which
moves less than each of them; so values are fitted until what is found is the style's stride as it was captured."""

from typing import Sequence

import numpy as np
import torch
from torch import Tensor

from sim.math.springs import lag
from sim.motion.clip import FPS
from sim.motion.features import STRIDE
from sim.motion.gait import cycle_at
from stylizer.networks.layers import BlockFeatures
from stylizer.styles.style_clips import WINDOW, Gait, OwnMotion
from stylizer.systems.motion_puzzle.joint_config import JOINTS
from stylizer.systems.motion_puzzle.joint_model import BODY, ROOT, JointPuzzle
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures, cat_batch

TOKENS = 24  # of each clip
SMOOTHING = 0.05  # half-life in seconds of the spring that follows what is looked up
AHEAD = lag(SMOOTHING)  # seconds by which values come later than what they are looked up by, because that spring lags
SAMPLES_AHEAD = round(AHEAD * FPS / STRIDE)
RIDGE = 0.05  # how much dearer it is to change a token that is never found than to miss the stride
TURN = 2 * np.pi


@torch.inference_mode()
def encode_clip_tokens(model: JointPuzzle, windows: np.ndarray, cycle: np.ndarray, cadence: float) -> StyleFeatures:
    """The style of one clip, as a batch of 1, from its windows (m, WINDOW, 21, 15), its cycle (coefficients, 21, 12),
    see stylizer.styles.style_clips.Gait, and its strides a second."""
    motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
    clip = motion.flatten(1, 2)[:, None]
    mean, deviation = model.statistics(clip)
    velocity = model.velocity(clip)
    if not cycle.any():
        return {JOINTS: model.style_side(mean, deviation, velocity, *_sampled(model, motion, mean, deviation))}
    mean = _normalized(model, cycle[None, 0])
    phases = TURN * np.arange(TOKENS) / TOKENS
    back = TURN * cadence * STRIDE / FPS * np.array(model.config.lags)
    seen = _normalized(model, cycle_at(cycle, (phases[:, None] - back).ravel())).unflatten(2, (TOKENS, -1))
    roots = clip[0, ..., ROOT].mean(1)[None, :, None, None].expand(*seen.shape[:-1], -1)
    keys = model.moments.at(torch.cat([seen, roots], dim=-1), mean, deviation)
    wanted = _strides(model, cycle, phases + TURN * cadence * AHEAD, mean)
    style = model.style_side(mean, deviation, velocity, keys, wanted)
    return {JOINTS: style._replace(values=_fitted(wanted, model.attention(keys, style.keys), wanted))}


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
    for place, (windows, cycle, cadence) in enumerate(zip(own.windows, own.gait.cycles, own.gait.cadences)):
        clip = encode_clip_tokens(model, windows, cycle, cadence)
        found = _own_strides(model, own, place)
        clips.append({JOINTS: _refitted(model, clip[JOINTS], cycle, *found)} if cycle.any() and found else clip)
    return cat_batch(clips)


def encode_style_tokens(model: JointPuzzle, windows: Sequence[np.ndarray], gait: Gait) -> StyleFeatures:
    """A style from the windows (m, WINDOW, 21, 15) of each of its clips."""
    return cat_batch([encode_clip_tokens(model, *each) for each in zip(windows, gait.cycles, gait.cadences)])


def refit_tokens(model: JointPuzzle, style: BlockFeatures, gait: Gait, own: OwnMotion) -> BlockFeatures:
    """A style, whatever motion it was made for, for another one, `own`: in a live session the queries are that
    motion's, and what they find are to be the style's strides."""
    found = {
        name: [
            strides
            for place, kind in enumerate(own.gait.movements)
            if kind.replace("_", " ").startswith(name) and (strides := _own_strides(model, own, place))
        ]
        for name in dict.fromkeys(gait.movements)
    }
    clips = []
    for place, (name, cycle) in enumerate(zip(gait.movements, gait.cycles)):
        clip = BlockFeatures(*(t[:, place : place + 1] for t in style))
        if cycle.any() and found[name]:
            queries, phases = zip(*found[name])
            clip = _refitted(model, clip, cycle, torch.cat(queries, dim=1), np.concatenate(phases))
        clips.append({JOINTS: clip})
    weights = torch.from_numpy(own.gait.weights(gait.root_velocities).astype(np.float32))  # (clips, own movements)
    means = torch.cat([_own_statistics(model, own, place)[0] for place in range(len(own.windows))], dim=1)
    return model.beside(cat_batch(clips)[JOINTS], torch.einsum("co,votx->vctx", weights, means))


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
    model: JointPuzzle, style: BlockFeatures, cycle: np.ndarray, queries: Tensor, phases: np.ndarray
) -> BlockFeatures:
    """One clip whose values are such that queries (1, T, code) find its cycle at stride phases (T,)."""
    wanted = model.by_part(_normalized(model, cycle_at(cycle, phases))) - model.pose(style.bias)[:, :, None]
    return style._replace(values=_fitted(style.values, model.attention(queries, style.keys), wanted))


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
