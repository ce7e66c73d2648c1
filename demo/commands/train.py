"""`patchwalk train`: learn the weights of a model from a folder of BVH files."""

import argparse
import importlib
from pathlib import Path
from typing import Any

from demo.commands import styles
from demo.commands.bench import positive
from stylizer.systems.registry import system_of_network

HELP = "train a model on a folder of BVH files"
EXAMPLE = "patchwalk train controller --data mocap --minutes 60 --out runs/controller"
OWN_OPTIONS = ("minutes", "start", "network", "recipe", "leave_out", "steps")  # handed on where they are given


def add_arguments(parser: argparse.ArgumentParser) -> None:
    models = parser.add_subparsers(dest="model", required=True, metavar="controller|stylizer")
    options: dict[str, Any] = {"formatter_class": argparse.RawDescriptionHelpFormatter, "allow_abbrev": False}
    controller = models.add_parser(
        "controller", help="the neutral motion, from commands", epilog=f"example:\n  {EXAMPLE}", **options
    )
    stylizer = models.add_parser(
        "stylizer",
        help="a style-transfer network",
        epilog="example:\n  patchwalk train stylizer --data mocap --steps 3000",
        **options,
    )
    for model in (controller, stylizer):
        model.add_argument(
            "--data", type=Path, metavar="DIR", help="a folder of BVH files, searched to any depth; needed"
        )
        model.add_argument("--minutes", type=positive(float), metavar="M", help="when to stop (default: 60)")
        model.add_argument("--resume", action="store_true", help="go on from the last checkpoint in the output folder")
        model.add_argument(
            "--out", type=Path, metavar="DIR", help="where weights, checkpoint and curve go (default: runs/MODEL)"
        )
    controller.add_argument(
        "--start", type=Path, metavar="FILE", help="weights to begin with, as controller/weights/pfnn.safetensors"
    )
    stylizer.add_argument(
        "--start", type=Path, metavar="FILE", help="trained weights of unpaired, diverse or latent, for --recipe live"
    )
    stylizer.add_argument(
        "--steps",
        type=positive(int),
        metavar="N",
        help="stop after so many steps, however long they take, to compare networks",
    )
    stylizer.add_argument(
        "--network",
        metavar="NAME",
        help="joints (default), or what it is without a piece: joints_half_second, joints_no_attention, "
        "joints_whole_body_adain; the paper's own form: slim, slim_no_attention, slim_whole_body_adain, paper_narrow, "
        "paper_slim, large, full; or another system: unpaired, diverse, diverse_full, latent, latent_unlabelled, "
        "latent_vae",
    )
    stylizer.add_argument(
        "--recipe",
        metavar="NAME",
        help="ours (default); paper, its losses alone; live: unpaired, diverse or latent, trained before, learn what "
        "to give live, where nothing is to be seen of what comes next",
    )
    stylizer.add_argument(
        "--leave-out",
        nargs="+",
        metavar="WORD",
        help="clips with one of these words in their name are not learned from",
    )


def run(args: argparse.Namespace) -> int:
    if args.data is None:
        raise ValueError("there is nothing to learn from: name a folder of BVH files with --data")
    if not args.data.is_dir():
        raise ValueError(f"there is no folder {args.data}; name one that holds BVH files with --data")
    if next(args.data.rglob("*.[bB][vV][hH]"), None) is None:
        packed = next(args.data.glob("*.tar.*"), None)
        hint = f"unpack its archives first: tar xf {packed} -C FOLDER" if packed else "name another with --data"
        raise ValueError(f"{args.data} holds no BVH files; {hint}")
    out = args.out or Path("runs") / args.model
    started = (out / "checkpoint.pt").exists()
    if started and not args.resume:
        raise ValueError(f"{out} holds a run already; go on with --resume, or choose another folder with --out")
    if args.resume and not started:
        raise ValueError(f"{out} holds no run to go on with; leave --resume out, or name its folder with --out")
    chosen = {name: value for name in OWN_OPTIONS if (value := getattr(args, name, None)) is not None}
    if "start" in chosen and not args.start.is_file():
        raise ValueError(f"there is no weight file {args.start}: name one with --start, or leave it out")
    if "minutes" in chosen and "steps" in chosen:
        raise ValueError("training stops after some minutes or after some steps: leave --minutes or --steps out")
    if "network" in chosen:
        system_of_network(args.network)  # first: a mistake in its name is said before anything heavy is loaded
    weights = importlib.import_module(f"{args.model}.training.train").train(
        args.data, out, resume=args.resume, **chosen
    )
    print(f"wrote {weights}", flush=True)
    if args.model == "controller":
        print(styles.capture(out / "styles", out))
    return 0
