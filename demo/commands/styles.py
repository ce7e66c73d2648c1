"""`patchwalk styles`: the styles that limbs can wear, and adding the user's own."""

import argparse
from pathlib import Path

from demo.commands.replay import STYLIZER_HELP

HELP = "list the styles, add one from a BVH file or from a video's key points, or remove it"
EXAMPLE = """patchwalk styles add limp.bvh --name limp
  patchwalk styles add key_points/ --name limp --stylizer unpaired --fps 25

A folder of key points holds one .json a frame, as OpenPose's --write_json makes them, in the BODY_25 or the COCO order.
A style from a BVH file is there for every stylizer, one from key points for unpaired."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="list|add|remove")
    options = {"formatter_class": argparse.RawDescriptionHelpFormatter, "allow_abbrev": False}
    shown = actions.add_parser("list", help="print the names", epilog="example:\n  patchwalk styles list", **options)
    add = actions.add_parser("add", help="learn a style from a clip", epilog=f"example:\n  {EXAMPLE}", **options)
    add.add_argument("clip", type=Path, metavar="CLIP.bvh|DIR",
                     help="a few seconds of walking or standing in that style, or a folder of OpenPose key points")
    add.add_argument("--name", required=True, help="what to call it")
    add.add_argument("--map", type=Path, metavar="FILE",
                     help='JSON {"our joint": "theirs", ...}, for a skeleton that is not recognised by its names')
    add.add_argument("--fps", type=float, default=30.0, help="frames a second of the key points (default: 30)")
    remove = actions.add_parser("remove", help="forget a style of your own",
                                epilog="example:\n  patchwalk styles remove limp", **options)
    remove.add_argument("name", help="a name that `styles list` prints")
    for parser in (shown, add, remove):
        parser.add_argument("--stylizer", metavar="NAME", help=STYLIZER_HELP)


def run(args: argparse.Namespace) -> int:
    import torch

    from sim import name_maps
    from stylizer import catalogue
    torch.set_num_threads(1)  # one clip is too little work for more
    bank = catalogue.bank(args.stylizer)
    if args.action == "add" and args.clip.is_dir():
        if not hasattr(bank, "add_points"):
            raise ValueError(f"{args.clip} is a folder: key points of a video are read with --stylizer unpaired")
        if not 1 <= args.fps <= 1000:
            raise ValueError(f"--fps {args.fps:g} is no frame rate: give that of the video, such as 25 or 30")
        bank.add_points(args.clip, args.name, args.fps)
        print(f"added {args.name}")
    elif args.action == "add":
        bank.add(args.clip, args.name, name_maps.load(args.map) if args.map else None)
        print(f"added {args.name}")
    elif args.action == "remove":
        bank.remove(args.name)
        print(f"removed {args.name}")
    else:
        print("\n".join(bank.names))
    return 0
