"""`patchwalk train`: learn the weights of a model from a folder of BVH files."""

import argparse
import importlib
from pathlib import Path

from demo.commands import styles
from demo.commands.bench import positive

HELP = "train a model on a folder of BVH files"
EXAMPLE = "patchwalk train controller --data mocap --minutes 60 --out runs/controller"
MODELS = ("controller", "stylizer")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", choices=MODELS, help="what to train")
    parser.add_argument(
        "--data",
        type=Path,
        default=Path("../shared/mocap"),
        metavar="DIR",
        help="a folder of BVH files, searched to any depth (default: %(default)s)",
    )
    parser.add_argument(
        "--minutes", type=positive(float), metavar="M", help="when to stop (default: enough for that model)"
    )
    parser.add_argument(
        "--steps",
        type=positive(int),
        metavar="N",
        help="stylizer only: stop after so many steps, however long they take, to compare networks",
    )
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint in the output folder")
    parser.add_argument(
        "--start",
        type=Path,
        metavar="FILE",
        help="controller only: weights to begin with, as controller/weights/pfnn.safetensors",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="where weights, checkpoint and curve go (default: runs/MODEL)"
    )
    parser.add_argument(
        "--network",
        metavar="NAME",
        help="stylizer only: joints (default), or what it is without a piece: joints_half_second, joints_no_attention, "
        "joints_whole_body_adain; the paper's own form: slim, slim_no_attention, slim_whole_body_adain, paper_narrow, "
        "paper_slim, large, full; or another system: unpaired, diverse, diverse_full, latent, latent_unlabelled, "
        "latent_vae",
    )
    parser.add_argument("--recipe", metavar="NAME", help="stylizer only: ours (default) or paper, its losses alone")
    parser.add_argument(
        "--leave-out",
        nargs="+",
        metavar="WORD",
        help="stylizer only: clips with one of these words in their name are not learned from",
    )


def run(args: argparse.Namespace) -> int:
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
    named = ("network", "recipe", "leave_out", "steps")
    chosen = {name: getattr(args, name) for name in named if getattr(args, name) is not None}
    if chosen and args.model != "stylizer":
        wrong = next(iter(chosen)).replace("_", "-")
        raise ValueError(f"the {args.model} has one form, one recipe and its clock: leave --{wrong} out")
    if args.start and args.model != "controller":
        raise ValueError("only the controller starts from weights: leave --start out")
    if args.start and not args.start.is_file():
        raise ValueError(f"there is no weight file {args.start}: name one with --start, or leave it out")
    if args.minutes and args.steps:
        raise ValueError("training stops after some minutes or after some steps: leave --minutes or --steps out")
    if args.minutes is not None:
        chosen["minutes"] = args.minutes
    if args.start:
        chosen["start"] = args.start
    weights = importlib.import_module(f"{args.model}.training.train").train(
        args.data, out, resume=args.resume, **chosen
    )
    print(f"wrote {weights}", flush=True)
    if args.model == "controller":
        print(styles.capture(out / "styles", out))
    return 0
