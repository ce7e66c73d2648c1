"""A style as one array of numbers, and as features again."""

import numpy as np
import torch

from stylizer.systems.motion_puzzle.style_tensors import pack, take_batch, to_numpy, to_tensors, unpack


def style(batch: int) -> dict[str, torch.Tensor]:
    shapes = {"values": (6, 5), "mean": (7,), "keys": (6, 4)}  # not by the alphabet: the order must not count
    generator = torch.Generator().manual_seed(batch)
    return {name: torch.randn(5, batch, *shape, generator=generator) for name, shape in shapes.items()}


def test_what_is_packed_comes_out_again_whatever_the_order_of_its_names():
    features = style(3)
    numbers = pack(features)
    assert numbers.shape == (3, 5, 30 + 7 + 24)
    again = to_tensors(unpack(numbers, take_batch(style(1), [0])))
    assert all(torch.equal(again[name], values) for name, values in features.items())
    backwards = dict(reversed(features.items()))
    np.testing.assert_array_equal(pack(backwards), numbers)


def test_what_is_written_into_the_numbers_is_seen():
    features, other = style(2), style(1)
    numbers = pack(features)
    seen = unpack(numbers, features)
    numbers[1] = pack(other)[0]
    for name, values in to_numpy(other).items():
        np.testing.assert_array_equal(seen[name][1], values[0])
        np.testing.assert_array_equal(seen[name][0], to_numpy(features)[name][0])
