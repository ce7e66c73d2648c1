"""`patchwalk bench`: how fast this machine is, on the bundled recording played round and round, every part restyled."""

import argparse
import json
from pathlib import Path
from typing import Callable

from sim.io.text_files import read_json

HELP = "time every stage of a frame on this machine, beside the paper's networks and the machine's own speed"
EXAMPLE = """patchwalk bench --seconds 20 --json bench.json --plot bench.png
  patchwalk bench --seconds 600    ten minutes: also whether memory grows and the last minute is as quick as the first

Everything is measured in one process, on one thread, in turns: a stretch of frames, the paper's full network, its slim
one, the machine's matrix products and memory, and again; so what else runs on the machine slows all of them, and ratios
hold. Two seconds of frames, and two windows of each network, are left out as warm-up. Times are medians and percentiles
of all that was measured; nothing is thrown away. The load and how often the system took the processor away stand
beside them: take times, not ratios, from a machine with a load under 1.5. The paper's networks have untrained weights,
which cost the same. Styles are interpolated anew in every fourth frame: the shipped time is the mean of four frames.
A crowd is one session of many characters, each of them somewhere else in the recording; its frame is everybody's."""
COMPARED = {"full": "full network", "paper_slim": "paper's slim", "shipped": "shipped"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", type=Path, metavar="OUT.json", help="write the figures as JSON")
    parser.add_argument("--plot", type=Path, metavar="OUT.png", help="draw them")
    parser.add_argument(
        "--quality",
        type=Path,
        metavar="EVAL.json",
        help="what `patchwalk evaluate stylizer --json` wrote: drawn against its times beside the rest",
    )
    parser.add_argument(
        "--characters",
        type=positive(int),
        default=1,
        metavar="N",
        help="characters stepped together in a frame (default: 1); crowds of 1, 4, 16 and 64 are always timed",
    )
    parser.add_argument(
        "--seconds", type=positive(float), default=10.0, metavar="S", help="seconds of motion (default: 10)"
    )


def run(args: argparse.Namespace) -> int:
    from demo import STARTED
    from demo.export import export
    from sim.io.atomic_write import atomic_write

    export.check_outputs({kind: path for kind in ("json", "plot") if (path := getattr(args, kind))})
    quality = _rows(args.quality, args.plot) if args.quality else None
    from demo.bench import bench

    report = bench.measure(args.characters, args.seconds, STARTED)
    print_table(report)
    if args.json:
        with atomic_write(args.json) as temporary:
            temporary.write_text(json.dumps(report, indent=2) + "\n")
        print(f"wrote {args.json}")
    if args.plot:
        from demo.bench import plots

        plots.save(report, args.plot, quality)
        print(f"wrote {args.plot}")
    return 0


def print_table(report: dict) -> None:
    """The figures a person wants to see."""
    from sim.latency import STAGES

    machine, ratio, noise = report["machine"], report["ratio"], report["noise"]
    print(f"{machine['cpu']}, {machine['threads']} of {machine['cores']} cores, torch {machine['torch']}")
    print(f"{'ms':<14}{'p50':>9}{'p95':>9}{'p99':>9}{'max':>9}")
    for stage in STAGES:
        if stage in report:
            print(f"{stage:<14}" + "".join(f"{milliseconds:9.3f}" for milliseconds in report[stage].values()))
    for name, text in COMPARED.items():
        print(f"{text:<14}" + "".join(f"{milliseconds:9.3f}" for milliseconds in report["stylizer_ms"][name].values()))
    print(
        f"full / shipped {ratio['full_over_shipped']:.1f}, "
        f"paper's slim / shipped {ratio['paper_slim_over_shipped']:.1f}"
    )
    print(
        f"{report['missed_60hz']} of {report['frames']} frames over 16.67 ms; "
        f"first frame after {report['first_frame_s']:.2f} s; peak memory {report['rss_mb']} MB"
    )
    for size, milliseconds in report["characters"].items():
        print(f"{size} character{'s' if size != '1' else ''}: {milliseconds:.3f} ms each")
    print(f"one of 64 / a lone one {ratio['one_of_64_over_lone']:.2f}")
    speed, bound = report["machine_speed"], report["bound"]
    print(
        "matrix products, GFLOP/s: "
        + ", ".join(f"{shape} {value}" for shape, value in speed["sgemm_gflops"].items())
        + f"; memory {speed['read_gb_s']} GB/s"
    )
    if bound:
        print(
            f"shipped network: {bound['mflop']} MFLOP a frame, {bound['weights_mb']} MB of weights: at least "
            f"{bound['arithmetic_ms']:.3f} ms of arithmetic, {bound['memory_ms']:.3f} ms of memory; the stylizer takes "
            f"{bound['shipped_over_bound']:.1f} times that"
        )
    collector, steady = report["collector"], report["steady"]
    print(
        f"collector: {collector['pauses']} pauses, longest {collector['longest_ms']} ms; "
        f"load {noise['load']}, preempted {noise['preempted']} times"
    )
    if steady:
        print(
            f"p99 of the last minute / the first {steady['ratio']:.2f}; "
            f"memory grew by {steady['growth_mb']} MB in between"
        )


def _rows(path: Path, plot: Path | None) -> list[dict]:
    """The rows of an evaluation's JSON. Raises ValueError or OSError for what is none, or where nothing is drawn."""
    if plot is None:
        raise ValueError("--quality is drawn: say where with --plot OUT.png")
    try:
        rows = read_json(path)["rows"]
        rows = [row for row in rows if row["model"] and row["mode"]]
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(
            f"{path} is no report of the stylizer: write one with 'patchwalk evaluate stylizer --json'"
        ) from error
    return rows


def positive(kind: type[int] | type[float]) -> Callable[[str], float]:
    """What argparse makes of a number above 0."""

    def parse(text: str) -> float:
        try:
            value: float = kind(text)
        except ValueError:
            value = 0
        if not 0 < value < 1e6:
            raise argparse.ArgumentTypeError(f"'{text}' is no number above 0")
        return value

    return parse
