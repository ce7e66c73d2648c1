"""glTF 2.0 binary files (.glb) as they are written: a document, and one block of numbers that it points into."""

import json
import struct
from typing import Any

import numpy as np

COMPONENTS = {
    np.dtype(np.float32): 5126,
    np.dtype(np.uint8): 5121,
    np.dtype(np.uint16): 5123,
    np.dtype(np.uint32): 5125,
}
TYPES = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
VERTICES, INDICES = 34962, 34963  # what a buffer view feeds
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"


class Numbers:
    """The binary block, and the accessors and views that say what lies where in it."""

    def __init__(self) -> None:
        self.block = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: np.ndarray, target: int | None = None, bounds: bool = False) -> int:
        """Appends (n, ...) numbers and gives their accessor; floats become single precision.

        target: VERTICES or INDICES for a mesh. bounds: with the least and greatest value."""
        values = np.ascontiguousarray(values, np.float32 if values.dtype.kind == "f" else values.dtype)
        view = self.add_view(values.tobytes(), {"target": target} if target else {})
        self.accessors.append(
            {
                "bufferView": view,
                "componentType": COMPONENTS[values.dtype],
                "count": len(values),
                "type": TYPES[values.shape[1:]],
            }
        )
        if bounds:
            ends = {"min": values.min(axis=0), "max": values.max(axis=0)}
            self.accessors[-1] |= {name: np.atleast_1d(end).tolist() for name, end in ends.items()}
        return len(self.accessors) - 1

    def add_view(self, data: bytes, properties: dict[str, Any]) -> int:
        """Appends bytes, aligned as any numbers need to be, and gives their view."""
        self.views.append({"buffer": 0, "byteOffset": len(self.block), "byteLength": len(data)} | properties)
        self.block += data
        self.block += bytes(-len(self.block) % 4)
        return len(self.views) - 1


def encode_glb(document: dict[str, Any], numbers: Numbers) -> bytes:
    """The bytes of a .glb file: JSON chunk, binary chunk (glTF 2.0, sec. 4.4)."""
    whole = document | {
        "accessors": numbers.accessors,
        "bufferViews": numbers.views,
        "buffers": [{"byteLength": len(numbers.block)}],
    }
    chunks = _chunk(JSON_CHUNK, json.dumps(whole).encode(), b" ") + _chunk(BINARY_CHUNK, bytes(numbers.block), b"\0")
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _chunk(kind: bytes, data: bytes, filler: bytes) -> bytes:
    data += filler * (-len(data) % 4)
    return struct.pack("<I4s", len(data), kind) + data


def animation(numbers: Numbers, name: str, fps: float, tracks: list[tuple[int, str, np.ndarray]]) -> dict[str, Any]:
    """An animation of a key a frame: tracks are (node, path, values (frames, 3) or quaternions as glTF has them)."""
    times = numbers.add(np.arange(len(tracks[0][2])) / fps, bounds=True)
    return {
        "name": name,
        "samplers": [{"input": times, "output": numbers.add(values)} for _, _, values in tracks],
        "channels": [
            {"sampler": sampler, "target": {"node": node, "path": path}}
            for sampler, (node, path, _) in enumerate(tracks)
        ],
    }


def xyzw(q: np.ndarray) -> np.ndarray:
    """Our quaternions (..., 4), (w, x, y, z), in glTF's order."""
    return np.roll(q, -1, axis=-1)
