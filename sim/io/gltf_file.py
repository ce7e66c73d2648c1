"""A glTF 2.0 file (.glb, .gltf, .vrm): its document, its tree of nodes, and the numbers that its accessors point at.

Read by hand because it is little, and because pygltflib takes a quarter of a minute for a file of fifty animations, and
trimesh leaves out skins; sections are the specification's."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from sim.io.bvh_parser import LARGEST_NUMBER, MAX_DEPTH, shorten
from sim.math import rotations as rot

ENDINGS = (".glb", ".gltf", ".vrm")
MAX_MEGABYTES = 256
MEGABYTE = 1_000_000
TYPES: dict[int, Any] = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
# What makes of a file's text and numbers anything but a motion or a mesh.
BROKEN = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError, struct.error)


class GltfFile:
    """What a file says, its nodes, and for each of these its parent, -1 for none."""

    def __init__(self, path: str | Path) -> None:
        """Raises OSError, or one of BROKEN for what is no glTF file."""
        self.path, self._blob = Path(path), b""
        self._buffers: dict[int, bytes] = {}
        with open(path, "rb") as file:
            data = file.read(MAX_MEGABYTES * MEGABYTE + 1)
        if len(data) > MAX_MEGABYTES * MEGABYTE:
            raise ValueError(
                f"{path} is larger than {MAX_MEGABYTES} MB: export the skeleton and what hangs on it alone"
            )
        if data[:4] == b"glTF":  # sec. 4.4
            data, self._blob = self._chunks(data)
        self.document: dict[str, Any] = json.loads(data.decode("utf-8-sig"))
        self.nodes: list[dict[str, Any]] = self.document.get("nodes", [])
        self.parents = _parents(self.nodes)

    def _chunks(self, data: bytes) -> tuple[bytes, bytes]:
        found: dict[bytes, bytes] = {}
        start = 12
        while start + 8 <= len(data):
            length, kind = struct.unpack_from("<I4s", data, start)
            found.setdefault(kind, data[start + 8 : start + 8 + length])
            start += 8 + length
        return found[b"JSON"], found.get(b"BIN\0", b"")

    def name(self, node: int) -> str:
        """What a node is called."""
        return str(self.nodes[node].get("name") or f"node{node}")

    def numbers(self, number: int, shares: bool | None = None) -> np.ndarray:
        """(n, columns) of an accessor (sec. 3.6.2). shares: whether integers are shares of their range; None: where the
        accessor says so."""
        accessor = self.document["accessors"][number]
        kind, columns = np.dtype(TYPES[accessor["componentType"]]), COLUMNS[accessor["type"]]
        if not 0 < accessor["count"] * columns <= MAX_MEGABYTES * MEGABYTE:
            raise ValueError(f"accessor {number} holds nothing, or more than any file")
        values = np.zeros((accessor["count"], columns))
        if "bufferView" in accessor:
            start = accessor.get("byteOffset", 0)
            values = self._table(number, accessor["bufferView"], start, accessor["count"], kind, columns)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            places, news = sparse["indices"], sparse["values"]
            of_place = np.dtype(TYPES[places["componentType"]])
            rows = self._table(number, places["bufferView"], places.get("byteOffset", 0), sparse["count"], of_place, 1)
            values[rows[:, 0].astype(int)] = self._table(
                number, news["bufferView"], news.get("byteOffset", 0), sparse["count"], kind, columns
            )
        if kind.kind != "f" and (accessor.get("normalized", False) if shares is None else shares):
            values = np.maximum(values / float(np.iinfo(kind).max), -1.0)
        if not (np.abs(values) <= LARGEST_NUMBER).all():
            raise ValueError(f"accessor {number} holds numbers that are no body's")
        return values

    def _table(self, number: int, view: int, start: int, count: int, kind: np.dtype, columns: int) -> np.ndarray:
        """(count, columns) of floats from a byte of a buffer view on."""
        entry, data = self.document["bufferViews"][view], self.view(view)
        stride = entry.get("byteStride") or columns * kind.itemsize
        needed = start + stride * (count - 1) + columns * kind.itemsize
        if count < 1 or start < 0 or stride < columns * kind.itemsize or needed > len(data):
            raise ValueError(f"accessor {number} reaches beyond its buffer")
        strides = (stride, kind.itemsize)
        return np.ndarray((count, columns), kind.newbyteorder("<"), data, start, strides).astype(float)

    def view(self, number: int) -> bytes:
        """The bytes of a buffer view."""
        entry = self.document["bufferViews"][number]
        start = entry.get("byteOffset", 0)
        data = self._buffer(entry["buffer"])
        if start < 0 or start + entry["byteLength"] > len(data):
            raise ValueError(f"buffer view {number} reaches beyond its buffer")
        return data[start : start + entry["byteLength"]]

    def _buffer(self, number: int) -> bytes:
        """The bytes of a buffer: in the .glb, in the text, or in a file in the same folder."""
        if number not in self._buffers:
            uri = self.document["buffers"][number].get("uri")
            self._buffers[number] = self._blob if uri is None else self.resource(uri)
        return self._buffers[number]

    def resource(self, uri: str) -> bytes:
        """The bytes that a URI stands for: in the text, or in a file in the same folder."""
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2])
        if Path(uri).name != uri:
            raise ValueError(f"{self.path}: what it needs lies in '{shorten(uri)}', which has to be a file beside it")
        with open(self.path.parent / uri, "rb") as file:
            return file.read(MAX_MEGABYTES * MEGABYTE)

    def above(self, node: int) -> list[int]:
        """A node and all that it hangs on, itself first."""
        found = [node]
        while self.parents[found[-1]] >= 0:
            found.append(self.parents[found[-1]])
        return found


def _parents(nodes: list[dict[str, Any]]) -> list[int]:
    """The parent of each node, -1 for none. Raises ValueError for nodes that are no tree."""
    parents = [-1] * len(nodes)
    for number, node in enumerate(nodes):
        for child in node.get("children", ()):
            if not 0 <= child < len(nodes) or parents[child] >= 0:
                raise ValueError("its nodes are no tree")
            parents[child] = number
    for place in range(len(nodes)):
        depth = 0
        while place >= 0:
            place, depth = parents[place], depth + 1
            if depth > MAX_DEPTH:
                raise ValueError(f"its nodes lie more than {MAX_DEPTH} deep, or in a circle")
    return parents


def rest_of(node: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Translation (3,), rotation (4,) and scale (3,) of a node."""
    if "matrix" in node:
        matrix = np.array(node["matrix"], dtype=float).reshape(4, 4).T
        scale = np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-12)
        scale[0] *= np.sign(np.linalg.det(matrix[:3, :3])) or 1.0
        return matrix[:3, 3], rot.from_matrix(matrix[:3, :3] / scale), scale
    turn = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=float).reshape(4)
    return (
        np.array(node.get("translation", (0.0, 0.0, 0.0)), dtype=float).reshape(3),
        rot.normalize(np.roll(turn, 1)),
        np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=float).reshape(3),
    )
