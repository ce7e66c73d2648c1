"""`patchwalk evaluate`: measured quality of the models, as a table, as JSON and as plots."""

import argparse
import json
import sys
from pathlib import Path

HELP = "measure the quality of a model (the controller's; the stylizer's is not in this version yet)"
EXAMPLE = "patchwalk evaluate controller --data mocap --json evaluation.json --plots evaluation"
COLUMNS = "{:<36} {:>10} {:>10} {:>18}  {}"
VERDICTS = {True: "ok", False: "short", None: "-"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", choices=("controller", "stylizer"), help="what to measure")
    parser.add_argument("--data", type=Path, metavar="DIR",
                        help="a folder of BVH files, to measure its held-out clips alike")
    parser.add_argument("--json", type=Path, metavar="OUT.json", help="where to write the figures")
    parser.add_argument("--plots", type=Path, metavar="DIR",
                        help="a folder to draw the controller's trajectory, speed and feet into")


def run(args: argparse.Namespace) -> int:
    if args.model == "stylizer":
        raise ValueError("the stylizer's evaluation is not here yet, it comes with the next issue; "
                         "`patchwalk evaluate controller` measures the controller")
    _check(args)
    from tqdm import tqdm

    from controller.evaluate import evaluate
    with tqdm(desc="evaluate controller", unit="frame", leave=False, disable=not sys.stderr.isatty()) as bar:
        def progress(frames: int):
            bar.reset(frames)
            return bar.update
        result = evaluate(args.data, progress)
    print(table(result.figures), flush=True)
    if args.json:
        from sim.atomic import replacing
        report = {"figures": {name: figure.as_json() for name, figure in result.figures.items()}}
        with replacing(args.json) as temporary:
            temporary.write_text(json.dumps(report, indent=2, allow_nan=False) + "\n")
        print(f"wrote {args.json}", flush=True)
    if args.plots:
        from controller.plots import save_plots
        for path in save_plots(args.plots, result.played, args.data):
            print(f"wrote {path}", flush=True)
    return 0


def table(figures) -> str:
    """Name, ours, the real clips', what to reach and whether it is, a figure a line."""
    lines = [COLUMNS.format("figure", "ours", "real", "reach", "")]
    for name, figure in figures.items():
        lines.append(COLUMNS.format(name, _number(figure.ours), _number(figure.real), _bounds(figure.low, figure.high),
                                    VERDICTS[figure.reached]))
    return "\n".join(lines)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _bounds(low: float | None, high: float | None) -> str:
    if low is None and high is None:
        return "-"
    if low is None:
        return f"at most {high:.4g}"
    return f"at least {low:.4g}" if high is None else f"{low:.4g} to {high:.4g}"


def _check(args: argparse.Namespace) -> None:
    """Raises ValueError or OSError for what could only fail after minutes of work."""
    if args.data and not args.data.is_dir():
        raise ValueError(f"there is no folder {args.data}; name one that holds BVH files with --data")
    if args.plots and args.plots.exists() and not args.plots.is_dir():
        raise ValueError(f"cannot draw into {args.plots}: it is not a folder")
    if args.json:
        from demo.export import check_outputs
        check_outputs({"json": args.json})
