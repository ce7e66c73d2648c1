"""`patchwalk stylize`: restyle a clip of the user's own. Arguments are settled, the work comes with the next issue."""

import argparse
from pathlib import Path

HELP = "restyle a BVH file (not in this version yet)"
EXAMPLE = "patchwalk stylize walk.bvh --style arms=old:0.8 --style spine=proud -o new.bvh"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("content", type=Path, metavar="CONTENT.bvh", help="the motion to restyle")
    parser.add_argument("--style", type=_style, action="append", required=True,
                        metavar="PART=CLIP_OR_NAME[:STRENGTH]", help="a body part or group and its style")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT.bvh", help="where to write the result")
    parser.add_argument("--stylizer", metavar="NAME", help="the weights to use")


def _style(text: str):
    from demo.style_names import parse_style
    try:
        return parse_style(text)
    except ValueError as error:  # of an ordinary ValueError argparse would show the type's name only
        raise argparse.ArgumentTypeError(str(error)) from None


def run(args: argparse.Namespace) -> int:
    raise ValueError("stylize is not here yet, it comes with the next issue; "
                     "`patchwalk replay` with --bvh writes styled motion")
