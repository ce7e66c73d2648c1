"""`patchwalk stylize`: restyle a clip of the user's own, part by part."""

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import Iterable

from demo.commands.replay import STYLIZER_HELP, add_takeaway, takeaway_of
from sim.io.provenance import SHIPPED
from sim.style_spec import PartSpec, StyleSpec

HELP = "restyle a BVH file, body part by body part"
EXAMPLE = """patchwalk stylize walk.bvh --style arms=old:0.8 --style spine=proud -o new.bvh
  patchwalk stylize walk.bvh --style legs=limp.bvh --style arms=old+proud@0.4 --retarget-back -o new.bvh

PART is left_leg, right_leg, spine, left_arm, right_arm, or legs, arms, upper, all. A style is a name that `patchwalk
styles list` prints or any BVH clip that shows it. STRENGTH goes from 0 (as it was) over 1 to 1.5 (exaggerated).
A+B@SHARE goes that share of the way, 0 to 1, from style A to style B."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "content",
        type=Path,
        metavar="CONTENT",
        help="the motion to restyle: BVH, glTF (.glb, .glb#ANIMATION), or SMPL as AMASS has it (.npz)",
    )
    parser.add_argument(
        "--style",
        type=_style,
        action="append",
        required=True,
        metavar="PART=CLIP_OR_NAME[:STRENGTH]",
        help="a body part or group and its style; once for each",
    )
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT.bvh|OUT.glb", help="where to write it")
    parser.add_argument(
        "--retarget-back",
        action="store_true",
        help="write it on the content's own skeleton, in its unit and frame rate (default: ours, 60 a second)",
    )
    add_takeaway(parser)
    parser.add_argument(
        "--map",
        type=Path,
        metavar="FILE",
        help='JSON {"our joint": "theirs", ...}, for a content skeleton that is not recognised by its names',
    )
    parser.add_argument(
        "--fps", type=float, help="frames a second of the content, believed in place of what its file says"
    )
    parser.add_argument("--stylizer", metavar="NAME", help=STYLIZER_HELP)
    parser.add_argument(
        "--global-motion",
        action="store_true",
        help="let the style change the way over the floor too: unpaired warps the time by how quick the style "
        "is, latent tells the root's way from the local motion; the default keeps the content's",
    )


def _style(text: str) -> tuple[tuple[str, ...], PartSpec]:
    from demo.state.style_names import parse_style

    try:
        return parse_style(text)
    except ValueError as error:  # of an ordinary ValueError argparse would show the type's name only
        raise argparse.ArgumentTypeError(str(error)) from None


def run(args: argparse.Namespace) -> int:
    from demo.export.export import check_outputs
    from sim.io import motion_file
    from sim.retarget import joint_names
    from stylizer.styles import style_names

    style = _by_part(args.style)
    if args.output.resolve() == args.content.resolve():
        raise ValueError(f"{args.output} is the content itself: write to another file")
    kind = "glb" if args.output.suffix.lower() == ".glb" else "bvh"
    if args.retarget_back and (args.character or args.in_place or args.rate != 60):
        raise ValueError("--retarget-back writes the content's own skeleton, way and frame rate: leave the others out")
    if kind == "glb" and args.retarget_back:
        raise ValueError("--retarget-back writes the content's own skeleton, as BVH: name the output .bvh")
    check_outputs({kind: args.output})
    motion_file.check_there(args.content)
    style_names.check_known(style.names, args.stylizer or SHIPPED)
    name_map = joint_names.load(args.map) if args.map else None
    takeaway = takeaway_of(args)

    from sim.io import bvh
    from sim.retarget.retarget import to_clip
    from stylizer.runtime import catalogue
    from stylizer.runtime.offline import resolve_styles, stylize

    start = time.perf_counter()
    motion = motion_file.read(args.content, args.fps)
    content = replace(to_clip(motion, args.content, name_map), name=str(args.content))  # as messages name it
    bank = catalogue.load_bank(args.stylizer)
    styled = stylize(bank.model, content, resolve_styles(bank, style))
    if args.global_motion:
        from stylizer.runtime.global_motion import change_global_motion

        styled = change_global_motion(bank, styled, content, style)
    if args.retarget_back:
        from sim.retarget.retarget_back import retarget_back

        bvh.write(args.output, retarget_back(motion, content, styled, name_map))
    else:
        from demo.export import export

        export.WRITERS[kind](args.output, export.of_clip(styled, style, takeaway))
    seconds = len(content) / content.fps
    print(f"{args.content.name}: {seconds:.1f} s of motion restyled in {time.perf_counter() - start:.1f} s")
    print(f"wrote {args.output}")
    return 0


def _by_part(styles: Iterable[tuple[tuple[str, ...], PartSpec]]) -> StyleSpec:
    """The styles of all parts. Raises ValueError for a part that is given two styles."""
    specs: dict[str, PartSpec] = {}
    for parts, spec in styles:
        for part in parts:
            if part in specs:
                raise ValueError(
                    f"{part} is given two styles: one for each body part, "
                    f"or blend two as {part}={specs[part].name}+{spec.name}@0.5"
                )
            specs[part] = spec
    return StyleSpec(specs)
