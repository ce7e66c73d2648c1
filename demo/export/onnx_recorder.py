"""Records what numpy code computes as an ONNX graph, so that what is exported is the very code that runs.

`Recorded` stands in for an array. What numpy is asked to do with it is done with an example's numbers, which say
shapes, and written down as a node. Arrays are changed in place and seen in part, ONNX values are not: so an array is a
`_Store` of values (pieces) and, for each of its numbers, the place in them where it comes from; only when an operation
reads it are the pieces put together. A branch that hangs on numbers takes its general side: `any` is taken for true,
all else for false."""

import sys
from contextlib import contextmanager
from typing import Any, Callable, Iterator, Sequence

import numpy as np

from demo.export import onnx_nodes, onnx_operators
from demo.export.onnx_nodes import KINDS, Nodes
from demo.export.onnx_operators import COMPOSED, OF_INTEGERS, OPERATORS, UNSET

ROOMS = ("sim", "controller", "stylizer", "demo")
OWN_MODULES = (__name__, onnx_nodes.__name__, onnx_operators.__name__)  # which keep numpy as it is


class Graph(Nodes):
    """A graph that arrays are recorded in."""

    def input(self, name: str, example: "np.ndarray | float | Recorded") -> "Recorded":
        """An input of numbers; NaN in the example is UNSET."""
        numbers = example.value if isinstance(example, Recorded) else np.asarray(example, float)
        value = np.nan_to_num(numbers, nan=UNSET)
        self.inputs[name] = value.astype(self.kinds["f"])
        return _whole(self, name, value)

    def output(self, name: str, values: "Recorded | np.ndarray") -> None:
        """Names a result, as numbers."""
        array = _recorded(self, values)
        self.shapes[name] = array.shape
        self.outputs[name] = array.read("f")


class _Store:
    """The numbers of an array: `places` (n,) says of each where in the pieces, one after the other, it comes from."""

    def __init__(
        self, graph: Graph, kind: str, pieces: list[tuple[str, int]], places: np.ndarray, data: np.ndarray
    ) -> None:
        self.graph, self.kind, self.pieces, self.places, self.data = graph, kind, pieces, places, data


