"""Key poses: what a style looks like at the moments that movements have in common, put straight on the decoder's
answer.

The attention of BP-ATN (Jang et al. 2022, Sec. 4.4) at the resolution of joints: each body part has MOMENTS that it
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
from stylizer.networks.layers import Parts, PartStyle, leaky
from stylizer.systems.motion_puzzle.direction_transfer import CODE as STYLE_CODE
from stylizer.systems.motion_puzzle.direction_transfer import LEAST, ROOT, ROOT_SIZE, DirectionTransfer

BODY = slice(0, ROOT.start)  # all but the way over the floor, which is the content's
HIDDEN, CODE = 96, 16  # units of the network that tells moments, and of the code it tells them by
QUIET = 0.2  # of the normalized deviation, added to a joint's own: what hardly moves tells little
# Sideways, forward, turning: how little another way may be trusted at most. A slow walk does say how legs move in a
# quick one; learning alone, whose loss is fond of medians, makes legs hardly ever listen to it.
MOST_WARY = torch.tensor([math.inf, 0.15, math.inf])[:, None]
SHARPNESS = 3.0  # how surely moments are told at first: minus the score at the mean distance of two poses' codes
RIDGE = 0.03  # how much dearer it is to change a moment that is never told than to miss the clip's poses


class Fields(NamedTuple):
    """Where in the scale of a clip's key poses what lies: statistics of every number, what `DirectionTransfer` says of
    the clip on its own way, that mean way over the floor, and the style's code."""

    mean: slice
    deviation: slice
    here: slice
    way: slice
    code: slice


