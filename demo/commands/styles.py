"""`patchwalk styles`: the styles that there are, and adding the user's own."""

import argparse
import warnings
from pathlib import Path
from typing import Any

from demo.commands.replay import STYLIZER_HELP
from sim.io.provenance import SHIPPED

POINTS_FPS = 30.0  # of key points, unless told otherwise

HELP = "list the styles, add, rename or remove one of your own, or capture the own style anew"
EXAMPLE = """patchwalk styles add limp.bvh --name limp
  patchwalk styles add walk.bvh run.bvh --name limp
  patchwalk styles add key_points/ --name limp --stylizer unpaired --fps 25

Key points are a folder with one .json a frame, as OpenPose's --write_json makes it, AlphaPose's results, or MediaPipe's
landmarks: one .json with "width", "height" and "frames", each with "pose_landmarks". Several BVH files make one style,
which knows each movement that they show: walking, running, backing, strafing, turning, standing. So does one long file
that walks and runs. A style from BVH files is there for every stylizer, one from key points for unpaired."""

CAPTURE = """Restyling changes the controller's motion by what sets a style apart from the own style, which therefore
has to be the motion of the very controller that runs. This captures it (standing, walking, running, backing,
strafing, turning) and writes it, and what of all the other styles depends on it, for every stylizer. `patchwalk train
controller` ends with it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="list|add|rename|remove|capture")
    options: dict[str, Any] = {"formatter_class": argparse.RawDescriptionHelpFormatter, "allow_abbrev": False}
    shown = actions.add_parser(
        "list",
        help="print each name, and the movements that the style knows",
        epilog="example:\n  patchwalk styles list",
        **options,
    )
    add = actions.add_parser(
        "add", help="learn a style from one clip or several", epilog=f"example:\n  {EXAMPLE}", **options
    )
    add.add_argument(
        "clips",
        type=Path,
        nargs="+",
        metavar="CLIP.bvh|DIR",
        help="a few seconds of moving in that style, in one file or several, or a video's key points",
    )
    add.add_argument("--name", required=True, help="what to call it")
    add.add_argument(
        "--map",
        type=Path,
        metavar="FILE",
        help='JSON {"our joint": "theirs", ...}, for a skeleton that is not recognised by its names',
    )
    add.add_argument(
        "--fps",
        type=float,
        help="frames a second, where a BVH file says none that can be, or of key points (default: 30)",
    )
    rename = actions.add_parser(
        "rename",
        help="call a style of your own something else, in your presets too",
        epilog="example:\n  patchwalk styles rename limp hobble",
        **options,
    )
    rename.add_argument("name", metavar="OLD", help="a name that `styles list` prints")
    rename.add_argument("new", metavar="NEW", help="what to call it from now on")
    remove = actions.add_parser(
        "remove", help="forget a style of your own", epilog="example:\n  patchwalk styles remove limp", **options
    )
    remove.add_argument("name", help="a name that `styles list` prints")
    for parser in (shown, add, rename, remove):
        parser.add_argument("--stylizer", metavar="NAME", help=STYLIZER_HELP)
    capture = actions.add_parser(
        "capture",
        help="capture the own style anew from the controller",
        description=CAPTURE,
        epilog="example:\n  patchwalk styles capture",
        **options,
    )
    capture.add_argument(
        "--out", type=Path, metavar="DIR", help="where to write it (default: the package's own styles)"
    )


def run(args: argparse.Namespace) -> int:
    if args.action == "capture":
        print(capture(args.out))
        return 0
    if args.action == "remove":
        _remove(args.name)
    elif args.action == "rename":
        _rename(args.name, args.new, args.stylizer)
    elif args.action == "list":
        _list(args.stylizer)
    else:
        _add(args)
    return 0


def _add(args: argparse.Namespace) -> None:
    """Learns a style and says which seconds of which file show what."""
    from sim.io import bvh, motion_file
    from sim.retarget import joint_names
    from stylizer.styles import style_names

    bvh.check_fps(args.fps)
    style_names.check_name(args.name)
    style_names.check_free(args.name, style_names.known_names(args.stylizer or SHIPPED))
    for clip in args.clips:
        motion_file.check_there(clip)

    from stylizer.runtime import catalogue
    from stylizer.styles.code_bank import CodeBank
    from stylizer.styles.keypoint_files import is_one_file

    bank = catalogue.load_bank(args.stylizer)
    points = next((path for path in args.clips if path.is_dir() or is_one_file(path)), None)
    if points is None:
        name_map = joint_names.load(args.map) if args.map else None
        taken = bank.add(args.name, *args.clips, name_map=name_map, fps=args.fps).taken
        print(f"added {args.name}", *taken, sep="\n")
        return
    if not (isinstance(bank, CodeBank) and bank.system.reads_key_points):
        raise ValueError(f"{points} holds no BVH file: key points of a video are read with --stylizer unpaired")
    if len(args.clips) > 1:
        raise ValueError(f"{points} holds key points, which make a style by themselves: name it alone")
    bank.add_points(points, args.name, args.fps or POINTS_FPS)
    print(f"added {args.name}")


def _remove(name: str) -> None:
    """Forgets a style of the user's by its file. Raises ValueError where there is none."""
    from stylizer.styles import style_names

    if not style_names.remove(name, style_names.user_folder()):
        known = style_names.style_files(SHIPPED)
        if name not in known:
            raise style_names.unknown_style(name, known)
        raise ValueError(f"'{name}' comes with Patchwalk and cannot be removed: only styles that you added can")
    print(f"removed {name}")