class Recorded(np.lib.mixins.NDArrayOperatorsMixin):
    """A numpy array whose numbers a graph computes."""

    def __init__(self, store: _Store, cells: np.ndarray, general: bool = False) -> None:
        """cells: which of the store's numbers this is, in its shape; general: what `bool` says of it."""
        self.store, self.cells, self.general = store, cells, general

    shape = property(lambda self: self.cells.shape)
    ndim = property(lambda self: self.cells.ndim)
    size = property(lambda self: self.cells.size)
    T = property(lambda self: self._seen(self.cells.T))
    kind = property(lambda self: self.store.kind)

    @property
    def value(self) -> np.ndarray:
        """The example's numbers."""
        return self.store.data[self.cells]

    def read(self, kind: str | None = None) -> str:
        """The name of the graph's value that this is now, as numbers of a kind."""
        graph, store = self.store.graph, self.store
        places, sizes = store.places[self.cells].ravel(), np.array([size for _, size in store.pieces])
        starts = np.cumsum(sizes) - sizes
        piece = np.searchsorted(starts, places, side="right") - 1
        used = np.unique(piece)
        new_starts = np.cumsum(sizes[used]) - sizes[used]
        places = places - starts[piece] + new_starts[np.searchsorted(used, piece)]
        names = [store.pieces[one][0] for one in used]
        name = names[0]
        if len(names) > 1:
            name = graph.node("Concat", [graph.reshape(each, (-1,)) for each in names], axis=0)
        if np.array_equal(places, np.arange(sizes[used].sum())):
            name = graph.reshape(name, self.shape)
        else:
            name = graph.node(
                "Gather", [graph.reshape(name, (-1,)), graph.constant(places.reshape(self.shape))], axis=0
            )
        return graph.cast(name, store.kind, kind or store.kind)

    # ---- parts and shapes: nothing is computed ----

    def _seen(self, cells: np.ndarray) -> "Recorded":
        return Recorded(self.store, cells)

    def copy(self) -> "Recorded":
        """The same numbers, which no longer change with these."""
        places = self.store.places[self.cells].ravel()
        store = _Store(self.store.graph, self.kind, list(self.store.pieces), places, self.value.ravel())
        return Recorded(store, np.arange(self.size).reshape(self.shape))

    def __getitem__(self, where: Any) -> "Recorded":
        each = where if isinstance(where, tuple) else (where,)
        if any(isinstance(one, Recorded) for one in each):
            return self._looked_up(each)
        cells = self.cells[where]
        seen = self._seen(np.asarray(cells))
        return seen if isinstance(cells, np.ndarray) and np.shares_memory(cells, self.cells) else seen.copy()

    def _looked_up(self, where: tuple) -> "Recorded":
        """Entries whose places, one index for each leading axis, are computed."""
        graph = self.store.graph
        flat: Any = np.zeros((), int)
        for one, length in zip(where, self.shape):
            flat = flat * length + one
        rows = self.reshape(-1, *self.shape[len(where) :])
        name = graph.node("Gather", [rows.read(), flat.read("i")], axis=0)
        return _whole(graph, name, rows.value[flat.value.astype(int)], self.kind)

    def __setitem__(self, where: Any, values: Any) -> None:
        store, cells = self.store, self.cells[where]
        given = _recorded(store.graph, values)
        if given.kind != store.kind:
            given = given.astype(store.kind)
        taken = np.broadcast_to(given.cells, cells.shape)
        end = sum(size for _, size in store.pieces)
        store.pieces = [*store.pieces, *given.store.pieces]
        store.places[cells] = end + given.store.places[taken]
        store.data[cells] = given.store.data[taken]

    def __len__(self) -> int:
        return self.shape[0]

    def __iter__(self) -> "Iterator[Recorded]":
        return (self[one] for one in range(len(self)))

    def reshape(self, *shape: Any) -> "Recorded":
        return self._seen(self.cells.reshape(*shape))

    def ravel(self) -> "Recorded":
        return self.reshape(-1)

    def swapaxes(self, one: int, other: int) -> "Recorded":
        return self._seen(self.cells.swapaxes(one, other))

    def diagonal(self, axis1: int, axis2: int) -> "Recorded":
        return self._seen(self.cells.diagonal(axis1=axis1, axis2=axis2))

    def take(self, indices: np.ndarray, axis: int) -> "Recorded":
        return self._seen(self.cells.take(indices, axis)).copy()

    def astype(self, kind: Any) -> "Recorded":
        kind = kind if kind in KINDS else np.dtype(kind).kind
        if kind == self.kind:
            return self.copy()
        return _whole(self.store.graph, self.read(kind), self.value.astype(KINDS[kind]), kind)

    # ---- numbers ----

    def __bool__(self) -> bool:
        return self.general

    def __array__(self, *_: Any, **__: Any) -> np.ndarray:
        raise TypeError("an array that is recorded went where numbers are wanted")

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, out: Any = None, **options: Any) -> Any:
        if method != "__call__":
            raise NotImplementedError(f"{ufunc.__name__}.{method}")
        result = _apply(self.store.graph, ufunc, inputs, options)
        if out is not None:
            out[0][...] = result
            return out[0]
        return result

    def __array_function__(self, function: Callable, _: Any, args: Sequence, options: dict) -> Any:
        return _FUNCTIONS[function.__name__](self.store.graph, *args, **options)

    def _reduced(self, operator: str, name: str, axis: Any, keepdims: bool, kind: str) -> "Recorded":
        axes = [int(one) % self.ndim for one in (range(self.ndim) if axis is None else np.atleast_1d(axis))]
        value = getattr(self.value, name)(axis=tuple(axes), keepdims=keepdims)
        if not axes:
            return self
        graph, operand = self.store.graph, self.read("f")
        if operator == "ReduceSum":
            made = graph.node(operator, [operand, graph.constant(np.array(axes))], keepdims=int(keepdims))
        else:
            made = graph.node(operator, [operand], axes=axes, keepdims=int(keepdims))
        return _whole(graph, graph.cast(made, "f", kind), np.asarray(value), kind)

    def sum(self, axis: Any = None, keepdims: bool = False) -> "Recorded":
        return self._reduced("ReduceSum", "sum", axis, keepdims, "f")

    def max(self, axis: Any = None, keepdims: bool = False) -> "Recorded":
        return self._reduced("ReduceMax", "max", axis, keepdims, "f")

    def min(self, axis: Any = None, keepdims: bool = False) -> "Recorded":
        return self._reduced("ReduceMin", "min", axis, keepdims, "f")

    def any(self, axis: Any = None, keepdims: bool = False) -> "Recorded":
        return self._truth().max(axis, keepdims)._as_truth(True)

    def all(self, axis: Any = None, keepdims: bool = False) -> "Recorded":
        return self._truth().min(axis, keepdims)._as_truth(False)

    def _truth(self) -> "Recorded":
        return (self if self.kind == "b" else ~(self == 0)).astype("f")

    def _as_truth(self, general: bool) -> "Recorded":
        result = self.astype("b")
        result.general = general
        return result

    def argmax(self, axis: int) -> "Recorded":
        made = self.store.graph.node("ArgMax", [self.read()], axis=axis, keepdims=0)
        return _whole(self.store.graph, made, self.value.argmax(axis), "i")


