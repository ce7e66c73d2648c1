"""`patchwalk doctor`: what this machine has, what is missing and how to get it."""

import argparse
import os
import platform
from typing import Callable

HELP = "show what this machine has, what is missing and how to get it"
EXAMPLE = "patchwalk doctor"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """None."""


def run(args: argparse.Namespace) -> int:
    """Exit status 0 when recordings can be replayed here, with a window or without."""
    able = True
    for name, needed, check in CHECKS:
        try:
            mark, text = "ok", check()
        except Exception as error:  # a doctor reports what is broken, whatever it is
            mark, text = "MISSING" if needed else "none", " ".join(str(error).split())
            able = able and not needed
        print(f"{name:<19} {mark:<8} {text}")
    print("Recordings can be replayed here." if able else "Recordings cannot be replayed here: see what is MISSING.")
    return 0 if able else 1


def _python() -> str:
    return f"{platform.python_version()} on {platform.system()} {platform.machine()}"


def _torch() -> str:
    try:
        import torch
    except ImportError as error:
        raise ValueError(f"{error}; `make run` installs it") from None
    cuda = torch.cuda.get_device_name() if torch.cuda.is_available() else "no GPU; only training would use one"
    return f"{torch.__version__} ({cuda})"


def _threads() -> str:
    from sim.latency import cpu_name

    return f"a session uses 1 of {os.cpu_count()} cores ({cpu_name()})"


def _controller() -> str:
    from controller.runtime.controller import PhaseFunctionedController

    PhaseFunctionedController.from_pretrained()
    return "loaded; they match this skeleton and feature layout"


def _stylizer() -> str:
    from controller.model import checkpoint
    from sim.io.provenance import NONCOMMERCIAL
    from sim.session import check_own_style
    from stylizer.runtime import catalogue
    from stylizer.systems import weight_files

    stylizers = {name: catalogue.from_pretrained(name) for name in weight_files.names()}
    for stylizer in stylizers.values():
        check_own_style(stylizer.own_of, checkpoint.fingerprint())
    shipped, *others = stylizers
    styles, marked = len(stylizers[shipped].styles), len(stylizers[shipped].noncommercial)
    also = f"; also there: {', '.join(others)}" * bool(others)
    return (
        f"loaded; they match this skeleton, feature layout and controller; {styles} styles"
        + f", {marked} of them for {NONCOMMERCIAL} use only" * bool(marked)
        + also
    )


def _display() -> str:
    from demo.render.window import open_window

    with open_window((320, 180)) as window:
        return f"a window opens, drawn by {window.renderer_name}"


def _offscreen() -> str:
    from demo.render.window import open_window

    with open_window((320, 180), visible=False) as window:
        return f"pictures without a window, drawn by {window.renderer_name}"


def _gamepads() -> str:
    from demo.input.devices import gamepad_names

    names = gamepad_names()
    if not names:
        raise ValueError("plug one in at any time; the keyboard does everything too")
    return ", ".join(names)


def _ffmpeg() -> str:
    try:
        import imageio_ffmpeg

        return f"{imageio_ffmpeg.get_ffmpeg_version()} (for videos as MP4)"
    except (ImportError, RuntimeError):
        raise ValueError("needed for videos as MP4 only, not as GIF; pip install imageio-ffmpeg brings one") from None


def _browser() -> str:
    try:
        import aiohttp

        return f"aiohttp {aiohttp.__version__} (for patchwalk serve)"
    except ImportError:
        raise ValueError("needed for patchwalk serve only; pip install aiohttp brings what it lacks") from None


CHECKS: tuple[tuple[str, bool, Callable[[], str]], ...] = (  # name, whether replaying needs it, what finds out
    ("Python", True, _python),
    ("PyTorch", True, _torch),
    ("threads", True, _threads),
    ("controller weights", True, _controller),
    ("stylizer weights", True, _stylizer),
    ("display", False, _display),
    ("OpenGL off-screen", False, _offscreen),
    ("gamepads", False, _gamepads),
    ("ffmpeg", False, _ffmpeg),
    ("browser", False, _browser),
)
