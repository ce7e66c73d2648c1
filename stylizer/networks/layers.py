"""The layers of Motion Puzzle (Jang et al. 2022, Sec. 4). Every feature map is (vertex, batch, time, channel).

With the vertex first, mixing over the graph is one matrix product, and with the channel last the temporal convolution
reads memory in order: twice as fast on a CPU as (batch, channel, time, vertex).
"""

from typing import Any, NamedTuple, TypeVar

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from stylizer.networks.graph import Graph, pooling, unpooling

M = TypeVar("M", bound=nn.Module)
EPSILON = 1e-2  # added to variances: a standing body hardly varies, and its noise must not be blown up


def of_kind(kind: type[M], module: object) -> M:
    """The module, which is one of that kind: what torch keeps in its containers has no type."""
    assert isinstance(module, kind)
    return module


def moments(x: Tensor, dims: tuple[int, ...]) -> tuple[Tensor, Tensor]:
    """Mean and variance over `dims`, kept as axes of length 1; on a CPU many times quicker than torch.var_mean."""
    mean = x.mean(dims, keepdim=True)
    return mean, (x - mean).square().mean(dims, keepdim=True)


def normalize(x: Tensor, dims: tuple[int, ...]) -> Tensor:
    """Zero mean and unit variance over `dims`, channel by channel (instance normalization, no learned affine)."""
    mean, variance = moments(x, dims)
    return (x - mean) * torch.rsqrt(variance + EPSILON)


