"""Patchwalk as a library: a character under control, restyled limb by limb, and clips restyled offline.

    import patchwalk as pw
    session = pw.Session(pw.load_controller(), pw.load_stylizer())
    frame = session.step(pw.Command(move=(0, 1), gait="walk", style={"arms": ("old", 0.8)}))
    frame.styled.positions                          # (21, 3) metres, at 60 frames a second
    session.stylizer.bank.add("limp", pw.load_clip("limp.bvh"))
    pw.save_bvh("out.bvh", pw.stylize(pw.load_clip("walk.bvh"), {"legs": "limp"}, session.stylizer))
    hero = pw.load_character("hero.glb")            # or .vrm: one's own, in place of the figure
    pw.CharacterFit(hero).step(frame.styled)        # its joints in that frame, at the figure's leg length
    pw.save_glb("out.glb", pw.load_clip("walk.bvh"), hero)

What is named here is kept: it changes only with a new minor version, and then the changelog says how. Every function
raises ValueError in one sentence for what it cannot use, OSError for a file that it cannot read or write. Loading a
stylizer sets one thread for torch, because a frame is too little work for a second one, and flushes denormals, which
cost a hundredfold."""

from pathlib import Path
from typing import Iterable, Mapping

from controller.runtime.controller import PhaseFunctionedController
from sim.body.pose import Pose
from sim.character import files, glb
from sim.character.character import Character, load_character
from sim.character.fit import CharacterFit
from sim.character.motion import fit_motion, poses_of
from sim.command import Command, Commands
from sim.ground.catalogue import load_ground
from sim.ground.ground import Ground
from sim.io import bvh
from sim.motion.clip import Clip
from sim.retarget.retarget import load_clip
from sim.session import Frame, Session
from sim.style_spec import PartLike, StyleSpec
from stylizer.runtime import catalogue
from stylizer.runtime.live import LiveStylizer
from stylizer.runtime.offline import resolve_styles
from stylizer.runtime.offline import stylize as _stylize
from stylizer.styles.bank import StyleBank

__all__ = [
    "Character",
    "CharacterFit",
    "Clip",
    "Command",
    "Commands",
    "Frame",
    "Ground",
    "LiveStylizer",
    "PhaseFunctionedController",
    "Pose",
    "Session",
    "StyleBank",
    "StyleSpec",
    "load_character",
    "load_clip",
    "load_controller",
    "load_ground",
    "load_stylizer",
    "save_bvh",
    "save_glb",
    "stylize",
]


def load_controller() -> PhaseFunctionedController:
    """The shipped controller: neutral motion from commands, one frame of 1/60 s a step."""
    return PhaseFunctionedController.from_pretrained()


def load_stylizer(name: str | None = None) -> LiveStylizer:
    """A live stylizer, with the bundled styles and the user's own in its `bank`: None for Motion Puzzle, or slim,
    unpaired, diverse, latent."""
    return catalogue.from_pretrained(name)


def stylize(content: Clip, style: Mapping[str, PartLike], stylizer: LiveStylizer) -> Clip:
    """A clip with its body parts restyled and its feet cleaned. style: as of `StyleSpec`, where a name may also be the
    path of a BVH clip to take the style from."""
    return _stylize(stylizer.bank.model, content, resolve_styles(stylizer.bank, style))


def save_bvh(path: str | Path, clip: Clip, character: Character | None = None) -> None:
    """Writes a clip in centimetres, on the 21-joint skeleton or on a character's own."""
    bvh.write(path, clip if character is None else files.to_bvh(fit_motion(character, poses_of(clip))))


def save_glb(
    path: str | Path,
    motion: Clip | Iterable[Frame],
    character: Character,
    ground: Ground | None = None,
    fps: int = 60,
    in_place: bool = False,
) -> None:
    """Writes a character with its materials and the motion of a clip, or of a session's frames on its ground, as .glb
    at 30 or 60 frames a second; a `root` joint carries its way over the floor, or, in place, nothing does."""
    poses = poses_of(motion) if isinstance(motion, Clip) else [frame.styled for frame in motion]
    glb.write_glb(path, fit_motion(character, poses, ground, fps, in_place))
