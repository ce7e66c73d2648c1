"""What is recorded gives, as a graph, the numbers that numpy gives: parts, changes in place, operators, branches."""

import sys
from types import ModuleType

import numpy as np
import pytest

onnxruntime = pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")

from demo.export import onnx_recorder  # noqa: E402

SEED, TABLE = 3, np.arange(12.0).reshape(4, 3)


def write_in_part(np, x):
    y = np.zeros((3, 4))
    y[:, ::2], y[1, 1] = x[:, :2], x[0, 3]
    view = y[2]
    view[1:] += x[2, 1:]
    x[..., 0] = 7.0  # what was taken before keeps its value
    return y + x


def overlap(np, x):
    x[:-1] = x[1:]
    return x


def fancy(np, x):
    copy = x[[2, 0]]
    copy[0] = 0.0
    x[:, [1, 3]] = x[:, [3, 1]] * 2
    return np.concatenate([copy, x.swapaxes(0, 1)[:2, :2].reshape(1, 4), x.T[1:2, [0, 1, 2, 2]]])


def look_up(np, x):
    rows = np.abs(x).argmax(axis=1)
    return np.take(TABLE, rows, axis=0) + x[np.arange(3), rows][:, None]


def stack(np, x):
    a, b = np.array([x[0], 2 * x[1]])
    return np.stack([a, b, np.broadcast_to(x[0, :1], (4,))], axis=1)


def reduce(np, x):
    return x.sum(axis=0) + x.max(axis=-1, keepdims=True) - x.min() + (x > 0).any(axis=0) * 2.0 + (x > -1).all()


def choose(np, x):
    np.copyto(x, [x[1], x[0], 0 * x[2]], where=x > 0.2)
    return np.where(np.isnan(x), 1.0, np.clip(x, -0.5, 0.5))


def operators(np, x):
    angles = np.arctan2(x[0], x[1]), np.arctan2(-x[1], -x[0]), np.hypot(x[0], x[2])
    wrapped = (10 * x[0] + np.pi) % (2 * np.pi), np.copysign(x[0], x[1]), np.logaddexp(0.0, x[2])
    return np.stack([*angles, *wrapped, x[0] ** 2, np.vecdot(x, x[1])[[0, 1, 2, 0]], np.log1p(x[0] ** 2)])


def product(np, x):
    return np.array([[1.0, 2.0, 3.0]]) @ x + (x @ x.T).sum()


def branches(np, x):
    if not (x > 100).any():  # the general side, whatever the numbers
        return x * 0.0
    if (x > -100).all():
        return x * 0.0
    return x + 1


CASES = [write_in_part, overlap, fancy, look_up, stack, reduce, choose, operators, product]


@pytest.fixture
def module(monkeypatch):
    """A module of ours, whose numpy is taken while something is recorded."""
    made = ModuleType("sim.of_a_test")
    made.np = np
    monkeypatch.setitem(sys.modules, made.__name__, made)
    return made


def play(graph, x):
    model = graph.model(["y"], "a test")
    return onnxruntime.InferenceSession(model.SerializeToString()).run(None, {"x": x.astype(np.float32)})[0]


def recorded(module, case, example):
    with onnx_recorder.recording() as graph:
        graph.output("y", case(module.np, graph.input("x", example)))
    return graph


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_a_graph_says_what_numpy_says_of_other_numbers_too(module, case):
    example, other = np.random.default_rng(SEED).standard_normal((2, 3, 4))
    graph = recorded(module, case, example.copy())
    for x in (example, other):
        np.testing.assert_allclose(play(graph, x), case(np, x.copy()), atol=2e-6)


def test_a_branch_takes_its_general_side(module):
    x = np.ones((3, 4))
    np.testing.assert_array_equal(play(recorded(module, branches, x), x), x + 1)


def test_what_is_not_there_yet_is_told_without_nan(module):
    graph = recorded(module, lambda np, x: np.where(np.isnan(x), 5.0, x), np.array([1.0, np.nan]))
    np.testing.assert_array_equal(play(graph, np.array([onnx_recorder.UNSET, 2.0])), [5.0, 2.0])


def test_only_what_an_output_needs_is_in_its_model(module):
    with onnx_recorder.recording() as graph:
        x, z = graph.input("x", np.ones(2)), graph.input("z", np.ones(3))
        graph.output("y", x + 1)
        graph.output("both", (x + 1).sum() * z)
    assert graph.needed(["y"]) == {"x": (2,)} and graph.needed(["both"]) == {"x": (2,), "z": (3,)}
    assert len(graph.model(["y"], "").graph.node) < len(graph.model(["both"], "").graph.node)


def test_numpy_is_given_back_whatever_happens(module):
    with pytest.raises(TypeError, match="where numbers are wanted"):
        recorded(module, lambda np, x: float(x.__array__()), np.ones(1))
    assert module.np is np
