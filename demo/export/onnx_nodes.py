"""An ONNX graph while it is made: its nodes, constants, inputs and outputs, and the model that any part of it is."""

from typing import Any, Sequence

import numpy as np

OPSET, IR_VERSION = 15, 8  # what the engines' own runtimes read
KINDS: dict[str, np.dtype] = {"f": np.dtype(np.float32), "i": np.dtype(np.int64), "b": np.dtype(bool)}


class Nodes:
    """An ONNX graph that grows node by node."""

    def __init__(self, double: bool = False) -> None:
        """double: numbers of float64 in place of float32."""
        self.kinds = KINDS | ({"f": np.dtype(np.float64)} if double else {})
        self.nodes: list[Any] = []
        self.inputs: dict[str, np.ndarray] = {}  # name -> example
        self.outputs: dict[str, str] = {}  # name -> the value that it is
        self.shapes: dict[str, tuple[int, ...]] = {}  # of outputs
        self.constants: dict[tuple, tuple[str, np.ndarray]] = {}
        self._known: dict[tuple, str] = {}  # nodes that give what is asked for once more

    def constant(self, value: np.ndarray) -> str:
        """The name of a value that is always the same."""
        key = (value.shape, value.dtype.str, value.tobytes())
        return self.constants.setdefault(key, (f"c{len(self.constants)}", value))[0]

    def node(self, operator: str, inputs: Sequence[str], **attributes: Any) -> str:
        """The name of what an operator makes of values."""
        from onnx import helper

        key = operator, *inputs, *sorted((name, str(value)) for name, value in attributes.items())
        if key not in self._known:
            self._known[key] = f"v{len(self.nodes)}"
            self.nodes.append(helper.make_node(operator, list(inputs), [self._known[key]], **attributes))
        return self._known[key]

    def needed(self, outputs: Sequence[str]) -> dict[str, tuple[int, ...]]:
        """The shapes of the inputs that these outputs hang on."""
        reached, _ = self._reached(outputs)
        return {name: example.shape for name, example in self.inputs.items() if name in reached}

    def _reached(self, outputs: Sequence[str]) -> tuple[set[str], list[Any]]:
        """The names of all values, and the nodes, that make these outputs."""
        names, nodes = {self.outputs[name] for name in outputs}, []
        for node in reversed(self.nodes):
            if node.output[0] in names:
                nodes.append(node)
                names.update(node.input)
        return names, nodes[::-1]

    def model(self, outputs: Sequence[str], description: str) -> Any:
        """The part of the graph that makes these outputs, as an onnx.ModelProto."""
        import onnx
        from onnx import helper, numpy_helper

        needed, kept = self._reached(outputs)
        number = helper.np_dtype_to_tensor_dtype(self.kinds["f"])
        kept = kept + [helper.make_node("Identity", [self.outputs[name]], [name]) for name in outputs]
        graph = helper.make_graph(
            kept,
            "patchwalk",
            [helper.make_tensor_value_info(name, number, shape) for name, shape in self.needed(outputs).items()],
            [helper.make_tensor_value_info(name, number, self.shapes[name]) for name in outputs],
            [numpy_helper.from_array(value, name) for name, value in self.constants.values() if name in needed],
            doc_string=description,
        )
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="patchwalk")
        model.ir_version = IR_VERSION
        onnx.checker.check_model(model)
        return model

    def reshape(self, name: str, shape: tuple[int, ...]) -> str:
        """A value in another shape."""
        return self.node("Reshape", [name, self.constant(np.array(shape, np.int64))])

    def cast(self, name: str, kind: str, wanted: str) -> str:
        """A value of one of KINDS as another."""
        from onnx import helper

        return (
            name
            if kind == wanted
            else self.node("Cast", [name], to=helper.np_dtype_to_tensor_dtype(self.kinds[wanted]))
        )
