"""Restyling a whole clip: the network over overlapping windows, its turns on top of the content, then the feet.

Where the live stylizer sees only the past, here every frame is the mean of the windows that see it from all sides."""

from typing import Mapping, NamedTuple

import numpy as np
import torch
from scipy.ndimage import gaussian_filter1d, maximum_filter1d, minimum_filter1d

from sim.body.kinematics import to_local
from sim.body.pose import Pose
from sim.body.skeleton import CONTACT_JOINTS, INDEX, PART_NAMES
from sim.feet.foot_cleanup import clean_feet, foot_height_error, raise_feet
from sim.hands.hand_clearance import clear_hands
from sim.math import rotations as rot
from sim.math.easing import smooth_step
from sim.math.vectors import UP
from sim.motion.clip import FPS, Clip, root_frame
from sim.motion.contacts import foot_contacts
from sim.motion.features import LAYOUT, STRIDE, WINDOW, clip_features, rotations_of
from sim.motion.gait import with_run
from sim.retarget.retarget import load_clip
from sim.style_spec import PartLike, StyleSpec
from stylizer.runtime.overlap import evaluate_overlapping
from stylizer.runtime.pose_delta import (
    ARM_PARTS,
    LEG_PARTS,
    apply_delta,
    delta_weights,
    pose_delta,
    preserve_hands,
    rotations_of_delta,
    unwrap_frames,
)
from stylizer.styles.bank import StyleBank
from stylizer.styles.encoding import encode, encode_motion
from stylizer.styles.joint_tokens import AHEAD
from stylizer.styles.style_clips import SHORTEST, StyleClips, single_clip
from stylizer.styles.style_clips import WINDOW as STYLE_WINDOW
from stylizer.styles.style_names import is_clip
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.motion_puzzle.model import MotionPuzzle
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures, interpolate, stack_parts
from stylizer.systems.whole_body import WholeBody, combine_joints, joints_by_code, stylize_windows

SMOOTHING = 1.5  # frames (Gaussian sigma): what windows tell of even and of odd frames becomes one
DELAY = round(AHEAD * FPS)  # frames by which tokens' values come later than their keys; here no spring lags
BATCH = 256  # frames that are looked up at once
LEAP = 0.025  # metres
CALMING = (3.0, 6.0, 12.0, 24.0)  # frames (Gaussian sigma) by which leaps are smoothed, one after the other
UPRIGHT = (0.2, 0.6)  # cosine of the way from feet to head with the vertical: none of the style below, all of it above
UPRIGHT_FADE = 6.0  # frames (Gaussian sigma) over which the style fades out before a body is no longer upright
FLOOR_SMOOTHING = 6.0  # frames (Gaussian sigma), for the height that all legs are lengthened or shortened by
SHORTEST_CONTENT = 4  # frames: fewer have no velocity to speak of
# windows from which a style is read: of a clip of seconds, of a longer one; as stylizer.styles.encoding.TOKEN_WINDOWS,
# or a multiple
FEW, MANY = 3, 12
Network = MotionPuzzle | JointPuzzle | WholeBody


class ResolvedStyle(NamedTuple):
    """PartSpec with the styles themselves in place of their names."""

    style: StyleClips
    strength: float = 1.0
    other: StyleClips | None = None
    share: float = 0.0


def resolve_styles(bank: StyleBank, style: Mapping[str, PartLike]) -> dict[str, ResolvedStyle]:
    """Part -> ResolvedStyle, where a name may also be the path of a BVH clip.

    Raises ValueError or OSError for a style that the bank does not hold and that is no clip."""
    spec = StyleSpec.of(style)
    styles = {name: _style(bank, name) for name in spec.names}
    return {
        part: ResolvedStyle(styles[each.name], each.strength, styles[each.other] if each.other else None, each.share)
        for part, each in spec.items()
    }


def _style(bank: StyleBank, name: str) -> StyleClips:
    if name in bank.names or not is_clip(name):
        return bank[name]
    clip = load_clip(name)
    try:
        features = clip_features(clip)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
    return encode_clip(bank.model, features)


def stylize(model: Network, content: Clip, style: Mapping[str, ResolvedStyle]) -> Clip:
    """The clip (60 Hz, grounded) with the parts of `style` restyled; all others, and strength 0, are as they were.

    Raises ValueError for a clip of a few frames."""
    if len(content) < SHORTEST_CONTENT:
        raise ValueError(
            f"{content.name or 'the clip'} is too short to restyle ({len(content)} frames): "
            f"give at least {SHORTEST_CONTENT} frames at {FPS} a second"
        )
    strengths = np.array([style[part].strength if part in style else 0.0 for part in PART_NAMES])
    return (
        apply_styled(content, evaluate(model, clip_features(content), style), strengths) if strengths.any() else content
    )


