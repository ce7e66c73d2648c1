"""What `patchwalk bench` measures: all in one run, in turns, on one thread, so that a busy machine slows everything
alike."""

import gc
import os
import sys
import time
from collections import defaultdict
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Callable, Iterator, Sequence

import numpy as np
import torch

from demo import assemble
from demo.bench.machine import Probe, products_of
from sim.body.skeleton import PART_NAMES
from sim.command import Command, Commands
from sim.ground.catalogue import load_ground
from sim.io import recording
from sim.latency import Latency, percentiles
from sim.motion.clip import FPS
from sim.session import Session
from sim.style_spec import PartLike, StyleSpec
from stylizer.runtime.live import LiveStylizer
from stylizer.systems.motion_puzzle.config import CONFIGS, Config
from stylizer.systems.motion_puzzle.model import MotionPuzzle

WARM_UP = 2 * FPS  # frames that are stepped before anything counts
TURNS = 40  # at most: the run is cut into so many, and each thing that is measured has its part in every one
RIVALS = {"full": 1, "paper_slim": 2}  # of stylizer.systems.motion_puzzle.config.CONFIGS: times each is asked in a turn
RIVAL_WINDOW = 32  # samples: the window of the paper's real-time system
CROWDS = (1, 4, 16, 64)
CROWD_STEPS = 128  # characters' frames of each crowd in one of its turns
CROWD_FRAMES = 8  # of each crowd in one of its turns at least
CROWD_TURNS = 4
SETTLE = 8  # frames in which a crowd puts on its styles
# frames of the recording between two characters of a crowd, so that they walk, turn and switch at other times
APART = 37
PERIOD = LiveStylizer.PERIOD  # frames: styles are interpolated in one of them, so the cost is taken over so many
MINUTE = 60 * FPS


