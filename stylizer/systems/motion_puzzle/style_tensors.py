"""Styles put together from styles: each body part its own, two of them blended, many side by side in a batch."""

from typing import Sequence

import torch
from torch import Tensor

from stylizer.networks.layers import PartStyle

Style = dict[int, PartStyle]  # by number of the decoder's block


def stack_parts(styles: Sequence[Style]) -> Style:
    """One style that is the first's in the first of the five body parts, the second's in the second ... (Eq. 5)."""
    return {
        level: PartStyle(
            *(
                torch.stack([getattr(style[level], key)[part] for part, style in enumerate(styles)])
                for key in PartStyle._fields
            )
        )
        for level in styles[0]
    }


def interpolated(first: Style, other: Style, shares: Sequence[float]) -> Style:
    """(1 - share) first + share other, each of the five parts by its own share (Sec. 7.1); 0 and 1 are exact."""
    share = torch.tensor(shares, dtype=torch.float32)
    return {
        level: PartStyle(
            *(torch.lerp(a, b, share.view(-1, *[1] * (a.dim() - 1))) for a, b in zip(first[level], other[level]))
        )
        for level in first
    }


def expand_batch(style: Style, size: int) -> Style:
    """One style as that of a whole batch, without copies."""
    return {level: PartStyle(*(t.expand(-1, size, *t.shape[2:]) for t in part)) for level, part in style.items()}


def write_slot(style: Style, together: Style, place: int) -> None:
    """Writes a style over the one at this place of several that lie side by side along the batch."""
    for level, parts in style.items():
        for one, all_of_them in zip(parts, together[level]):
            all_of_them[:, place] = one[:, 0]


def mix_parts(own: Style, other: Style, use_other: Tensor) -> Style:
    """Each part from one style or the other (Alg. 1). use_other: (5, B) of bool."""
    pick = use_other[:, :, None]
    return {
        level: PartStyle(
            *(torch.where(pick if a.dim() == 3 else pick[..., None], b, a) for a, b in zip(own[level], other[level]))
        )
        for level in own
    }


def cat_batch(styles: list[Style]) -> Style:
    """Styles of several batches as those of one."""
    return {
        level: PartStyle(*(torch.cat(ts, dim=1) for ts in zip(*(style[level] for style in styles))))
        for level in styles[0]
    }


def split_batch(styles: Style) -> tuple[Style, Style]:
    """The styles of the first and of the second half of a batch."""
    size = next(iter(styles.values())).scale.shape[1] // 2
    return tuple(
        {level: PartStyle(*(t[:, half] for t in style)) for level, style in styles.items()}
        for half in (slice(size), slice(size, None))
    )
