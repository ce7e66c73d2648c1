"""Styles put together from styles: each body part its own, two of them blended, many side by side in a batch."""

import math
from typing import Sequence

import numpy as np
import torch
from torch import Tensor

StyleFeatures = dict[str, Tensor]  # what a network keeps of a style, by name: (5, B, ...), body parts first
NumpyFeatures = dict[str, np.ndarray]  # the same as numpy has it: (B, 5, ...), batch first


def stack_parts(styles: Sequence[StyleFeatures]) -> StyleFeatures:
    """One style that is the first's in the first of the five body parts, the second's in the second ... (Eq. 5)."""
    return {name: torch.stack([style[name][part] for part, style in enumerate(styles)]) for name in styles[0]}


def interpolate(first: StyleFeatures, other: StyleFeatures, shares: Sequence[float]) -> StyleFeatures:
    """(1 - share) first + share other, each of the five parts by its own share (Sec. 7.1); 0 and 1 are exact."""
    share = torch.tensor(shares, dtype=torch.float32)
    return {name: torch.lerp(one, other[name], _beside(share, one)) for name, one in first.items()}


def pack(style: StyleFeatures) -> np.ndarray:
    """All numbers of a style in one array (B, 5, N), so that a single operation interpolates or copies them."""
    return torch.cat([style[name].transpose(0, 1).flatten(2) for name in sorted(style)], dim=2).numpy()


def unpack(numbers: np.ndarray, like: StyleFeatures) -> NumpyFeatures:
    """The style that `pack` made numbers (B, 5, N) of, one of the same network as `like`; it sees them as they are
    now, whatever is written into them."""
    result, end = {}, 0
    for name in sorted(like):
        shape = like[name].shape[2:]
        start, end = end, end + math.prod(shape)
        result[name] = numbers[..., start:end].reshape(*numbers.shape[:2], *shape)
    return result


def to_tensors(style: NumpyFeatures) -> StyleFeatures:
    """The same numbers as tensors."""
    return {name: torch.from_numpy(values.swapaxes(0, 1)) for name, values in style.items()}


def to_numpy(style: StyleFeatures) -> NumpyFeatures:
    """The same numbers as arrays."""
    return {name: values.numpy().swapaxes(0, 1) for name, values in style.items()}


def mix_parts(own: StyleFeatures, other: StyleFeatures, use_other: Tensor) -> StyleFeatures:
    """Each part from one style or the other (Alg. 1). use_other: (5, B) of bool."""
    return {name: torch.where(_beside(use_other, values), other[name], values) for name, values in own.items()}


def cat_batch(styles: Sequence[StyleFeatures]) -> StyleFeatures:
    """Styles of several batches as those of one."""
    return {name: torch.cat([style[name] for style in styles], dim=1) for name in styles[0]}


def split_batch(styles: StyleFeatures) -> tuple[StyleFeatures, StyleFeatures]:
    """The styles of the first and of the second half of a batch."""
    halves = {name: values.chunk(2, dim=1) for name, values in styles.items()}
    return {name: first for name, (first, _) in halves.items()}, {name: second for name, (_, second) in halves.items()}


def take_batch(styles: StyleFeatures, places: slice | Sequence[int]) -> StyleFeatures:
    """Those at these places of several that lie side by side along the batch."""
    return {name: values[:, places] for name, values in styles.items()}


def _beside(shares: Tensor, values: Tensor) -> Tensor:
    """Numbers of parts, (5,) or (5, B), with axes of length 1 for all further ones of values (5, B, ...)."""
    return shares.reshape(*shares.shape, *[1] * (values.dim() - shares.dim()))