def measure(characters: int, seconds: float, started: float) -> dict:
    """The report; `started`: time.perf_counter() when the program began."""
    latency = Latency()
    session = assemble.build_session(latency=latency)
    session.stand_on(load_ground(recording.read(assemble.BUNDLED_RECORDING).ground))
    startup_s = time.perf_counter() - started
    script = dress(session)
    with leave_out(latency):
        play(session, commands_of(script), 1)
        first_frame_s, first_frame_ms = time.perf_counter() - started, latency.last_ms("frame")
        crowd, commands = make_crowd(session, script, characters)
        crowd.latency = latency
        play(crowd, commands, WARM_UP)
    rss_mb = peak_memory_mb()  # before anything that a session does not need is loaded

    rivals = {name: make_rival(CONFIGS[name]) for name in RIVALS}
    frames = max(PERIOD, round(seconds * FPS))
    turns = min(TURNS, max(1, frames // (4 * PERIOD)))
    with leave_out(latency):
        products = products_of(lambda: play(crowd, commands, PERIOD))
    probe, pauses = Probe([(m, k, n) for batch, m, k, n in products for _ in range(batch)]), Pauses()
    rival_times, crowd_times, memory = defaultdict(list), defaultdict(list), [(0, memory_mb())]
    before = usage("ru_nivcsw")
    for turn in range(turns):
        with leave_out(latency):
            play(crowd, commands, PERIOD)  # the caches are as a session leaves them, not as the others did
        with pauses:
            play(crowd, commands, frames * (turn + 1) // turns - frames * turn // turns)
        for name, evaluate in rivals.items():
            for _ in range(RIVALS[name]):
                rival_times[name].append(time_call(evaluate))
        probe.take()
        memory.append((len(latency.seconds["frame"]), memory_mb()))
    after = usage("ru_nivcsw")
    preempted = None if before is None or after is None else after - before
    with leave_out(latency):
        for size, seconds_each in time_crowds(session, script, {*CROWDS, characters}):
            crowd_times[size].append(seconds_each)

    report = latency.report(startup_s=startup_s, **assemble.machine())
    shipped = 1e3 * by_period(latency.seconds["stylizer"]) / characters
    times = {name: 1e3 * np.array(times) for name, times in rival_times.items()} | {"shipped": shipped}
    each = {size: 1e3 * float(np.median(times)) for size, times in sorted(crowd_times.items())}
    ratio = {f"{name}_over_shipped": round(float(np.median(times[name]) / np.median(shipped)), 2) for name in RIVALS}
    return {
        **report,
        "first_frame_ms": round(first_frame_ms, 3),
        "stylizer_ms": {name: shorten(percentiles(values)) for name, values in times.items()},
        "ratio": ratio | {"one_of_64_over_lone": round(each[64] / each[1], 3)},
        "characters": {str(size): round(ms, 4) for size, ms in each.items()},
        "rss_mb": rss_mb,
        "first_frame_s": round(first_frame_s, 3),
        "machine_speed": probe.report(),
        "bound": bound(session, products, probe, float(np.median(shipped)), characters),
        "collector": pauses.report(),
        "steady": compare_halves(latency.seconds["frame"], memory),
        "noise": {"load": load(), "preempted": preempted},
        "timeline": timeline(latency.seconds["frame"]),
    }


def dress(session: Session) -> list[Command]:
    """The bundled recording with every part restyled in every frame: an unstyled frame asks no network."""
    dress: dict[str, PartLike] = dict.fromkeys(PART_NAMES, (session.stylizer.styles[0], 1.0))
    return [
        replace(command, style=StyleSpec({**dress, **command.style}))
        for command in recording.read(assemble.BUNDLED_RECORDING)
    ]


def commands_of(script: list[Command], characters: int | None = None) -> Iterator[Command | Commands]:
    """The script round and round, for one character or a crowd, each of whom is somewhere else in it."""
    for frame in count():
        each = [script[(frame + one * APART) % len(script)] for one in range(characters or 1)]
        yield Commands(each) if characters else each[0]


def make_crowd(
    session: Session, script: list[Command], characters: int
) -> tuple[Session, Iterator[Command | Commands]]:
    """A session of so many characters, a lone one's being the session itself, and what they are asked."""
    return (
        (session, commands_of(script))
        if characters == 1
        else (session.crowd(characters), commands_of(script, characters))
    )


def play(session: Session, commands: Iterator[Command | Commands], frames: int) -> None:
    """Steps a session through so many frames."""
    for _ in range(frames):
        session.step(next(commands))


@contextmanager
def leave_out(latency: Latency) -> Iterator[None]:
    """What is timed in the block is forgotten after it."""
    counted = {name: len(seconds) for name, seconds in latency.seconds.items()}
    yield
    for name, seconds in latency.seconds.items():
        del seconds[counted.get(name, 0) :]


def make_rival(config: Config) -> Callable[[], object]:
    """A network of the paper with weights that nobody trained, which cost the same: restyles a window, its style
    ready."""
    model = MotionPuzzle(config).eval()
    motion = torch.randn(21, 1, RIVAL_WINDOW, 15, generator=torch.Generator().manual_seed(0))
    with torch.inference_mode():
        style = model.encode_style(motion)

    @torch.inference_mode()
    def evaluate() -> object:
        return model(motion, style, style)

    for _ in range(2):
        evaluate()
    return evaluate


def time_crowds(session: Session, script: list[Command], sizes: set[int]) -> Iterator[tuple[int, float]]:
    """(characters, seconds that one of them took for one frame), each size several times, in turns."""
    people = {size: make_crowd(session, script, size) for size in sorted(sizes)}
    for crowd, commands in people.values():
        play(crowd, commands, SETTLE)
    for _ in range(CROWD_TURNS):
        for size, (crowd, commands) in people.items():
            play(crowd, commands, PERIOD)  # the caches are as this crowd leaves them
            frames = max(CROWD_FRAMES, CROWD_STEPS // size // PERIOD * PERIOD)
            start = time.perf_counter()
            play(crowd, commands, frames)
            yield size, (time.perf_counter() - start) / (frames * size)


class Pauses:
    """Counts how often Python's collector stopped the frames stepped inside the block, and for how long."""

    def __init__(self) -> None:
        self.milliseconds: list[float] = []
        self._start = 0.0

    def __enter__(self) -> None:
        gc.callbacks.append(self._heard)

    def __exit__(self, *_: object) -> None:
        gc.callbacks.remove(self._heard)

    def _heard(self, when: str, _: dict) -> None:
        if when == "start":
            self._start = time.perf_counter()
        else:
            self.milliseconds.append(1e3 * (time.perf_counter() - self._start))

    def report(self) -> dict:
        return {"pauses": len(self.milliseconds), "longest_ms": round(max(self.milliseconds, default=0.0), 3)}


def bound(
    session: Session, products: Sequence[tuple[int, ...]], probe: Probe, shipped_ms: float, characters: int
) -> dict | None:
    """How near the shipped stylizer is, for one character, to what this machine could do: its arithmetic at the speed
    of its own products, and its weights once through memory, whichever takes longer. None where it multiplies no
    matrices."""
    if not products:
        return None
    model = session.stylizer.bank.model
    weights = sum(p.nbytes for name, p in model.named_parameters() if not name.startswith("style_encoder"))
    operations = sum(2 * np.prod(product) for product in products) / PERIOD / characters
    arithmetic_ms = 1e-6 * operations / probe.typical_gflops()
    memory_ms = 1e-6 * weights / PERIOD / characters / probe.read_gb_s()
    return {
        "mflop": round(operations / 1e6, 2),
        "weights_mb": round(weights / 1e6, 2),
        "arithmetic_ms": round(arithmetic_ms, 4),
        "memory_ms": round(memory_ms, 4),
        "shipped_over_bound": round(shipped_ms / max(arithmetic_ms, memory_ms), 2),
    }


def compare_halves(seconds: Sequence[float], memory: list[tuple[int, float]]) -> dict | None:
    """The last minute beside the first, and what memory grew by between them; None for a run of less than two
    minutes."""
    if len(seconds) < 2 * MINUTE:
        return None
    first, last = (percentiles(1e3 * np.array(part))["p99_ms"] for part in (seconds[:MINUTE], seconds[-MINUTE:]))
    after_first = next(mb for frame, mb in memory if frame >= MINUTE)
    return {
        "first_minute_p99_ms": first,
        "last_minute_p99_ms": last,
        "ratio": round(last / first, 3),
        "growth_mb": round(memory[-1][1] - after_first, 1),
    }


def timeline(seconds: Sequence[float]) -> list[list[float]]:
    """[p50, p99] milliseconds of the frames of every second."""
    return [
        [p["p50_ms"], p["p99_ms"]]
        for start in range(0, len(seconds) - FPS + 1, FPS)
        for p in (percentiles(1e3 * np.array(seconds[start : start + FPS])),)
    ]


def by_period(seconds: Sequence[float]) -> np.ndarray:
    """A frame's share of every PERIOD frames."""
    return np.array(seconds[: len(seconds) // PERIOD * PERIOD]).reshape(-1, PERIOD).mean(axis=1)


def time_call(action: Callable[[], object]) -> float:
    """The seconds it takes."""
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def shorten(values: dict[str, float]) -> dict[str, float]:
    """The percentiles under the names that `stylizer_ms` has them by."""
    return {name: values[f"{name}_ms"] for name in ("p50", "p95", "p99")}


def memory_mb() -> float:
    """What the process holds now, in megabytes; the most it has held where the system does not tell."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    except OSError:
        return peak_memory_mb() or 0.0


def peak_memory_mb() -> float | None:
    """The most that this process has held, in megabytes; None where the system does not tell."""
    unit = 1 if sys.platform == "darwin" else 1024  # it counts bytes there, kilobytes elsewhere
    most = usage("ru_maxrss")
    return None if most is None else round(most * unit / 1e6, 1)


def usage(name: str) -> int | None:
    """A field of what the system has counted for this process; None on Windows, where Python's library does not ask."""
    try:
        import resource
    except ImportError:
        return None
    return getattr(resource.getrusage(resource.RUSAGE_SELF), name)


def load() -> float | None:
    """How many programs wanted a processor in the last minute; None on Windows."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None
