"""The slim network as it runs live: only the last sample, in numpy, equal to stylizer.systems.motion_puzzle.model up to
rounding.

A window is so little work that calling the library costs more than computing: this does the same in half as many and
far cheaper calls. Feature maps are (batch, vertex, time, channel) here, so that moments and tokens of a part lie
together."""

from typing import Callable, Mapping, NamedTuple

import numpy as np
import torch

from sim.body.skeleton import PARTS
from stylizer.networks.layers import EPSILON, JointLinear, Pool, STConv, Unpool, of_kind
from stylizer.systems.motion_puzzle.config import KEY_POSES, Config
from stylizer.systems.motion_puzzle.direction_transfer import MOST, ROOT, known_direction
from stylizer.systems.motion_puzzle.key_poses import BODY, QUIET, KeyPoses
from stylizer.systems.motion_puzzle.model import BPStyleNet, MotionPuzzle, PlainBlock, RootCondition
from stylizer.systems.motion_puzzle.style_tensors import StyleFeatures

UPPER = np.array([not name.endswith("leg") for name in PARTS])  # of the parts: spine and arms
KEPT = 16  # styles whose numbers are kept at hand
Condition = tuple[np.ndarray | float, np.ndarray | float]  # what is added to scale and bias


class NumpyFeatures(NamedTuple):
    """stylizer.networks.layers.BlockFeatures as numpy sees them, batch first."""

    scale: np.ndarray
    bias: np.ndarray
    keys: np.ndarray
    values: np.ndarray


