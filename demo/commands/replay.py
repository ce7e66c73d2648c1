"""`patchwalk replay`: play a recording, in the window or without one, and write what it made."""

import argparse
import sys
import time
import warnings
from contextlib import ExitStack
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Iterable, Iterator, Mapping

from sim.io.provenance import SHIPPED

if TYPE_CHECKING:
    from demo.export.export import Takeaway
    from demo.export.vmc import Sender
    from sim.character.character import Character
    from sim.ground.ground import Ground
    from sim.io.recording import Recording
    from sim.session import Frame, Session

HELP = "play a recording and write its motion, its video and how long each stage took"
EXAMPLE = "patchwalk replay walk.jsonl --headless --poses walk.npz --bvh walk.bvh --latency walk.json"
VMC_HELP = (
    "stream the poses live to Blender, Unity or Unreal: VMC/OSC over UDP, to port 39539 of this machine "
    "unless told otherwise"
)
STYLIZER_HELP = (
    "the style-transfer system: joints (Motion Puzzle at the resolution of joints, the default), slim (its own form), "
    "unpaired, diverse, latent, or other weights of the package by name"
)
GROUND_HELP = (
    "what to walk on: flat, hills, stairs, rough, or a height map FILE.png (10 cm a pixel, white 5 m over black)"
)
CHARACTER_HELP = "your own character in place of the figure: a skinned person as .glb, .gltf or .vrm"
MAP_HELP = 'JSON {"our joint": "theirs", ...}, for a skeleton that is not recognised by its names or its shape'
OUTPUTS = {  # kind, as in demo.export.export.WRITERS: (metavar, help)
    "poses": ("OUT.npz", "write neutral and styled motion as arrays"),
    "bvh": ("OUT.bvh", "write the styled motion as BVH"),
    "glb": ("OUT.glb", "write the figure and its styled motion as binary glTF"),
    "video": ("OUT.mp4|OUT.gif", "write a video (needs OpenGL, an .mp4 also ffmpeg; no display)"),
    "latency": ("OUT.json", "write how long each stage of a frame took"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("recording", type=Path, metavar="REC", help="a recording (.jsonl), as R in the window makes")
    parser.add_argument("--headless", action="store_true", help="open no window, even where there is a display")
    for kind, (metavar, text) in OUTPUTS.items():
        parser.add_argument(f"--{kind}", type=Path, metavar=metavar, help=text)
    add_takeaway(parser)
    parser.add_argument("--map", type=Path, metavar="FILE", help=f"{MAP_HELP}, of the character")
    parser.add_argument("--vmc", nargs="?", const="", metavar="HOST:PORT", help=f"{VMC_HELP}; in real time")
    parser.add_argument("--stylizer", metavar="NAME", help=STYLIZER_HELP)
    parser.add_argument("--ground", metavar="NAME", help=f"{GROUND_HELP}; by default as it was recorded")


def add_takeaway(parser: argparse.ArgumentParser) -> None:
    """The options of demo.export.export.Takeaway."""
    parser.add_argument("--character", type=Path, metavar="HERO.glb|HERO.vrm", help=CHARACTER_HELP)
    way = parser.add_mutually_exclusive_group()
    way.add_argument(
        "--root-motion",
        action="store_true",
        help="in .glb and .bvh the character goes its way over the floor, in .glb by its `root` joint (the default)",
    )
    way.add_argument("--in-place", action="store_true", help="in .glb and .bvh the way over the floor is left out")
    parser.add_argument(
        "--rate", type=int, choices=(30, 60), default=60, help="frames a second of .glb and .bvh (default: 60)"
    )


def takeaway_of(args: argparse.Namespace, name_map: dict[str, str] | None = None) -> "Takeaway":
    """What those options say. Raises ValueError or OSError for a character that cannot be read."""
    from demo.export.export import Takeaway
    from demo.state.characters import FIGURE

    character = None
    if args.character is not None and str(args.character) != FIGURE:
        from sim.character.character import load_character

        character = load_character(args.character, name_map)
        for note in character.notes:
            warnings.warn(f"{args.character}: {note}", stacklevel=2)
    return Takeaway(character, args.rate, args.in_place)


def run(args: argparse.Namespace) -> int:
    from sim.io import recording
    from stylizer.styles import style_names

    recorded = recording.read(args.recording)
    style_names.check_known(recorded.styles, args.stylizer or recorded.stylizer or SHIPPED)
    outputs = {kind: path for kind in OUTPUTS if (path := getattr(args, kind))}
    from demo.export.export import check_outputs

    check_outputs(outputs, args.recording)
    from demo.export import vmc
    from demo.state.grounds import ground_of
    from sim.ground.catalogue import load_ground
    from sim.retarget import joint_names

    takeaway = takeaway_of(args, joint_names.load(args.map) if args.map else None)
    ground = load_ground(args.ground if args.ground is not None else ground_of(recorded, args.recording.parent))
    stream = None if args.vmc is None else vmc.Sender(args.vmc)
    play(
        args.recording.name,
        recorded,
        outputs,
        args.stylizer or recorded.stylizer,
        window=not args.headless,
        stream=stream,
        ground=ground,
        takeaway=takeaway,
    )
    return 0


def play(
    name: str,
    recorded: "Recording",
    outputs: Mapping[str, Path],
    stylizer: str | None = None,
    window: bool = False,
    stream: "Sender | None" = None,
    ground: "Ground | None" = None,
    takeaway: "Takeaway | None" = None,
) -> None:
    """Plays a sim.io.recording.Recording on a ground, None for level floor, in a window if asked and possible, else as
    fast as it goes, but in real time to a `stream` (demo.export.vmc.Sender); then writes the outputs (kind -> path), by
    the figure or as `takeaway` says, and says on stdout what came of it."""
    from demo import STARTED, assemble
    from demo.export import export
    from sim.character.files import CharacterRows
    from sim.io import poses_npz
    from sim.motion.clip import FPS

    export.check_length(name, len(recorded), outputs)
    session = assemble.build_session(stylizer, ground=ground)
    for style in recorded.styles:
        session.stylizer.movements(style)  # raises for one that is not there, before anything is played
    if recorded.seed:
        session.stylizer.resample(recorded.seed)
    takeaway = takeaway or export.Takeaway()
    character = takeaway.character
    startup_s = time.perf_counter() - STARTED
    kept: list[Frame] = []  # no more than is written of them: a day's frames fit into no memory
    with ExitStack() as files:
        takers = [kept.append] if outputs.keys() & export.WHOLE else []
        if "poses" in outputs:
            rows = CharacterRows(character, ground) if character else None
            skeleton = rows.constants if rows else poses_npz.CONSTANTS
            takers.append(files.enter_context(poses_npz.writer(outputs["poses"], rows, skeleton)))
        shown = _watched(session, recorded, character) if window else None
        for frame in _sent(shown or _stepped(session, recorded), stream):
            for take in takers:
                take(frame)
    result = export.Result(kept, session.latency, startup_s, ground, takeaway)
    report = session.latency.report()
    count = len(recorded)
    print(
        f"{name}: {count} frames, {count / FPS:.1f} s; a frame took {report['frame']['p50_ms']:.2f} ms "
        f"at the median, {report['missed_60hz']} took over 16.67 ms",
        flush=True,
    )
    if session.healed:
        warnings.warn(f"{session.healed} frames were not finite, and show the neutral pose", stacklevel=2)
    if stream:
        stream.report()
    for kind, path in outputs.items():
        if kind in export.WRITERS:
            export.WRITERS[kind](path, result)
        print(f"wrote {path}", flush=True)


def _stepped(session: "Session", recorded: "Recording") -> "Iterator[Frame]":
    from tqdm import tqdm

    with tqdm(recorded, "replay", unit="frame", leave=False, disable=not sys.stderr.isatty()) as commands:
        yield from map(session.step, commands)


def _sent(frames: "Iterable[Frame]", stream: "Sender | None") -> "Iterable[Frame]":
    from demo.export import vmc

    return vmc.stream(frames, stream) if stream else frames


def _watched(session: "Session", recorded: "Recording", character: "Character | None") -> "Iterable[Frame] | None":
    """The frames, each as it is shown; None, before the first step, where no window can be opened."""
    from demo.render.window import NoDisplay, NoGL, has_display

    if not has_display():
        print("No display: replaying headless.")
        return None
    from demo.live.replay_window import watch

    frames = watch(session, recorded, character)
    try:
        first = next(frames, None)
    except (NoDisplay, NoGL) as error:
        print(f"No window ({error}): replaying headless.")
        return None
    return frames if first is None else chain([first], frames)
