"""What training asks of Motion Puzzle at the resolution of joints: the paper's reconstruction and smoothness (Eq. 15,
18, 19), and what measurement added.

The paper's cycle and root losses have nothing to do here: a style's mean pose is read from its clip, and root
velocities are never changed. All that is learned is the code by which instants are compared."""

from dataclasses import dataclass, replace

import torch
from torch import Tensor, nn

from sim.body.skeleton import PART_OF_JOINT
from sim.motion.features import LAYOUT, POSE_CHANNELS, WINDOW
from sim.motion.thresholds import STAND_OR_WALK
from stylizer.networks.layers import moments
from stylizer.systems.motion_puzzle.joint_model import BODY, FAINT, JointPuzzle
from stylizer.systems.motion_puzzle.objective import LEGS, OURS, SPEED_SCALE, Recipe
from stylizer.systems.motion_puzzle.style_tensors import mix_parts, split_batch

LEAST = 0.05  # of the normalized deviation, added before logarithms are taken: how still a still joint is says nothing
TOKENS = 64  # samples of a clip that are attended to in training
# Imitation and smoothness are fond of medians, which move little: amplitude outweighs them.
RECIPE = replace(OURS, weights={"reconstruction": 1.0, "smoothness": 1.0, "amplitude": 2.0, "imitation": 0.5}, late=())


@dataclass
class JointInputs:
    """One batch, normalized (21, B, T, 15): what `stylizer.data.joint_sampler.JointBatch` holds, and the parts (5, B)
    of bool that take the target's style (Alg. 1)."""

    source: Tensor
    own: Tensor
    target: Tensor
    exemplar: Tensor
    match: Tensor
    closeness: Tensor  # (B,)
    use_target: Tensor


class JointObjective(nn.Module):
    """The losses as a module's forward pass, which is what DistributedDataParallel averages the gradients of."""

    def __init__(self, model: JointPuzzle, recipe: Recipe = RECIPE) -> None:
        super().__init__()
        self.model, self.recipe = model, recipe

    def forward(self, inputs: JointInputs, late: bool = True) -> dict[str, Tensor]:
        """The terms of the recipe, none of which begins late.

        reconstruction: a motion comes back from its own style; smoothness: so does its change from sample to sample;
        amplitude: see `missed_amplitude`; imitation: restyled parts turn as the target does in the same step."""
        model, content, use_target = self.model, inputs.source[:, :, -WINDOW:], inputs.use_target
        own, other = split_batch(model.encode_style(torch.cat([inputs.own, inputs.target], dim=1), TOKENS))
        styled, rebuilt = model(inputs.source, mix_parts(own, other, use_target), own, WINDOW)
        restyled = content + styled - rebuilt
        chosen = use_target[torch.as_tensor(PART_OF_JOINT, device=content.device)]  # (21, B)
        wanted = torch.where(chosen[..., None, None], inputs.match, content)
        worth = torch.where(chosen, inputs.closeness, 1.0)[..., None, None]
        turns, miss = (restyled - wanted)[..., LAYOUT["rotation"]], (rebuilt - content)[..., BODY]
        return {
            "reconstruction": miss.abs().mean(),  # Eq. 15
            "smoothness": miss.diff(dim=2).abs().mean() + (turns.diff(dim=2).abs() * worth).mean(),  # Eq. 18, 19
            "amplitude": missed_amplitude(model, restyled, content, inputs.source, inputs.exemplar, chosen),
            "imitation": (turns.abs() * worth).mean(),
        }


def missed_amplitude(
    model: JointPuzzle, restyled: Tensor, content: Tensor, source: Tensor, target: Tensor, chosen: Tensor
) -> Tensor:
    """How far the amplitude of restyled joints, chosen (21, B), is from the target's; motions are (21, B, T,
    15).

    |log(s(restyled) / s(content)) - log(s(target) / s(source))|, s the deviation over time: a ratio, because what is
    uncertain would shrink under a difference. Clips at other speeds say less; where one walks and the other stands,
    legs keep their amplitude."""
    alike, same_gait = _likeness(model, source, target)
    legs = torch.as_tensor(LEGS, device=source.device)[:, None, None]
    ratio = (_log_amplitude(target) - _log_amplitude(source)) * torch.where(legs, same_gait, 1.0)
    error = (_log_amplitude(restyled) - _log_amplitude(content) - ratio).abs() * alike
    return (error * chosen[..., None]).sum() / (chosen.sum() * error.shape[2]).clamp(min=1)


def _likeness(model: JointPuzzle, source: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
    """How alike the speeds of normalized clips are, and whether both walk or both stand: two of (1, B, 1) in 0..1."""
    root = LAYOUT["root"]
    speed = [
        (m[0, ..., root] * model.deviation[0, 0, 0, root] + model.mean[0, 0, 0, root])[..., :2].norm(dim=-1).mean(-1)
        for m in (source, target)
    ]
    walking = [((v - STAND_OR_WALK[0]) / (STAND_OR_WALK[1] - STAND_OR_WALK[0])).clamp(0, 1) for v in speed]
    return (
        torch.exp(-(((speed[0] - speed[1]) / SPEED_SCALE) ** 2))[None, :, None],
        1 - (walking[0] - walking[1]).abs()[None, :, None],
    )


def _log_amplitude(motion: Tensor) -> Tensor:
    """(21, B, T, 15) -> (21, B, 9) logarithm of the deviation over time of position and rotation; LEAST is added, for
    how still a still joint is says nothing."""
    return ((moments(motion[..., POSE_CHANNELS], (2,))[1][:, :, 0] + FAINT).sqrt() + LEAST).log()
