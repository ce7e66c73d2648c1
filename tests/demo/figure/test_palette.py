"""The colours of styles: told apart by eye, which CIELAB measures, and the same in every process."""

import itertools
import re

import numpy as np

from demo.figure.colours import OWN_STYLE, TWIN, style_colour
from demo.figure.palette import BUNDLED, OTHERS

APART = 20  # in CIELAB, where 2.3 is just noticeable side by side: enough for two limbs, lit from one side
OTHERS_APART = 15


def lab(colour) -> np.ndarray:
    """A display colour (sRGB, 0..1) in CIELAB under daylight (D65)."""
    channels = np.asarray(colour, float)
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    to_xyz = [[0.4125, 0.3576, 0.1804], [0.2127, 0.7152, 0.0722], [0.0193, 0.1192, 0.9503]]
    x, y, z = (
        np.cbrt(share) if share > (6 / 29) ** 3 else share / (3 * (6 / 29) ** 2) + 4 / 29
        for share in np.array(to_xyz) @ linear / [0.9505, 1.0, 1.0888]
    )
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_lab_is_that_of_the_text_books():
    np.testing.assert_allclose(lab((1, 1, 1)), [100, 0, 0], atol=0.1)
    np.testing.assert_allclose(lab((1, 0, 0)), [53.24, 80.09, 67.20], atol=0.1)


def nearest(colours: dict[str, np.ndarray]) -> tuple[float, str, str]:
    return min(
        (float(np.linalg.norm(colours[one] - colours[other])), one, other)
        for one, other in itertools.combinations(colours, 2)
    )


def test_bundled_styles_are_told_apart_and_from_no_style():
    colours = {name: lab(style_colour(name)) for name in BUNDLED} | {"no style": lab(OWN_STYLE)}
    assert nearest(colours)[0] > APART, nearest(colours)
    assert min(np.linalg.norm(colours[name] - lab(TWIN)) for name in BUNDLED) > APART


def test_every_bundled_style_has_a_colour_of_its_own():
    from stylizer.styles import bank

    folders = [bank.BUNDLED, bank.BUNDLED.parent / "non-commercial" / "styles"]
    names = {path.stem for folder in folders for path in folder.glob("[js]*/*.safetensors")}
    assert len(names) > 17 and names <= set(BUNDLED)


def test_other_styles_have_a_stable_colour_that_is_near_no_other():
    codes = {code: [int(pair, 16) / 255 for pair in re.findall("..", code)] for code in (*BUNDLED.values(), *OTHERS)}
    assert nearest({code: lab(colour) for code, colour in codes.items()})[0] > OTHERS_APART
    assert style_colour("My-limp") == tuple(codes["965a87"]) and style_colour("limp") == tuple(codes["b45a5a"])
