"""What a machine can do: how fast it multiplies matrices of the shapes that a program asks for, and reads memory."""

import time
from typing import Any, Callable, Sequence

import numpy as np
import torch
from torch.utils._python_dispatch import TorchDispatchMode

LARGE = (512, 512, 512)  # rows, inner size, columns of a product that shows the processor at its best
SHAPES = 3  # of the program's own products, the dearest, that are timed
READ_MB = 128  # more than a processor's caches hold
SLICE_S = 0.004  # seconds that a product is repeated for at a time


class Products(TorchDispatchMode):
    """Notes the matrix products that torch carries out under it: (batch, rows, inner size, columns) each."""

    def __init__(self) -> None:
        super().__init__()
        self.seen: list[tuple[int, int, int, int]] = []

    def __torch_dispatch__(
        self, function: Any, types: Any, args: tuple[Any, ...] = (), kwargs: dict[str, Any] | None = None
    ) -> Any:
        name = function.overloadpacket.__name__
        if name in ("mm", "bmm", "addmm", "baddbmm"):
            a, b = args[-2:]
            self.seen.append((a.shape[0] if a.dim() == 3 else 1, *a.shape[-2:], b.shape[-1]))
        else:
            with self:
                parts = function.decompose(*args, **kwargs or {})
            if parts is not NotImplemented:
                return parts
        return function(*args, **kwargs or {})


def products_of(action: Callable[[], object]) -> list[tuple[int, int, int, int]]:
    """The matrix products that torch carries out in an action."""
    with Products() as products:
        action()
    return products.seen


class Probe:
    """Measures the machine in short turns; what it reports are medians, as noisy as what is measured beside it."""

    def __init__(self, shapes: Sequence[tuple[int, int, int]]) -> None:
        dearest = sorted(set(shapes), key=lambda shape: -np.prod(shape) * shapes.count(shape))[:SHAPES]
        self.speeds: dict[tuple[int, int, int], list[float]] = {shape: [] for shape in (*dearest, LARGE)}
        self._pairs = {(m, k, n): (torch.randn(m, k), torch.randn(k, n)) for m, k, n in self.speeds}
        self._own = {shape: shapes.count(shape) * int(np.prod(shape)) for shape in dearest}
        self._memory = np.ones(READ_MB * 250_000, np.float32)
        self._reads: list[float] = []

    def take(self) -> None:
        """One turn of each."""
        for shape, (a, b) in self._pairs.items():
            count, start = 0, time.perf_counter()
            while time.perf_counter() < start + SLICE_S:
                torch.mm(a, b)
                count += 1
            self.speeds[shape].append(2e-9 * count * np.prod(shape) / (time.perf_counter() - start))
        start = time.perf_counter()
        self._memory.max()  # which the processor finds as fast as it can read
        self._reads.append(1e-9 * self._memory.nbytes / (time.perf_counter() - start))

    def typical_gflops(self) -> float:
        """Speed on the program's own products: their arithmetic over the time it takes at each shape's speed."""
        if not self._own:
            return float(np.median(self.speeds[LARGE]))
        return sum(self._own.values()) / sum(work / np.median(self.speeds[shape]) for shape, work in self._own.items())

    def read_gb_s(self) -> float:
        """Speed of reading memory, gigabytes a second."""
        return float(np.median(self._reads))

    def report(self) -> dict:
        """For the JSON: GFLOP/s by shape, and GB/s."""
        speeds = {
            "x".join(map(str, shape)): round(float(np.median(values)), 1) for shape, values in self.speeds.items()
        }
        return {"sgemm_gflops": speeds, "read_gb_s": round(self.read_gb_s(), 2)}
