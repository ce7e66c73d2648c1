"""`patchwalk` alone: the live window, or, where none can be opened, the bundled recording replayed into out/."""

import argparse
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from demo.commands.bench import positive
from demo.commands.replay import CHARACTER_HELP, GROUND_HELP, MAP_HELP, STYLIZER_HELP, VMC_HELP
from sim.io.bvh_parser import shorten
from sim.io.provenance import SHIPPED

if TYPE_CHECKING:
    from demo.export.vmc import Sender
    from sim.character.character import Character
    from sim.ground.ground import Ground
    from sim.io.recording import Recording

HELP = "Steer a character and restyle it limb by limb; without a display, replay the bundled recording into out/."
EXAMPLE = "patchwalk --ground stairs"
OUT = Path("out")
LARGEST_CROWD = 64
CROWD_SECONDS = 10  # of a crowd that are stepped where there is no window
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
    parser.add_argument(
        "--crowd", type=crowd_size, metavar="N", help=f"N characters (2 to {LARGEST_CROWD}) who walk about"
    )
    parser.add_argument(
        "--seconds",
        type=positive(float),
        metavar="S",
        help="of a crowd: without a window, and say how long its frames take",
    )
    parser.add_argument("--vmc", nargs="?", const="", metavar="HOST:PORT", help=f"{VMC_HELP}; off by default")


def run(args: argparse.Namespace) -> int:
    from demo.export import vmc
    from demo.state.grounds import ground_of
    from sim.ground.catalogue import FLAT, load_ground
    from stylizer.systems import weight_files

    # First: a mistake is said before anything is loaded or opens.
    if args.seconds and not args.crowd:
        raise ValueError("--seconds goes with --crowd N; `patchwalk bench --seconds S` times a single character")
    if args.seconds:
        check_unseen_crowd(args)
    weight_files.system(args.stylizer or SHIPPED)
    load_ground(args.ground)
    character = choose_character(args)
    stream = None if args.vmc is None else vmc.Sender(args.vmc)

    from demo import assemble
    from demo.render.window import NoDisplay, NoGL, has_display
    from sim.io import recording
    from sim.motion.clip import FPS

    bundled = recording.read(assemble.BUNDLED_RECORDING)
    ground = args.ground if args.ground is not None else ground_of(bundled, assemble.BUNDLED_RECORDING.parent)
    if args.crowd and args.ground is None:
        ground = FLAT
    reason = "there is no display"
    if args.seconds:
        return time_crowd(args.crowd, args.seconds, args.stylizer, load_ground(ground))
    if has_display():
        from demo.live.live import run_live
        from demo.state import user_bindings
        from demo.state.crowd import Crowd
        from demo.state.presets import Presets

        with warnings.catch_warnings(
            record=True
        ) as caught:  # what of the user's cannot be read is said in the window too
            warnings.simplefilter("always")
            bindings, presets = user_bindings.load(), Presets()
            session = assemble.build_session(args.stylizer)
        for warning in caught:
            warnings.warn(warning.message, stacklevel=1)
        crowd = Crowd(session, args.crowd - 1) if args.crowd else None
        try:
            report = run_live(
                session,
                session.stylizer.styles,
                attract=() if crowd else bundled,
                bindings=bindings,
                presets=presets,
                stream=stream,
                ground=ground,
                notes=[str(warning.message) for warning in caught],
                character=character,
                crowd=crowd,
            )
        except (NoDisplay, NoGL) as error:
            reason = str(error)
        else:
            for path in report.files:
                print(f"wrote {path}")
            return 0
    if args.crowd:
        check_unseen_crowd(args)
        print(f"No window ({reason}): {CROWD_SECONDS} s of the crowd without one.")
        return time_crowd(args.crowd, CROWD_SECONDS, args.stylizer, load_ground(ground))
    print("To steer it in a browser instead: patchwalk serve")
    print(f"No window ({reason}): replaying the first {SECONDS} s of the bundled recording into {OUT}/.")
    replay_bundled(OUT, bundled.first(SECONDS * FPS), stream, args.stylizer, load_ground(ground), character)
    return 0


def check_unseen_crowd(args: argparse.Namespace) -> None:
    """Raises ValueError for options that a crowd without a window has no use for."""
    given = [name for name in ("--vmc", "--character", "--map") if getattr(args, name.strip("-")) is not None]
    if given:
        raise ValueError(f"a crowd without a window is only timed: leave {' and '.join(given)} out")


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


def crowd_size(text: str) -> int:
    """What argparse makes of the size of a crowd."""
    if not (text.isascii() and text.isdecimal() and len(text) < 9) or not 2 <= int(text) <= LARGEST_CROWD:
        raise argparse.ArgumentTypeError(f"'{shorten(text)}' is no size of a crowd: give 2 to {LARGEST_CROWD}")
    return int(text)


def time_crowd(count: int, seconds: float, stylizer: str | None, ground: "Ground | None") -> int:
    """Steps a crowd, its first member steered by the bundled recording, and says how long its frames took."""
    import numpy as np

    from demo import assemble
    from demo.state.crowd import Crowd
    from sim.io import recording
    from sim.latency import BUDGET_MS, percentiles
    from sim.motion.clip import FPS

    session = assemble.build_session(stylizer, ground=ground)
    crowd, times = Crowd(session, count - 1), []
    commands = list(recording.read(assemble.BUNDLED_RECORDING))
    for frame in range(max(1, round(seconds * FPS))):
        crowd.step(session.step(commands[frame % len(commands)]).styled)
        times.append(session.latency.last_ms("frame") + crowd.last_ms)
    figures, missed = percentiles(np.array(times)), int(np.sum(np.array(times) > BUDGET_MS))
    print(
        f"{count} characters, {len(times)} frames: a frame took {figures['p50_ms']:.2f} ms at the median, "
        f"{figures['p99_ms']:.2f} ms at the 99th percentile; {missed} took over {BUDGET_MS:.2f} ms"
    )
    return 0


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
