"""`patchwalk serve`: the character in a browser, steered and restyled there."""

import argparse
import asyncio
import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING

from demo.commands.live import choose_character
from demo.commands.replay import CHARACTER_HELP, GROUND_HELP, MAP_HELP, STYLIZER_HELP
from sim.io.bvh_parser import shorten
from sim.io.provenance import SHIPPED

if TYPE_CHECKING:
    from demo.serve.server import Server

HELP = "steer and restyle the character in a browser, on this machine or from another one over SSH"
EXAMPLE = "patchwalk serve          # then open http://127.0.0.1:8321"
PORT = 8321
A_CORE, MOST = 5, 40  # visitors, by default
MISSING = "the package 'aiohttp' is not installed; `pip install -e '.[serve]'` installs it"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--port", type=int, default=PORT, help=f"where to serve (default: {PORT}; 0: any that is free)")
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="NAME",
        help="the address or name to serve at; by default this machine alone can reach it, 0.0.0.0 lets others, too",
    )
    parser.add_argument(
        "--visitors",
        type=int,
        metavar="N",
        help=f"pages at once, each with a character of its own (default: {A_CORE} for each core)",
    )
    parser.add_argument("--stylizer", metavar="NAME", help=STYLIZER_HELP)
    parser.add_argument("--ground", metavar="NAME", help=GROUND_HELP)
    parser.add_argument(
        "--character",
        metavar="HERO.glb|HERO.vrm",
        help=f"{CHARACTER_HELP}; kept for the next start; `figure` is the built-in one again",
    )
    parser.add_argument("--map", type=Path, metavar="FILE", help=f"{MAP_HELP}, of the character")


def run(args: argparse.Namespace) -> int:
    from demo.state import user_bindings
    from demo.state.presets import Presets
    from sim.ground.catalogue import load_ground
    from stylizer.systems import weight_files

    visitors = args.visitors if args.visitors is not None else min(A_CORE * (os.cpu_count() or 1), MOST)
    if not 1 <= visitors <= MOST:
        raise ValueError(f"--visitors is {visitors}, but must lie in 1 .. {MOST}")
    try:
        args.host.encode("idna")
    except UnicodeError:
        raise ValueError(
            f"--host {shorten(args.host)} is no name of a machine: give an address, such as 127.0.0.1"
        ) from None
    if not 0 <= args.port < 2**16:
        raise ValueError(f"--port is {args.port}, but must lie in 0 .. {2**16 - 1}")
    weight_files.system(args.stylizer or SHIPPED)  # as the rest here: a mistake is said before anything starts
    load_ground(args.ground)
    Presets()
    bindings = user_bindings.load()
    character = choose_character(args)
    try:
        import aiohttp  # noqa: F401
    except ModuleNotFoundError:
        raise ValueError(MISSING) from None
    from demo.serve.options import Options
    from demo.serve.server import Server

    server = Server(
        args.host, args.port, visitors, Options(args.stylizer, args.ground, character is not None), bindings
    )
    asyncio.run(_serve(server))
    return 0


async def _serve(server: "Server") -> None:
    from demo.serve.access import is_loopback

    leaving = asyncio.Event()
    for name in ("SIGINT", "SIGTERM"):
        try:
            asyncio.get_running_loop().add_signal_handler(getattr(signal, name), leaving.set)
        except (NotImplementedError, AttributeError):  # Windows: Ctrl + C raises KeyboardInterrupt
            pass
    try:
        await server.start()
    except OSError as error:
        raise ValueError(
            f"cannot serve at {server.host}, port {server.port}: {error.strerror or error}; try another --port"
        ) from None
    print(f"Open {server.address} (Ctrl + C ends it).", flush=True)
    if not is_loopback(server.host):
        print("Everybody who can reach this machine can steer there and see your styles.", flush=True)
    try:
        await leaving.wait()
    finally:
        await server.stop()
