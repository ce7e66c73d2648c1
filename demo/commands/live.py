"""`patchwalk` alone: the live window, or, where none can be opened, the bundled recording replayed into out/."""

import argparse
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from demo.commands.replay import CHARACTER_HELP, GROUND_HELP, MAP_HELP, STYLIZER_HELP, VMC_HELP

if TYPE_CHECKING:
    from demo.export.vmc import Sender
    from sim.character.character import Character
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
    parser.add_argument(
        "--character",
        metavar="HERO.glb|HERO.vrm",
        help=f"{CHARACTER_HELP}; kept for the next start; `figure` is the built-in one again",
    )
    parser.add_argument("--map", type=Path, metavar="FILE", help=f"{MAP_HELP}, of the character")
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
    character = choose_character(args)
    stream = None if args.vmc is None else vmc.Sender(args.vmc)
    reason = "there is no display"
    if has_display():
        from demo.live.live import run_live
        from demo.state import user_bindings
        from demo.state.presets import Presets

        with warnings.catch_warnings(
            record=True
        ) as caught:  # what of the user's cannot be read is said in the window too
            warnings.simplefilter("always")
            bindings, presets = user_bindings.load(), Presets()
            session = assemble.build_session(args.stylizer)
        for warning in caught:
            warnings.warn(warning.message, stacklevel=1)
        try:
            report = run_live(
                session,
                session.stylizer.styles,
                attract=bundled,
                bindings=bindings,
                presets=presets,
                stream=stream,
                ground=ground,
                notes=[str(warning.message) for warning in caught],
                character=character,
            )
        except (NoDisplay, NoGL) as error:
            reason = str(error)
        else:
            for path in report.files:
                print(f"wrote {path}")
            return 0
    print("To steer it in a browser instead: patchwalk serve")
    print(f"No window ({reason}): replaying the first {SECONDS} s of the bundled recording into {OUT}/.")
    replay_bundled(OUT, bundled.first(SECONDS * FPS), stream, args.stylizer, load_ground(ground), character)
    return 0


def choose_character(args: argparse.Namespace) -> "Character | None":
    """Who is steered: the character that is named, which is kept, or the one that was kept; None for the figure."""
    from demo.state import characters
    from sim.character.character import load_character
    from sim.retarget import joint_names

    if args.character == characters.FIGURE:
        characters.forget()
        return None
    if args.character is None:
        try:
            return characters.kept()
        except ValueError as error:
            warnings.warn(f"your character is left out: {error}", stacklevel=2)
            return None
    name_map = joint_names.load(args.map) if args.map else None
    character = load_character(args.character, name_map)
    for note in character.notes:
        warnings.warn(f"{args.character}: {note}", stacklevel=2)
    characters.keep(character, name_map)
    return character


def replay_bundled(
    folder: Path,
    bundled: "Recording",
    stream: "Sender | None" = None,
    stylizer: str | None = None,
    ground: "Ground | None" = None,
    character: "Character | None" = None,
) -> None:
    """Writes everything that a replay can into `folder`: all but the video where this machine cannot make one."""
    from demo.commands.replay import play
    from demo.export.export import Takeaway, check_outputs

    folder.mkdir(exist_ok=True)
    outputs = {kind: folder / name for kind, name in FILES.items()}
    try:
        check_outputs({"video": outputs["video"]})
    except ValueError as error:
        del outputs["video"]
        print(f"No video: {error}.")
    check_outputs(outputs)
    play("bundled recording", bundled, outputs, stylizer, stream=stream, ground=ground, takeaway=Takeaway(character))
