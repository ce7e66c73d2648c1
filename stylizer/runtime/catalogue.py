"""The stylizers by name: which weights there are, and the bank and the live stylizer that go with them."""

import torch

from stylizer.networks import checkpoint as weights
from stylizer.runtime.live import LiveStylizer
from stylizer.styles.bank import Bank


def names() -> tuple[str, ...]:
    """The stylizers whose weights come with this package, the one that is used unless another is named first."""
    found = sorted(path.stem for path in weights.FOLDER.glob("*.safetensors"))
    return tuple(sorted(found, key=lambda name: name != weights.SLIM))


def bank(name: str | None = None) -> Bank:
    """The style bank of the named weights (None: the shipped ones).

    Raises ValueError where there are none of that name, or they or their styles do not fit."""
    name = name or weights.SLIM
    if weights.kind(name) == weights.MOTION_PUZZLE:
        return Bank(name)
    from stylizer.styles.code_bank import CodeBank

    return CodeBank(name)


def stylizer_of(bank) -> LiveStylizer:
    """The live stylizer of a bank, or of what is as much of one as it needs (stylizer.evaluation.playback.Styles)."""
    if bank.model.KIND == weights.MOTION_PUZZLE:
        return LiveStylizer(bank)
    from stylizer.runtime.whole_body_live import WholeBodyStylizer

    return WholeBodyStylizer(bank)


def from_pretrained(name: str | None = None) -> LiveStylizer:
    """The named weights and their bank, ready to run on one thread. Raises ValueError where they are missing or do not
    fit."""
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    return stylizer_of(bank(name))
