"""What training asks of the network: Eq. 15 to 20 of Motion Puzzle, and what measurement added to them."""

from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

from sim.body.skeleton import (
    CONTACT_JOINTS,
    GROUPS,
    JOINT_COUNT,
    PART_NAMES,
    PART_OF_JOINT,
)
from sim.body.torch_kinematics import forward_kinematics
from sim.motion.features import LAYOUT, POSE_CHANNELS, STRIDE, WINDOW
from sim.motion.thresholds import STAND_OR_WALK
from stylizer.data.dataset import LATER, STYLE_WINDOW
from stylizer.networks.blocks import NEWEST, newest
from stylizer.systems.motion_puzzle.model import MotionPuzzle
from stylizer.systems.motion_puzzle.style_tensors import cat_batch, mix_parts, split_batch

AMPLITUDE_WEIGHT = 2.0  # what a joint's deviation over time counts in `mean_pose_loss`, where its mean counts 1
SPEED_SCALE = 1.0  # m/s; clips whose speeds differ by more have little to say about each other's dynamics
FEET = np.isin(np.arange(JOINT_COUNT), CONTACT_JOINTS)
LEGS = np.isin(PART_OF_JOINT, [PART_NAMES.index(part) for part in GROUPS["legs"]])


@dataclass(frozen=True)
class Recipe:
    """How a network is trained. `weights` names the terms of the total (Eq. 20) and what each counts."""

    weights: dict[str, float] = field(default_factory=dict)
    batch: int = 32
    learning_rate: float = 1e-4
    momentum: float = 0.0  # beta_1 of RAdam; beta_2 is 0.99
    average: float = 0.999  # of the exponential moving average of the weights
    last_weight: float = 1.0  # of the newest samples in what is compared sample by sample
    late: tuple[str, ...] = ()  # terms that are left out until the learning rate falls, because they are costly

    def active(self, late: bool) -> dict[str, float]:
        """The weights that count before or after the learning rate falls."""
        return {name: weight for name, weight in self.weights.items() if late or name not in self.late}


# App. A.2 of the paper; the weights of Eq. 20 are all one.
PAPER = Recipe({"reconstruction": 1.0, "cycle": 1.0, "root": 1.0, "smoothness": 1.0})
OURS = Recipe(
    {
        "reconstruction": 1.0,
        "root": 0.5,
        "smoothness": 1.0,
        "mean_pose": 6.0,
        "imitation": 0.7,
        "stream": 0.4,
    },
    batch=12,
    learning_rate=2e-3,
    momentum=0.9,
    average=0.998,
    last_weight=5.0,
    late=("stream",),
)
RECIPES = {"paper": PAPER, "ours": OURS}


@dataclass
class Inputs:
    """One batch, normalized: what `stylizer.data.sampler.Batch` holds as (21, B, T, 15), and the parts (5, B) of bool
    that take the target's style (Alg. 1)."""

    source: Tensor
    own: Tensor
    later: Tensor
    target: Tensor
    exemplar: Tensor
    match: Tensor
    match_later: Tensor
    closeness: Tensor  # (B,)
    use_target: Tensor


def compute_losses(model: MotionPuzzle, inputs: Inputs, recipe: Recipe, late: bool = True) -> dict[str, Tensor]:
    """The terms that the recipe names, of one training pass; late: those too that count only once the learning rate
    falls."""
    return paper_losses(model, inputs) if "cycle" in recipe.weights else our_losses(model, inputs, recipe, late)


