"""`patchwalk replay`: play a recording, in the window or without one, and write what it made."""

import argparse
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Iterable, Mapping

if TYPE_CHECKING:
    from demo.export.vmc import Sender
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
    parser.add_argument("--vmc", nargs="?", const="", metavar="HOST:PORT", help=f"{VMC_HELP}; in real time")
    parser.add_argument("--stylizer", metavar="NAME", help=STYLIZER_HELP)
    parser.add_argument("--ground", metavar="NAME", help=f"{GROUND_HELP}; by default as it was recorded")


def run(args: argparse.Namespace) -> int:
    from sim.io import recording

    recorded = recording.read(args.recording)
    outputs = {kind: path for kind in OUTPUTS if (path := getattr(args, kind))}
    from demo.export.export import check_outputs

    check_outputs(outputs, args.recording)
    from demo.export import vmc
    from demo.state.grounds import ground_of
    from sim.ground.catalogue import load_ground

    ground = load_ground(args.ground or ground_of(recorded, args.recording.parent))
    stream = None if args.vmc is None else vmc.Sender(args.vmc)
    play(
        args.recording.name,
        recorded,
        outputs,
        args.stylizer or recorded.stylizer,
        window=not args.headless,
        stream=stream,
        ground=ground,
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
) -> None:
    """Plays a sim.io.recording.Recording on a ground, None for level floor, in a window if asked and possible, else as
    fast as it goes, but in real time to a `stream` (demo.export.vmc.Sender); then writes the outputs (kind -> path) and
    says on stdout what came of it."""
    from demo import STARTED, assemble
    from demo.export import export
    from sim.motion.clip import FPS

    session = assemble.build_session(stylizer, ground=ground)
    for style in recorded.styles:
        session.stylizer.movements(style)  # raises for one that is not there, before anything is played
    startup_s = time.perf_counter() - STARTED
    frames = (_watched(session, recorded, stream) if window else None) or _stepped(session, recorded, stream)
    result = export.Result(frames, session.latency, startup_s, ground)
    report = session.latency.report()
    print(
        f"{name}: {len(frames)} frames, {len(frames) / FPS:.1f} s; a frame took {report['frame']['p50_ms']:.2f} ms "
        f"at the median, {report['missed_60hz']} took over 16.67 ms",
        flush=True,
    )
    for kind, path in outputs.items():
        export.WRITERS[kind](path, result)
        print(f"wrote {path}", flush=True)


def _stepped(session: "Session", recorded: "Recording", stream: "Sender | None") -> "list[Frame]":
    from tqdm import tqdm

    with tqdm(recorded, "replay", unit="frame", leave=False, disable=not sys.stderr.isatty()) as commands:
        return _sent(map(session.step, commands), stream)


def _sent(frames: "Iterable[Frame]", stream: "Sender | None") -> "list[Frame]":
    from demo.export import vmc

    return list(vmc.stream(frames, stream) if stream else frames)


def _watched(session: "Session", recorded: "Recording", stream: "Sender | None") -> "list[Frame] | None":
    """The frames, once shown; None, before the first step, where no window can be opened."""
    from demo.render.window import NoDisplay, NoGL, has_display

    if not has_display():
        print("No display: replaying headless.")
        return None
    from demo.live.replay_window import watch

    try:
        return _sent(watch(session, recorded), stream)
    except (NoDisplay, NoGL) as error:
        print(f"No window ({error}): replaying headless.")
        return None
