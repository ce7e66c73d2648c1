"""`patchwalk export onnx`: the models as ONNX graphs, for engines, with a table of their tensors and a player."""

import argparse
from pathlib import Path

HELP = "write controller, stylizer and styles as ONNX, for Unity, Unreal, Godot or whatever runs it"
EXAMPLE = "patchwalk export onnx OUT/ && python OUT/player.py demo.jsonl"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("format", choices=("onnx",), help="onnx: graphs, graphs.json and player.py (docs/ENGINES.md)")
    parser.add_argument("folder", type=Path, metavar="OUT", help="the folder, made where there is none")
    parser.add_argument(
        "--ground",
        metavar="NAME",
        default="stairs",
        help="the uneven ground that is written beside them for the player: hills, stairs, rough or a height map",
    )
    parser.add_argument(
        "--double",
        action="store_true",
        help="float64, for checking a port: engines take float32",
    )


def run(args: argparse.Namespace) -> int:
    from sim.ground.catalogue import FLAT, load_ground

    ground = load_ground(args.ground)
    if ground is None:
        raise ValueError(f"'{FLAT}' is what the player walks on without a ground: name an uneven one, or none")
    try:
        import onnx  # noqa: F401
    except ModuleNotFoundError as error:
        raise ValueError("export needs the Python package 'onnx': pip install -e '.[export]'") from error
    from demo import assemble
    from demo.export import onnx_folder

    for path in onnx_folder.write_folder(args.folder, assemble.build_session(), ground, args.double):
        print(f"wrote {path}")
    return 0
