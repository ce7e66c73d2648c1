"""Key poses: what a style looks like at the moments that movements have in common, put straight on the decoder's
output.

The attention of BP-ATN (Jang et al. 2022, Sec. 4.4) at the resolution of joints: each body part has moments that it
learned to tell, most of them steps of a gait. A style clip says how the part is held in each of them (its key poses),
the content says which moment it is in, and so the style's own pose for that moment arrives without passing through two
averaged vertices a part. Two styles have their key poses for the same moments, so they can be blended, and what a style
has in common with the content's own cancels exactly."""

import math
from itertools import accumulate, pairwise
from typing import NamedTuple

import torch
from torch import Tensor, nn

from sim.body.skeleton import JOINT_COUNT, PARTS
from stylizer.networks.graph import LEVELS
from stylizer.networks.layers import BlockFeatures, Parts, leaky
from stylizer.systems.motion_puzzle.direction_transfer import CODE as STYLE_CODE
from stylizer.systems.motion_puzzle.direction_transfer import LEAST, ROOT, ROOT_SIZE, DirectionTransfer

BODY = slice(0, ROOT.start)  # all but the root motion, which is the content's
HIDDEN, CODE = 96, 16  # units of the network that assigns a pose to prototypes, and of the code it compares
QUIET = 0.2  # of the normalized deviation, added to a joint's own: what hardly moves says little
# Sideways, forward, turning: how little another root velocity may count at most. A slow walk does say how legs move in
# a quick one; learning alone, whose loss is fond of medians, makes legs hardly ever listen to it.
MAX_INVERSE_SCALE = torch.tensor([math.inf, 0.15, math.inf])[:, None]
SHARPNESS = 3.0  # how sharp the assignment is at first: minus the score at the mean distance of two poses' codes
RIDGE = 0.03  # how much dearer it is to change a prototype that no pose is assigned to than to miss the clip's poses


class Fields(NamedTuple):
    """Where in the scale of a clip's key poses what lies: statistics of every number, what `DirectionTransfer` says of
    the clip at its own root velocity, that mean root velocity, and the style's code."""

    mean: slice
    deviation: slice
    source_prediction: slice
    root_velocity: slice
    code: slice


