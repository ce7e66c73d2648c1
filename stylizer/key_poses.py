"""Key poses: what a style looks like at the moments that movements have in common, put straight on the decoder's answer.

The attention of BP-ATN (Jang et al. 2022, Sec. 4.4) at the resolution of joints: each body part has MOMENTS that it learned to
tell, most of them steps of a gait. A style clip says how the part is held in each of them (its key poses), the content says which
moment it is in, and so the style's own pose for that moment arrives without passing through two averaged vertices a part. Two
styles have their key poses for the same moments, so they can be blended, and what a style has in common with the content's own
cancels exactly.
"""

import math

import torch
from torch import Tensor, nn

from sim.features import LAYOUT
from sim.skeleton import JOINT_COUNT, PARTS
from stylizer.graph import LEVELS
from stylizer.layers import Parts, PartStyle, leaky

BODY = slice(0, LAYOUT["root"].start)  # all but the way over the floor, which is the content's
ROOT = LAYOUT["root"]
ROOT_SIZE = ROOT.stop - ROOT.start
HIDDEN, CODE = 96, 16  # units of the network that tells moments, and of the code it tells them by
WAYS = 32  # units of the network that tells what is usual on a way
QUIET = 0.2  # of the normalized deviation, added to a joint's own: what hardly moves tells little
MOST_GAIN = 2.0  # what the moments' average has lost of a joint's liveliness is given back up to this
# Sideways, forward, turning: how little another way may be trusted at most. A slow walk does say how legs move in a quick one;
# learning alone, whose loss is fond of medians, makes legs hardly ever listen to it.
MOST_WARY = torch.tensor([math.inf, 0.3, math.inf])[:, None]
SHARPNESS = 10.0  # how surely moments are told at first: minus the score at the mean distance of two poses' codes


