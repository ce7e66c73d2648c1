"""The parts of the exported graphs switch, blend and fade as those of the live stylizer."""

import numpy as np

from demo.export.onnx_styles import _Parts
from sim.body.skeleton import PART_NAMES
from sim.style_spec import PartSpec, StyleSpec
from stylizer.runtime.style_mixer import StyleMixer
from stylizer.styles.own_style import OWN

NAMES = (OWN, "marching", "zombie", "leaning")
FRAMES, HOLD = 400, 9  # frames, and how many of them the same is asked


def test_parts_are_those_of_the_mixer_whatever_is_asked():
    random, mixer, parts = np.random.default_rng(5), StyleMixer(1), _Parts(0)
    for frame in range(FRAMES):
        if frame % HOLD == 0:
            request, style = np.tile([-1.0, 0, -1, 0], (5, 1)), {}
            for place, part in enumerate(PART_NAMES):
                name, other = random.integers(0, len(NAMES), 2)
                strength, share = random.choice([0.0, 0.6, 1.0]), random.choice([0.0, 0.4, 1.0])
                if random.random() < 0.7:
                    blended = random.random() < 0.5
                    request[place] = name, strength, (other if blended else -1), (share if blended else 0.0)
                    style[part] = PartSpec(NAMES[name], strength, NAMES[other] if blended else None, share * blended)
        switched = mixer.step(StyleSpec(style))
        np.testing.assert_array_equal(parts.step(request), switched)
        assert [NAMES[int(name)] for name in parts.name] == [part.name for part in mixer.parts]
        assert [NAMES[int(name)] for name in parts.other] == [part.other for part in mixer.parts]
        for name in ("strength", "share", "styled_share"):
            np.testing.assert_allclose(getattr(parts, name), [getattr(p, name) for p in mixer.parts], atol=1e-9)
