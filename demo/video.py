"""A video of a replay: the demo's renderer without a screen, its pictures piped to ffmpeg."""

import sys
from contextlib import closing
from pathlib import Path
from typing import Sequence

from tqdm import tqdm

from demo import panels
from demo.renderer import Renderer
from demo.view import View
from demo.window import NoDisplay, NoGL, Window, open_window
from sim.clip import FPS
from sim.latency import Latency
from sim.session import Frame

SIZE = (960, 540)  # pixels
# The index in front, so that a browser can play at once; little effort, because the processor may be drawing as well.
FFMPEG_OPTIONS = ["-crf", "20", "-preset", "veryfast", "-movflags", "+faststart"]


def check() -> None:
    """Raises ValueError, saying what is missing and how to get it, where no video can be made."""
    try:
        import imageio_ffmpeg
        imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        raise ValueError("a video needs ffmpeg; pip install imageio-ffmpeg brings one") from None
    _open().close()


def render(path: Path, frames: Sequence[Frame], latency: Latency) -> None:
    """Writes every frame as one picture of an H.264 video at 60 a second; drawing is timed as the stage `render`.

    Raises ValueError where OpenGL is missing or ffmpeg gives up."""
    import imageio_ffmpeg
    encoder = imageio_ffmpeg.write_frames(str(path), SIZE, fps=FPS, codec="libx264", macro_block_size=2,
                                          output_params=FFMPEG_OPTIONS)
    view = View()
    view.camera.jump(frames[0].styled.root_position)
    with _open() as window, closing(encoder):  # closing the generator ends ffmpeg
        renderer = Renderer(window.size)
        encoder.send(None)
        try:
            for frame in tqdm(frames, "video", unit="frame", leave=False, disable=not sys.stderr.isatty()):
                view.follow(frame, 1 / FPS)
                view.panels = (panels.parts(frame.command.style),)
                with latency.stage("render"):
                    window.bind()
                    renderer.draw(frame, view)
                    picture = window.read_pixels()  # waits until it is drawn
                encoder.send(picture)
        except OSError as error:
            raise ValueError("ffmpeg stopped before the video was whole; is the disk full?") from error


def _open() -> Window:
    try:
        return open_window(SIZE, visible=False)
    except (NoGL, NoDisplay) as error:
        raise ValueError(f"a video needs OpenGL: {error}") from None
