"""`patchwalk styles`: the styles that limbs can wear, and adding the user's own."""

import argparse
from pathlib import Path

HELP = "list the styles, add one from a BVH file, or remove it"
EXAMPLE = "patchwalk styles add limp.bvh --name limp"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="list|add|remove")
    options = {"formatter_class": argparse.RawDescriptionHelpFormatter, "allow_abbrev": False}
    actions.add_parser("list", help="print the names", epilog="example:\n  patchwalk styles list", **options)
    add = actions.add_parser("add", help="learn a style from a clip", epilog=f"example:\n  {EXAMPLE}", **options)
    add.add_argument("clip", type=Path, metavar="CLIP.bvh", help="a few seconds of walking or standing in that style")
    add.add_argument("--name", required=True, help="what to call it")
    add.add_argument("--map", type=Path, metavar="FILE",
                     help='JSON {"our joint": "theirs", ...}, for a skeleton that is not recognised by its names')
    remove = actions.add_parser("remove", help="forget a style of your own",
                                epilog="example:\n  patchwalk styles remove limp", **options)
    remove.add_argument("name", help="a name that `styles list` prints")


def run(args: argparse.Namespace) -> int:
    import torch

    from sim import name_maps
    from stylizer.bank import Bank
    torch.set_num_threads(1)  # one clip is too little work for more
    bank = Bank()
    if args.action == "add":
        bank.add(args.clip, args.name, name_maps.load(args.map) if args.map else None)
        print(f"added {args.name}")
    elif args.action == "remove":
        bank.remove(args.name)
        print(f"removed {args.name}")
    else:
        print("\n".join(bank.names))
    return 0
