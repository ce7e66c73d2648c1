"""What a style does to the root motion, for a whole clip: the velocity warp of Aberman et al. 2020 (Eq. 2), and
the global motion that a network reads from the local one (Guo et al. 2024, Sec. 3.2.3)."""

from typing import TYPE_CHECKING, Mapping, Sequence

import numpy as np
import torch

from sim.body.skeleton import PART_NAMES
from sim.math import rotations as rot
from sim.motion.clip import FPS, Clip, root_frame
from sim.motion.features import clip_features
from sim.style_spec import PartLike, PartSpec, StyleSpec
from stylizer.runtime.overlap import evaluate_overlapping
from stylizer.styles.bank import StyleBank
from stylizer.styles.code_bank import CodeBank
from stylizer.systems.registry import GlobalMotion
from stylizer.systems.whole_body import velocity_factor

if TYPE_CHECKING:  # a system's file is imported when the system is wanted
    from stylizer.systems.latent import Latent

SLOWEST, QUICKEST = 0.5, 2.0  # factors of a warp beyond which a style says nothing of the content's pace


def warp_time(styled: Clip, content: np.ndarray, styles: Sequence[float]) -> Clip:
    """The clip with its time warped by V^sty / V^con; content: its features before. styles: V of the style of each body
    part, whose mean counts."""
    return styled.paced(float(np.clip(np.mean(styles) / max(velocity_factor(content), 1e-6), SLOWEST, QUICKEST)))


def follow_predicted_root(model: "Latent", styled: Clip) -> Clip:
    """The clip at the root velocity that the network predicts from its local motion."""

    @torch.inference_mode()
    def evaluate(windows: np.ndarray) -> np.ndarray:
        root_velocity = model.predict_root_velocity(model.normalize(torch.from_numpy(windows.astype(np.float32))))
        return root_velocity[None, :, :, None].double().numpy()

    root_velocity = evaluate_overlapping(clip_features(styled), model.config.window, evaluate)[0, :, 0]  # (frames, 3)
    root = root_frame(styled.positions(), styled.fps)
    facing = root.facing[0] + np.concatenate([[0.0], root_velocity[1:, 2].cumsum()]) / FPS
    steps = (
        rot.rotate(
            rot.from_yaw(facing),
            np.stack([root_velocity[:, 0], np.zeros(len(root_velocity)), root_velocity[:, 1]], axis=-1),
        )
        / FPS
    )
    steps[0] = root.positions[0]
    turn = rot.from_yaw(facing - root.facing)
    hips = rot.rotate(turn, styled.hips - root.positions) + steps.cumsum(axis=0)
    rotations = styled.rotations.copy()
    rotations[:, 0] = rot.multiply(turn, rotations[:, 0])
    return Clip(hips, rotations, styled.fps, styled.name)


def change_global_motion(bank: StyleBank, styled: Clip, content: Clip, style: Mapping[str, PartLike]) -> Clip:
    """The restyled clip with the style's own global motion, as the bank's system has it: the velocity warp of
    `unpaired`, or the way that a network reads. style: names or paths of clips, as
    `offline.resolve_styles` takes them.

    Raises ValueError for a system that has neither."""
    does = bank.system.global_motion
    if does == GlobalMotion.KEPT:
        raise ValueError(
            f"the {bank.model.KIND} stylizer leaves the root motion to the content: leave --global-motion out"
        )
    if does == GlobalMotion.PREDICTED:
        return follow_predicted_root(bank.model, styled)
    assert isinstance(bank, CodeBank)  # whose system warps the time
    features, spec = clip_features(content), StyleSpec.of(style)
    own = velocity_factor(features)
    return warp_time(styled, features, [_speed(bank, spec.get(part), own) for part in PART_NAMES])


def _speed(bank: CodeBank, spec: PartSpec | None, own: float) -> float:
    """V of a part's style at its strength; own: the content's."""
    if spec is None:
        return own
    speeds = [bank.speed_of(name) for name in spec.names]
    return own + spec.strength * (speeds[0] + (speeds[-1] - speeds[0]) * spec.share - own)
