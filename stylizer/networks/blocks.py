"""The layers that the whole-body systems share: temporal and graph convolutions, AdaIN by a style code, domain
branches.

Feature maps are (vertex, batch, time, channel), as in `stylizer.networks.layers`. A temporal convolution is a graph
convolution on BODY, the skeleton as one vertex, so that one implementation serves all."""

from typing import Callable, Sequence

import numpy as np
import torch
from torch import Tensor, nn

from sim.body.skeleton import INDEX, JOINT_COUNT
from stylizer.networks.graph import LEVELS, Graph
from stylizer.networks.layers import Pool, STConv, Unpool, leaky, normalize

HIPS = INDEX["Hips"]
NEWEST = slice(-2, None)  # the samples that a live stream is made of
NEWEST_WEIGHT = 4.0  # of these, where a whole-body system rebuilds motion


class Rooted(Graph):
    """A graph whose neighbours are told apart by where they lie (Yan et al. 2018; Park et al. 2021, Eq. 1)."""

    def mixing(self, distance: int = 2) -> np.ndarray:
        """(distance + 1, V, V): label 0 takes the vertex itself, 1 averages its neighbours nearer to the hips, 2 the
        others."""
        hops = self.hops()
        depth = hops[next(v for v, group in enumerate(self.groups) if HIPS in group)]
        nearer = depth[None] < depth[:, None]
        labels = [hops == 0, (hops == 1) & nearer, (hops == 1) & ~nearer][: distance + 1]
        matrices = np.stack(labels).astype(np.float32)
        return matrices / np.maximum(matrices.sum(axis=2, keepdims=True), 1.0)


BODY = Rooted((tuple(range(JOINT_COUNT)),), ((0,),))
ROOTED = {level: Rooted(graph.groups, graph.parts) for level, graph in LEVELS.items()}


def conv(graph: Graph, channels_in: int, channels_out: int, taps: int) -> STConv:
    """A spatial-temporal convolution; on BODY there are no neighbours, and it is a temporal one."""
    return STConv(graph, channels_in, channels_out, 2 if graph.size > 1 else 0, taps)


def stack(widths: Sequence[int], taps: int) -> nn.ModuleList:
    """Temporal convolutions from one width to the next."""
    return nn.ModuleList(conv(BODY, a, b, taps) for a, b in zip(widths, widths[1:]))


def halving() -> Pool:
    """Pairs of samples become one, on BODY."""
    return Pool(BODY, BODY)


def doubling() -> Unpool:
    """Each sample becomes two, on BODY."""
    return Unpool(BODY, BODY)


def whole(motion: Tensor) -> Tensor:
    """Joints (21, B, T, C) side by side in one vertex: (1, B, T, 21 C)."""
    return motion.permute(1, 2, 0, 3).flatten(2)[None]


def by_joint(x: Tensor) -> Tensor:
    """The inverse of `whole`."""
    return x[0].unflatten(2, (JOINT_COUNT, -1)).permute(2, 0, 1, 3)


def for_each(x: Tensor, codes: Tensor) -> Tensor:
    """A feature (V, B, T, C) of B motions once for each style that they are wanted in: (V, n B, T, C) for codes (n B,
    code)."""
    return x.repeat(1, len(codes) // x.shape[1], 1, 1)


def newest(motion: Tensor, weight: float = NEWEST_WEIGHT) -> Tensor:
    """(T, 1) of mean 1 for motion (V, B, T, C): the NEWEST samples count `weight` times as much as the others."""
    time = torch.ones(motion.shape[2], 1, device=motion.device)
    time[NEWEST] = weight
    return time / time.mean()


class Plain(nn.Module):
    """No normalization."""

    def forward(self, x: Tensor, code: Tensor | None = None) -> Tensor:
        return x


class InstanceNorm(nn.Module):
    """Zero mean and unit variance over vertices and time, channel by channel: what takes the style out of the
    content."""

    def forward(self, x: Tensor, code: Tensor | None = None) -> Tensor:
        return normalize(x, (0, 2))


class AdaIN(nn.Module):
    """Adaptive instance normalization (Huang & Belongie 2017): mean and deviation of each channel are what a style code
    says."""

    def __init__(self, code: int, channels: int) -> None:
        super().__init__()
        self.affine = nn.Linear(code, 2 * channels)
        # the library's would let codes matter too little to be learned
        nn.init.normal_(self.affine.weight, std=code**-0.5)

    def forward(self, x: Tensor, code: Tensor) -> Tensor:
        """(V, B, T, C), (B, code) -> (V, B, T, C)"""
        scale, bias = self.affine(code)[None, :, None].chunk(2, dim=3)
        return normalize(x, (0, 2)) * (1 + scale) + bias


class ResBlock(nn.Module):
    """Two convolutions, each after normalization and activation, round which the feature passes on (He et al. 2016).

    norm: makes the normalization of so many channels, such as `InstanceNorm` or AdaIN of a code. coarse: the graph that
    the feature is pooled to between the convolutions, the second of which then widens it (Choi et al. 2020)."""

    def __init__(
        self,
        graph: Graph,
        channels_in: int,
        channels_out: int,
        taps: int,
        norm: Callable[[int], nn.Module] = lambda channels: Plain(),
        coarse: Graph | None = None,
    ) -> None:
        super().__init__()
        between = channels_in if coarse else channels_out
        self.norm1, self.conv1 = norm(channels_in), conv(graph, channels_in, between, taps)
        self.norm2, self.conv2 = norm(between), conv(coarse or graph, between, channels_out, taps)
        self.pool = Pool(graph, coarse) if coarse else nn.Identity()
        self.shortcut = (
            nn.Identity() if channels_in == channels_out else nn.Linear(channels_in, channels_out, bias=False)
        )

    def forward(self, x: Tensor, code: Tensor | None = None) -> Tensor:
        """(V, B, T, channels_in) -> (V, B, T, channels_out), or pooled (V coarse, B, T / 2, channels_out)."""
        y = self.pool(self.conv1(leaky(self.norm1(x, code))))
        y = self.conv2(leaky(self.norm2(y, code)))
        return (self.shortcut(self.pool(x)) + y) * 0.5**0.5  # as large as either


class DomainHead(nn.Module):
    """Linear branches, one for each domain (multi-task learning of Liu et al. 2019 and Choi et al. 2020)."""

    def __init__(self, channels: int, domains: int, size: int) -> None:
        super().__init__()
        self.domains, self.size = domains, size
        self.branches = nn.Linear(channels, domains * size)

    def forward(self, feature: Tensor, domain: Tensor) -> Tensor:
        """(B, channels), (B,) which branch -> (B, size)"""
        every = self.branches(feature).view(-1, self.domains, self.size)
        return every[torch.arange(len(every), device=every.device), domain]


def pool(x: Tensor) -> Tensor:
    """(V, B, T, C) -> (B, V C): the mean over time, vertices side by side."""
    return x.mean(dim=2).transpose(0, 1).flatten(1)
