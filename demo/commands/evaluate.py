"""`patchwalk evaluate`: measured quality of the models. Arguments are settled, the work comes with the next issue."""

import argparse
from pathlib import Path

HELP = "measure the quality of a model (not in this version yet)"
EXAMPLE = "patchwalk evaluate stylizer --data mocap --json evaluation.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", choices=("controller", "stylizer"), help="what to measure")
    parser.add_argument("--data", type=Path, metavar="DIR", help="a folder of BVH files")
    parser.add_argument("--json", type=Path, metavar="OUT.json", help="where to write the figures")


def run(args: argparse.Namespace) -> int:
    raise ValueError("evaluate is not here yet, it comes with the next issue; `patchwalk bench` measures speed")