def apply_styled(content: Clip, styled: np.ndarray, strengths: np.ndarray) -> Clip:
    """The clip changed by the network's output, features (frames, 21, 15), at the strengths (5,), and its feet in
    order. No joint moves farther in a frame than the content's quickest does, by more than LEAP: where the network's
    output leaps, it is smoothed, and where nothing else helps it is left out."""
    before = to_pose(content)
    upright = uprightness(before)
    delta = unwrap_frames(pose_delta(styled, clip_features(content))) * delta_weights(strengths)
    delta = gaussian_filter1d(delta, SMOOTHING, axis=0, mode="nearest")
    longest = _steps(before).max() + LEAP
    for sigma in (*CALMING, None):
        after = _put_on(before, delta, strengths, upright)
        leaps = _steps(after) > longest
        if not leaps.any():
            break
        reach = round(2 * (sigma or CALMING[-1]))
        near = maximum_filter1d(np.append(leaps, leaps[-1]).astype(float), 2 * reach + 1, mode="nearest")
        near = gaussian_filter1d(near, reach / 4, mode="nearest")
        calm = gaussian_filter1d(delta, sigma, axis=0, mode="nearest") if sigma else 0.0
        delta += near[:, None, None] * (calm - delta)
    else:
        after = _put_on(before, delta, strengths, upright)
    after = clear_hands(after, np.minimum(strengths[ARM_PARTS], 1.0))
    return Clip(after.hips, to_local(after.rotations), content.fps, content.name)


def _steps(pose: Pose) -> np.ndarray:
    """(frames - 1,) metres that the quickest joint moves from each frame to the next."""
    return np.linalg.norm(np.diff(pose.positions, axis=0), axis=-1).max(axis=1)


def _put_on(before: Pose, delta: np.ndarray, strengths: np.ndarray, upright: np.ndarray) -> Pose:
    """The poses changed by deltas (frames, 22, 3) as far as the body is upright (frames,), their feet in order as far
    as it stands on them."""
    delta = delta * upright[:, None, None]
    pose = preserve_hands(
        apply_delta(before, rotations_of_delta(delta), delta[..., -1, :]), before, strengths[ARM_PARTS]
    )
    to_floor = gaussian_filter1d(foot_height_error(pose, before), FLOOR_SMOOTHING, mode="nearest")
    to_floor *= strengths[LEG_PARTS].min() * upright
    after = clean_feet(raise_feet(pose, to_floor) if to_floor.any() else pose, before)
    hips = pose.hips + upright[:, None] * (after.hips - pose.hips)
    return pose.with_body(hips, rot.slerp(pose.rotations, after.rotations, upright[:, None, None]))


def uprightness(pose: Pose) -> np.ndarray:
    """(frames,) 1 where the head is over the feet, 0 where it is not: a body that flips or lies keeps its own motion,
    for the network has only seen bodies that stand."""
    feet = pose.positions[:, CONTACT_JOINTS].mean(axis=1)
    bearing = rot.normalize(pose.positions[:, INDEX["Head"]] - feet) @ UP
    lowest = minimum_filter1d(bearing, 4 * round(UPRIGHT_FADE) + 1, mode="nearest")
    return gaussian_filter1d(smooth_step(lowest, *UPRIGHT), UPRIGHT_FADE, mode="nearest")


def evaluate(model: Network, features: np.ndarray, style: Mapping[str, ResolvedStyle]) -> np.ndarray:
    """The network's own output (frames, 21, 15) for the content's features, before anything is put in order."""
    if isinstance(model, WholeBody):
        return evaluate_whole_body(model, features, style)
    if isinstance(model, JointPuzzle):
        return evaluate_joints(model, features, style)
    return evaluate_by_part(model, features, style)


def evaluate_whole_body(model: WholeBody, features: np.ndarray, style: Mapping[str, ResolvedStyle]) -> np.ndarray:
    """The output of a whole-body system, which is evaluated once for each style."""
    root_velocity = features[:, 0, LAYOUT["root"]].mean(axis=0)

    def code(part: ResolvedStyle) -> torch.Tensor:
        first, other = (style.at(root_velocity) for style in (part.style, part.other or part.style))
        return torch.lerp(first, other, part.share)

    parts = [style.get(part) for part in PART_NAMES]
    keys = [part and (id(part.style), id(part.other), part.share) for part in parts]
    by_key = {key: code(part) for key, part in zip(keys, parts) if key and part}

    def answer(code: torch.Tensor) -> np.ndarray:
        def restyle(windows: np.ndarray) -> np.ndarray:
            return stylize_windows(model, windows, code.expand(len(windows), -1))[None]

        return evaluate_overlapping(features, model.config.window, restyle)[0]

    styled = {key: answer(code) for key, code in by_key.items()}
    return combine_joints(features, styled, joints_by_code(keys))


