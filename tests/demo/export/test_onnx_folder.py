"""The exported folder: its player follows Session, its table names every tensor, it says what it was made from."""

import ast
import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

onnxruntime = pytest.importorskip("onnxruntime")
onnx = pytest.importorskip("onnx")

from controller.model import checkpoint  # noqa: E402
from demo import assemble  # noqa: E402
from demo.export import onnx_folder, onnx_player  # noqa: E402
from sim.ground.catalogue import load_ground  # noqa: E402
from sim.io import recording  # noqa: E402
from sim.session import Session  # noqa: E402

CLOSE = 1e-4  # metres, of every joint in every frame
START = '{"format": "patchwalk-recording", "version": 1, "fps": 60, "ground": "%s", "pace": true}\n'
WALK = """{"frame": 0, "move": [0.0, 1.0], "style": {"legs": ["marching", 1], "spine": ["leaning", 1, "hunched", 0.3]}}
{"frame": 20, "jump": true, "style": {"arms": ["zombie", 1.2]}}
{"frame": 40, "move": [0.6, 0.6], "gait": "run", "style": {"legs": null}}
{"frame": 60, "gait": "crouch", "face": [1.0, 0.0]}
{"frame": 80, "end": true}
"""


@pytest.fixture(scope="module")
def session() -> Session:
    return assemble.build_session()


@pytest.fixture(scope="module")
def folder(session, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("onnx")
    onnx_folder.write_folder(path, session, load_ground("stairs"))
    return path


@pytest.fixture(scope="module")
def about(folder) -> dict:
    return json.loads((folder / "graphs.json").read_text())


@pytest.mark.parametrize("ground", ["flat", "stairs"])
def test_the_player_follows_the_session(session, folder, about, tmp_path, ground):
    path = tmp_path / "walk.jsonl"
    path.write_text(START % ground + WALK)
    session.stand_on(load_ground(ground))
    player = onnx_player.Player(folder, None if ground == "flat" else onnx_player.HeightMap(folder / "ground.npz"))
    commands = onnx_player.commands(path, about["groups"])
    for command, asked in zip(recording.read(path), commands, strict=True):
        frame, played = session.step(command), player.step(**asked)
        np.testing.assert_allclose(played["positions"], frame.styled.positions, atol=CLOSE)
        np.testing.assert_allclose(played["neutral_positions"], frame.neutral.positions, atol=CLOSE)
        np.testing.assert_allclose(played["contacts"], frame.styled.contacts, atol=1e-3)
    session.stand_on(None)


def test_every_tensor_of_every_file_is_in_the_table(folder, about):
    assert {graph["file"] for graph in about["graphs"].values()} == {path.name for path in folder.glob("*.onnx")}
    for graph in about["graphs"].values():
        model = onnx.load(folder / graph["file"]).graph
        for told, found in ((graph["inputs"], model.input), (graph["outputs"], model.output)):
            shapes = {each.name: [d.dim_value for d in each.type.tensor_type.shape.dim] for each in found}
            assert {each["name"]: each["shape"] for each in told} == shapes
            assert all(each["what"] for each in told)
        start = np.fromfile(folder / graph["state"], "<f4")
        assert len(start) == sum(int(np.prod(each["shape"])) for each in graph["state_layout"])
        assert np.isfinite(start).all()


def test_it_says_which_weights_it_was_made_from(session, about):
    made_from = about["made_from"]
    assert made_from["controller"] == checkpoint.fingerprint()
    assert made_from["stylizer"] == session.stylizer.bank.fingerprint
    licences = {style["name"]: style["licence"] for style in about["styles"]}
    assert set(licences) == set(session.stylizer.styles) and all(licences.values())


def test_the_player_is_short_and_needs_numpy_and_onnxruntime_alone(folder):
    text = (folder / "player.py").read_text()
    assert len(text.splitlines()) < 200
    names = {
        (node.module if isinstance(node, ast.ImportFrom) else node.names[0].name).split(".")[0]
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Import | ast.ImportFrom)
    }
    assert names - set(sys.stdlib_module_names) == {"numpy", "onnxruntime"}


def test_another_stylizer_is_refused_in_a_sentence(session, tmp_path):
    other = SimpleNamespace(controller=session.controller, stylizer=SimpleNamespace(name="slim"))
    with pytest.raises(ValueError, match="only the stylizer 'joints' is exported, and 'slim' is another one"):
        onnx_folder.write_folder(tmp_path, other, load_ground("stairs"))
