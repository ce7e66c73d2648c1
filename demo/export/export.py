"""What a replay leaves behind: poses, BVH, glTF, video and latency report, each complete or not there at all."""

import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Callable, Mapping, Sequence

import numpy as np

from sim.command import Command
from sim.ground.ground import Ground
from sim.io import bvh
from sim.io.atomic_write import atomic_write
from sim.latency import Latency
from sim.math.vectors import FLOOR
from sim.motion.clip import FPS, Clip, RootFrame
from sim.session import Frame
from sim.style_spec import StyleSpec

if TYPE_CHECKING:  # imported where it is used: it brings scipy, and what a line mistypes is said before
    from sim.character.character import Character
    from sim.character.motion import CharacterMotion


@dataclass(frozen=True)
class Takeaway:
    """Who moves in what is written: the user's own character, None for the figure; at how many frames a second, 30 or
    60, and whether in place, without the way over the floor."""

    character: "Character | None" = None
    rate: int = FPS
    in_place: bool = False


Progress = Callable[[float], object]  # told how much is done, 0 .. 1


def ignore(share: float) -> None:
    """For whoever does not want to know how much is done."""


@dataclass(frozen=True)
class Result:
    """A finished replay: its frames, how long their stages took, the seconds before the first, what was walked on
    (None: level floor), and how it is written. progress: told, while a video is drawn, how much of it is, 0 .. 1."""

    frames: Sequence[Frame]
    latency: Latency
    startup_s: float
    ground: Ground | None = None
    takeaway: Takeaway = field(default_factory=Takeaway)
    progress: Progress = ignore


def write_bvh(path: Path, result: Result) -> None:
    """The styled motion, for other animation programs: on the figure's skeleton, or on the character's."""
    from sim.character import files

    motion = _character_motion(result)
    clip = styled_clip(result.frames)
    way = root_of(result.frames).positions * FLOOR if result.takeaway.in_place else np.zeros(3)
    clip = replace(clip, hips=clip.hips - way)[:: FPS // result.takeaway.rate]
    bvh.write(path, files.to_bvh(motion) if motion else replace(clip, fps=result.takeaway.rate))


def write_glb(path: Path, result: Result) -> None:
    """The styled motion on the figure, in the colours that it has at the end, or on the character; and the uneven
    ground under it."""
    from demo.export import gltf
    from demo.figure import colours
    from sim.character import glb

    clip, takeaway, ground = styled_clip(result.frames), result.takeaway, result.ground
    if motion := _character_motion(result):
        scenery = None
        if ground is not None:
            corners, triangles = gltf.ground_around(ground, clip.hips)
            scenery = corners * motion.character.scale, triangles
        glb.write_glb(path, motion, scenery)
        return
    worn = colours.part_colours(colours.worn(result.frames[-1]))
    gltf.write(path, clip, worn, ground, takeaway.rate, takeaway.in_place, root_of(result.frames))


def _character_motion(result: Result) -> "CharacterMotion | None":
    """What the character does in the frames; None where there is none."""
    from sim.character.motion import fit_motion

    takeaway = result.takeaway
    if takeaway.character is None:
        return None
    poses = (frame.styled for frame in result.frames)
    return fit_motion(takeaway.character, poses, result.ground, takeaway.rate, takeaway.in_place)


def of_clip(clip: Clip, style: StyleSpec, takeaway: Takeaway) -> Result:
    """A clip at 60 frames a second, in a style, as something to write."""
    from sim.character.motion import poses_of

    command = Command(style=style)
    return Result([Frame(command, pose, pose) for pose in poses_of(clip)], Latency(), 0.0, takeaway=takeaway)


def root_of(frames: Sequence[Frame]) -> RootFrame:
    """Where the ground frame goes."""
    roots = np.array([frame.styled.root_position for frame in frames])
    return RootFrame(roots, np.unwrap([float(frame.styled.root_facing) for frame in frames]))


def styled_clip(frames: Sequence[Frame]) -> Clip:
    """What is drawn, as a clip at 60 fps."""
    poses = [frame.styled for frame in frames]
    return Clip(np.array([pose.hips for pose in poses]), np.array([pose.local_rotations for pose in poses]))


def write_video(path: Path, result: Result) -> None:
    """The replay as seen by the demo's camera, as an MP4 or a GIF, by the file's ending."""
    from demo.export import video

    try:
        with atomic_write(path) as temporary:
            video.render(
                temporary,
                result.frames,
                result.latency,
                result.ground,
                result.takeaway.character,
                result.progress,
            )
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def write_latency(path: Path, result: Result) -> None:
    """How long each stage took; written last, so that drawing the video counts as well."""
    from demo import assemble

    with atomic_write(path) as temporary:
        result.latency.save(temporary, startup_s=result.startup_s, **assemble.machine())


WRITERS = {"bvh": write_bvh, "glb": write_glb, "video": write_video, "latency": write_latency}


WHOLE = {"bvh", "glb", "video"}  # that are made of all frames at once; poses are written as they come
MAX_MINUTES = 60  # of those
ENDINGS = {"bvh": ".bvh", "glb": ".glb"}  # of a video see demo.export.video


def check_length(name: str, frames: int, outputs: Mapping[str, Path]) -> None:
    """Raises ValueError where a replay is too long for what is to be made of it."""
    minutes = frames / FPS / 60
    if minutes > MAX_MINUTES and outputs.keys() & WHOLE:
        raise ValueError(
            f"{name} lasts {minutes:.0f} minutes: bvh, glb and video hold {MAX_MINUTES} at most, poses any length"
        )


def check_outputs(outputs: Mapping[str, Path], source: Path | None = None) -> None:
    """Raises ValueError or OSError for the first output that could not be written, before a long replay begins."""
    taken = {source.resolve(): "the recording itself"} if source else {}
    for kind, path in outputs.items():
        resolved = path.resolve()
        if resolved in taken:
            raise ValueError(f"cannot write {kind} to {path}: it is {taken[resolved]}")
        taken[resolved] = f"where {kind} goes already"
        if path.exists() and not path.is_file():
            raise ValueError(f"cannot write {kind} to {path}: it is not a file")
        if path.suffix.lower() != ENDINGS.get(kind, path.suffix.lower()):
            raise ValueError(f"cannot write {kind} to {path}: name it {path.with_suffix(ENDINGS[kind])}")
        if not path.parent.is_dir():
            raise ValueError(f"cannot write {kind} to {path}: there is no folder {path.parent}; make it first")
        try:
            tempfile.TemporaryFile(dir=path.parent).close()
        except OSError as error:
            raise ValueError(f"cannot write {kind} to {path}: {error.strerror}") from None
    if "video" in outputs:
        from demo.export import video

        video.check(outputs["video"])