class KeyPoses(nn.Module):
    """The moments of five body parts, and what tells them from a whole body without its style.

    A pose loses its style by its clip's own statistics: mean and deviation of every joint. As a `PartStyle` a clip's key poses
    are: bias, the flattened table (5, B, moments n 12) of n joints a part; scale, (5, B, 3 n 12 + 3), those statistics, what
    is usual on the clip's mean way over the floor, and that way; no tokens."""

    def __init__(self, moments: int) -> None:
        super().__init__()
        self.parts = Parts(LEVELS[1])
        size = self.parts.count * BODY.stop
        self.fields = [*(slice(i * size, (i + 1) * size) for i in range(3)), slice(3 * size, None)]  # of scale, as said above
        inputs = JOINT_COUNT * BODY.stop + ROOT_SIZE
        self.hidden, self.code = nn.Linear(inputs, HIDDEN), nn.Linear(HIDDEN, len(PARTS) * CODE)
        self.usual = nn.Sequential(nn.Linear(ROOT_SIZE, WAYS), nn.LeakyReLU(0.2), nn.Linear(WAYS, JOINT_COUNT * BODY.stop))
        self.moments = nn.Parameter(torch.randn(len(PARTS), moments, CODE))
        nn.init.zeros_(self.usual[-1].weight)
        self.sharpness = nn.Parameter(torch.zeros(2, len(PARTS), 1, 1, 1))  # logarithms: of a style's poses, of the content's
        self.wary = nn.Parameter(torch.full((len(PARTS), ROOT_SIZE, 1), -1.5))  # logarithms: how little another way is trusted

    @torch.no_grad()
    def begin(self, clips: Tensor) -> None:
        """Takes as moments poses of normalized clips (21, B, T, 15) drawn at random, which beats random moments by far."""
        codes = self.codes(clips, self.statistics(clips)).flatten(1, 2)
        chosen = torch.randperm(codes.shape[1])[:self.moments.shape[1]]
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
        bare = bare / (1 + bare.square().mean((0, 3), keepdim=True)).sqrt()  # who runs moves more than their own style's walk
        inputs = torch.cat([bare.permute(1, 2, 0, 3).flatten(2), motion[0, ..., ROOT]], dim=-1)
        return self.code(leaky(self.hidden(inputs))).unflatten(2, (len(PARTS), CODE)).permute(2, 0, 1, 3)

    def scores(self, codes: Tensor, side: int) -> Tensor:
        """(5, B, T, CODE) -> (5, B, T, moments), larger the nearer."""
        moments = self.moments[:, None]
        near = 2 * codes @ moments.transpose(2, 3) - codes.square().sum(-1, keepdim=True) - moments.square().sum(-1)[:, :, None]
        return near * self.sharpness[side].exp()

    def style_side(self, clip: Tensor) -> PartStyle:
        """The key poses of a style clip (21, B, T, 15) of any length."""
        statistics = self.statistics(clip)
        codes = self.codes(clip, statistics)
        poses = self.parts.split(clip[..., BODY]).permute(0, 2, 3, 1, 4).flatten(3)  # (5, B, T, n 12)
        table = _lively(self.scores(codes, 0).softmax(dim=2).transpose(2, 3) @ poses, self.scores(codes, 1).softmax(dim=3), poses)
        way = clip[0, ..., ROOT].mean(1)
        usual = self.usual(way).unflatten(1, (JOINT_COUNT, 1, -1)).transpose(0, 1)
        scale = [self.parts.split(values)[:, :, :, 0].transpose(1, 2).flatten(2) for values in (*statistics, usual)]
        way = way.expand(len(PARTS), -1, -1)
        none = way[:, :, None][:, :, :0]
        return PartStyle(torch.cat([*scale, way], dim=2), table.flatten(2), none, none)

    def wariness(self) -> Tensor:
        """(5, 3, 1) how quickly trust falls with the square of what lies between two ways: sideways, forward, turning."""
        return self.wary.exp().minimum(MOST_WARY.to(self.wary))

    def told(self, motion: Tensor, own: PartStyle) -> Tensor:
        """Which moments normalized motion (21, B, T, 15) in its own style passes through: (5, B, T, moments), sums of one."""
        mean, deviation = (self.parts.join(own.scale[..., field].unflatten(2, (-1, BODY.stop)).transpose(1, 2))[:, :, None]
                           for field in self.fields[:2])
        return self.scores(self.codes(motion, (mean, deviation)), 1).softmax(dim=3)

    def forward(self, told: Tensor, style: PartStyle, own: PartStyle) -> Tensor:
        """What is put on motion in its own style so that it wears another: told (5, B, T, moments) -> (21, B, T, 15).

        The style's poses for its own ones, moment by moment as far as both clips go the same way over the floor; a walk says
        little about the moments of a step back, and then no more than the mean posture is exchanged. What is usual on the one
        way and not on the other is no style: who turns leans, whatever they wear."""
        usual, way = ((style.scale[..., field] - own.scale[..., field])[:, :, None] for field in self.fields[2:])
        trust = torch.exp(-(way.square() @ self.wariness()[:, None]))  # (5, B, 1, 1)
        shares = trust * told + (1 - trust) / told.shape[3]
        theirs, ours = (clip.bias.unflatten(2, (told.shape[3], -1)) for clip in (style, own))  # (5, B, moments, n 12)
        poses = told @ ours + shares @ (theirs - ours) - usual
        poses = self.parts.join(poses.unflatten(3, (-1, BODY.stop)).permute(0, 3, 1, 2, 4))
        return torch.cat([poses, torch.zeros_like(poses[..., :ROOT_SIZE])], dim=-1)


def _lively(table: Tensor, told: Tensor, poses: Tensor) -> Tensor:
    """A table of key poses (5, B, moments, n 12) drawn away from their mean so far that its clip, poses (5, B, T, n 12) told
    (5, B, T, moments) as content is, comes back as lively as it is: a mean of poses moves less than any of them."""
    rebuilt = told @ table
    gain = (_deviations(poses) / _deviations(rebuilt)).clamp(1.0, MOST_GAIN)
    mean = rebuilt.mean(2, keepdim=True)
    return mean + (table - mean) * gain


def _deviations(poses: Tensor) -> Tensor:
    """(5, B, T, n 12) -> (5, B, 1, n 12) deviation over time, for each joint one."""
    by_joint = poses.var(2, keepdim=True, correction=0).unflatten(3, (-1, BODY.stop))
    return by_joint.mean(-1, keepdim=True).expand_as(by_joint).flatten(3).add(1e-6).sqrt()
