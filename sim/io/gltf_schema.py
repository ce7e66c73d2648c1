"""What a glTF document has to look like where it is read: a table of its fields, checked before anything is made of it.

Sections are those of glTF 2.0. Fields that are not in the table are not read, only copied."""

import math
from typing import Any, Callable, Mapping

from sim.io.bvh_parser import LARGEST_NUMBER, shorten
from sim.style_spec import abbreviate

COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
COMPONENTS = (5120, 5121, 5122, 5123, 5125, 5126)
AGAIN = "the file is damaged, export it again"

Sizes = Mapping[str, int]  # how many entries each list of the document has
Check = Callable[[Any, str, Sizes], None]  # of a value, its place in the document, and those sizes: raises ValueError


def check_document(document: Any) -> None:
    """Raises ValueError, naming the place, where a document is not as the table says, or holds a number that is
    none."""
    if not isinstance(document, dict):
        raise ValueError(f"it holds no glTF document but {abbreviate(document)}: {AGAIN}")
    check_finite_numbers(document)
    sizes = {name: len(value) for name, value in document.items() if isinstance(value, list)}
    ASSET(document, "", sizes)
    version = document.get("asset", {}).get("version", "2.0")
    if not version.startswith("2."):
        raise ValueError(f"it is glTF {shorten(version)}, and 2.0 is read: export it as that")
    DOCUMENT(document, "", sizes)


def check_finite_numbers(document: Any) -> None:
    """Raises ValueError, naming the place, for NaN and infinity, which Python's JSON takes for numbers."""
    open_values = [(document, "")]
    while open_values:
        value, place = open_values.pop()
        if isinstance(value, float) and not math.isfinite(value):
            raise ValueError(f"{_named(place)} is {value}, which is no number: {AGAIN}")
        if isinstance(value, dict):
            open_values += [(each, f"{place}.{shorten(name)}") for name, each in value.items()]
        elif isinstance(value, list):
            open_values += [(each, f"{place}[{number}]") for number, each in enumerate(value)]


def kind(wanted: str, fits: Callable[[Any], bool]) -> Check:
    """A value that fits."""

    def check(value: Any, place: str, sizes: Sizes) -> None:
        if not fits(value):
            raise ValueError(f"{_named(place)} is {abbreviate(value)}, but must be {wanted}: {AGAIN}")

    return check


def entry_of(name: str) -> Check:
    """The number of an entry of one of the document's lists."""

    def check(value: Any, place: str, sizes: Sizes) -> None:
        there = sizes.get(name, 0)
        if not _is_count(value) or value >= there:
            raise ValueError(f"{_named(place)} is {abbreviate(value)}, but there are {there} {name}: {AGAIN}")

    return check


def each(entry: Check) -> Check:
    """A list of such values."""

    def check(value: Any, place: str, sizes: Sizes) -> None:
        LIST(value, place, sizes)
        for number, one in enumerate(value):
            entry(one, f"{place}[{number}]", sizes)

    return check


def table(entry: Check) -> Check:
    """An object whose values are such, whatever they are called."""

    def check(value: Any, place: str, sizes: Sizes) -> None:
        OBJECT(value, place, sizes)
        for name, one in value.items():
            entry(one, f"{place}.{shorten(name)}", sizes)

    return check


def fields(required: str = "", **known: Check) -> Check:
    """An object with these fields; required: those that have to be there, one word each."""

    def check(value: Any, place: str, sizes: Sizes) -> None:
        OBJECT(value, place, sizes)
        for name in required.split():
            if name not in value:
                raise ValueError(f"{_named(place)} has no '{name}': {AGAIN}")
        for name, entry in known.items():
            if name in value:
                entry(value[name], f"{place}.{name}", sizes)

    return check


def _channels(value: Any, place: str, sizes: Sizes) -> None:
    """An animation, whose channels name its own samplers."""
    samplers = fields("input output", input=entry_of("accessors"), output=entry_of("accessors"), interpolation=TEXT)
    OBJECT(value, place, sizes)
    count = len(value["samplers"]) if isinstance(value.get("samplers"), list) else 0
    target = fields("path", node=entry_of("nodes"), path=TEXT)
    channel = fields("sampler target", sampler=entry_of("samplers"), target=target)
    fields("channels samplers", channels=each(channel), samplers=each(samplers))(
        value, place, {**sizes, "samplers": count}
    )


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= LARGEST_NUMBER


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST_NUMBER


