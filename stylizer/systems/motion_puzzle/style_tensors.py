"""Styles put together from styles: each body part its own, two of them blended, many side by side in a batch."""

from typing import Sequence

import torch
from torch import Tensor

from stylizer.networks.layers import BlockFeatures

StyleFeatures = dict[int, BlockFeatures]  # by number of the decoder's block


def stack_parts(styles: Sequence[StyleFeatures]) -> StyleFeatures:
    """One style that is the first's in the first of the five body parts, the second's in the second ... (Eq. 5)."""
    return {
        level: BlockFeatures(
            *(
                torch.stack([getattr(style[level], key)[part] for part, style in enumerate(styles)])
                for key in BlockFeatures._fields
            )
        )
        for level in styles[0]
    }


def interpolate(first: StyleFeatures, other: StyleFeatures, shares: Sequence[float]) -> StyleFeatures:
    """(1 - share) first + share other, each of the five parts by its own share (Sec. 7.1); 0 and 1 are exact."""
    share = torch.tensor(shares, dtype=torch.float32)
    return {
        level: BlockFeatures(
            *(torch.lerp(a, b, share.view(-1, *[1] * (a.dim() - 1))) for a, b in zip(first[level], other[level]))
        )
        for level in first
    }


def expand_batch(style: StyleFeatures, size: int) -> StyleFeatures:
    """One style as that of a whole batch, without copies."""
    return {level: BlockFeatures(*(t.expand(-1, size, *t.shape[2:]) for t in part)) for level, part in style.items()}


def write_slot(style: StyleFeatures, together: StyleFeatures, place: int) -> None:
    """Writes a style over the one at this place of several that lie side by side along the batch."""
    for level, parts in style.items():
        for one, all_of_them in zip(parts, together[level]):
            all_of_them[:, place] = one[:, 0]


def mix_parts(own: StyleFeatures, other: StyleFeatures, use_other: Tensor) -> StyleFeatures:
    """Each part from one style or the other (Alg. 1). use_other: (5, B) of bool."""
    pick = use_other[:, :, None]
    return {
        level: BlockFeatures(
            *(torch.where(pick if a.dim() == 3 else pick[..., None], b, a) for a, b in zip(own[level], other[level]))
        )
        for level in own
    }


def cat_batch(styles: list[StyleFeatures]) -> StyleFeatures:
    """Styles of several batches as those of one."""
    return {
        level: BlockFeatures(*(torch.cat(ts, dim=1) for ts in zip(*(style[level] for style in styles))))
        for level in styles[0]
    }


def split_batch(styles: StyleFeatures) -> tuple[StyleFeatures, StyleFeatures]:
    """The styles of the first and of the second half of a batch."""
    size = next(iter(styles.values())).scale.shape[1] // 2
    first, second = (
        {level: BlockFeatures(*(t[:, half] for t in style)) for level, style in styles.items()}
        for half in (slice(size), slice(size, None))
    )
    return first, second
