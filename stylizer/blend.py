"""Styles put together from styles: each body part its own, and two of them blended."""

from math import lcm
from typing import Sequence

import torch

from stylizer.layers import PartStyle

Style = dict[int, PartStyle]  # by level of the decoder, batch of one


def side_by_side(styles: Sequence[Style]) -> Style:
    """One style that is the first's in the first of the five body parts, the second's in the second ... (Eq. 5).

    They hold as many tokens: see `with_equal_tokens`."""
    return {level: PartStyle(*(torch.stack([getattr(style[level], key)[part] for part, style in enumerate(styles)])
                               for key in PartStyle._fields)) for level in styles[0]}


def interpolated(first: Style, other: Style, shares: Sequence[float]) -> Style:
    """(1 - share) first + share other, each of the five parts by its own share (Sec. 7.1); 0 and 1 are exact."""
    share = torch.tensor(shares, dtype=torch.float32)
    return {level: PartStyle(*(torch.lerp(a, b, share.view(-1, *[1] * (a.dim() - 1)))
                               for a, b in zip(first[level], other[level]))) for level in first}


def with_equal_tokens(styles: Sequence[Style]) -> list[Style]:
    """The same styles, their tokens repeated to one number for all, which makes no difference to attention."""
    counts = [max(1, *(part.keys.shape[2] for part in style.values())) for style in styles]
    return [{level: part._replace(**{key: getattr(part, key).repeat(1, 1, lcm(*counts) // count, 1)
                                     for key in ("keys", "values")}) for level, part in style.items()}
            for style, count in zip(styles, counts)]


def for_batch(style: Style, size: int) -> Style:
    """One style as that of a whole batch, without copies."""
    return {level: PartStyle(*(t.expand(-1, size, *t.shape[2:]) for t in part)) for level, part in style.items()}


def put(style: Style, together: Style, place: int) -> None:
    """Writes a style over the one at this place of several that lie side by side along the batch."""
    for level, parts in style.items():
        for one, all_of_them in zip(parts, together[level]):
            all_of_them[:, place] = one[:, 0]
