"""What a live run takes in and gives away: recordings, exports, screenshots, and styles learned from dropped files."""

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pygame

from demo.export import export_jobs
from demo.live.drop_import import Arrived, Learned
from demo.ui import panels
from demo.ui.canvas import ALERT
from sim.motion.clip import FPS

if TYPE_CHECKING:
    from demo.live.live import Live


def toggle_recording(live: "Live") -> None:
    """Starts a recording in the current folder, or ends the one that runs.

    The character goes back to standing at the start point, in the styles it has, because that is where a replay
    starts: so it makes equal poses."""
    if live.recorder:
        stop_recording(live)
        return
    path = new_file(live.folder, "jsonl")

    def start() -> None:
        live.recorder = live.recorder_factory(
            path, live.stylizers.other, live.pace, live.grounds.other, live.session.stylizer.seed
        )
        live.files.append(path)
        live.start_over()
        live.say(f"recording into {path.name}")

    live.guard(start)


def stop_recording(live: "Live") -> None:
    """Ends the recording, if one runs."""
    if live.recorder:
        recorder, live.recorder = live.recorder, None
        live.guard(recorder.close)
        live.say(f"recorded into {recorder.path.name}")


def export(live: "Live") -> None:
    """Begins to write the last ten seconds as BVH, glTF and video into the current folder."""
    if live.takes.busy:
        live.say("the last export is still being written; press F9 again when it is done")
    elif not live.takes.frames:
        live.say("there is nothing to export yet")
    elif live.guard(
        lambda: live.takes.export(
            new_file(live.folder, *export_jobs.ENDINGS).with_suffix(""), live.session.ground, live.shown
        )
    ):
        live.say(f"exporting the last {len(live.takes.frames) / FPS:.1f} s as BVH, glTF and video")


def show_written(live: "Live", written: export_jobs.Written | None) -> None:
    """Says what came of an export."""
    if written:
        live.files += written.files
        if written.files:
            live.say(f"exported {', '.join(path.name for path in written.files)} into {written.files[0].parent}")
        for problem in written.problems:
            live.say(problem, ALERT)


def apply_learned(live: "Live") -> None:
    """Puts styles that were learned from dropped files on the picked part, shows a character that was dropped, and says
    what could not be used."""
    for result in live.drop_import.finished():
        if isinstance(result, Arrived):
            live.dress(result.character)
            live.say(f"“{result.character.character.name}” is your character now, and kept for the next start")
            for note in result.notes:
                live.say(note)
        elif isinstance(result, Learned):
            known = result.style in live.choice.users_own
            live.offer_styles()
            if result.style not in live.choice.styles:  # another stylizer was chosen while it was learned
                live.say(f"learned “{result.style}”: it is there when you choose the former stylizer again")
                continue
            live.choice.replace_style(result.style)
            live.inset.play(result.clip, result.style)
            live.say(
                (f"“{result.style}” is this very motion" if known else f"learned “{result.style}”")
                + f" ({', '.join(result.movements)}): now on the {panels.readable(live.choice.picked)}"
                + ", and kept for the next start" * (not known)
            )
            for note in result.notes:
                live.say(note)
        else:
            live.say(result.reason, ALERT)


def screenshot(live: "Live") -> None:
    """Saves the picture as it is, with the text, in the current folder."""
    path = new_file(live.folder, "png")

    def save() -> None:
        live.paint()
        pixels = live.window.read_pixels()
        pygame.image.save(pygame.image.frombuffer(pixels.tobytes(), live.window.size, "RGB"), str(path))
        live.files.append(path)
        live.say(f"saved {path}")

    live.guard(save)


def new_file(folder: Path, *suffixes: str) -> Path:
    """A path in a folder with the first suffix, whose name is free with all of them."""
    now = f"patchwalk-{datetime.now():%Y%m%d-%H%M%S}"
    number = 1
    while True:
        paths = [folder / f"{now}{f'-{number}' if number > 1 else ''}.{suffix}" for suffix in suffixes]
        if not any(path.exists() for path in paths):
            return paths[0]
        number += 1