def _rename(name: str, new: str, stylizer: str | None) -> None:
    """Calls a style of the user's something else, in their presets too, as the window does. Raises ValueError where
    there is none of that name, or the new one is none or taken."""
    from demo.state.presets import Presets
    from stylizer.runtime import catalogue

    catalogue.load_bank(stylizer).rename(name, new)
    Presets().rename(name, new)
    print(f"renamed {name} to {new}")


def _list(stylizer: str | None) -> None:
    """A name a line, what is known of how that style moves, and which are for non-commercial use; a warning for each
    file that cannot be used."""
    from demo.state.style_names import movement_names
    from sim.io.provenance import NONCOMMERCIAL
    from stylizer.styles import style_names

    shown = []
    for entry in style_names.style_entries(stylizer or SHIPPED):
        if isinstance(entry, str):
            warnings.warn(entry, stacklevel=2)
        else:
            shown.append(entry)
    width = max((len(entry.name) for entry in shown), default=0)
    for name, movements, noncommercial in shown:
        mark = f"  ({NONCOMMERCIAL} use only)" if noncommercial else ""
        print(f"{name:<{width}}  {', '.join(movement_names(movements))}{mark}".rstrip())


def capture(out: Path | None = None, weights_folder: Path | None = None) -> str:
    """Captures the own style from the controller whose weights lie in a folder (None: the shipped one), and writes it
    and what depends on it into the folder `out` (None: the package's own styles). A sentence that says what was
    written."""
    from controller.model import checkpoint
    from controller.runtime.controller import PhaseFunctionedController
    from stylizer.styles import own_style
    from stylizer.styles.style_names import BUNDLED
    from stylizer.training import build_styles

    out, folder = out or BUNDLED, weights_folder or checkpoint.FOLDER
    if out.exists() and not out.is_dir():
        raise ValueError(f"cannot write styles into {out}: it is not a folder")
    network, fingerprint = checkpoint.load(folder=folder), checkpoint.fingerprint(folder=folder)
    motion = own_style.capture_motion(PhaseFunctionedController(network, fingerprint), fingerprint)
    files = build_styles.rebuild(motion, out)
    return (
        f"captured the own style from the controller in {folder}: wrote {len(files)} style files into {out}, "
        "which belong with its weights"
    )
