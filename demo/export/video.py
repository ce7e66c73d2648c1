"""A video of frames: the demo's renderer without a screen, its pictures as MP4 (by ffmpeg) or as GIF (by Pillow)."""

import sys
from contextlib import closing
from pathlib import Path
from typing import Generator, Sequence

import numpy as np
from PIL import Image
from tqdm import tqdm

from demo.export.export import Progress, ignore
from demo.figure.character_model import DrawnCharacter
from demo.figure.colours import worn
from demo.render.renderer import Renderer
from demo.render.view import View
from demo.render.window import NoDisplay, NoGL, Window, open_window
from demo.ui import panels
from sim.character.character import Character
from sim.ground.ground import Ground
from sim.latency import Latency
from sim.motion.clip import FPS
from sim.session import Frame

SIZE = (960, 540)  # pixels
SUPERSAMPLE = 2  # a scene is drawn twice as wide and as high: nobody waits at a video ...
# The index in front, so that a browser can play at once; little effort, because the processor may be drawing as well.
FFMPEG_OPTIONS = ["-crf", "20", "-preset", "veryfast", "-movflags", "+faststart"]
GIF_SIZE = (640, 360)
GIF_STEP = 3  # every third frame: a GIF counts in hundredths of a second, so 20 pictures a second are exact, 30 are not


def check(path: Path) -> None:
    """Raises ValueError, saying what is wrong or missing and how to get it, where no such video can be made."""
    suffix = path.suffix.lower()
    if suffix not in (".mp4", ".gif"):
        raise ValueError(f"a video is an .mp4 or a .gif, and {path} is neither; give it one of these endings")
    if suffix == ".mp4" and not has_ffmpeg():
        raise ValueError("a video needs ffmpeg; pip install imageio-ffmpeg brings one (a .gif needs none)")
    _open(SIZE).close()


def has_ffmpeg() -> bool:
    """Whether an MP4 can be made here."""
    try:
        import imageio_ffmpeg

        imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        return False
    return True


def render(
    path: Path,
    frames: Sequence[Frame],
    latency: Latency,
    ground: Ground | None = None,
    character: Character | None = None,
    progress: Progress = ignore,
) -> None:
    """Writes the frames, on a ground, by the figure or by a character, as a video in real time: every one in an .mp4,
    every GIF_STEP-th in a .gif.

    progress: told after each picture how much is drawn, 0 .. 1. Drawing is timed as the stage `render`. Raises
    ValueError where OpenGL is missing or ffmpeg gives up."""
    if path.suffix.lower() == ".gif":
        write_gif(path, _pictures(frames, GIF_SIZE, GIF_STEP, latency, ground, character, progress))
    else:
        _write_mp4(path, _pictures(frames, SIZE, 1, latency, ground, character, progress))


def _pictures(
    frames: Sequence[Frame],
    size: tuple[int, int],
    step: int,
    latency: Latency,
    ground: Ground | None,
    character: Character | None,
    progress: Progress,
) -> Generator[np.ndarray, None, None]:
    """Every step-th frame as (height, width, 3) uint8."""
    view = View(ground=ground)
    view.dress(DrawnCharacter(character) if character else None)
    view.jump_to(frames[0])
    with _open(size) as window:
        renderer = Renderer(window.size, supersample=_supersample(step))
        drawn = tqdm(frames, "video", unit="frame", leave=False, disable=not sys.stderr.isatty())
        for number, frame in enumerate(drawn):
            view.panels = (panels.parts(worn(frame)),)
            view.make_room(size)
            view.follow(frame, 1 / FPS)
            if number % step:
                continue
            with latency.stage("render"):
                window.bind()
                renderer.draw(frame, view)
                picture = window.read_pixels()  # waits until it is drawn
            progress((number + 1) / len(frames))
            yield picture


def _supersample(step: int) -> int:
    """... but where a processor draws 60 pictures a second: outlines are smoothed there in any case, and it would take
    twice as long. The window is open."""
    from demo.render import gl

    return 1 if step == 1 and gl.is_software() else SUPERSAMPLE


def _write_mp4(path: Path, pictures: Generator[np.ndarray, None, None]) -> None:
    import imageio_ffmpeg

    encoder = imageio_ffmpeg.write_frames(
        str(path), SIZE, fps=FPS, codec="libx264", macro_block_size=2, output_params=FFMPEG_OPTIONS
    )
    with closing(pictures), closing(encoder):  # closing the generator ends ffmpeg
        encoder.send(None)
        try:
            for picture in pictures:
                encoder.send(picture)
        except OSError as error:
            raise ValueError("ffmpeg stopped before the video was whole; is the disk full?") from error


def write_gif(path: Path, pictures: Generator[np.ndarray, None, None]) -> None:
    """Writes pictures (height, width, 3) uint8, 20 of them a second, as an endless loop."""
    with closing(pictures):
        # The octree keeps the figure's colours; the others spend nearly all on sky and ground. Dithering triples the
        # file.
        images = (
            Image.fromarray(picture).quantize(method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
            for picture in pictures
        )
        next(images).save(path, "GIF", save_all=True, append_images=images, loop=0, duration=1000 * GIF_STEP // FPS)


def _open(size: tuple[int, int]) -> Window:
    try:
        return open_window(size, visible=False)
    except (NoGL, NoDisplay) as error:
        raise ValueError(f"a video needs OpenGL: {error}") from None
