"""`patchwalk bench`: how fast this machine is, on the bundled recording played round and round, every part restyled."""

import argparse
import json
import sys
import time
from dataclasses import replace
from itertools import cycle, islice
from pathlib import Path

HELP = "measure the time of every stage of a frame on this machine"
EXAMPLE = "patchwalk bench --seconds 20 --json bench.json"
CROWDS = (1, 4, 16, 64)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", type=Path, metavar="OUT.json", help="write the figures as JSON")
    parser.add_argument("--characters", type=_positive(int), default=1, metavar="N",
                        help="characters stepped in every frame (default: 1)")
    parser.add_argument("--seconds", type=_positive(float), default=10.0, metavar="S",
                        help="seconds of motion (default: 10)")


def run(args: argparse.Namespace) -> int:
    from demo import export
    from sim.atomic import replacing
    if args.json:
        export.check_outputs({"json": args.json})
    report = measure(args.characters, args.seconds)
    print_table(report)
    if args.json:
        with replacing(args.json) as temporary:
            temporary.write_text(json.dumps(report, indent=2) + "\n")
        print(f"wrote {args.json}")
    return 0


def measure(characters: int, seconds: float) -> dict:
    """The bench report of DESIGN.md, Sec. 4. What this version cannot measure yet is null: the full and the paper's
    slim network, their ratios, crowds of another size than the one asked for."""
    from demo import STARTED, assemble
    from sim import recording
    from sim.clip import FPS
    from sim.latency import Latency
    from sim.skeleton import PART_NAMES
    latency = Latency()
    sessions = [assemble.build_session(latency=latency) for _ in range(characters)]
    startup_s = time.perf_counter() - STARTED
    first_frame_s, start = None, time.perf_counter()
    frames = max(1, round(seconds * FPS))
    dressed = dict.fromkeys(PART_NAMES, (sessions[0].stylizer.styles[0], 1.0))  # an unstyled frame skips the network
    for command in islice(cycle(recording.read(assemble.BUNDLED_RECORDING)), frames):
        command = replace(command, style={**dressed, **command.style})
        for session in sessions:
            session.step(command)
        first_frame_s = first_frame_s or time.perf_counter() - STARTED
    elapsed = time.perf_counter() - start
    report = latency.report(startup_s=startup_s, **assemble.machine())
    shipped = {name: report["stylizer"][f"{name}_ms"] for name in ("p50", "p95", "p99")}
    crowd = {str(size): None for size in sorted({*CROWDS, characters})}
    return {**report,
            "stylizer_ms": {"full": None, "paper_slim": None, "shipped": shipped},
            "ratio": {"full_over_shipped": None, "paper_slim_over_shipped": None},
            "characters": crowd | {str(characters): round(1e3 * elapsed / (frames * characters), 4)},
            "rss_mb": peak_memory_mb(),
            "first_frame_s": round(first_frame_s, 3)}


def print_table(report: dict) -> None:
    """The figures a person wants to see."""
    from sim.latency import STAGES
    machine = report["machine"]
    print(f"{machine['cpu']}, {machine['threads']} of {machine['cores']} cores, torch {machine['torch']}")
    print(f"{'ms':<12}{'p50':>9}{'p95':>9}{'p99':>9}{'max':>9}")
    for stage in STAGES:
        if stage in report:
            print(f"{stage:<12}" + "".join(f"{milliseconds:9.3f}" for milliseconds in report[stage].values()))
    print(f"{report['missed_60hz']} of {report['frames']} frames over 16.67 ms; "
          f"first frame after {report['first_frame_s']:.2f} s; peak memory {report['rss_mb']} MB")
    for size, milliseconds in report["characters"].items():
        if milliseconds is not None:
            print(f"{size} character{'s' if size != '1' else ''}: {milliseconds:.3f} ms each")
    print("Not measured by this version, null in the JSON: the full network, the paper's slim one, other crowds.")


def peak_memory_mb() -> float | None:
    """The most memory this process has held, in megabytes; None on Windows, which Python's library does not ask."""
    try:
        import resource
    except ImportError:
        return None
    unit = 1 if sys.platform == "darwin" else 1024  # getrusage counts bytes there, kilobytes elsewhere
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6, 1)


def _positive(kind: type):
    def parse(text: str):
        try:
            value = kind(text)
        except ValueError:
            value = 0
        if not 0 < value < 1e6:
            raise argparse.ArgumentTypeError(f"'{text}' is no number above 0")
        return value
    return parse
