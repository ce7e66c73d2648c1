"""The stylizers by name: which weights there are, and the bank and the live stylizer that go with them."""

from pathlib import Path
from typing import Any

from sim.io.provenance import SHIPPED
from sim.torch_setup import set_up_torch
from stylizer.runtime.decoder_live import DecoderStylizer
from stylizer.runtime.joint_live import JointStylizer
from stylizer.runtime.live import LiveStylizer
from stylizer.styles.bank import StyleBank
from stylizer.systems import weight_files
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle

STYLES = "styles"  # in the folder that training writes into


def load_bank(name: str | None = None, folder: Path | None = None) -> StyleBank:
    """The style bank of the named weights (None: the shipped ones).

    folder: where `patchwalk train stylizer` wrote weights and styles that are to be taken instead of the package's.
    Raises ValueError where there are none of that name, or they or their styles do not fit."""
    set_up_torch()
    name = name or SHIPPED
    if weight_files.system(name, folder).by_part:
        return StyleBank(name, folder / STYLES, weights=folder) if folder else StyleBank(name)
    if folder:
        raise ValueError(f"'{name}' restyles the whole body: only weights of Motion Puzzle are taken from a folder")
    from stylizer.styles.code_bank import CodeBank

    return CodeBank(name)


def make_stylizer(bank: Any) -> LiveStylizer:
    """The live stylizer of a bank, or of what is as much of one as it needs (stylizer.evaluation.playback.Styles)."""
    if bank.system.by_part:
        return (JointStylizer if isinstance(bank.model, JointPuzzle) else DecoderStylizer)(bank)
    from stylizer.runtime.whole_body_live import WholeBodyStylizer

    return WholeBodyStylizer(bank)


def from_pretrained(name: str | None = None, folder: Path | None = None) -> LiveStylizer:
    """The named weights and their bank, of the package or of a folder (see `load_bank`), ready to run on one thread.
    Raises ValueError where they are missing or do not fit."""
    return make_stylizer(load_bank(name, folder))
