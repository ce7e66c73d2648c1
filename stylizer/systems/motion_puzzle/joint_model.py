"""Motion Puzzle (Jang et al., ACM TOG 41(3), 2022) at the resolution of joints: BP-AdaIN and BP-ATN on the poses
themselves.

The paper attends to features of a few averaged vertices and decodes what it finds. Here the values of the attention are
poses, so nothing has to be decoded: a style token is a body part at one instant of the style's clip; its value is the
pose of the part's joints, its key the code of the whole body at that instant. The content's code is the query. A code
is made of the newest pose with its velocities, or of several poses of the last half second (`JointConfig.lags`); it
says at which instant of a movement a body is, not in which style, because each motion is normalized by the mean and
deviation of its own style.

Motion is (joint, batch, time, number); what belongs to a body part is (part, batch, ..., n 12) of its n joints, shorter
parts filled up."""

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from sim.body.skeleton import JOINT_COUNT, PARTS
from sim.motion.features import LAYOUT
from sim.motion.gait import RUN_APART, SIDEWAYS, SLOW, TURN_UNIT
from sim.motion.thresholds import STANDING_STYLE, STYLE_WALK_OR_RUN
from stylizer.networks.graph import LEVELS
from stylizer.networks.layers import Parts, leaky, moments
from stylizer.networks.normalization import Scaled
from stylizer.systems.motion_puzzle.joint_config import JointConfig
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures

ROOT = LAYOUT["root"]
BODY = slice(0, ROOT.start)  # all but the way over the floor, which is the content's
QUIET = 0.2  # of the normalized deviation, added to a joint's own: what hardly moves says little
FAINT = 1e-6  # added to variances
GAIT_WIDTH = 1.0  # of the root of `gait_distance`, by which movements of one gait differ at most
LEGS = torch.tensor([name.endswith("leg") for name in PARTS])[:, None, None]
UPPER_SIDEWAYS = 0.45  # what another direction counts for spine and arms, which say less of it than legs
SIDEWAYS_OF_PART = torch.where(LEGS, SIDEWAYS, UPPER_SIDEWAYS)[..., 0]  # (5, 1)


class MomentEncoder(nn.Module):
    """E_c, and the key side of E_s: the code of a body at an instant, by a temporal convolution."""

    def __init__(self, config: JointConfig) -> None:
        super().__init__()
        self.lags = config.lags
        self.body = nn.Linear(JOINT_COUNT * BODY.stop, config.hidden * len(config.lags), bias=False)
        self.root = nn.Linear(ROOT.stop - ROOT.start, config.hidden)
        self.code = nn.Linear(config.hidden, config.code)

    def forward(self, motion: Tensor, mean: Tensor, deviation: Tensor, last: int) -> Tensor:
        """The codes (B, last, code), of length 1, of the last samples of normalized motion (21, B, T, 15) in a style of
        that mean and deviation, (21, B, 1, 12)."""
        given = self.body(remove_style(motion[..., BODY], mean, deviation).permute(1, 2, 0, 3).flatten(2))
        given = given.unflatten(2, (len(self.lags), -1))  # (B, T, lags, hidden)
        when = torch.arange(motion.shape[2] - last, motion.shape[2], device=motion.device)
        seen = [given[:, (when - lag).clamp(min=0), place] for place, lag in enumerate(self.lags)]
        return self._code(sum(seen), motion[0, :, -last:, ROOT])

    def at(self, poses: Tensor, mean: Tensor, deviation: Tensor) -> Tensor:
        """The codes (B, T, code) of T moments, given by the normalized poses at each lag before them, (21, B, T, lags,
        15)."""
        seen = remove_style(poses[..., BODY], mean[:, :, None], deviation[:, :, None], (0, 4))
        weight = self.body.weight.unflatten(0, (len(self.lags), -1))  # (lags, hidden, 252)
        hidden = torch.einsum("btlx,lhx->bth", seen.permute(1, 2, 3, 0, 4).flatten(3), weight)
        return self._code(hidden, poses[0, :, :, 0, ROOT])

    def _code(self, hidden: Tensor, root: Tensor) -> Tensor:
        return F.normalize(self.code(leaky(hidden + self.root(root))), dim=2)