class KeyPoses(nn.Module):
    """The prototypes of five body parts, and the network that assigns a whole body without its style to them.

    A pose loses its style by its clip's own statistics: mean and deviation of every joint. As a `BlockFeatures` a
    clip's key poses are: bias, the flattened table (5, B, prototypes n 12) of n joints a part, as they differ from the
    mean; scale, the `fields` of (5, B, 4 n 12 + 3 + 16), see `Fields`; no tokens."""

    def __init__(self, moments: int) -> None:
        super().__init__()
        self.parts = Parts(LEVELS[1])
        size = self.parts.count * BODY.stop
        self.fields = Fields(
            *(slice(*ends) for ends in pairwise(accumulate((0, size, size, 2 * size, ROOT_SIZE, STYLE_CODE))))
        )
        inputs = JOINT_COUNT * BODY.stop + ROOT_SIZE
        self.hidden, self.code = nn.Linear(inputs, HIDDEN), nn.Linear(HIDDEN, len(PARTS) * CODE)
        self.direction_transfer = DirectionTransfer(JOINT_COUNT * BODY.stop, size)
        self.prototypes = nn.Parameter(torch.randn(len(PARTS), moments, CODE))
        # logarithms: of a style's poses, of the content's
        self.sharpness = nn.Parameter(torch.zeros(2, len(PARTS), 1, 1, 1))
        # logarithms: how little another root velocity counts
        self.log_inverse_scale = nn.Parameter(torch.full((len(PARTS), ROOT_SIZE, 1), -1.5))

    @torch.no_grad()
    def begin(self, clips: Tensor) -> None:
        """Takes as moments poses of normalized clips (21, B, T, 15) drawn at random, which beats random moments by
        far."""
        codes = self.codes(clips, self.statistics(clips)).flatten(1, 2)
        chosen = torch.randperm(codes.shape[1])[: self.prototypes.shape[1]]
        self.prototypes.copy_(codes[:, chosen])
        apart = (codes[:, torch.randperm(codes.shape[1])] - codes).square().sum(-1).mean(1)
        self.sharpness.copy_((SHARPNESS / apart).log().view(-1, 1, 1, 1))

    def statistics(self, clip: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and deviation over time of a clip (21, B, T, 15): two of (21, B, 1, 12)."""
        body = clip[..., BODY]
        return body.mean(2, keepdim=True), body.var(2, keepdim=True, correction=0).add(1e-6).sqrt()

    def codes(self, motion: Tensor, statistics: tuple[Tensor, Tensor]) -> Tensor:
        """The codes that are compared with the prototypes': (21, B, T, 15), statistics (21, B, 1, 12) -> (5, B, T,
        CODE)."""
        mean, deviation = statistics
        bare = (motion[..., BODY] - mean) / (deviation + QUIET)
        # who runs moves more than their own style's walk
        bare = bare / (1 + bare.square().mean((0, 3), keepdim=True)).sqrt()
        inputs = torch.cat([bare.permute(1, 2, 0, 3).flatten(2), motion[0, ..., ROOT]], dim=-1)
        return self.code(leaky(self.hidden(inputs))).unflatten(2, (len(PARTS), CODE)).permute(2, 0, 1, 3)

    def scores(self, codes: Tensor, side: int) -> Tensor:
        """(5, B, T, CODE) -> (5, B, T, prototypes), larger the nearer."""
        moments = self.prototypes[:, None]
        near = (
            2 * codes @ moments.transpose(2, 3)
            - codes.square().sum(-1, keepdim=True)
            - moments.square().sum(-1)[:, :, None]
        )
        return near * self.sharpness[side].exp()

    def style_side(self, clip: Tensor) -> BlockFeatures:
        """The key poses of a style clip (21, B, T, 15) of any length."""
        statistics = self.statistics(clip)
        codes = self.codes(clip, statistics)
        mean, deviation = (self._by_part(values)[:, :, 0] for values in statistics)
        poses = self._by_part(clip[..., BODY]) - mean[:, :, None]
        first = self.scores(codes, 0).softmax(dim=2).transpose(2, 3) @ poses
        table = _ridge_refine(first, self.scores(codes, 1).softmax(dim=3), poses)
        root_velocity = clip[0, ..., ROOT].mean(1)
        body_mean, body_deviation = (values[:, :, 0].transpose(0, 1).flatten(1) for values in statistics)
        code, source_prediction = self.direction_transfer.style_side(body_mean, body_deviation, root_velocity)
        scale = torch.cat(
            [mean, deviation, source_prediction, *(each.expand(len(PARTS), -1, -1) for each in (root_velocity, code))],
            dim=2,
        )
        none = root_velocity.new_zeros(len(PARTS), len(root_velocity), 0, ROOT_SIZE)
        return BlockFeatures(scale, table.flatten(2), none, none)

    def refit(self, style: BlockFeatures, attention: Tensor, poses: Tensor) -> BlockFeatures:
        """The key poses changed so that attention (5, 1, T, prototypes) shows normalized poses (21, 1, T, 12)."""
        mean = style.scale[..., self.fields.mean][:, :, None]
        table = style.bias.unflatten(2, (attention.shape[3], -1))
        return style._replace(bias=_ridge_refine(table, attention, self._by_part(poses) - mean).flatten(2))

    def take_joints(self, style: BlockFeatures, to: int, source: int, joints: Tensor) -> BlockFeatures:
        """The key poses of n clips, with those of some joints (21,) bool in clip `to` replaced by those in clip
        `source`."""
        # (5, n 12)
        taken = self._by_part(joints[:, None, None, None].expand(-1, 1, 1, BODY.stop).float())[:, 0, 0] > 0.5
        scale, table = style.scale.clone(), style.bias.unflatten(2, (self.prototypes.shape[1], -1)).clone()
        table[:, to] = torch.where(taken[:, None], table[:, source], table[:, to])
        for field, mask in (
            (self.fields.mean, taken),
            (self.fields.deviation, taken),
            (self.fields.source_prediction, taken.repeat(1, 2)),
        ):
            scale[:, to, field] = torch.where(mask, scale[:, source, field], scale[:, to, field])
        return style._replace(scale=scale, bias=table.flatten(2))

    def _by_part(self, values: Tensor) -> Tensor:
        """(21, B, T, 12) -> (5, B, T, n 12)"""
        return self.parts.split(values).permute(0, 2, 3, 1, 4).flatten(3)

    def inverse_scale(self) -> Tensor:
        """(5, 3, 1) how quickly the kernel falls with the square of what lies between two root velocities: sideways,
        forward, turning."""
        return self.log_inverse_scale.exp().minimum(MAX_INVERSE_SCALE.to(self.log_inverse_scale))

    def attend(self, motion: Tensor, own: BlockFeatures) -> Tensor:
        """Which moments normalized motion (21, B, T, 15) in its own style passes through: (5, B, T, prototypes), sums
        of one."""
        mean, deviation = (
            self.parts.join(own.scale[..., field].unflatten(2, (-1, BODY.stop)).transpose(1, 2))[:, :, None]
            for field in self.fields[:2]
        )
        return self.scores(self.codes(motion, (mean, deviation)), 1).softmax(dim=3)

    def pose_statistics(
        self, style: BlockFeatures, root_velocity: Tensor, known: Tensor | float = 1.0
    ) -> tuple[Tensor, Tensor]:
        """Of a style at another root velocity (B, 3): the mean, and the logarithm of what its movement is multiplied
        by, two of (5, B, n 12). known: (5, B, 1) how far direction transfer knows that velocity."""
        mean, _, source_prediction, _, code = (style.scale[..., field] for field in self.fields)
        shift, gain = self.direction_transfer(code, source_prediction, root_velocity)
        return mean + known * shift, known * gain

    def forward(
        self,
        attention: Tensor,
        root_velocity: Tensor,
        style: BlockFeatures,
        own: BlockFeatures,
        own_root_velocity: Tensor | None = None,
        known_direction: Tensor | None = None,
        known: Tensor | float = 1.0,
    ) -> Tensor:
        """What is added to motion in its own style at a root velocity (B, 3) so that it has another: attention
        (5, B, T, prototypes) -> (21, B, T, 15).

        The style's mean pose for its own, and the style's movement, moment by moment, as far as its clip goes the same
        root motion: a walk says little about the moments of a step back. own_root_velocity: (B, 3) of the motion
        itself, where styled legs carry the body at another; known_direction: (B, 3) what of the root velocity direction
        transfer knows, known: (5, B, 1) how far the velocity is of that kind."""
        kernel = torch.exp(
            -(
                (style.scale[..., self.fields.root_velocity] - root_velocity)[:, :, None].square()
                @ self.inverse_scale()[:, None]
            )
        )
        theirs, their_moves = self._styled_statistics(
            attention, root_velocity if known_direction is None else known_direction, style, known
        )
        ours, our_moves = self._styled_statistics(
            attention, root_velocity if own_root_velocity is None else own_root_velocity, own
        )
        poses = ours + our_moves + (theirs - ours) + kernel * (their_moves - our_moves)
        poses = self.parts.join(poses.unflatten(3, (-1, BODY.stop)).permute(0, 3, 1, 2, 4))
        return torch.cat([poses, torch.zeros_like(poses[..., :ROOT_SIZE])], dim=-1)

    def _styled_statistics(
        self, attention: Tensor, root_velocity: Tensor, clip: BlockFeatures, known: Tensor | float = 1.0
    ) -> tuple[Tensor, Tensor]:
        """How a clip's parts are held at this root velocity, (5, B, 1, n 12), and how they move, (5, B, T, n 12)."""
        mean, gain = (values[:, :, None] for values in self.pose_statistics(clip, root_velocity, known))
        return mean, attention @ clip.bias.unflatten(2, (attention.shape[3], -1)) * gain.exp()

    def direction_transfer_loss(self, style: BlockFeatures, clip: Tensor) -> Tensor:
        """By how much the style, at the root velocity of a normalized clip (21, B, T, 15) in the same style, misses how
        that is held and how lively it is: the mean over both."""
        root_velocity = clip[0, ..., ROOT].mean(1)
        mean, gain = self.pose_statistics(style, root_velocity)
        wanted, lively = (self._by_part(values)[:, :, 0] for values in self.statistics(clip))
        ratio = (lively + LEAST).log() - (style.scale[..., self.fields.deviation] + LEAST).log()
        return ((mean - wanted).abs() + (gain - ratio).abs()).mean()


def _ridge_refine(table: Tensor, attention: Tensor, poses: Tensor) -> Tensor:
    """A table of key poses (5, B, prototypes, n 12) changed so that its clip, poses (5, B, T, n 12) at attention (5, B,
    T, prototypes) as content is, comes back as it is: means of poses move less than the poses do. Ridge regression,
    from the table given."""
    missed = attention.transpose(2, 3) @ (poses - attention @ table) / attention.shape[2]
    together = attention.transpose(2, 3) @ attention / attention.shape[2]
    penalty = RIDGE / attention.shape[3] * torch.eye(attention.shape[3], device=attention.device)
    return table + torch.linalg.solve(together + penalty, missed)
