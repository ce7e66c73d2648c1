"""How long each stage of a frame takes: collected by name, reported as percentiles."""

import json
import os
import platform
import time
from array import array
from collections import defaultdict
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Callable, Iterator

import numpy as np

STAGES = ("controller", "features", "stylizer", "foot_lock", "render", "frame")
BUDGET_MS = 1000 / 60


class Latency:
    """Seconds spent in each stage, frame by frame. Nothing in the simulation depends on what is measured here."""

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        # Packed: in a window that stays open all day these times would take 300 MB as lists.
        self.seconds: dict[str, array] = defaultdict(partial(array, "d"))

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Times the block under it as one entry of `name`."""
        start = self._clock()
        yield
        self.seconds[name].append(self._clock() - start)

    def last_ms(self, name: str) -> float:
        """The newest entry of a stage in milliseconds, 0 before the first."""
        return 1e3 * self.seconds[name][-1] if self.seconds[name] else 0.0

    def report(self, startup_s: float = 0.0, **machine: object) -> dict[str, Any]:
        """The latency report. `machine` adds what only the caller knows (threads, torch)."""
        frames = 1e3 * np.array(self.seconds["frame"])
        result: dict[str, Any] = {
            "machine": {"cpu": cpu_name(), "cores": os.cpu_count(), **machine},
            "frames": len(frames),
            "missed_60hz": int(np.sum(frames > BUDGET_MS)),
            "first_frame_ms": round(float(frames[0]), 3) if len(frames) else None,
            "startup_s": round(startup_s, 3),
        }
        for name in STAGES:
            if self.seconds[name]:
                result[name] = percentiles(1e3 * np.array(self.seconds[name]))
        return result

    def save(self, path: str | Path, **extra: Any) -> None:
        """Writes the report as JSON. Raises OSError where it cannot."""
        Path(path).write_text(json.dumps(self.report(**extra), indent=2) + "\n")


def percentiles(milliseconds: np.ndarray) -> dict[str, float]:
    """p50, p95, p99 and maximum of an array of milliseconds, as the reports name them."""
    p50, p95, p99 = np.percentile(milliseconds, (50, 95, 99))
    return {
        "p50_ms": round(float(p50), 4),
        "p95_ms": round(float(p95), 4),
        "p99_ms": round(float(p99), 4),
        "max_ms": round(float(milliseconds.max()), 4),
    }


def cpu_name() -> str:
    """The processor's name where the system says it."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