class JointPuzzle(Scaled):
    """The whole network. The style of C clips is, with C along the batch and S tokens of n joints a part:

    mean, deviation (5, C, n 12) of its poses; own_mean (5, C, n 12), how the own style is held where it moves so; gait
    (5, C, 4), how it moves (see sim.motion.gait.with_run); keys (5, C, S, code), values (5, C, S, n 12), poses about
    the mean."""

    KIND, CONFIG = "motion-puzzle-joints", JointConfig

    def __init__(self, config: JointConfig) -> None:
        super().__init__(config)
        self.parts = Parts(LEVELS[1])
        self.moments = MomentEncoder(config)

    # The style's side, computed once a style.

    def encode_style(self, clip: Tensor, tokens: int) -> StyleFeatures:
        """The style of normalized clips (21, B, T, 15): their statistics, and as tokens their last samples."""
        mean, deviation = self.statistics(clip)
        keys = self.moments(clip[:, :, -tokens - max(self.config.lags) :], mean, deviation, tokens)
        values = self.by_part(clip[:, :, -tokens:, BODY] - mean)
        return self.style_side(mean, deviation, self.gait(clip), keys, values)

    def statistics(self, clip: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and deviation over time of a clip (21, B, T, 15): two of (21, B, 1, 12)."""
        mean, variance = moments(clip[..., BODY], (2,))
        return mean, (variance + FAINT).sqrt()

    def gait(self, motion: Tensor) -> Tensor:
        """How normalized motion (21, B, T, 15) moves: (B, 4), mean root velocity in metres and radians a second, and
        how far that is a run's."""
        velocity = motion[0, ..., ROOT].mean(1) * self.deviation[0, 0, 0, ROOT] + self.mean[0, 0, 0, ROOT]
        return torch.cat([velocity, run_share(velocity)], dim=1)

    def style_side(self, mean: Tensor, deviation: Tensor, gait: Tensor, keys: Tensor, values: Tensor) -> StyleFeatures:
        """From statistics (21, B, 1, 12), the gait (B, 4), keys (B, S, code) and values (5, B, S, n 12)."""
        deviation, mean = (self.by_part(each)[:, :, 0] for each in (deviation, mean))
        every = len(PARTS)
        return {
            "mean": mean,
            "deviation": deviation,
            "own_mean": mean,
            "gait": gait.expand(every, -1, -1),
            "keys": keys.expand(every, -1, -1, -1),
            "values": values,
        }

    def take_joints(self, style: StyleFeatures, to: int, source: int, joints: Tensor) -> StyleFeatures:
        """The style of n clips, with some joints (21,) bool of clip `to` replaced by those of clip `source`."""
        # (5, n 12)
        taken = self.by_part(joints[:, None, None, None].expand(-1, 1, 1, BODY.stop).float())[:, 0, 0] > 0.5
        result = {name: values.clone() for name, values in style.items()}
        for name, chosen in (("mean", taken), ("deviation", taken), ("own_mean", taken), ("values", taken[:, None])):
            values = result[name]
            values[:, to] = torch.where(chosen, values[:, source], values[:, to])
        return result

    # The content's side, in every frame.

    def forward(
        self, motion: Tensor, style: StyleFeatures, own: StyleFeatures, last: int, gait: Tensor | None = None
    ) -> tuple[Tensor, Tensor]:
        """The last samples of normalized motion (21, B, T, 15) in a style, and in its own: two of (21, B, last, 15),
        root velocities 0. What is put on the content is how the two differ.

        gait: (B, 4) of the bodies, see `gait`; None for what the motion says."""
        gait = self.gait(motion) if gait is None else gait
        if self.config.attention:
            query = self.queries(motion, own, last)
            # BP-ATN, Eq. 11 to 13
            moves, own_moves = (self.attention(query, each["keys"]) @ each["values"] for each in (style, own))
        else:
            own_moves = self.by_part(motion[:, :, -last:, BODY]) - own["mean"][:, :, None]
            moves = own_moves * (style["deviation"] / own["deviation"])[:, :, None]
        same = same_gait(style["gait"], gait)
        translated = own["mean"] + style["mean"] - style["own_mean"]
        styled_mean = torch.where(LEGS, torch.lerp(translated, style["mean"], same), style["mean"])
        shift = styled_mean - own["mean"]  # BP-AdaIN, Eq. 8, 9
        if not self.config.by_part:
            shift = self._over_body(shift)
        # who stands is held as the style is, wherever the arms are just now
        own_moves = moving_share(gait)[:, None] * own_moves
        moves = own_moves + (moving_share(gait) * same)[:, :, None] * (moves - own_moves)
        return self._whole((own["mean"] + shift)[:, :, None] + moves), self._whole(own["mean"][:, :, None] + own_moves)

    def queries(self, motion: Tensor, own: StyleFeatures, last: int) -> Tensor:
        """The queries (B, last, code) of the last samples of normalized motion (21, B, T, 15) in its own style."""
        return self.moments(motion, self._of_joints(own["mean"]), self._of_joints(own["deviation"]), last)

    def attention(self, query: Tensor, keys: Tensor) -> Tensor:
        """The map A of Eq. 12, (5, B, T, S), rows that add up to 1, from queries (B, T, code) and keys (5, B, S,
        code)."""
        return (self.config.sharpness * query @ keys.transpose(2, 3)).softmax(dim=3)

    def token_pose(self, style: StyleFeatures, token: int) -> Tensor:
        """The pose (21, 15) that a token of a style (a batch of 1) stands for, root velocities the mean."""
        pose = (style["mean"] + style["values"][:, :, token])[:, :, None]
        return self.restore(self._whole(pose))[0, 0]

    def by_part(self, values: Tensor) -> Tensor:
        """(21, B, T, 12) -> (5, B, T, n 12)"""
        return self.parts.split(values).permute(0, 2, 3, 1, 4).flatten(3)

    def _of_joints(self, values: Tensor) -> Tensor:
        """(5, B, n 12) -> (21, B, 1, 12)"""
        return self.parts.join(values.unflatten(2, (-1, BODY.stop)).transpose(1, 2))[:, :, None]

    def _whole(self, poses: Tensor) -> Tensor:
        """(5, B, T, n 12) -> (21, B, T, 15), root velocities 0."""
        poses = self.parts.join(poses.unflatten(3, (-1, BODY.stop)).permute(0, 3, 1, 2, 4))
        return F.pad(poses, (0, ROOT.stop - ROOT.start))

    def _over_body(self, shift: Tensor) -> Tensor:
        """One shift (5, B, n 12) for all joints of the body: the mean over them."""
        joints = self._of_joints(shift)
        return self.by_part(joints.mean(0, keepdim=True).expand_as(joints))[:, :, 0]


def remove_style(body: Tensor, mean: Tensor, deviation: Tensor, of_one: tuple[int, ...] = (0, 3)) -> Tensor:
    """Normalized poses (21, B, ..., 12) without their own style: in deviations from its mean. of_one: the axes of one
    pose, over which movement is bounded, for who runs moves more than their own style's walk."""
    moved = (body - mean) / (deviation + QUIET)
    return moved / (1 + moved.square().mean(of_one, keepdim=True)).sqrt()


def moving_share(gait: Tensor) -> Tensor:
    """How far bodies that move so, (B, 4), are no longer standing: (B, 1) in 0..1."""
    speed = gait[:, :2].norm(dim=1)[:, None]
    low, high = STANDING_STYLE
    return ((speed - low) / (high - low)).clamp(0, 1)


def run_share(velocity: Tensor) -> Tensor:
    """How far root velocities (B, 3) are a run's: (B, 1) in 0..1, as sim.motion.gait.with_run says."""
    low, high = STYLE_WALK_OR_RUN
    share = ((velocity[:, 1:2] - low) / (high - low)).clamp(0, 1)
    return share * share * (3 - 2 * share)


def same_gait(seen: Tensor, gait: Tensor) -> Tensor:
    """How far the steps of a style that was seen moving so, (5, B, 4), are those of bodies that move otherwise (B, 4):
    (5, B, 1). A slow walk does say how legs move in a quick one, but little of a run, and nothing of a step back: there
    legs keep their own steps, in a mean pose as far from their own as the style's was from the own style's where it was
    seen."""
    return torch.exp(-((gait_distance(seen, gait, SIDEWAYS_OF_PART.to(gait)) / GAIT_WIDTH**2).square()))[..., None]


def gait_distance(one: Tensor, other: Tensor, sideways: Tensor | float = SIDEWAYS) -> Tensor:
    """sim.motion.gait.gait_distance, of tensors."""
    speeds = [each[..., :2].norm(dim=-1) for each in (one, other)]
    reach = [(speed / SLOW).log1p() for speed in speeds]
    cosine = (one[..., :2] * other[..., :2]).sum(-1) / (speeds[0] * speeds[1]).clamp(min=1e-9)
    angle = cosine.clamp(-1, 1).arccos() * sideways * torch.minimum(*reach)
    turn, run = (one[..., 2:] - other[..., 2:]).unbind(-1)
    return (reach[0] - reach[1]).square() + angle.square() + (turn / TURN_UNIT).square() + (RUN_APART * run).square()
