"""The slim network as it runs live: only the last sample, in numpy, equal to stylizer.systems.motion_puzzle.model up to
rounding.

A window is so little work that calling the library costs more than computing: this does the same in half as many and
far cheaper calls. Feature maps are (batch, vertex, time, channel) here, so that moments and tokens of a part lie
together."""

from typing import Callable, Mapping

import numpy as np
import torch

from sim.body.skeleton import PARTS
from stylizer.networks.layers import EPSILON, JointLinear, Pool, STConv, Unpool, of_kind
from stylizer.systems.motion_puzzle.config import Config
from stylizer.systems.motion_puzzle.model import ROOT, BPStyleNet, MotionPuzzle, PlainBlock, RootCondition
from stylizer.systems.motion_puzzle.style_tensors import NumpyFeatures, StyleFeatures, to_tensors

Condition = tuple[np.ndarray | float, np.ndarray | float]  # what is added to scale and bias


class TorchInference:
    """The network for the live stylizer, whatever its configuration."""

    def __init__(self, model: MotionPuzzle) -> None:
        self.model = model

    def prepare(self, style: NumpyFeatures) -> StyleFeatures:
        """A style as the network takes it; to be prepared anew where its numbers change."""
        return to_tensors(style)

    @torch.inference_mode()
    def change(self, windows: np.ndarray, style: StyleFeatures, own: StyleFeatures) -> np.ndarray:
        """By how much the last sample of windows of features (batch, samples, 21, 15) changes from their own style to
        another: features (batch, 21, 15)."""
        model = self.model
        motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
        content = model.content_encoder(motion)
        if not model.config.residual_output:
            (output,) = model.decode_styles(motion, content, [style], last=1)
            return self._features(output) - windows[:, -1]
        styled, rebuilt = map(self._features, model.decode_styles(motion, content, [style, own], last=1))
        return styled - rebuilt

    def _features(self, motion: torch.Tensor) -> np.ndarray:
        """Of normalized motion (21, batch, 1, 15): features (batch, 21, 15)."""
        return self.model.restore(motion)[:, 0].double().numpy()


def to_inference(model: MotionPuzzle) -> "TorchInference | FastInference":
    """The quick one for a network of the shape that is shipped; another one runs as it is."""
    return FastInference(model) if FastInference.fits(model.config) else TorchInference(model)


class FastInference:
    """A network of the shape that is shipped, made for speed."""

    def __init__(self, model: MotionPuzzle) -> None:
        """model: one that `fits`."""
        encoder, decoder = model.content_encoder, model.decoder
        self.mean, self.deviation = (values.numpy()[:, 0, 0] for values in (model.mean, model.deviation))
        self.stem, self.head = _end(encoder.stem), _end(decoder.head)
        self.convs = [_Conv(of_kind(STConv, conv)) for conv in encoder.convs]
        self.pools = [_Pool(of_kind(Pool, pool)) for pool in encoder.pools[1:]]
        self.nets = [_StyleNet(of_kind(BPStyleNet, decoder.blocks[level])) for level in ("3", "2")]
        self.sources = [of_kind(Unpool, decoder.unpools[level]).source.numpy() for level in ("3", "2")]
        last = of_kind(PlainBlock, decoder.blocks["1"])
        self.last = _LastConv(last.conv)
        # last samples of level 2 that the last of level 1 can see
        self.needed = (1 + last.reach + 1) // 2
        self.root_condition = _RootCondition(model.root_condition) if model.root_condition else None

    @staticmethod
    def fits(config: Config) -> bool:
        return (
            not config.residual_taps
            and config.style_levels == (3, 2)
            and config.by_part
            and config.attention
            and config.residual_output
        )

    def prepare(self, style: NumpyFeatures) -> NumpyFeatures:
        """As TorchInference.prepare."""
        return style

    def change(self, windows: np.ndarray, style: NumpyFeatures, own: NumpyFeatures) -> np.ndarray:
        """As TorchInference.change."""
        motion = np.ascontiguousarray(((windows - self.mean) / self.deviation).swapaxes(1, 2), dtype=np.float32)
        styles = [style, own]
        conditions: Mapping[int, Condition] = {3: (0.0, 0.0), 2: (0.0, 0.0)}
        if self.root_condition:
            conditions = self.root_condition(motion)
        x = self._encoded(motion)[None].repeat(len(styles), axis=0)
        for level, net, source in zip((3, 2), self.nets, self.sources):
            x = net(x, level, styles, conditions[level], self.needed if level == 2 else None)
            x = x[:, source].repeat(2, axis=2).reshape(len(styles), len(windows), len(source), -1, x.shape[-1])
        x = self.head(_leaky(self.last(_leaky(x.reshape(-1, *x.shape[2:])))[:, :, None]))
        styled, rebuilt = x.reshape(len(styles), len(windows), *self.mean.shape)
        return ((styled - rebuilt) * self.deviation).astype(float)

    def _encoded(self, motion: np.ndarray) -> np.ndarray:
        """The content feature (batch, 5, T / 4, C3) of normalized motion (batch, 21, T, 15)."""
        x = self.stem(motion)
        for pool, conv in zip((None, *self.pools), self.convs):
            x = pool(x) if pool else x
            batch, vertices, time, channels = x.shape
            centred, deviation = _centred(x.reshape(batch, vertices * time, channels))
            x = _leaky(conv((centred / deviation).reshape(x.shape)))
        return x