def encode_clip(model: Network, features: np.ndarray, label: str | None = None) -> StyleClips:
    """The style of a clip's features (frames, 21, 15) of any length; one shorter than a window is repeated. label: its
    domain, for a whole-body system that knows it."""
    if isinstance(model, JointPuzzle):
        return encode_motion(model, features)
    count = FEW if len(features) < MANY * SHORTEST else MANY
    starts = np.linspace(0, max(len(features) - SHORTEST, 0), count).round().astype(int)
    windows = features[(starts[:, None] + STRIDE * np.arange(STYLE_WINDOW)) % len(features)]
    encoded = model.encode_style(windows, label) if isinstance(model, WholeBody) else encode(model, windows)
    return single_clip(encoded, features)


def combine_parts(
    own: StyleClips, style: Mapping[str, ResolvedStyle], root_velocities: np.ndarray
) -> tuple[StyleFeatures, StyleFeatures]:
    """One style for the network, part by part, and the content's own, which the parts that are not restyled keep, both
    for windows that move at root velocities (B, 3)."""
    clips = {id(each): each for part in style.values() for each in (part.style, part.other) if each}
    at = {key: each.at(root_velocities) for key, each in (clips | {id(own): own}).items()}
    parts = [style.get(part, ResolvedStyle(own)) for part in PART_NAMES]
    first = stack_parts([at[id(part.style)] for part in parts])
    other = stack_parts([at[id(part.other or part.style)] for part in parts])
    return interpolate(first, other, [part.share for part in parts]), at[id(own)]


@torch.inference_mode()
def evaluate_by_part(model: MotionPuzzle, features: np.ndarray, style: Mapping[str, ResolvedStyle]) -> np.ndarray:
    """What the network makes of features (frames, 21, 15): windows as long as in training, faded into each other."""
    own = encode_clip(model, features)

    def restyle(windows: np.ndarray) -> np.ndarray:
        motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
        both = combine_parts(own, style, windows[:, :, 0, LAYOUT["root"]].mean(axis=1))
        styled, rebuilt = model(motion, *both)
        result = model.restore(styled).double().numpy()
        return (result if rebuilt is None else windows + (result - model.restore(rebuilt).double().numpy()))[None]

    return evaluate_overlapping(features, WINDOW, restyle)[0]


@torch.inference_mode()
def evaluate_joints(model: JointPuzzle, features: np.ndarray, style: Mapping[str, ResolvedStyle]) -> np.ndarray:
    """What the network at the resolution of joints makes of features (frames, 21, 15): frame by frame, from the half
    second that ends DELAY frames earlier. Parts that `style` does not name keep the content's."""
    own, result = encode_clip(model, features), features.copy()
    for frames in np.array_split(np.arange(len(features)), -(-len(features) // BATCH)):
        seen = frames[:, None] - DELAY + STRIDE * np.arange(1 - WINDOW, 1)
        windows = features[np.clip(seen, 0, len(features) - 1)]
        velocities = windows[:, :, 0, LAYOUT["root"]].mean(axis=1)
        motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
        outputs = model(
            motion, *combine_parts(own, style, velocities), 1, torch.from_numpy(with_run(velocities).astype(np.float32))
        )
        styled, rebuilt = (model.restore(each)[:, 0].double().numpy() for each in outputs)
        result[frames] = _change_by(features[frames], styled, rebuilt)
    return result


def _change_by(content: np.ndarray, styled: np.ndarray, rebuilt: np.ndarray) -> np.ndarray:
    """Features (frames, 21, 15) of the content, rotated and shifted as leads from the rebuilt ones to the styled."""
    result = content.copy()
    after, before, now = rotations_of(np.array([styled, rebuilt, content]))
    result[..., LAYOUT["rotation"]] = rot.to_6d(rot.from_matrix(after @ before.swapaxes(-1, -2) @ now))
    result[..., LAYOUT["position"]] += (styled - rebuilt)[..., LAYOUT["position"]]
    return result


def to_pose(clip: Clip) -> Pose:
    """All frames of a clip as one pose with a leading axis, its contacts found from its feet."""
    root = root_frame(clip.positions(), clip.fps)
    return Pose(
        root.positions, root.facing, clip.hips, clip.global_rotations(), foot_contacts(clip), np.zeros(len(clip))
    )