class _SumOfTaps(torch.autograd.Function):
    """(V, B, T, taps, C) -> (V, B, T, C): sample t sums tap k of sample t + k - taps // 2, nothing beyond the ends.

    Written out because the library's own way back through such slices copies the whole array once a tap."""

    @staticmethod
    def forward(ctx: Any, x: Tensor) -> Tensor:
        ctx.taps = x.shape[3]
        padded = F.pad(x, (0, 0, 0, 0, ctx.taps // 2, ctx.taps // 2))
        by_part, by_batch, by_time, by_tap, by_channel = padded.stride()
        return padded.as_strided(x.shape, (by_part, by_batch, by_time, by_time + by_tap, by_channel)).sum(dim=3)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> Tensor:
        half, time = ctx.taps // 2, gradient.shape[2]
        padded = F.pad(gradient, (0, 0, half, half))
        return torch.stack([padded[:, :, 2 * half - k : 2 * half - k + time] for k in range(ctx.taps)], dim=3)


class STConv(nn.Module):
    """Spatial-temporal graph convolution (Eq. 1, 2): own weights for each hop distance 0..K and each of `taps` samples.

    Neighbours are averaged first; then one matrix product makes what every sample gives to each of its neighbours in
    time, and these are summed. On a CPU that is two to four times as quick as the library's convolution, in training
    too."""

    matrix: Tensor

    def __init__(self, graph: Graph, channels_in: int, channels_out: int, distance: int, taps: int) -> None:
        super().__init__()
        self.hops, self.taps = distance + 1, taps
        mixing = torch.from_numpy(graph.mixing(distance))  # (hops, V, V): target, source
        self.register_buffer("matrix", mixing.transpose(0, 1).reshape(-1, graph.size).contiguous(), persistent=False)
        self.weight = nn.Parameter(torch.empty(self.hops * channels_in, taps * channels_out))
        self.bias = nn.Parameter(torch.zeros(channels_out))
        bound = (6 / (self.hops * taps * channels_in)) ** 0.5  # He et al. 2015: features keep their size on the way
        nn.init.uniform_(self.weight, -bound, bound)

    def forward(self, x: Tensor) -> Tensor:
        """(V, B, T, channels_in) -> (V, B, T, channels_out)"""
        V, B, T, C = x.shape
        x = (self.matrix @ x.reshape(V, -1)).view(V, self.hops, B, T, C).permute(0, 2, 3, 1, 4).reshape(V, B, T, -1)
        return _SumOfTaps.apply((x @ self.weight).view(V, B, T, self.taps, -1)) + self.bias


class JointLinear(nn.Module):
    """A linear layer with weights of its own for each vertex: a graph convolution hardly knows an elbow from a
    wrist."""

    def __init__(self, vertices: int, channels_in: int, channels_out: int) -> None:
        super().__init__()
        bound = channels_in**-0.5
        self.weight = nn.Parameter(torch.empty(vertices, channels_in, channels_out).uniform_(-bound, bound))
        self.bias = nn.Parameter(torch.zeros(vertices, 1, channels_out))

    def forward(self, x: Tensor) -> Tensor:
        """(V, B, T, channels_in) -> (V, B, T, channels_out)"""
        return torch.baddbmm(self.bias, x.flatten(1, 2), self.weight).view(*x.shape[:3], -1)


class Pool(nn.Module):
    """Part-preserving pooling: vertices along the chain and pairs of samples are averaged."""

    matrix: Tensor

    def __init__(self, fine: Graph, coarse: Graph) -> None:
        super().__init__()
        self.register_buffer("matrix", torch.from_numpy(pooling(fine, coarse)), persistent=False)

    def forward(self, x: Tensor) -> Tensor:
        """(V fine, B, T, C) -> (V coarse, B, T / 2, C)"""
        V, B, T, C = x.shape
        x = (self.matrix @ x.reshape(V, -1)).view(-1, B, T // 2, 2, C)
        return (x[:, :, :, 0] + x[:, :, :, 1]) * 0.5


class Unpool(nn.Module):
    """The way back: each vertex and each sample is repeated for those it was pooled from."""

    source: Tensor

    def __init__(self, coarse: Graph, fine: Graph) -> None:
        super().__init__()
        self.register_buffer("source", torch.from_numpy(unpooling(coarse, fine)).argmax(dim=1), persistent=False)

    def forward(self, x: Tensor) -> Tensor:
        """(V coarse, B, T, C) -> (V fine, B, 2 T, C)"""
        return x[self.source].repeat_interleave(2, dim=2)


class Parts(nn.Module):
    """Groups the vertices of a graph by body part and back. Parts of different length are filled up and masked."""

    table: Tensor
    mask: Tensor
    back: Tensor

    def __init__(self, graph: Graph) -> None:
        super().__init__()
        table = torch.from_numpy(graph.part_table())  # (5, n)
        self.even = bool((table >= 0).all())
        self.count = table.shape[1]
        order = torch.arange(graph.size) if self.even else table.clamp(min=0).flatten()
        self.register_buffer("table", order, persistent=False)
        self.register_buffer("mask", (table >= 0).float()[:, None, :, None], persistent=False)  # (5, 1, n, 1)
        back = torch.empty(graph.size, dtype=torch.long)
        back[table[table >= 0]] = torch.nonzero(table.flatten() >= 0).flatten()
        self.register_buffer("back", back, persistent=False)

    def split(self, x: Tensor) -> Tensor:
        """(V, B, T, C) -> (5, n, B, T, C)"""
        x = x if self.even else x[self.table]
        return x.view(len(self.mask), self.count, *x.shape[1:])

    def join(self, x: Tensor) -> Tensor:
        """(5, n, B, T, C) -> (V, B, T, C)"""
        x = x.reshape(-1, *x.shape[2:])
        return x if self.even else x[self.back]

    def moments(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and variance over each part's vertices and time: (5, n, B, T, C) -> two of (5, 1, B, 1, C)."""
        if self.even:
            return moments(x, (1, 3))
        weight = (self.mask / self.mask.sum(2, keepdim=True) / x.shape[3]).view(len(self.mask), self.count, 1, 1, 1)
        mean = (x * weight).sum((1, 3), keepdim=True)
        return mean, ((x - mean).square() * weight).sum((1, 3), keepdim=True)


class BlockFeatures(NamedTuple):
    """What one level of the decoder needs to know of a style; the body part is axis 0, so parts can be mixed (Eq. 5).

    scale, bias: (5, B, C) of AdaIN; keys, values: (5, B, S, C) of the attention, S style tokens."""

    scale: Tensor
    bias: Tensor
    keys: Tensor
    values: Tensor


class BPAdaIN(nn.Module):
    """Adaptive instance normalization by body part (Eq. 8, 9): each part takes the scale and bias of its own style.

    by_part=False is the ablation of Sec. 7.2: one normalization, one scale and bias for the whole body. statistics: 1
    makes them of the style's mean alone, 2 of its mean and deviation over vertices and time."""

    def __init__(self, graph: Graph, channels: int, by_part: bool, statistics: int) -> None:
        super().__init__()
        self.parts = Parts(graph)
        self.by_part, self.statistics = by_part, statistics
        parts, inputs = len(graph.parts) if by_part else 1, statistics * channels
        self.weight = nn.Parameter(torch.randn(parts, inputs, 2 * channels) * inputs**-0.5 * 0.5)
        self.bias = nn.Parameter(torch.cat([torch.ones(parts, 1, channels), torch.zeros(parts, 1, channels)], dim=2))

    def _moments(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Of a feature (5, n, B, T, C), over each part or over the whole body: two of (5 or 1, 1, B, 1, C)."""
        mean, variance = self.parts.moments(x)
        if self.by_part:
            return mean, variance
        share = (self.parts.mask / self.parts.mask.sum()).sum(2).view(-1, 1, 1, 1, 1)  # of the vertices, by part
        whole = (mean * share).sum(0, keepdim=True)
        return whole, ((variance + (mean - whole).square()) * share).sum(0, keepdim=True)

    def style_side(self, style: Tensor) -> tuple[Tensor, Tensor]:
        """Scale and bias, (5, B, C) each, from a style feature (V, B, S, C): affine in its statistics."""
        mean, variance = self._moments(self.parts.split(style))
        # (5, B, 1 or 2 C)
        statistics = torch.cat([mean, (variance + 1e-5).sqrt()][: self.statistics], dim=4)[:, 0, :, 0]
        affine = statistics @ self.weight + self.bias
        scale, bias = affine.expand(len(self.parts.mask), -1, -1).chunk(2, dim=2)
        return scale, bias

    def forward(self, x: Tensor, scale: Tensor, bias: Tensor) -> Tensor:
        """(V, B, T, C) -> the same shape, with each part's mean and deviation set by the style."""
        x = self.parts.split(x)
        mean, variance = self._moments(x)
        gain = scale[:, None, :, None] * torch.rsqrt(variance + EPSILON)
        return self.parts.join(x * gain + (bias[:, None, :, None] - mean * gain))


class BPATN(nn.Module):
    """Attention by body part (Eq. 11 to 13): every content token looks up the style tokens of its own part.

    A token is one vertex at one sample. The paper convolves the looked-up values once more; attention rows sum to one,
    so that product of two linear maps is the one linear map `value` here."""

    def __init__(self, graph: Graph, channels: int) -> None:
        super().__init__()
        self.parts = Parts(graph)
        self.query = nn.Linear(channels, channels)  # n of Eq. 12
        self.key = nn.Linear(channels, channels)  # m of Eq. 12
        self.value = nn.Linear(channels, channels)  # l of Eq. 13

    def _tokens(self, x: Tensor) -> Tensor:
        """(5, n, B, T, C) -> (5, B, n T, C)"""
        return x.transpose(1, 2).flatten(2, 3)

    def _normalized(self, x: Tensor) -> Tensor:
        mean, variance = self.parts.moments(x)
        return (x - mean) * torch.rsqrt(variance + EPSILON)

    def style_side(self, style: Tensor) -> tuple[Tensor, Tensor]:
        """Keys and values (5, B, S, C) of a style feature (V, B, T, C); fillers of short parts stay unreachable."""
        x = self.parts.split(style)
        keys, values = self.key(self._tokens(self._normalized(x))), self.value(self._tokens(x))
        return keys * keys.shape[-1] ** -0.5, values

    def attention(self, x: Tensor, keys: Tensor) -> Tensor:
        """The map A of Eq. 12, (5, B, content tokens, style tokens), from a content feature (V, B, T, C)."""
        score = self.query(self._tokens(self._normalized(self.parts.split(x)))) @ keys.transpose(2, 3)
        if not self.parts.even:
            time = keys.shape[2] // self.parts.count
            filler = (self.parts.mask == 0).flatten(1).repeat_interleave(time, dim=1)
            score = score.masked_fill(filler[:, None, None], -torch.inf)
        return score.softmax(dim=3)

    def forward(self, x: Tensor, keys: Tensor, values: Tensor) -> Tensor:
        """(V, B, T, C) -> the same shape (Eq. 13)."""
        V, B, T, C = x.shape
        found = (self.attention(x, keys) @ values).view(len(keys), B, -1, T, C).transpose(1, 2)
        return x + self.parts.join(found)


def leaky(x: Tensor) -> Tensor:
    return F.leaky_relu(x, 0.2)