def paper_losses(model: MotionPuzzle, inputs: Inputs) -> dict[str, Tensor]:
    """Eq. 15 to 19: source and target rebuilt from their own styles, and both got back by way of the restyled
    motion."""
    source, target = inputs.source, inputs.target[:, :, -STYLE_WINDOW:]
    wanted = torch.cat([source, target], dim=1)
    own, other = split_batch(model.encode_style(wanted))
    of_source, of_target = model.content_encoder(wanted).chunk(2, dim=1)
    mixed = mix_parts(own, other, inputs.use_target)
    both = cat_batch([own, other])
    (rebuilt,) = model.decode_styles(wanted, torch.cat([of_source, of_target], dim=1), [both])
    restyled, restyled_whole = model.decode_styles(source, of_source, [mixed, other])
    again = model.encode_style(restyled_whole)
    (cycled,) = model.decode_styles(
        torch.cat([restyled, target], dim=1),
        torch.cat([model.content_encoder(restyled), of_target], dim=1),
        [cat_batch([own, again])],
    )
    return {
        "reconstruction": (rebuilt - wanted).abs().mean(),
        "cycle": (cycled - wanted).abs().mean(),
        "root": (restyled - source)[..., LAYOUT["root"]].abs().mean(),
        "smoothness": (rebuilt - wanted).diff(dim=2).abs().mean() + (cycled - wanted).diff(dim=2).abs().mean(),
    }


def our_losses(model: MotionPuzzle, inputs: Inputs, recipe: Recipe, late: bool) -> dict[str, Tensor]:
    """Reconstruction, root and smoothness of the paper, without its cycles; and what presses on style and on the live
    stream:

    mean_pose, how restyled parts are held and how lively they are (see `mean_pose_loss`); imitation, the matched step
    of the exemplar (see `imitate`); stream, the newest samples must be what a later window says of the same
    instants."""
    use_target, now = inputs.use_target, inputs.source[:, :, -WINDOW:]
    later = [inputs.later] if "stream" in recipe.active(late) else []
    motion = torch.cat([now, *later], dim=1)
    times = 1 + len(later)
    clips = torch.cat([inputs.own, inputs.target], dim=1)
    own, other = split_batch(model.encode_style(clips[:, :, -STYLE_WINDOW:]))
    content = model.content_encoder(motion)
    own, mixed = (cat_batch([style] * times) for style in (own, mix_parts(own, other, use_target)))
    rebuilt, restyled = model.decode_styles(motion, content, [own, mixed])
    if model.config.residual_output:
        restyled = motion + (restyled - rebuilt)

    matches = [inputs.match, inputs.match_later][:times]
    wanted = imitate(model, motion, torch.cat(matches, dim=1), use_target.repeat(1, times))
    chosen = use_target[torch.as_tensor(PART_OF_JOINT, device=now.device)]  # (21, B)
    worth = torch.where(use_target.any(0), inputs.closeness, 1.0).repeat(times)[:, None, None]  # of where joints are
    # of each joint's own turn
    turn_worth = torch.where(chosen, inputs.closeness, 1.0).repeat(1, times)[..., None, None]
    error, miss = restyled - wanted, rebuilt - motion
    turns = error[..., LAYOUT["rotation"]]
    places = torch.cat(
        [
            error[..., LAYOUT["position"]],
            error[..., LAYOUT["velocity"]],
            place_joints(model, restyled) - wanted[..., LAYOUT["position"]],
        ],
        dim=-1,
    )
    time = newest(now, recipe.last_weight)
    terms = {
        "reconstruction": (miss.abs() * time).mean(),  # Eq. 15
        "root": ((restyled - motion)[..., LAYOUT["root"]].abs() * time).mean(),  # Eq. 17
        # Eq. 18, 19
        "smoothness": miss[..., POSE_CHANNELS].diff(dim=2).abs().mean() + (turns.diff(dim=2).abs() * turn_worth).mean(),
        "mean_pose": mean_pose_loss(
            restyled[:, : now.shape[1]], now, inputs.source, inputs.exemplar, use_target, model
        ),
        "imitation": (turns.abs() * time * turn_worth).mean() + (places.abs() * time * worth).mean(),
    }
    if later:
        first, second = (restyled - motion).chunk(2, dim=1)  # later, the newest samples lie well inside the window
        terms["stream"] = (
            (first[:, :, NEWEST] - _seen_later(second).detach()[:, :, NEWEST])[..., POSE_CHANNELS].abs().mean()
        )
    return {name: terms[name] for name in recipe.active(late)}


