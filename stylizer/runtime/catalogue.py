"""The stylizers by name: which weights there are, and the bank and the live stylizer that go with them."""

from typing import Any

from sim.torch_setup import set_up_torch
from stylizer.runtime.joint_live import JointStylizer
from stylizer.runtime.live import LiveStylizer
from stylizer.styles.bank import BUNDLED, StyleBank
from stylizer.systems import checkpoint
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle


def names() -> tuple[str, ...]:
    """The stylizers whose weights come with this package, the one that is used unless another is named first."""
    found = sorted(path.stem for path in checkpoint.FOLDER.glob("*.safetensors"))
    return tuple(sorted(found, key=lambda name: name != checkpoint.SLIM))


def load_bank(name: str | None = None) -> StyleBank:
    """The style bank of the named weights (None: the shipped ones).

    Raises ValueError where there are none of that name, or they or their styles do not fit."""
    set_up_torch()
    name = name or checkpoint.SLIM
    if checkpoint.system(name).by_part:
        return StyleBank(name) if name == checkpoint.SLIM else StyleBank(name, BUNDLED / name)
    from stylizer.styles.code_bank import CodeBank

    return CodeBank(name)


def make_stylizer(bank: Any) -> LiveStylizer:
    """The live stylizer of a bank, or of what is as much of one as it needs (stylizer.evaluation.playback.Styles)."""
    if bank.system.by_part:
        return (JointStylizer if isinstance(bank.model, JointPuzzle) else LiveStylizer)(bank)
    from stylizer.runtime.whole_body_live import WholeBodyStylizer

    return WholeBodyStylizer(bank)


def from_pretrained(name: str | None = None) -> LiveStylizer:
    """The named weights and their bank, ready to run on one thread. Raises ValueError where they are missing or do not
    fit."""
    return make_stylizer(load_bank(name))