def _whole(graph: Graph, name: str, value: np.ndarray, kind: str = "f") -> Recorded:
    """The array that a value of the graph is."""
    places = np.arange(value.size)
    store = _Store(graph, kind, [(name, value.size)], places.copy(), np.array(value).ravel())
    return Recorded(store, places.reshape(value.shape))


def _recorded(graph: Graph, values: Any) -> Recorded:
    """Whatever is given, numbers, arrays and lists of recorded ones among them, as recorded."""
    if isinstance(values, Recorded):
        return values
    if isinstance(values, list | tuple) and any(map(_holds_recorded, values)):
        parts = [_recorded(graph, each) for each in values]
        kind = max((part.kind for part in parts), key="bif".index)
        result = _filled(graph, (len(parts), *np.broadcast_shapes(*(part.shape for part in parts))), 0, kind)
        for place, part in enumerate(parts):
            result[place] = part
        return result
    value = np.asarray(values)
    kind = "i" if value.dtype.kind == "u" else value.dtype.kind
    return _whole(graph, graph.constant(value.astype(graph.kinds[kind])), value, kind)


def _holds_recorded(value: Any) -> bool:
    return isinstance(value, Recorded) or isinstance(value, list | tuple) and any(map(_holds_recorded, value))


def _filled(graph: Graph, shape: Any, value: Any, kind: str) -> Recorded:
    return _recorded(graph, np.full(shape, value, KINDS[kind]))


def _apply(graph: Graph, ufunc: np.ufunc, inputs: Sequence[Any], options: dict) -> Any:
    name = ufunc.__name__
    if name in COMPOSED:
        return COMPOSED[name](*inputs, **options)
    if name == "arctan" and graph.kinds["f"] == np.float64:
        return _arctan_in_double(graph, *inputs)
    operator, kind = OPERATORS[name]
    arrays = [_recorded(graph, each) for each in inputs]
    if name in OF_INTEGERS and all(array.kind == "i" for array in arrays):
        kind = "i"
    value = ufunc(*(array.value.astype(KINDS[kind]) if kind == "b" else array.value for array in arrays))
    made = graph.node(operator, [array.read(kind) for array in arrays])
    result = "b" if value.dtype.kind == "b" else kind
    return _whole(graph, made, np.asarray(value), result)


def _arctan_in_double(graph: Graph, x: Recorded) -> Any:
    """onnxruntime has none: the one of float32, and a step of Newton's method."""
    known = graph.node("Atan", [graph.node("Cast", [x.read("f")], to=1)])
    angle = _whole(graph, graph.node("Cast", [known], to=11), np.arctan(x.value))
    sine, cosine = np.sin(angle), np.cos(angle)
    return angle + (x * cosine - sine) / (cosine + x * sine)


