"""`patchwalk evaluate`: measured quality of the models, as a table, as JSON and as plots."""

import argparse
import json
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Callable, Iterator, Mapping

from demo.commands.replay import STYLIZER_HELP
from stylizer.systems.registry import system_of_network

if TYPE_CHECKING:
    from controller.evaluation.figures import Figure

HELP = "measure the quality of a model"
EXAMPLE = """patchwalk evaluate controller --data mocap --json evaluation.json --plots evaluation
  patchwalk evaluate stylizer --data mocap --json transfer.json --plots insight
  patchwalk evaluate live --data mocap --json live.json --plots strips
  patchwalk evaluate character hero.glb"""
ABOUT = {  # what each model's help says
    "controller": """Plays a fixed suite of commands and measures the motion, in about six minutes on one
core; with --data beside held-out clips.""",
    "stylizer": """Measures transfer from clip to clip, in about a quarter of an hour for the shipped weights, half
of it where its judges have been trained before, longer with --weights for larger networks; it needs the labelled
Bandai-Namco motion.""",
    "live": """Measures what the session draws, every bundled style walking, running, backing, strafing, turning
and standing, as the controller moves and after the foot lock, in about twelve minutes on one core; it needs
Bandai-Namco's and SNU's motion in --data.""",
    "character": """Measures how truly skinned figures follow the session's poses, over a minute of the bundled
recording on level floor: directions of their limbs, heights of planted soles, how far these slide.""",
}
EXAMPLES = {
    "controller": "patchwalk evaluate controller --data mocap --json evaluation.json --plots evaluation",
    "stylizer": """patchwalk evaluate stylizer --data mocap --json transfer.json --plots insight
  patchwalk evaluate stylizer --all --data mocap --json systems.json""",
    "live": "patchwalk evaluate live --data mocap --json live.json --plots strips",
    "character": "patchwalk evaluate character hero.glb other.vrm --json characters.json",
}
DATA = {
    "controller": "a folder of BVH files: held-out clips to measure alike",
    "stylizer": "a folder with Bandai-Namco's labelled motion; needed",
    "live": "a folder with Bandai-Namco's and SNU's motion; needed",
}
PLOTS = {
    "controller": "a folder to draw trajectory, speed, feet and strips of poses into",
    "stylizer": "a folder to draw into: what attention looks at, blends, locality, every style on one walk",
    "live": "a folder to draw strips of every style into: neutral, drawn, captured",
}
COLUMNS = "{:<36} {:>10} {:>10} {:>18}  {}"
VERDICTS = {True: "ok", False: "short", None: "-"}
CHARACTER_SECONDS = 60  # of the bundled recording
ROW_COLUMNS = "{:<18} {:<8} {:>13} {:>13} {:>13} {:>13} {:>13} {:>13} {:>8}"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    models = parser.add_subparsers(dest="model", required=True, metavar="|".join(MODELS))
    each = {
        name: models.add_parser(
            name,
            help=" ".join(ABOUT[name].partition(",")[0].split()).lower(),
            description=ABOUT[name],
            epilog=f"example:\n  {EXAMPLES[name]}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        for name in MODELS
    }
    for name, model in each.items():
        model.add_argument("--json", type=Path, metavar="OUT.json", help="where to write the figures")
        if name in DATA:
            model.add_argument("--data", type=Path, metavar="DIR", help=DATA[name])
            model.add_argument("--plots", type=Path, metavar="DIR", help=PLOTS[name])
    each["character"].add_argument("files", nargs="+", type=Path, metavar="HERO.glb", help="skinned figures to measure")
    each["stylizer"].add_argument(
        "--all",
        nargs="*",
        metavar="NETWORK",
        help="every system whose weights are there in one table, with 95%% intervals, or those named alone",
    )
    each["stylizer"].add_argument(
        "--weights",
        type=Path,
        metavar="DIR",
        help="a folder with more weights than the shipped ones, to put beside them: joints_half_second, "
        "joints_no_attention, joints_whole_body_adain, paper_narrow, full, large, left_out; with --all full, large, "
        "unpaired, diverse, latent, latent_vae, latent_unlabelled (.safetensors)",
    )
    each["live"].add_argument("--stylizer", metavar="NAME", help=STYLIZER_HELP)
    each["live"].add_argument(
        "--weights",
        type=Path,
        metavar="DIR",
        help="a folder that `train stylizer` wrote weights and styles into, to measure instead of the shipped ones",
    )
    each["live"].add_argument(
        "--movements",
        nargs="+",
        metavar="NAME",
        help="these movements alone, such as walk_1.3 run_3.0 back, instead of all",
    )


def run(args: argparse.Namespace) -> int:
    _check(args)
    return MODELS[args.model](args)


def _controller(args: argparse.Namespace) -> int:
    from controller.evaluation.report import evaluate

    with _bar(args.model, "frame") as progress:
        result = evaluate(args.data, progress)
    print(figures_table(result.figures), flush=True)
    if args.json:
        _write(args.json, {"figures": {name: figure.as_json() for name, figure in result.figures.items()}})
    if args.plots:
        from controller.evaluation.plots import save_plots

        for path in save_plots(args.plots, result.played, args.data):
            print(f"wrote {path}", flush=True)
    return 0


def _stylizer(args: argparse.Namespace) -> int:
    if not args.data:
        raise ValueError(
            "the stylizer is judged on labelled motion: name a folder that holds Bandai-Namco's with --data"
        )
    if args.all is not None:
        return _all_stylizers(args)
    from stylizer.evaluation.report import evaluate_transfer

    with _bar(args.model, "step") as progress:
        result = evaluate_transfer(args.data, args.weights, progress)
    print(transfer_table(result.report), *result.notes, sep="\n", flush=True)
    if args.json:
        _write(args.json, result.report)
    if args.plots:
        from stylizer.evaluation.pictures import save_pictures

        for path in save_pictures(args.plots, args.data):
            print(f"wrote {path}", flush=True)
    return 0


def _live(args: argparse.Namespace) -> int:
    if not args.data:
        raise ValueError(
            "drawn motion is judged beside captured motion: "
            "name a folder that holds Bandai-Namco's and SNU's with --data"
        )
    from demo.assemble import build_session
    from stylizer.evaluation.live_benchmark import MOVEMENTS, evaluate_live, format_table
    from stylizer.evaluation.report import round_figures

    names = args.movements or list(MOVEMENTS)
    if unknown := [name for name in names if name not in MOVEMENTS]:
        raise ValueError(f"there is no movement '{unknown[0]}': use some of {', '.join(MOVEMENTS)}")
    session = build_session(args.stylizer, weights=args.weights)
    with _bar(args.model, "step") as progress:
        result = evaluate_live(session, args.data, progress, {name: MOVEMENTS[name] for name in names})
    print(format_table(result.report), flush=True)
    if args.json:
        _write(args.json, round_figures(result.report))
    if args.plots:
        from stylizer.evaluation.live_strips import save_strips

        for path in save_strips(args.plots, result):
            print(f"wrote {path}", flush=True)
    return 0


def _character(args: argparse.Namespace) -> int:
    from demo.assemble import BUNDLED_RECORDING, build_session
    from sim.character.character import load_character
    from sim.character.figures import measure
    from sim.io import recording
    from sim.motion.clip import FPS

    characters = [load_character(path) for path in args.files]
    session = build_session()
    poses = [
        session.step(command).styled for command in recording.read(BUNDLED_RECORDING).first(CHARACTER_SECONDS * FPS)
    ]
    report = {str(character.path): measure(character, poses) for character in characters}
    names = list(dict.fromkeys(name for figures in report.values() for name in figures))
    print("\n".join(f"{name:<24}" + "".join(f" {each[name]:8.2f}" for each in report.values()) for name in names))
    if args.json:
        _write(args.json, report)
    return 0


def _all_stylizers(args: argparse.Namespace) -> int:
    from stylizer.evaluation import compare

    with _bar("all stylizers", "step") as progress:
        result = compare.compare(args.data, args.weights, progress, args.all)
    print(compare.format_comparison(result.report), *result.notes, sep="\n", flush=True)
    if args.json:
        _write(args.json, result.report)
    return 0


@contextmanager
def _bar(model: str, unit: str) -> Iterator[Callable[[int], Callable[[], object]]]:
    """A progress bar, as what an evaluation wants: told how much there is to do, it returns what to call once a
    unit."""
    from tqdm import tqdm

    with ExitStack() as bars:  # none before it is known how much there is to do: reading has a bar of its own

        def progress(total: int) -> Callable[[], object]:
            bar = tqdm(desc=f"evaluate {model}", total=total, unit=unit, leave=False, disable=not sys.stderr.isatty())
            return bars.enter_context(bar).update

        yield progress


def _write(path: Path, report: dict) -> None:
    from sim.io.atomic_write import atomic_write

    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(report, indent=2, allow_nan=False) + "\n")
    print(f"wrote {path}", flush=True)


