"""`patchwalk` alone: the live window, or, where none can be opened, the bundled recording replayed into out/."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from demo.commands.replay import GROUND_HELP, STYLIZER_HELP, VMC_HELP

if TYPE_CHECKING:
    from demo.export.vmc import Sender
    from sim.ground.ground import Ground
    from sim.io.recording import Recording

HELP = "Steer a character and restyle it limb by limb; without a display, replay the bundled recording into out/."
EXAMPLE = "patchwalk --ground stairs"
OUT = Path("out")
SECONDS = 30  # of the bundled recording that are replayed where there is no window: a video takes twice as long
FILES = {
    "poses": "poses.npz",
    "bvh": "styled.bvh",
    "glb": "styled.glb",
    "video": "video.mp4",
    "latency": "latency.json",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--stylizer", metavar="NAME", help=STYLIZER_HELP)
    parser.add_argument("--ground", metavar="NAME", help=GROUND_HELP)
    parser.add_argument("--vmc", nargs="?", const="", metavar="HOST:PORT", help=f"{VMC_HELP}; off by default")


def run(args: argparse.Namespace) -> int:
    from demo import assemble
    from demo.export import vmc
    from demo.render.window import NoDisplay, NoGL, has_display
    from demo.state.grounds import ground_of
    from sim.ground.catalogue import load_ground
    from sim.io import recording
    from sim.motion.clip import FPS

    bundled = recording.read(assemble.BUNDLED_RECORDING)
    ground = args.ground if args.ground is not None else ground_of(bundled, assemble.BUNDLED_RECORDING.parent)
    load_ground(ground)  # first: a mistake in its name or its map is said before anything opens
    stream = None if args.vmc is None else vmc.Sender(args.vmc)
    reason = "there is no display"
    if has_display():
        from demo.live.live import run_live
        from demo.state import user_bindings
        from demo.state.presets import Presets

        bindings, presets = user_bindings.load(), Presets()  # first: a mistake in a file is said before anything opens
        session = assemble.build_session(args.stylizer)
        try:
            report = run_live(
                session,
                session.stylizer.styles,
                attract=bundled,
                bindings=bindings,
                presets=presets,
                stream=stream,
                ground=ground,
            )
        except (NoDisplay, NoGL) as error:
            reason = str(error)
        else:
            for path in report.files:
                print(f"wrote {path}")
            return 0
    print("To steer it in a browser instead: patchwalk serve")
    print(f"No window ({reason}): replaying the first {SECONDS} s of the bundled recording into {OUT}/.")
    replay_bundled(OUT, bundled.first(SECONDS * FPS), stream, args.stylizer, load_ground(ground))
    return 0


def replay_bundled(
    folder: Path,
    bundled: "Recording",
    stream: "Sender | None" = None,
    stylizer: str | None = None,
    ground: "Ground | None" = None,
) -> None:
    """Writes everything that a replay can into `folder`: all but the video where this machine cannot make one."""
    from demo.commands.replay import play
    from demo.export.export import check_outputs

    folder.mkdir(exist_ok=True)
    outputs = {kind: folder / name for kind, name in FILES.items()}
    try:
        check_outputs({"video": outputs["video"]})
    except ValueError as error:
        del outputs["video"]
        print(f"No video: {error}.")
    check_outputs(outputs)
    play("bundled recording", bundled, outputs, stylizer, stream=stream, ground=ground)