class NumpyViews:
    """Styles' numbers as numpy sees them, batch first; kept for the few styles that are asked for in turns."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[StyleFeatures, dict[int, NumpyFeatures]]] = {}

    def __getitem__(self, style: StyleFeatures) -> dict[int, NumpyFeatures]:
        known = self._known.get(id(style))
        if known is None or known[0] is not style:
            known = (
                style,
                {level: NumpyFeatures(*(t.numpy().swapaxes(0, 1) for t in part)) for level, part in style.items()},
            )
            self._known = dict([*self._known.items()][-KEPT:]) | {id(style): known}
        return known[1]


class TorchInference:
    """A network in two halves, for the live stylizer: its decoder, which looks at half a second, and its key poses,
    which look at one pose. Both say what features (batch, 21, 15) are in a style, and what they are in their own."""

    def __init__(self, model: MotionPuzzle) -> None:
        self.model = model

    @torch.inference_mode()
    def decoded(self, windows: np.ndarray, style: StyleFeatures, own: StyleFeatures) -> np.ndarray:
        """What the decoder changes in the last sample of windows of features (batch, samples, 21, 15)."""
        model = self.model
        motion = model.normalize(torch.from_numpy(windows.astype(np.float32)))
        content = model.content_encoder(motion)
        if not model.config.residual_output:
            (output,) = model.decoded(motion, content, [style], last=1)
            return model.restore(output)[:, 0].double().numpy() - windows[:, -1]
        styled, rebuilt = map(self._features, model.decoded(motion, content, [style, own], last=1))
        return styled - rebuilt

    @torch.inference_mode()
    def key_poses(
        self,
        poses: np.ndarray,
        root_velocities: np.ndarray,
        own_root_velocities: np.ndarray,
        style: StyleFeatures,
        own: StyleFeatures,
    ) -> tuple[np.ndarray, np.ndarray]:
        """What key poses make of the moment that poses, features (batch, 21, 15), are in: as it is in the style, of a
        body that goes mean root motions (batch, 3), and as it is in their own, of motion that goes its own
        (batch, 3). Without key poses both are the poses."""
        key_poses, model = self.model.key_poses, self.model
        if not key_poses:
            return poses, poses
        attention = key_poses.attend(
            model.normalize(torch.from_numpy(poses[:, None].astype(np.float32))), own[KEY_POSES]
        )
        mean, deviation = (values[0, 0, 0, ROOT] for values in (model.mean, model.deviation))
        known_velocities, known = known_direction(root_velocities)
        root_velocity, own_root_velocity, forward = (
            (torch.from_numpy(each.astype(np.float32)) - mean) / deviation
            for each in (root_velocities, own_root_velocities, known_velocities)
        )
        styled = key_poses(
            attention,
            root_velocity,
            style[KEY_POSES],
            own[KEY_POSES],
            own_root_velocity,
            forward,
            torch.from_numpy(known_by_part(known)),
        )
        return self._features(styled), self._features(
            key_poses(attention, own_root_velocity, own[KEY_POSES], own[KEY_POSES])
        )

    def _features(self, motion: torch.Tensor) -> np.ndarray:
        """Of normalized motion (21, batch, 1, 15): features (batch, 21, 15)."""
        return self.model.restore(motion)[:, 0].double().numpy()


def known_by_part(known: np.ndarray) -> np.ndarray:
    """How far direction transfer knows root velocities (B, 1), for each part (5, B, 1): of legs it always has to tell,
    for who stands does not walk."""
    return np.where(UPPER[:, None, None], known, 1.0).astype(np.float32)


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
        self.pose_table = _KeyPoses(model.key_poses) if model.key_poses else None
        self._views = NumpyViews()

    @staticmethod
    def fits(config: Config) -> bool:
        return (
            not config.residual_taps
            and config.style_levels == (3, 2)
            and config.by_part
            and config.attention
            and config.residual_output
            and config.decodes
        )

    def decoded(self, windows: np.ndarray, style: StyleFeatures, own: StyleFeatures) -> np.ndarray:
        """As TorchInference.decoded."""
        motion = np.ascontiguousarray(((windows - self.mean) / self.deviation).swapaxes(1, 2), dtype=np.float32)
        styles = [self._views[style], self._views[own]]
        conditions: Mapping[int, Condition] = {3: (0.0, 0.0), 2: (0.0, 0.0)}
        if self.root_condition:
            conditions = self.root_condition(motion)
        x = self._encoded(motion)[None].repeat(len(styles), axis=0)
        for level, net, source in zip((3, 2), self.nets, self.sources):
            x = net(x, [style[level] for style in styles], conditions[level], self.needed if level == 2 else None)
            x = x[:, source].repeat(2, axis=2).reshape(len(styles), len(windows), len(source), -1, x.shape[-1])
        x = self.head(_leaky(self.last(_leaky(x.reshape(-1, *x.shape[2:])))[:, :, None]))
        styled, rebuilt = x.reshape(len(styles), len(windows), *self.mean.shape)
        return ((styled - rebuilt) * self.deviation).astype(float)

    def key_poses(
        self,
        poses: np.ndarray,
        root_velocities: np.ndarray,
        own_root_velocities: np.ndarray,
        style: StyleFeatures,
        own: StyleFeatures,
    ) -> tuple[np.ndarray, np.ndarray]:
        """As TorchInference.key_poses."""
        if not self.pose_table:
            return poses, poses
        normalized = ((poses - self.mean) / self.deviation).astype(np.float32)
        forward, known = known_direction(root_velocities)
        root_velocities = (
            (np.array([root_velocities, own_root_velocities, forward]) - self.mean[0, ROOT]) / self.deviation[0, ROOT]
        ).astype(np.float32)
        known = known_by_part(known).swapaxes(0, 1)
        poses_in_styles = np.zeros((2, *poses.shape))
        poses_in_styles[..., BODY] = self.pose_table(
            normalized, root_velocities, known, *(self._views[each][KEY_POSES] for each in (style, own))
        )
        styled, rebuilt = poses_in_styles * self.deviation + self.mean
        return styled, rebuilt

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


class _KeyPoses:
    """stylizer.systems.motion_puzzle.key_poses.KeyPoses and its Translation."""

    def __init__(self, poses: KeyPoses) -> None:
        self.hidden, self.code, self.going = map(_Linear, (poses.hidden, poses.code, poses.direction_transfer.going))
        self.sides = poses.direction_transfer.weight.detach().numpy()  # (5, HIDDEN, 2 n 12)
        self.inverse_scale = poses.inverse_scale().detach().numpy()[..., 0]  # (5, 3)
        self.fields, self.joints = poses.fields, poses.parts.back.numpy()
        # (5, 1, 1)
        moments, sharpness = poses.prototypes.detach().numpy(), poses.sharpness.detach().exp().numpy()[1, :, 0]
        self.codes = 2 * (sharpness * moments).swapaxes(1, 2).copy()  # (5, CODE, prototypes)
        self.offsets = -sharpness[..., 0] * np.square(moments).sum(axis=2)  # (5, prototypes)

    def __call__(
        self,
        poses: np.ndarray,
        root_velocities: np.ndarray,
        known: np.ndarray,
        style: NumpyFeatures,
        own: NumpyFeatures,
    ) -> np.ndarray:
        """The moment that normalized poses (batch, 21, 15) are in, with a style and with their own: (2, batch, 21, 12).
        root_velocities: (3, batch, 3) of the body, of the poses' own motion, and what of the first translation knows,
        each part as far as known (batch, 5, 1)."""
        attention, scale = self._attend(poses, own)[:, :, None], np.array([style.scale, own.scale])
        mean, _, source_prediction, root_velocity, code = (scale[..., field] for field in self.fields)
        root_velocities = root_velocities[:, :, None].repeat(len(PARTS), axis=2)
        going = _leaky(self.going(np.concatenate([code, root_velocities[[2, 1]]], axis=-1)))[..., None, :] @ self.sides
        going = going[..., 0, :] - source_prediction
        going[0] *= known
        shift, gain = np.split(going, 2, axis=-1)
        moves = np.array(
            [attention @ clip.bias.reshape(*clip.bias.shape[:2], attention.shape[-1], -1) for clip in (style, own)]
        )[..., 0, :]
        moves *= np.exp(np.minimum(np.maximum(gain, -MOST), MOST))
        kernel = np.exp(
            -(np.square(root_velocity[0] - root_velocities[0]) * self.inverse_scale).sum(axis=-1, keepdims=True)
        )
        moves[0] = moves[1] + kernel * (moves[0] - moves[1])
        return (mean + shift + moves).reshape(2, len(poses), -1, BODY.stop)[:, :, self.joints]

    def _attend(self, pose: np.ndarray, own: NumpyFeatures) -> np.ndarray:
        """(batch, 5, prototypes)"""
        mean, deviation = (
            own.scale[..., field].reshape(len(own.scale), -1, BODY.stop)[:, self.joints] for field in self.fields[:2]
        )
        bare = (pose[..., BODY] - mean) / (deviation + np.float32(QUIET))
        bare /= np.sqrt(1 + np.square(bare).sum(axis=(1, 2), keepdims=True) / bare[0].size)
        code = self.code(_leaky(self.hidden(np.concatenate([bare.reshape(len(bare), -1), pose[:, 0, ROOT]], axis=1))))
        score = (code.reshape(len(code), len(PARTS), 1, -1) @ self.codes)[:, :, 0] + self.offsets
        weight = np.exp(score - score.max(axis=-1, keepdims=True))
        return weight / weight.sum(axis=-1, keepdims=True)


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
        self, x: np.ndarray, styles: list[NumpyFeatures], conditions: Condition, last: int | None
    ) -> np.ndarray:
        """conditions: what the root velocity adds to scale and bias. -> (styles batch, V, T, C), the `last` samples
        alone where they are given."""
        shape = x.shape
        by_part = (*shape[:2], len(PARTS), -1, shape[-1])
        scale, bias = (
            np.array([getattr(style, key) for style in styles]) + more
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
            score = query @ style.keys.swapaxes(-1, -2)
            weight = np.exp(score - score.max(axis=-1, keepdims=True))
            tokens += weight @ style.values / weight.sum(axis=-1, keepdims=True)
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
