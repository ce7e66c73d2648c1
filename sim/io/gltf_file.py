"""A glTF 2.0 file (.glb, .gltf, .vrm): its document, its tree of nodes, and the numbers that its accessors point at.

Read by hand because it is little, and because pygltflib takes a quarter of a minute for a file of fifty animations, and
trimesh leaves out skins; sections are the specification's."""

import base64
import json
import struct
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any, Iterator

import numpy as np

from sim.io.bvh_parser import LARGEST_NUMBER, MAX_DEPTH, shorten
from sim.io.gltf_schema import AGAIN, COLUMNS, check_document
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
MAX_ENTRIES = 2_000_000  # of all lists of a document, whose numbers lie in its buffers


@contextmanager
def reading_gltf(path: Path) -> Iterator[None]:
    """Turns whatever fails while the block makes sense of a glTF file into a ValueError, in one sentence that names the
    file. What the table of gltf_schema does not foresee, and Python or numpy would say in their own words, is called
    damaged."""
    try:
        yield
    except ValueError as error:
        raise error if str(path) in str(error) else ValueError(f"{path}: {error}") from error
    except (LookupError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        raise ValueError(f"{path}: {AGAIN}") from error


class GltfFile:
    """What a file says, its nodes, and for each of these its parent, -1 for none."""

    def __init__(self, path: str | Path) -> None:
        """Raises OSError, or ValueError for what is no glTF file; what its numbers make of it, see `reading_gltf`."""
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
        self.document = _parsed(data)
        self.nodes: list[dict[str, Any]] = self.document.get("nodes", [])
        self.parents = _parents(self.nodes)

    def _chunks(self, data: bytes) -> tuple[bytes, bytes]:
        found: dict[bytes, bytes] = {}
        start = 12
        while start + 8 <= len(data):
            length, kind = struct.unpack_from("<I4s", data, start)
            found.setdefault(kind, data[start + 8 : start + 8 + length])
            start += 8 + length
        if b"JSON" not in found:
            raise ValueError(f"it is a .glb without a glTF 2.0 document: {AGAIN}")
        return found[b"JSON"], found.get(b"BIN\0", b"")

    def name(self, node: int) -> str:
        """What a node is called."""
        return str(self.nodes[node].get("name") or f"node{node}")

    def numbers(
        self, number: int, wanted: tuple[int, ...] = (), count: int | None = None, shares: bool | None = None
    ) -> np.ndarray:
        """(n, columns) of an accessor (sec. 3.6.2). wanted: how many columns there may be, () for any; count: how many
        rows there have to be; shares: whether integers are shares of their range; None: where the accessor says so.

        Raises ValueError where it holds something else, or numbers that are no body's."""
        accessor = self.document["accessors"][number]
        kind, columns = np.dtype(TYPES[accessor["componentType"]]), COLUMNS[accessor["type"]]
        if not 0 < accessor["count"] * columns <= MAX_MEGABYTES * MEGABYTE:
            raise ValueError(f"accessors[{number}] holds nothing, or more than any file: {AGAIN}")
        if wanted and columns not in wanted:
            needed = " or ".join(map(str, wanted))
            raise ValueError(f"accessors[{number}] holds {columns} numbers an entry where {needed} are needed: {AGAIN}")
        if count is not None and accessor["count"] != count:
            raise ValueError(f"accessors[{number}] has {accessor['count']} entries where {count} are needed: {AGAIN}")
        values = np.zeros((accessor["count"], columns))
        if "bufferView" in accessor:
            start = accessor.get("byteOffset", 0)
            values = self._table(number, accessor["bufferView"], start, accessor["count"], kind, columns)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            places, news = sparse["indices"], sparse["values"]
            of_place = np.dtype(TYPES[places["componentType"]])
            rows = self._table(number, places["bufferView"], places.get("byteOffset", 0), sparse["count"], of_place, 1)
            if rows.min() < 0 or rows.max() >= len(values):
                raise ValueError(f"accessors[{number}] replaces entries that it does not have: {AGAIN}")
            values[rows[:, 0].astype(int)] = self._table(
                number, news["bufferView"], news.get("byteOffset", 0), sparse["count"], kind, columns
            )
        if kind.kind != "f" and (accessor.get("normalized", False) if shares is None else shares):
            values = np.maximum(values / float(np.iinfo(kind).max), -1.0)
        if not (np.abs(values) <= LARGEST_NUMBER).all():
            raise ValueError(f"accessors[{number}] holds numbers that are no body's: {AGAIN}")
        return values

    def _table(self, number: int, view: int, start: int, count: int, kind: np.dtype, columns: int) -> np.ndarray:
        """(count, columns) of floats from a byte of a buffer view on."""
        entry, data = self.document["bufferViews"][view], self.view(view)
        stride = entry.get("byteStride") or columns * kind.itemsize
        needed = start + stride * (count - 1) + columns * kind.itemsize
        if count < 1 or start < 0 or stride < columns * kind.itemsize or needed > len(data):
            raise ValueError(f"accessors[{number}] reaches beyond its buffer: {AGAIN}")
        strides = (stride, kind.itemsize)
        return np.ndarray((count, columns), kind.newbyteorder("<"), data, start, strides).astype(float)

    def view(self, number: int) -> bytes:
        """The bytes of a buffer view."""
        entry = self.document["bufferViews"][number]
        start = entry.get("byteOffset", 0)
        data = self._buffer(entry["buffer"])
        if start < 0 or start + entry["byteLength"] > len(data):
            raise ValueError(f"bufferViews[{number}] reaches beyond its buffer: {AGAIN}")
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
            try:
                return base64.b64decode(uri.partition(",")[2])
            except ValueError:
                raise ValueError(f"'{shorten(uri)}' is no base64: {AGAIN}") from None
        if Path(uri).name != uri:
            raise ValueError(f"what it needs lies in '{shorten(uri)}', which has to be a file beside it")
        if not (self.path.parent / uri).is_file():
            raise ValueError(
                f"'{shorten(uri)}' does not lie beside it: put it there, or export it as .glb, which holds all"
            )
        with open(self.path.parent / uri, "rb") as file:
            return file.read(MAX_MEGABYTES * MEGABYTE)

    def picture(self, number: int) -> bytes:
        """The bytes of an image. Raises ValueError or OSError where it cannot be read."""
        image = self.document["images"][number]
        if "bufferView" not in image and "uri" not in image:
            raise ValueError("it says neither a buffer view nor a file")
        return self.view(image["bufferView"]) if "bufferView" in image else self.resource(image["uri"])

    @cached_property
    def lost_pictures(self) -> dict[int, str]:
        """Number -> reason of the images that cannot be read."""
        lost = {}
        for number in range(len(self.document.get("images", ()))):
            try:
                self.picture(number)
            except (ValueError, OSError) as error:
                lost[number] = error.strerror or str(error) if isinstance(error, OSError) else str(error)
        return lost

    def check_views(self) -> None:
        """Raises ValueError or OSError where some of its buffer views cannot be read."""
        for number in range(len(self.document.get("bufferViews", ()))):
            self.view(number)

    def above(self, node: int) -> list[int]:
        """A node and all that it hangs on, itself first."""
        found = [node]
        while self.parents[found[-1]] >= 0:
            found.append(self.parents[found[-1]])
        return found


def _parsed(data: bytes) -> dict[str, Any]:
    """The document in a file's text. Raises ValueError where it is none, or is not as gltf_schema has it."""
    if data.count(b",") > MAX_ENTRIES:
        raise ValueError(f"its document has over {MAX_ENTRIES} entries: export the figure alone")
    try:
        document = json.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise ValueError(f"byte {error.start} of its document is no UTF-8: {AGAIN}") from None
    except json.JSONDecodeError as error:
        raise ValueError(
            f"its document breaks off, or is no JSON, in line {error.lineno}, column {error.colno}: {AGAIN}"
        ) from None
    except (RecursionError, ValueError):  # the latter of a number of thousands of digits
        raise ValueError(f"its document is nested too deep, or holds numbers without an end: {AGAIN}") from None
    check_document(document)
    return document


def _parents(nodes: list[dict[str, Any]]) -> list[int]:
    """The parent of each node, -1 for none. Raises ValueError for nodes that are no tree."""
    parents = [-1] * len(nodes)
    for number, node in enumerate(nodes):
        for child in node.get("children", ()):
            if parents[child] >= 0:
                raise ValueError(f"nodes[{child}] hangs on two others: {AGAIN}")
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
