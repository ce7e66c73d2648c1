"""`patchwalk` alone: the live window, or, where none can be opened, the bundled recording replayed into out/."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from demo.commands.replay import STYLIZER_HELP, VMC_HELP

if TYPE_CHECKING:
    from demo.export.vmc import Sender

HELP = "Steer a character and restyle it limb by limb; without a display, replay the bundled recording into out/."
EXAMPLE = "patchwalk"
OUT = Path("out")
FILES = {
    "poses": "poses.npz",
    "bvh": "styled.bvh",
    "glb": "styled.glb",
    "video": "video.mp4",
    "latency": "latency.json",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--stylizer", metavar="NAME", help=STYLIZER_HELP)
    parser.add_argument("--vmc", nargs="?", const="", metavar="HOST:PORT", help=f"{VMC_HELP}; off by default")


def run(args: argparse.Namespace) -> int:
    from demo import assemble
    from demo.export import vmc
    from demo.render.window import NoDisplay, NoGL, has_display

    stream = None if args.vmc is None else vmc.Sender(args.vmc)
    reason = "there is no display"
    if has_display():
        from demo.live.live import run_live
        from demo.state import user_bindings
        from demo.state.presets import Presets
        from sim.io import recording

        bindings, presets = user_bindings.load(), Presets()  # first: a mistake in a file is said before anything opens
        session = assemble.build_session(args.stylizer)
        try:
            report = run_live(
                session,
                session.stylizer.styles,
                attract=recording.read(assemble.BUNDLED_RECORDING),
                bindings=bindings,
                presets=presets,
                stream=stream,
            )
        except (NoDisplay, NoGL) as error:
            reason = str(error)
        else:
            for path in report.files:
                print(f"wrote {path}")
            return 0
    print(f"No window ({reason}): replaying the bundled recording into {OUT}/.")
    replay_bundled(OUT, stream, args.stylizer)
    return 0


def replay_bundled(folder: Path, stream: "Sender | None" = None, stylizer: str | None = None) -> None:
    """Writes everything that a replay can into `folder`: all but the video where this machine cannot make one."""
    from demo import assemble
    from demo.commands.replay import play
    from demo.export.export import check_outputs
    from sim.io import recording

    folder.mkdir(exist_ok=True)
    outputs = {kind: folder / name for kind, name in FILES.items()}
    try:
        check_outputs({"video": outputs["video"]})
    except ValueError as error:
        del outputs["video"]
        print(f"No video: {error}.")
    check_outputs(outputs)
    play("bundled recording", recording.read(assemble.BUNDLED_RECORDING), outputs, stylizer, stream=stream)
