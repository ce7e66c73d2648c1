"""Pictures compared with golden ones; what differs is saved in out/, to be looked at."""

from pathlib import Path

import numpy as np
import pygame

GOLDEN = Path(__file__).parents[1] / "golden"
OUT = Path(__file__).parents[2] / "out"
# Of 255: drivers and fonts differ by a little everywhere, and by much on a few pixels of outlines.
MEAN_TOLERANCE, FAR_OFF, FAR_OFF_SHARE = 2.0, 48, 0.01


def assert_golden(name: str, pixels: np.ndarray) -> None:
    """pixels: (height, width, 3) of 0..255. After a change that is meant: look at the failed picture, and move it over
    the golden one."""
    failed = OUT / f"{name}_failed.png"
    failed.parent.mkdir(exist_ok=True)
    pygame.image.save(
        pygame.image.frombuffer(pixels.astype(np.uint8).tobytes(), pixels.shape[1::-1], "RGB"), str(failed)
    )
    golden = pygame.surfarray.array3d(pygame.image.load(str(GOLDEN / f"{name}.png"))).swapaxes(0, 1).astype(int)
    assert golden.shape == pixels.shape, f"look at {failed}"
    off = np.abs(pixels.astype(int) - golden)
    assert off.mean() < MEAN_TOLERANCE and (off.max(-1) > FAR_OFF).mean() < FAR_OFF_SHARE, f"look at {failed}"
    failed.unlink()