def _where(graph: Graph, condition: Any, one: Any, other: Any) -> Recorded:
    condition, one, other = (_recorded(graph, each) for each in (condition, one, other))
    kind = max(one.kind, other.kind, key="bif".index)
    made = graph.node("Where", [condition.read("b"), one.read(kind), other.read(kind)])
    return _whole(graph, made, np.where(condition.value, one.value, other.value), kind)


def _concatenate(graph: Graph, arrays: Sequence[Any], axis: int = 0) -> Recorded:
    parts = [_recorded(graph, each) for each in arrays]
    lengths = [part.shape[axis] for part in parts]
    shape = list(parts[0].shape)
    shape[axis] = sum(lengths)
    result = _filled(graph, shape, 0, max((part.kind for part in parts), key="bif".index))
    rows = np.moveaxis(np.arange(result.size).reshape(result.shape), axis, 0)
    for part, end in zip(parts, np.cumsum(lengths)):
        where = np.moveaxis(rows[end - part.shape[axis] : end], 0, axis)
        result.reshape(-1)[where] = part
    return result


def _stack(graph: Graph, arrays: Sequence[Any], axis: int = 0) -> Recorded:
    together = _recorded(graph, list(arrays))
    return together._seen(np.moveaxis(together.cells, 0, axis))


def _take(graph: Graph, table: Any, indices: Any, axis: int = 0) -> Recorded:
    """Entries of a table, whose places are computed."""
    if not isinstance(indices, Recorded):
        return table.take(indices, axis)
    rows = _recorded(graph, table)
    name = graph.node("Gather", [rows.read(), indices.read("i")], axis=axis)
    return _whole(graph, name, rows.value.take(indices.value.astype(int), axis), rows.kind)


def _copyto(graph: Graph, to: Recorded, values: Any, where: Any = True) -> None:
    to[...] = _where(graph, where, _recorded(graph, values), to)


_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "where": _where,
    "concatenate": _concatenate,
    "stack": _stack,
    "copyto": _copyto,
    "ndim": lambda _, x: x.ndim,
    "shape": lambda _, x: x.shape,
    "any": lambda _, x, axis=None: x.any(axis),
    "clip": lambda _, x, low, high: np.minimum(np.maximum(x, low), high),
    "reshape": lambda _, x, shape: x.reshape(shape),
    "zeros_like": lambda graph, x: _filled(graph, x.shape, 0, x.kind),
    "broadcast_to": lambda _, x, shape: x._seen(np.broadcast_to(x.cells, shape)),
}


class _Numpy:
    """numpy, but that the arrays which it makes are recorded."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)

    def zeros(self, shape: Any, dtype: Any = float) -> Recorded:
        return _filled(self._graph, shape, 0, np.dtype(dtype).kind)

    empty = zeros

    def ones(self, shape: Any, dtype: Any = float) -> Recorded:
        return _filled(self._graph, shape, 1, np.dtype(dtype).kind)

    def array(self, values: Any, *options: Any, **named: Any) -> Any:
        if isinstance(values, Recorded):
            return values.copy()
        return _recorded(self._graph, values) if _holds_recorded(values) else np.array(values, *options, **named)

    def take(self, table: Any, indices: Any, axis: int = 0) -> Any:
        return _take(self._graph, table, indices, axis)  # numpy does not look at what the indices are

    def asarray(self, values: Any, *options: Any, **named: Any) -> Any:
        return values if isinstance(values, Recorded) else self.array(values, *options, **named)


@contextmanager
def recording(double: bool = False) -> Iterator[Graph]:
    """A graph that the modules of ROOMS write into while the block runs, with the arrays that it gives as inputs;
    double: of float64."""
    graph = Graph(double)
    modules = [
        module
        for name, module in sys.modules.items()
        if name.split(".")[0] in ROOMS and name not in OWN_MODULES and getattr(module, "np", None) is np
    ]
    for module in modules:
        module.np = _Numpy(graph)  # type: ignore[attr-defined]
    try:
        with np.errstate(all="ignore"):  # examples need not make sense
            yield graph
    finally:
        for module in modules:
            module.np = np  # type: ignore[attr-defined]
