"""What is wrong with a glTF document is said with its place, and never in Python's words."""

import json

import pytest

from sim.io import gltf
from sim.io.gltf_schema import check_document

WHOLE = {
    "asset": {"version": "2.0"},
    "buffers": [{"byteLength": 16}],
    "bufferViews": [{"buffer": 0, "byteLength": 16}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "SCALAR"}],
    "nodes": [{"name": "Hips", "children": [1]}, {"name": "Spine", "translation": [0, 1, 0]}],
    "animations": [
        {
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
            "samplers": [{"input": 0, "output": 0}],
        }
    ],
    "extras": {"anything": ["goes", {"here": -1}]},
}


def changed(*path, to):
    document = json.loads(json.dumps(WHOLE))
    holder = document
    for step in path[:-1]:
        holder = holder[step]
    holder[path[-1]] = to
    return document


def test_a_whole_document_passes():
    check_document(WHOLE)


@pytest.mark.parametrize(
    "document, sentence",
    [
        ([], "holds no glTF document"),
        (changed("asset", "version", to="1.0"), "it is glTF 1.0"),
        (changed("nodes", to={}), "nodes is {}, but must be a list"),
        (changed("nodes", 0, "children", 0, to=7), r"nodes\[0\].children\[0\] is 7, but there are 2 nodes"),
        (changed("nodes", 1, "translation", to=[0, 1]), r"nodes\[1\].translation is .* must be 3 numbers"),
        (changed("nodes", 1, "translation", to=[0, 10**400, 0]), "must be 3 numbers"),
        (changed("accessors", 0, to={}), r"accessors\[0\] has no 'componentType'"),
        (changed("accessors", 0, "count", to=True), "must be a whole number"),
        (changed("accessors", 0, "type", to=["VEC3"]), "must be one of SCALAR"),
        (changed("animations", 0, "channels", 0, "sampler", to=1), "there are 1 samplers"),
        (changed("extras", "anything", 1, "here", to=float("nan")), r"extras.anything\[1\].here is nan"),
        (changed("materials", to=[{"pbrMetallicRoughness": {"baseColorFactor": 1}}]), "baseColorFactor is 1"),
    ],
)
def test_a_mistake_is_named_with_its_place(document, sentence):
    with pytest.raises(ValueError, match=sentence):
        check_document(document)


@pytest.mark.parametrize(
    "text, sentence",
    [
        ('{"nodes": [', "line 1, column 12"),
        ('{"nodes": [' + "[" * 5000 + "]" * 5000 + "]}", "nested too deep|must be an object"),
        ('{"asset": ' + "1" * 5000 + "}", "numbers without an end"),
        ("[" + "0," * 2_000_001 + "0]", "over 2000000 entries"),
        (b'{"name": "\xff"}', "byte 10 of its document is no UTF-8"),
        (b"glTF\x01\0\0\0\x14\0\0\0", "without a glTF 2.0 document"),
        (json.dumps(changed("accessors", 0, "count", to=5)), "reaches beyond its buffer|does not lie beside it"),
    ],
)
def test_a_file_that_breaks_off_is_refused_by_name(tmp_path, text, sentence):
    path = tmp_path / "walk.gltf"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ValueError, match=sentence) as error:
        gltf.read(path)
    assert str(error.value).startswith(str(path))
