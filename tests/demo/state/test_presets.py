"""Presets lie in the slots that there are, and nowhere else."""

import pytest

from demo.state.presets import Presets
from sim.style_spec import StyleSpec


@pytest.mark.parametrize("slot", [0, 9, 99, -1])
def test_a_slot_that_there_is_not_is_refused_and_nothing_is_written(tmp_path, slot):
    presets = Presets(tmp_path / "presets.json")
    with pytest.raises(ValueError, match=rf"slot {slot}: slots are 1 \.\. 8"):
        presets.save(slot, StyleSpec({"spine": "proud"}))
    assert not (tmp_path / "presets.json").exists()