def _named(place: str) -> str:
    return place.lstrip(".") or "its document"


def numbers(*counts: int) -> Check:
    """A list of so many numbers."""
    wanted = f"{' or '.join(map(str, counts))} numbers of no more than {LARGEST_NUMBER:.0e}"
    return kind(wanted, lambda value: isinstance(value, list) and len(value) in counts and all(map(_is_number, value)))


LIST = kind("a list", lambda value: isinstance(value, list))
OBJECT = kind("an object", lambda value: isinstance(value, dict))
TEXT = kind("a text", lambda value: isinstance(value, str))
COUNT = kind("a whole number from 0 on", _is_count)
NUMBER = kind(f"a number of no more than {LARGEST_NUMBER:.0e}", _is_number)
NODE = kind("the number of a node", lambda value: isinstance(value, int))  # VRM writes -1 for a bone that is not there
SWITCH = kind("true or false", lambda value: isinstance(value, bool))

_TRANSFORM = fields(offset=numbers(2), rotation=NUMBER, scale=numbers(2), texCoord=COUNT)
_TEXTURE = fields(
    "index", index=entry_of("textures"), texCoord=COUNT, extensions=fields(KHR_texture_transform=_TRANSFORM)
)
_INDICES = fields(
    "bufferView componentType",
    bufferView=entry_of("bufferViews"),
    byteOffset=COUNT,
    componentType=kind("one of glTF's", lambda value: value in COMPONENTS),
)
_PRIMITIVE = fields(
    "attributes",
    attributes=table(entry_of("accessors")),
    indices=entry_of("accessors"),
    material=entry_of("materials"),
    mode=COUNT,
    targets=each(table(entry_of("accessors"))),
)
ASSET = fields(asset=fields(version=TEXT))
DOCUMENT = fields(
    extensionsRequired=each(TEXT),
    buffers=each(fields(uri=TEXT)),
    bufferViews=each(
        fields("buffer byteLength", buffer=entry_of("buffers"), byteOffset=COUNT, byteLength=COUNT, byteStride=COUNT)
    ),
    accessors=each(
        fields(
            "componentType count type",
            bufferView=entry_of("bufferViews"),
            byteOffset=COUNT,
            componentType=kind("one of glTF's", lambda value: value in COMPONENTS),
            normalized=SWITCH,
            count=COUNT,
            type=kind(f"one of {', '.join(COLUMNS)}", lambda value: isinstance(value, str) and value in COLUMNS),
            sparse=fields(
                "count indices values",
                count=COUNT,
                indices=_INDICES,
                values=fields("bufferView", bufferView=entry_of("bufferViews"), byteOffset=COUNT),
            ),
        )
    ),
    nodes=each(
        fields(
            children=each(entry_of("nodes")),
            skin=entry_of("skins"),
            mesh=entry_of("meshes"),
            matrix=numbers(16),
            translation=numbers(3),
            rotation=numbers(4),
            scale=numbers(3),
        )
    ),
    skins=each(
        fields(
            "joints",
            joints=each(entry_of("nodes")),
            inverseBindMatrices=entry_of("accessors"),
            skeleton=entry_of("nodes"),
        )
    ),
    meshes=each(fields("primitives", primitives=each(_PRIMITIVE))),
    materials=each(
        fields(
            pbrMetallicRoughness=fields(baseColorFactor=numbers(4), baseColorTexture=_TEXTURE),
            alphaMode=TEXT,
            alphaCutoff=NUMBER,
            doubleSided=SWITCH,
        )
    ),
    textures=each(
        fields(source=entry_of("images"), extensions=fields(EXT_texture_webp=fields(source=entry_of("images"))))
    ),
    images=each(fields(uri=TEXT, bufferView=entry_of("bufferViews"))),
    animations=each(_channels),
    scenes=each(fields(nodes=each(entry_of("nodes")))),
    extensions=fields(
        VRM=fields(
            "humanoid", humanoid=fields("humanBones", humanBones=each(fields("bone node", bone=TEXT, node=NODE)))
        ),
        VRMC_vrm=fields("humanoid", humanoid=fields("humanBones", humanBones=table(fields("node", node=NODE)))),
    ),
)
