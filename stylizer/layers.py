"""The layers of Motion Puzzle (Jang et al. 2022, Sec. 4). Every feature map is (vertex, batch, time, channel).

With the vertex first, mixing over the graph is one matrix product, and with the channel last the temporal convolution
reads memory in order: twice as fast on a CPU as (batch, channel, time, vertex).
"""

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from stylizer.graph import Graph, pooling, unpooling

EPSILON = 1e-2  # added to variances: a standing body hardly varies, and its noise must not be blown up


def moments(x: Tensor, dims: tuple[int, ...]) -> tuple[Tensor, Tensor]:
    """Mean and variance over `dims`, kept as axes of length 1; on a CPU many times quicker than torch.var_mean."""
    mean = x.mean(dims, keepdim=True)
    return mean, (x - mean).square().mean(dims, keepdim=True)


def normalized(x: Tensor, dims: tuple[int, ...]) -> Tensor:
    """Zero mean and unit variance over `dims`, channel by channel (instance normalization, no learned affine)."""
    mean, variance = moments(x, dims)
    return (x - mean) * torch.rsqrt(variance + EPSILON)


class STConv(nn.Module):
    """Spatial-temporal graph convolution (Eq. 1, 2): own weights for each hop distance 0..K and each of `taps` samples.

    Mixing over the graph and convolving in time commute; the mixing is done on the side with fewer channels."""

    def __init__(self, graph: Graph, channels_in: int, channels_out: int, distance: int, taps: int) -> None:
        super().__init__()
        hops = distance + 1
        mixing = torch.from_numpy(graph.mixing(distance))  # (hops, V, V): target, source
        self.mix_first = channels_in <= channels_out
        if self.mix_first:  # (V hops, V): for each vertex the averages at each distance
            matrix, conv = mixing.transpose(0, 1).reshape(-1, graph.size), (channels_in * hops, channels_out)
        else:  # (V, V hops): for each vertex the sum over sources and distances
            matrix, conv = mixing.permute(1, 2, 0).reshape(graph.size, -1), (channels_in, channels_out * hops)
        self.register_buffer("matrix", matrix.contiguous(), persistent=False)
        self.hops = hops
        self.temporal = nn.Conv2d(*conv, (taps, 1), padding=(taps // 2, 0)).to(memory_format=torch.channels_last)

    def forward(self, x: Tensor) -> Tensor:
        """(V, B, T, channels_in) -> (V, B, T, channels_out)"""
        V, B, T, C = x.shape
        if self.mix_first:
            x = (self.matrix @ x.reshape(V, -1)).view(V, self.hops, B, T, C)
            return self._convolve(x.permute(0, 2, 3, 1, 4).reshape(V, B, T, -1))
        x = self._convolve(x).view(V, B, T, self.hops, -1).permute(0, 3, 1, 2, 4)
        return (self.matrix @ x.reshape(V * self.hops, -1)).view(V, B, T, -1)

    def _convolve(self, x: Tensor) -> Tensor:
        """The temporal convolution; the layout is what the library calls channels-last, so nothing is copied."""
        V, B, T, C = x.shape
        y = self.temporal(x.reshape(V * B, T, 1, C).permute(0, 3, 1, 2))
        return y.permute(0, 2, 3, 1).reshape(V, B, T, -1)


class Pool(nn.Module):
    """Part-preserving pooling: vertices along the chain and pairs of samples are averaged."""

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

    def __init__(self, coarse: Graph, fine: Graph) -> None:
        super().__init__()
        self.register_buffer("source", torch.from_numpy(unpooling(coarse, fine)).argmax(dim=1), persistent=False)

    def forward(self, x: Tensor) -> Tensor:
        """(V coarse, B, T, C) -> (V fine, B, 2 T, C)"""
        return x[self.source].repeat_interleave(2, dim=2)


class Parts(nn.Module):
    """Groups the vertices of a graph by body part and back. Parts of different length are filled up and masked."""

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


class PartStyle(NamedTuple):
    """What one level of the decoder needs to know of a style; the body part is axis 0, so parts can be mixed (Eq. 5).

    scale, bias: (5, B, C) of AdaIN; keys, values: (5, B, S, C) of the attention, S style tokens."""

    scale: Tensor
    bias: Tensor
    keys: Tensor
    values: Tensor


class BPAdaIN(nn.Module):
    """Adaptive instance normalization by body part (Eq. 8, 9): each part takes the scale and bias of its own style."""

    def __init__(self, graph: Graph, channels: int) -> None:
        super().__init__()
        self.parts = Parts(graph)
        parts = len(graph.parts)
        self.weight = nn.Parameter(torch.randn(parts, 2 * channels, 2 * channels) * (2 * channels) ** -0.5 * 0.5)
        self.bias = nn.Parameter(torch.cat([torch.ones(parts, 1, channels), torch.zeros(parts, 1, channels)], dim=2))

    def style_side(self, style: Tensor) -> tuple[Tensor, Tensor]:
        """Scale and bias, (5, B, C) each, from a style feature (V, B, S, C): affine in its mean and deviation."""
        mean, variance = self.parts.moments(self.parts.split(style))
        statistics = torch.cat([mean, (variance + 1e-5).sqrt()], dim=4)[:, 0, :, 0]  # (5, B, 2 C)
        scale, bias = (statistics @ self.weight + self.bias).chunk(2, dim=2)
        return scale, bias

    def forward(self, x: Tensor, scale: Tensor, bias: Tensor) -> Tensor:
        """(V, B, T, C) -> the same shape, with each part's mean and deviation set by the style."""
        x = self.parts.split(x)
        mean, variance = self.parts.moments(x)
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