class KeyPoses(nn.Module):
    """The moments of five body parts, and what tells them from a whole body without its style.

    A pose loses its style by its clip's own statistics: mean and deviation of every joint. As a `PartStyle` a clip's
    key poses are: bias, the flattened table (5, B, moments n 12) of n joints a part, as they differ from the mean;
    scale, the `fields` of (5, B, 4 n 12 + 3 + 16), see `Fields`; no tokens."""

    def __init__(self, moments: int) -> None:
        super().__init__()
        self.parts = Parts(LEVELS[1])
        size = self.parts.count * BODY.stop
        self.fields = Fields(
            *(slice(*ends) for ends in pairwise(accumulate((0, size, size, 2 * size, ROOT_SIZE, STYLE_CODE))))
        )
        inputs = JOINT_COUNT * BODY.stop + ROOT_SIZE
        self.hidden, self.code = nn.Linear(inputs, HIDDEN), nn.Linear(HIDDEN, len(PARTS) * CODE)
        self.translation = DirectionTransfer(JOINT_COUNT * BODY.stop, size)
        self.moments = nn.Parameter(torch.randn(len(PARTS), moments, CODE))
        # logarithms: of a style's poses, of the content's
        self.sharpness = nn.Parameter(torch.zeros(2, len(PARTS), 1, 1, 1))
        # logarithms: how little another way is trusted
        self.wary = nn.Parameter(torch.full((len(PARTS), ROOT_SIZE, 1), -1.5))

    @torch.no_grad()
    def begin(self, clips: Tensor) -> None:
        """Takes as moments poses of normalized clips (21, B, T, 15) drawn at random, which beats random moments by
        far."""
        codes = self.codes(clips, self.statistics(clips)).flatten(1, 2)
        chosen = torch.randperm(codes.shape[1])[: self.moments.shape[1]]
        self.moments.copy_(codes[:, chosen])
        apart = (codes[:, torch.randperm(codes.shape[1])] - codes).square().sum(-1).mean(1)
        self.sharpness.copy_((SHARPNESS / apart).log().view(-1, 1, 1, 1))

    def statistics(self, clip: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and deviation over time of a clip (21, B, T, 15): two of (21, B, 1, 12)."""
        body = clip[..., BODY]
        return body.mean(2, keepdim=True), body.var(2, keepdim=True, correction=0).add(1e-6).sqrt()

    def codes(self, motion: Tensor, statistics: tuple[Tensor, Tensor]) -> Tensor:
        """What tells the moments: (21, B, T, 15), statistics (21, B, 1, 12) -> (5, B, T, CODE)."""
        mean, deviation = statistics
        bare = (motion[..., BODY] - mean) / (deviation + QUIET)
        # who runs moves more than their own style's walk
        bare = bare / (1 + bare.square().mean((0, 3), keepdim=True)).sqrt()
        inputs = torch.cat([bare.permute(1, 2, 0, 3).flatten(2), motion[0, ..., ROOT]], dim=-1)
        return self.code(leaky(self.hidden(inputs))).unflatten(2, (len(PARTS), CODE)).permute(2, 0, 1, 3)

    def scores(self, codes: Tensor, side: int) -> Tensor:
        """(5, B, T, CODE) -> (5, B, T, moments), larger the nearer."""
        moments = self.moments[:, None]
        near = (
            2 * codes @ moments.transpose(2, 3)
            - codes.square().sum(-1, keepdim=True)
            - moments.square().sum(-1)[:, :, None]
        )
        return near * self.sharpness[side].exp()

    def style_side(self, clip: Tensor) -> PartStyle:
        """The key poses of a style clip (21, B, T, 15) of any length."""
        statistics = self.statistics(clip)
        codes = self.codes(clip, statistics)
        mean, deviation = (self._by_part(values)[:, :, 0] for values in statistics)
        poses = self._by_part(clip[..., BODY]) - mean[:, :, None]
        first = self.scores(codes, 0).softmax(dim=2).transpose(2, 3) @ poses
        table = _fitted(first, self.scores(codes, 1).softmax(dim=3), poses)
        way = clip[0, ..., ROOT].mean(1)
        code, here = self.translation.style_side(
            *(values[:, :, 0].transpose(0, 1).flatten(1) for values in statistics), way
        )
        scale = torch.cat([mean, deviation, here, *(each.expand(len(PARTS), -1, -1) for each in (way, code))], dim=2)
        none = way.new_zeros(len(PARTS), len(way), 0, ROOT_SIZE)
        return PartStyle(scale, table.flatten(2), none, none)

    def refit(self, style: PartStyle, told: Tensor, poses: Tensor) -> PartStyle:
        """The key poses changed so that moments told (5, 1, T, moments) show normalized poses (21, 1, T, 12)."""
        mean = style.scale[..., self.fields.mean][:, :, None]
        table = style.bias.unflatten(2, (told.shape[3], -1))
        return style._replace(bias=_fitted(table, told, self._by_part(poses) - mean).flatten(2))

    def take_joints(self, style: PartStyle, to: int, source: int, joints: Tensor) -> PartStyle:
        """The key poses of n clips, with those of some joints (21,) bool in clip `to` replaced by those in clip
        `source`."""
        # (5, n 12)
        taken = self._by_part(joints[:, None, None, None].expand(-1, 1, 1, BODY.stop).float())[:, 0, 0] > 0.5
        scale, table = style.scale.clone(), style.bias.unflatten(2, (self.moments.shape[1], -1)).clone()
        table[:, to] = torch.where(taken[:, None], table[:, source], table[:, to])
        for field, mask in (
            (self.fields.mean, taken),
            (self.fields.deviation, taken),
            (self.fields.here, taken.repeat(1, 2)),
        ):
            scale[:, to, field] = torch.where(mask, scale[:, source, field], scale[:, to, field])
        return style._replace(scale=scale, bias=table.flatten(2))

    def _by_part(self, values: Tensor) -> Tensor:
        """(21, B, T, 12) -> (5, B, T, n 12)"""
        return self.parts.split(values).permute(0, 2, 3, 1, 4).flatten(3)

    def wariness(self) -> Tensor:
        """(5, 3, 1) how quickly trust falls with the square of what lies between two ways: sideways, forward,
        turning."""
        return self.wary.exp().minimum(MOST_WARY.to(self.wary))

    def told(self, motion: Tensor, own: PartStyle) -> Tensor:
        """Which moments normalized motion (21, B, T, 15) in its own style passes through: (5, B, T, moments), sums of
        one."""
        mean, deviation = (
            self.parts.join(own.scale[..., field].unflatten(2, (-1, BODY.stop)).transpose(1, 2))[:, :, None]
            for field in self.fields[:2]
        )
        return self.scores(self.codes(motion, (mean, deviation)), 1).softmax(dim=3)

    def held(self, style: PartStyle, way: Tensor, known: Tensor | float = 1.0) -> tuple[Tensor, Tensor]:
        """Of a style that goes another way (B, 3): the mean, and the logarithm of what its movement is multiplied by,
        two of (5, B, n 12). known: (5, B, 1) how far translation knows that way."""
        mean, _, here, _, code = (style.scale[..., field] for field in self.fields)
        shift, gain = self.translation(code, here, way)
        return mean + known * shift, known * gain

    def forward(
        self,
        told: Tensor,
        way: Tensor,
        style: PartStyle,
        own: PartStyle,
        own_way: Tensor | None = None,
        known_way: Tensor | None = None,
        known: Tensor | float = 1.0,
    ) -> Tensor:
        """What is put on motion in its own style, going a way (B, 3), so that it wears another: told (5, B, T, moments)
        -> (21, B, T, 15).

        The style's mean posture for its own, and the style's movement, moment by moment, as far as its clip goes the
        same way over the floor: a walk says little about the moments of a step back. own_way: (B, 3) of the motion
        itself, where styled legs carry the body another way than it goes; known_way: (B, 3) what of the way translation
        knows, known: (5, B, 1) how far the way is of that kind."""
        trust = torch.exp(-((style.scale[..., self.fields.way] - way)[:, :, None].square() @ self.wariness()[:, None]))
        theirs, their_moves = self._worn(told, way if known_way is None else known_way, style, known)
        ours, our_moves = self._worn(told, way if own_way is None else own_way, own)
        poses = ours + our_moves + (theirs - ours) + trust * (their_moves - our_moves)
        poses = self.parts.join(poses.unflatten(3, (-1, BODY.stop)).permute(0, 3, 1, 2, 4))
        return torch.cat([poses, torch.zeros_like(poses[..., :ROOT_SIZE])], dim=-1)

    def _worn(self, told: Tensor, way: Tensor, clip: PartStyle, known: Tensor | float = 1.0) -> tuple[Tensor, Tensor]:
        """How a clip's parts are held going this way, (5, B, 1, n 12), and how they move, (5, B, T, n 12)."""
        mean, gain = (values[:, :, None] for values in self.held(clip, way, known))
        return mean, told @ clip.bias.unflatten(2, (told.shape[3], -1)) * gain.exp()

    def mistranslated(self, style: PartStyle, clip: Tensor) -> Tensor:
        """By how much the style, going the way of a normalized clip (21, B, T, 15) in the same style, misses how that
        is held and how lively it is: the mean over both."""
        way = clip[0, ..., ROOT].mean(1)
        mean, gain = self.held(style, way)
        wanted, lively = (self._by_part(values)[:, :, 0] for values in self.statistics(clip))
        ratio = (lively + LEAST).log() - (style.scale[..., self.fields.deviation] + LEAST).log()
        return ((mean - wanted).abs() + (gain - ratio).abs()).mean()


def _fitted(table: Tensor, told: Tensor, poses: Tensor) -> Tensor:
    """A table of key poses (5, B, moments, n 12) changed so that its clip, poses (5, B, T, n 12) told (5, B, T,
    moments) as content is, comes back as it is: means of poses move less than the poses do. Ridge regression, from the
    table given."""
    missed = told.transpose(2, 3) @ (poses - told @ table) / told.shape[2]
    together = told.transpose(2, 3) @ told / told.shape[2]
    dear = RIDGE / told.shape[3] * torch.eye(told.shape[3], device=told.device)
    return table + torch.linalg.solve(together + dear, missed)
