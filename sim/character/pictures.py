"""The pictures of a character's file: its textures as they are drawn, and what becomes of those that cannot be read."""

import io
import warnings
from typing import Any, Mapping

import numpy as np
from PIL import Image

from sim.io.bvh_parser import shorten
from sim.io.gltf_file import GltfFile

MOST_PIXELS = 8192  # of a texture's side that a file may have
TEXTURE_PIXELS = 2048  # of a texture's side that is drawn
# A white pixel as PNG: what a written file has in the place of a lost picture, so that the others keep their numbers.
PIXEL = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b55"
    "0000000a49444154789c63f80f0001010100b138f6140000000049454e44ae426082"
)


def read_picture(file: GltfFile, texture: int, material: str) -> np.ndarray | None:
    """(h, w, 4) uint8 of a texture; None, with a warning, where its picture cannot be read."""
    source = next(iter(_sources(file.document["textures"][texture])), None)
    if source in file.lost_pictures:
        return None  # `warn_of_lost` says so
    try:
        return _decoded(file, source)
    except ValueError as error:
        reason = str(error)
    except Exception:  # Pillow raises many kinds for a damaged picture
        reason = "it is damaged, or no picture that is read; use PNG or JPEG"
    warnings.warn(f"{file.path}: the texture of '{shorten(material)}' is left out: {reason}", stacklevel=2)
    return None


def _decoded(file: GltfFile, source: int | None) -> np.ndarray:
    if source is None:
        raise ValueError("it is of a kind that is not read; use PNG or JPEG")
    with Image.open(io.BytesIO(file.picture(source))) as opened:
        if max(opened.size) > MOST_PIXELS:
            raise ValueError(f"it has {opened.size[0]} x {opened.size[1]} pixels: {MOST_PIXELS} are the most")
        picture = opened.convert("RGBA")
    if max(picture.size) > TEXTURE_PIXELS:
        picture.thumbnail((TEXTURE_PIXELS, TEXTURE_PIXELS))
    return np.asarray(picture)


def _sources(texture: dict[str, Any]) -> list[int]:
    """The pictures that a texture names: its own, and the one as WebP."""
    holders = (texture, texture.get("extensions", {}).get("EXT_texture_webp", {}))
    return [holder["source"] for holder in holders if "source" in holder]


def warn_of_lost(file: GltfFile) -> None:
    """A warning for each picture that neither is drawn nor comes into a file that is written."""
    for number, reason in file.lost_pictures.items():
        warnings.warn(f"{file.path}: its picture {number} is left out: {reason}", stacklevel=2)


def take_out_lost(document: dict[str, Any], lost: Mapping[int, str]) -> None:
    """Takes what refers to lost pictures out of the materials of a document that is to be written."""
    if not lost:
        return
    gone = {number for number, each in enumerate(document.get("textures", ())) if lost.keys() & _sources(each)}
    for material in document.get("materials", ()):
        _without(material, gone)


def _without(entry: dict[str, Any], textures: set[int]) -> None:
    for name, value in list(entry.items()):
        if isinstance(value, dict):
            if name.endswith("Texture") and value.get("index") in textures:
                del entry[name]
            else:
                _without(value, textures)
