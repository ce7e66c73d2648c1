"""Files that hold a motion, whatever their format: told by their ending."""

import os
from errno import ENOENT
from pathlib import Path

from sim.io import bvh, gltf, smpl

ENDINGS = (".bvh", ".glb", ".gltf", ".npz")  # of clips, as users name and drop them; another one is read as BVH
FBX = "FBX cannot be read: open it in Blender (File > Import > FBX), then File > Export > Motion Capture (.bvh)"


def read(path: str | Path, fps: float | None = None) -> bvh.Motion:
    """The motion in a BVH, glTF or SMPL (AMASS) file. fps: frames a second, believed in place of what the file says.

    Raises OSError, or ValueError, in one sentence that names the file, for what holds none."""
    bvh.check_fps(fps)
    file, _, animation = split(path)
    ending = file.suffix.lower()
    if ending == ".fbx":
        raise ValueError(f"{path}: {FBX}")
    if ending == ".npz":
        return smpl.read(file, fps)
    if ending in (".glb", ".gltf"):
        return gltf.read(file, fps, animation or None)
    return bvh.read(path, fps)


def check_there(path: str | Path) -> None:
    """Raises FileNotFoundError where there is no file or folder that is meant by a path (see `split`)."""
    if not split(path)[0].exists():
        raise FileNotFoundError(ENOENT, os.strerror(ENOENT), str(path))


def is_motion(name: str | Path) -> bool:
    """Whether a name ends as that of a file that may hold a motion, one that cannot be read among them."""
    return split(name)[0].suffix.lower() in (*ENDINGS, ".fbx")


def split(path: str | Path) -> tuple[Path, str, str]:
    """A file and the animation in it that is meant: walk.glb#Run is the animation Run of walk.glb."""
    if Path(path).exists():
        return Path(path), "", ""
    file, sign, animation = str(path).partition("#")
    return Path(file), sign, animation
