"""What numpy's functions are called in ONNX, and those that ONNX has no operator for, made of others."""

import math
from typing import Any, Callable

import numpy as np

UNSET = 1e9  # stands for NaN, which some GPUs do not tell from a number; nothing that is computed comes near to it

# numpy's name -> ONNX operator, and the kind of numbers that it takes.
OPERATORS: dict[str, tuple[str, str]] = {
    **{
        name: (operator, "f")
        for name, operator in {
            "divide": "Div",
            "sqrt": "Sqrt",
            "exp": "Exp",
            "log": "Log",
            "sin": "Sin",
            "cos": "Cos",
            "arctan": "Atan",
            "floor": "Floor",
            "matmul": "MatMul",
            "maximum": "Max",
            "minimum": "Min",
            "less": "Less",
            "less_equal": "LessOrEqual",
            "greater": "Greater",
            "greater_equal": "GreaterOrEqual",
            "equal": "Equal",
            "add": "Add",
            "subtract": "Sub",
            "multiply": "Mul",
            "absolute": "Abs",
            "negative": "Neg",
        }.items()
    },
    **{name: (operator, "b") for name, operator in {"bitwise_and": "And", "bitwise_or": "Or", "invert": "Not"}.items()},
}
OF_INTEGERS = {"add", "subtract", "multiply"}


def _arctan2(y: Any, x: Any) -> Any:
    small, large = np.minimum(np.abs(y), np.abs(x)), np.maximum(np.abs(y), np.abs(x))
    angle = np.arctan(small / np.maximum(large, 1e-30))
    angle = np.where(np.abs(y) > np.abs(x), math.pi / 2 - angle, angle)
    angle = np.where(x < 0, math.pi - angle, angle)
    return np.where(y < 0, -angle, angle)


def _arccos(x: Any) -> Any:
    return np.arctan2(np.sqrt(np.maximum((1 - x) * (1 + x), 0.0)), x)


def _power(x: Any, exponent: float) -> Any:
    if exponent not in (2, 3):
        raise NotImplementedError(f"the power {exponent}")
    return x * x if exponent == 2 else x * x * x


# What ONNX has no operator for.
COMPOSED: dict[str, Callable[..., Any]] = {
    "square": lambda x: x * x,
    "power": _power,
    "hypot": lambda a, b: np.sqrt(a * a + b * b),
    "arccos": _arccos,
    "arctan2": _arctan2,
    "remainder": lambda a, b: a - b * np.floor(a / b),
    "copysign": lambda a, b: np.where(b < 0, -np.abs(a), np.abs(a)),
    "logaddexp": lambda a, b: np.maximum(a, b) + np.log(1 + np.exp(-np.abs(a - b))),
    "log1p": lambda x: np.log(1 + x),
    "expm1": lambda x: np.exp(x) - 1,
    "vecdot": lambda a, b, axis=-1: (a * b).sum(axis=axis),
    "not_equal": lambda a, b: ~(a == b),
    "isnan": lambda x: x > UNSET / 2,
}