class _Linear:
    def __init__(self, layer: torch.nn.Linear) -> None:
        self.weight, self.bias = layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy()

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return (x.reshape(-1, x.shape[-1]) @ self.weight + self.bias).reshape(*x.shape[:-1], -1)


class _JointLinear:
    """stylizer.networks.layers.JointLinear."""

    def __init__(self, layer: JointLinear) -> None:
        self.weight, self.bias = layer.weight.detach().numpy(), layer.bias.detach().numpy()

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return x @ self.weight + self.bias


def _end(layer: JointLinear | torch.nn.Linear) -> Callable[[np.ndarray], np.ndarray]:
    """The 1x1 convolution at either end of the network."""
    return _JointLinear(layer) if isinstance(layer, JointLinear) else _Linear(layer)


class _Pool:
    """stylizer.networks.layers.Pool."""

    def __init__(self, pool: Pool) -> None:
        self.matrix = 0.5 * pool.matrix.numpy()

    def __call__(self, x: np.ndarray) -> np.ndarray:
        batch, vertices, time, channels = x.shape
        x = (self.matrix @ x.reshape(batch, vertices, -1)).reshape(batch, -1, time // 2, 2, channels)
        return x[:, :, :, 0] + x[:, :, :, 1]


class _Conv:
    """stylizer.networks.layers.STConv."""

    def __init__(self, conv: STConv) -> None:
        self.hops, self.taps, self.mixing = conv.hops, conv.taps, conv.matrix.numpy()
        self.weight, self.bias = conv.weight.detach().contiguous(), conv.bias.detach().numpy()

    def mixed(self, x: np.ndarray) -> np.ndarray:
        """(batch, V, T, C) -> what each vertex sees of its neighbours, (batch, V, T, hops C)."""
        batch, vertices, time, channels = x.shape
        x = (self.mixing @ x.reshape(batch, vertices, -1)).reshape(batch, vertices, self.hops, time, channels)
        return x.swapaxes(2, 3).reshape(batch, vertices, time, -1)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """(batch, V, T, channels in) -> (batch, V, T, channels out)"""
        time, middle = x.shape[2], self.taps // 2
        given = _product(self.mixed(x), self.weight)  # what every sample gives to each of its neighbours in time
        given = given.reshape(*x.shape[:3], self.taps, -1)
        result = given[:, :, :, middle] + self.bias
        for away in range(1, min(middle + 1, time)):
            result[:, :, :-away] += given[:, :, away:, middle + away]
            result[:, :, away:] += given[:, :, :-away, middle - away]
        return result


class _LastConv(_Conv):
    """Of a convolution its last sample alone, whose later taps see nothing."""

    def __init__(self, conv: STConv) -> None:
        super().__init__(conv)
        self.seen = self.taps // 2 + 1
        by_tap = self.weight.view(len(self.weight), self.taps, -1)[:, : self.seen].transpose(0, 1)
        self.weight = by_tap.reshape(-1, by_tap.shape[-1]).contiguous()

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """(batch, V, T, channels in) -> (batch, V, channels out)"""
        seen = self.mixed(x[:, :, -self.seen :])
        return _product(seen.reshape(*seen.shape[:2], -1), self.weight) + self.bias


class _StyleNet:
    """stylizer.systems.motion_puzzle.model.BPStyleNet, of several styles (styles, batch, V, T, C) at once."""

    def __init__(self, net: BPStyleNet) -> None:
        assert net.attention is not None
        self.conv1, self.conv2, self.query = _Conv(net.conv1), _Conv(net.conv2), _Linear(net.attention.query)
        self.reach = net.reach

    def __call__(
        self, x: np.ndarray, level: int, styles: list[NumpyFeatures], conditions: Condition, last: int | None
    ) -> np.ndarray:
        """level: the number of this block; conditions: what the root velocity adds to scale and bias. -> (styles batch,
        V, T, C), the `last` samples alone where they are given."""
        shape = x.shape
        by_part = (*shape[:2], len(PARTS), -1, shape[-1])
        scale, bias = (
            np.array([style[f"{level}.{key}"] for style in styles]) + more
            for key, more in zip(("scale", "bias"), conditions)
        )
        centred, deviation = _centred(x.reshape(by_part))
        x = _leaky(centred * (scale[..., None, :] / deviation) + bias[..., None, :])
        x = self.conv1(x.reshape(-1, *shape[2:])).reshape(by_part)
        centred, deviation = _centred(x)
        seen = shape[-2] if last is None else last + self.reach  # samples that the output depends on from here
        x, asking = (
            a.reshape(shape)[..., -seen:, :].reshape(*by_part[:3], -1, shape[-1]) for a in (x, centred / deviation)
        )
        for tokens, query, style in zip(x, self.query(asking), styles):
            score = query @ style[f"{level}.keys"].swapaxes(-1, -2)
            weight = np.exp(score - score.max(axis=-1, keepdims=True))
            tokens += weight @ style[f"{level}.values"] / weight.sum(axis=-1, keepdims=True)
        x = self.conv2(x.reshape(-1, shape[2], seen, shape[-1]))
        return x if last is None else x[:, :, -last:]


class _RootCondition:
    """stylizer.systems.motion_puzzle.model.RootCondition."""

    def __init__(self, condition: RootCondition) -> None:
        self.hidden = _Linear(condition.hidden)
        self.sides = {int(number): _Linear(of_kind(torch.nn.Linear, side)) for number, side in condition.sides.items()}

    def __call__(self, motion: np.ndarray) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Normalized motion (batch, 21, T, 15) -> by level what is added to scale and bias (batch, 5, C)."""
        root = motion[:, 0, :, ROOT]
        hidden = _leaky(self.hidden(np.concatenate([root.sum(axis=1) / root.shape[1], root[:, -1]], axis=-1)))
        sides = {level: side(hidden).reshape(len(hidden), len(PARTS), 2, -1) for level, side in self.sides.items()}
        return {level: (side[:, :, 0], side[:, :, 1]) for level, side in sides.items()}


def _product(x: np.ndarray, weight: torch.Tensor) -> np.ndarray:
    """(..., n) @ (n, m), by the library whose products of this size are quickest."""
    rows = torch.from_numpy(x.reshape(-1, x.shape[-1]))
    return torch.mm(rows, weight).numpy().reshape(*x.shape[:-1], -1)


def _centred(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(..., n, C) without its mean over n, and the deviation (..., 1, C) about it."""
    centred = x - x.sum(axis=-2, keepdims=True) / x.shape[-2]
    return centred, np.sqrt((centred * centred).sum(axis=-2, keepdims=True) / x.shape[-2] + np.float32(EPSILON))


def _leaky(x: np.ndarray) -> np.ndarray:
    return np.maximum(x, np.float32(0.2) * x)
