"""The layers do what their equations say."""

import pytest
import torch

from stylizer.networks.graph import G1, G2, LEVELS
from stylizer.networks.layers import BPATN, BPAdaIN, Parts, Pool, STConv, Unpool

GRAPHS = pytest.mark.parametrize("graph", LEVELS.values(), ids=lambda graph: f"{graph.size}")


def features(graph, channels=6, batch=2, time=8, seed=0):
    return torch.randn(graph.size, batch, time, channels, generator=torch.Generator().manual_seed(seed))


def test_stconv_is_equation_1():
    conv, mixing = STConv(G2, 3, 5, distance=2, taps=3), torch.from_numpy(G2.mixing(2))
    torch.nn.init.normal_(conv.bias)
    x = features(G2, 3).requires_grad_()
    padded = torch.nn.functional.pad(x, (0, 0, 1, 1))
    taps = torch.stack([padded[:, :, k : k + 8] for k in range(3)])
    expected = torch.einsum("dij,kjbtc,dcko->ibto", mixing, taps, conv.weight.view(3, 3, 3, 5)) + conv.bias
    assert torch.allclose(conv(x), expected, atol=1e-5)
    ways_back = [torch.autograd.grad(y.square().sum(), (x, conv.weight)) for y in (conv(x), expected)]
    for ours, theirs in zip(*ways_back):
        assert torch.allclose(ours, theirs, atol=1e-4)


@GRAPHS
def test_parts_come_apart_and_together_again(graph):
    parts, x = Parts(graph), features(graph)
    assert torch.equal(parts.join(parts.split(x)), x)
    mean, variance = parts.moments(parts.split(x))
    for p, vertices in enumerate(graph.parts):
        part = x[list(vertices)]
        assert torch.allclose(mean[p, 0, :, 0], part.mean((0, 2)), atol=1e-5)
        assert torch.allclose(variance[p, 0, :, 0], part.var((0, 2), correction=0), atol=1e-5)


@GRAPHS
@pytest.mark.parametrize("statistics", [1, 2])
def test_adain_sets_the_styles_statistics(graph, statistics):
    adain = BPAdaIN(graph, 6, by_part=True, statistics=statistics)
    scale, bias = adain.style_side(features(graph, seed=1))
    mean, variance = adain.parts.moments(adain.parts.split(adain(10 * features(graph), scale, bias)))
    assert torch.allclose(mean[:, 0, :, 0], bias, atol=1e-3)
    assert torch.allclose(variance[:, 0, :, 0].sqrt(), scale.abs(), atol=1e-2)


@GRAPHS
def test_adain_over_the_whole_body_knows_no_parts(graph):
    adain = BPAdaIN(graph, 6, by_part=False, statistics=2)
    x = 10 * features(graph)
    scale, bias = adain.style_side(features(graph, seed=1))
    assert scale.shape == (5, 2, 6) and torch.equal(scale, scale[:1].expand(5, -1, -1))
    y = adain(x, scale, bias)
    assert torch.allclose(y.mean((0, 2)), bias[0], atol=1e-3)
    assert torch.allclose(y.var((0, 2), correction=0).sqrt(), scale[0].abs(), atol=1e-2)


@GRAPHS
def test_attention_rows_sum_to_one_and_stay_in_their_part(graph):
    attention = BPATN(graph, 6)
    x, style = features(graph), features(graph, time=12, seed=1)
    keys, values = attention.style_side(style)
    rows = attention.attention(x, keys).sum(-1)
    assert torch.allclose(rows, torch.ones_like(rows), atol=1e-5)
    before = attention(x, keys, values)
    values = values.clone()
    values[2] += 1.0  # the spine's style changes: nothing but the spine may
    changed = (attention(x, keys, values) - before).abs().amax((1, 2, 3)) > 1e-6
    assert set(changed.nonzero().flatten().tolist()) == set(graph.parts[2])


def test_pooling_halves_time_and_unpooling_doubles_it():
    x = features(G1)
    pooled = Pool(G1, G2)(x)
    assert pooled.shape == (10, 2, 4, 6)
    assert torch.allclose(pooled[0, :, 0], x[1:3, :, :2].mean((0, 2)), atol=1e-6)  # the left leg's first two joints
    assert Unpool(G2, G1)(pooled).shape == x.shape