MODELS = {"controller": _controller, "stylizer": _stylizer, "live": _live, "character": _character}


def transfer_table(report: dict) -> str:
    """The stylizer's rows, mean and deviation over the trials, and the further figures, a name and a value a line."""
    names = ("sra", "cra", "fmd", "geodesic", "skate_cm_s", "jitter_ratio")
    lines = [ROW_COLUMNS.format("model", "mode", *names, "ms")]
    for row in ({"model": "real motion", "mode": "", **report["real"]}, *report["rows"]):
        cells = ["-" if row.get(name) is None else "{:.3g} ± {:.2g}".format(*row[name]) for name in names]
        cost = f"{row['ms_per_frame'][0]:.1f}" if row["mode"] else "-"
        lines.append(ROW_COLUMNS.format(row["model"], row["mode"], *cells, cost))
    return "\n".join([*lines, "", *_flat("", report["figures"])])


def _flat(prefix: str, value: object) -> Iterator[str]:
    if isinstance(value, dict):
        for name, item in value.items():
            yield from _flat(f"{prefix} {name}", item)
    else:
        yield f"{prefix.strip():<48} {value}"


def figures_table(figures: "Mapping[str, Figure]") -> str:
    """Name, ours, the real clips', what to reach and whether it is, a figure a line."""
    lines = [COLUMNS.format("figure", "ours", "real", "reach", "")]
    for name, figure in figures.items():
        lines.append(
            COLUMNS.format(
                name,
                _number(figure.ours),
                _number(figure.real),
                _bounds(figure.low, figure.high),
                VERDICTS[figure.reached],
            )
        )
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
    weights = getattr(args, "weights", None)
    plots, data = getattr(args, "plots", None), getattr(args, "data", None)
    if getattr(args, "all", None) is not None and plots:
        raise ValueError("--all draws no pictures: leave --plots out")
    for name in getattr(args, "all", None) or ():
        system_of_network(name)
    if data and not data.is_dir():
        raise ValueError(f"there is no folder {data}; name one that holds BVH files with --data")
    if weights and not weights.is_dir():
        raise ValueError(f"there is no folder {weights}; name one that holds stylizer weights with --weights")
    if plots and plots.exists() and not plots.is_dir():
        raise ValueError(f"cannot draw into {plots}: it is not a folder")
    if args.json:
        from demo.export.export import check_outputs

        check_outputs({"json": args.json})