def imitate(model: MotionPuzzle, content: Tensor, match: Tensor, use_target: Tensor) -> Tensor:
    """The motion that would be perfect if the match were: chosen parts turn as the target does in the same step, the
    others as the content; positions by forward kinematics, the root goes the content's way. All (21, B, T, 15),
    normalized."""
    chosen = use_target[torch.as_tensor(PART_OF_JOINT, device=content.device)][..., None, None]
    mixed = torch.where(chosen, match, content)
    mixed = torch.cat([mixed[..., : LAYOUT["root"].start], content[..., LAYOUT["root"]]], dim=-1)
    return torch.cat([place_joints(model, mixed), mixed[..., POSE_CHANNELS.start + 3 :]], dim=-1)


def place_joints(model: MotionPuzzle, motion: Tensor) -> Tensor:
    """Where the turns of normalized motion (21, B, T, 15) put the joints, normalized positions (21, B, T, 3): what is
    drawn."""
    natural = motion * model.deviation + model.mean
    positions = forward_kinematics(natural[..., LAYOUT["rotation"]], natural[:1, ..., LAYOUT["position"]])
    return (positions - model.mean[..., LAYOUT["position"]]) / model.deviation[..., LAYOUT["position"]]


def mean_pose_loss(
    restyled: Tensor, content: Tensor, source: Tensor, target: Tensor, use_target: Tensor, model: MotionPuzzle
) -> Tensor:
    """The restyled parts' mean and deviation over time, per joint, should differ as the target's and the source's do.

    A difference of whole cycles, because half a second is half a stride: its own mean depends on which leg is in front.
    How clips at different speeds move says less about style, so they count less; and where one walks and the other
    stands, feet stay as flat and legs as quiet (or lively) as they are."""
    speed = [
        (m[0] * model.deviation[0, 0] + model.mean[0, 0])[..., LAYOUT["root"]][..., :2].norm(dim=-1).mean(-1)
        for m in (source, target)
    ]
    alike = torch.exp(-(((speed[0] - speed[1]) / SPEED_SCALE) ** 2))[None, :, None]  # (1, B, 1)
    walking = [((v - STAND_OR_WALK[0]) / (STAND_OR_WALK[1] - STAND_OR_WALK[0])).clamp(0, 1) for v in speed]
    same_gait = 1 - (walking[0] - walking[1]).abs()[None, :, None]
    feet, legs = (torch.as_tensor(joints, device=source.device)[:, None, None] for joints in (FEET, LEGS))

    mean_shift = target[..., POSE_CHANNELS].mean(2) - source[..., POSE_CHANNELS].mean(2)  # (21, B, 9)
    mean_shift = torch.where(feet, same_gait, 1.0) * mean_shift
    deviation_shift = torch.where(legs, same_gait, 1.0) * (_deviation(target) - _deviation(source))
    mean_error = (restyled[..., POSE_CHANNELS].mean(2) - content[..., POSE_CHANNELS].mean(2) - mean_shift).abs()
    deviation_error = (_deviation(restyled) - (_deviation(content) + deviation_shift).clamp(min=0)).abs()

    chosen = use_target[torch.as_tensor(PART_OF_JOINT, device=use_target.device)][..., None]  # (21, B, 1)
    error = ((0.5 + 0.5 * alike) * mean_error + AMPLITUDE_WEIGHT * alike * deviation_error) * chosen
    return error.sum() / (chosen.sum() * error.shape[2]).clamp(min=1)


def _seen_later(later: Tensor) -> Tensor:
    """What a window that ends LATER frames on says of this window's last samples: (21, B, T, 15) -> (.., T', 15).

    LATER is odd, so its samples fall between ours: cubic interpolation, which keeps even and odd frames of a stream
    together."""
    between = (9 * (later[:, :, 1:-2] + later[:, :, 2:-1]) - (later[:, :, :-3] + later[:, :, 3:])) / 16
    after = (LATER - 1) // STRIDE - 1  # of those, the ones that lie after our last sample
    return between[:, :, :-after] if after else between


def _deviation(motion: Tensor) -> Tensor:
    """(21, B, T, 15) -> (21, B, 9) deviation over time of position and rotation."""
    return (motion[..., POSE_CHANNELS].var(dim=2, correction=0) + 1e-6).sqrt()
