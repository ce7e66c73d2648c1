"""Height maps: known heights are read back, tiles repeat, pictures become grounds, mistakes are one sentence."""

import copy

import numpy as np
import pytest
from PIL import Image

from sim.ground.catalogue import NAMES, PICTURE_CELL, PICTURE_HEIGHT, load_ground
from sim.ground.ground import FOOT_LENGTH, Ground, sole_heights
from sim.ground.terrains import CELL, CELLS, RISE, STEEPEST


def ramp(slope: float = 0.2, cells: int = 80, cell: float = 0.1) -> Ground:
    """Rises along +x, level along z."""
    x = (np.arange(cells) - cells // 2) * cell
    return Ground(np.tile(slope * x, (cells, 1)).astype(np.float32), cell, tiled=False)


def test_heights_and_slopes_of_a_ramp():
    ground = ramp()
    places = np.array([[0.0, 0.0], [1.03, 2.0], [-1.5, -0.7]])
    np.testing.assert_allclose(ground.height_at(places), 0.2 * places[:, 0], atol=1e-6)
    np.testing.assert_allclose(ground.smooth_height_at(places), 0.2 * places[:, 0], atol=1e-4)
    np.testing.assert_allclose(ground.slope_at(places), [[0.2, 0.0]] * 3, atol=1e-3)
    np.testing.assert_allclose(ground.slope_at(places.reshape(3, 1, 2)), [[[0.2, 0.0]]] * 3, atol=1e-3)


def test_what_is_no_tile_goes_on_level_and_a_tile_repeats():
    ground = ramp()
    assert ground.height_at(np.array([100.0, 0.0])) == ground.height_at(np.array([3.9, 0.0]))
    tile = load_ground("hills")
    here = np.array([[3.21, -1.7], [20.0, 8.0]])
    np.testing.assert_allclose(tile.height_at(here + CELL * CELLS), tile.height_at(here), atol=1e-4)


def test_a_sole_lies_along_a_slope_and_flat_on_an_edge():
    slope = np.array([0.1, 0.1 + 0.3 * FOOT_LENGTH])
    np.testing.assert_array_equal(sole_heights(slope), slope)
    np.testing.assert_array_equal(sole_heights(np.array([[0.0, 0.18], [0.18, 0.0]])), [[0.18, 0.18]] * 2)


@pytest.mark.parametrize("name", NAMES[1:])
def test_a_named_ground_starts_level_at_height_0_and_is_the_same_each_time(name):
    ground = load_ground(name)
    around = np.array([[0.0, 0.0], [0.3, 0.2], [-0.3, 0.4]])
    np.testing.assert_allclose(ground.height_at(around), 0.0, atol=0.01)
    assert load_ground(name) is ground and copy.deepcopy(ground) is ground
    assert np.ptp(ground.heights) > 0.2


def test_hills_and_stairs_are_as_steep_as_they_say():
    hills = load_ground("hills").heights
    steepest = np.hypot(*np.gradient(hills, CELL)).max()
    assert 0.8 * STEEPEST < steepest < 1.15 * STEEPEST
    steps = np.diff(load_ground("stairs").heights, axis=0)
    assert steps.max() == pytest.approx(RISE, abs=1e-5) and steps.min() == pytest.approx(-RISE, abs=1e-5)


def test_flat_is_no_ground():
    assert load_ground("flat") is None and load_ground(None) is None


def test_a_picture_is_a_height_map(tmp_path):
    grey = np.zeros((40, 60), np.uint8)
    grey[:, 40:] = 255
    Image.fromarray(grey).save(tmp_path / "step.png")
    ground = load_ground(str(tmp_path / "step.png"))
    assert ground.height_at(np.zeros(2)) == 0
    assert ground.height_at(np.array([15 * PICTURE_CELL, 0.0])) == pytest.approx(PICTURE_HEIGHT)
    Image.fromarray((grey.astype(np.uint16) * 257)).save(tmp_path / "deep.png")
    deep = load_ground(str(tmp_path / "deep.png"))
    np.testing.assert_allclose(deep.heights, ground.heights, atol=1e-6)


def test_mistakes_are_one_sentence(tmp_path):
    with pytest.raises(ValueError, match="unknown ground 'hils'.*hills.*FILE.png"):
        load_ground("hils")
    (tmp_path / "no.png").write_text("nothing")
    with pytest.raises(ValueError, match="no picture that can be read"):
        load_ground(str(tmp_path / "no.png"))
    Image.new("L", (5000, 2)).save(tmp_path / "wide.png")
    with pytest.raises(ValueError, match="4096"):
        load_ground(str(tmp_path / "wide.png"))
    whole = tmp_path / "whole.png"
    Image.fromarray(np.zeros((40, 40), np.uint8)).save(whole)
    (tmp_path / "half.png").write_bytes(whole.read_bytes()[:40])
    with pytest.raises(ValueError, match="half.png: this is no picture that can be read"):
        load_ground(str(tmp_path / "half.png"))
    with pytest.raises(ValueError, match="a ground is a name"):
        load_ground(5)
    with pytest.raises(FileNotFoundError):
        load_ground(str(tmp_path / "missing.png"))


@pytest.mark.parametrize("heights, cell", [(np.zeros(4), 0.1), (np.zeros((4, 4)), 0), (np.full((4, 4), np.nan), 0.1)])
def test_what_is_no_table_of_heights_is_refused(heights, cell):
    with pytest.raises(ValueError, match="a ground is a table"):
        Ground(heights, cell)
