"""Operations of a step of one body among many, counted: by the kernels themselves, as plain Python on numbers that count.

    NUMBA_DISABLE_JIT=1 python -m conservative.benchmarks.verification.operations

A step is the difference of a longer and a shorter run, so that what a run does once is not counted. Nothing here knows how a
step is made. Series of `taylor` are made of arrays, which do not count: see `roofline.count_series`. Prints JSON.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from conservative import registry
from conservative.deferred_imports import kernels
from conservative.kernels import COMPILED
from conservative.method import Grid

from ..studies.ensembles import draw

KINDS = {
    "multiplications": ("mul", "rmul"),
    "additions": ("add", "radd", "sub", "rsub"),
    "divisions": ("truediv", "rtruediv"),
}
LOADS = ("load", "load_rows", "load_tuple")
"""Functions by which kernels get numbers out of arrays."""
BODIES = 8
CASES = (
    ("moser_veselov", "free_bodies", "moser_veselov_many", 0.1),
    ("reduced", "free_bodies", "reduced_many", 0.01),
    ("reduced", "heavy_tops", "reduced_many", 0.005),
    ("taylor:order=8", "heavy_tops", "taylor_many", 0.05),
)
"""Name of a method, kind of bodies, module of its kernel, and step, s."""
counts: Counter[str] = Counter()


class Counted(float):
    """A float that counts what is done with it."""


def _counting(name: str, kind: str) -> Callable[..., Any]:
    plain = getattr(float, f"__{name}__")

    def operate(self: float, other: Any) -> Any:
        found = plain(self, other)
        if found is NotImplemented:
            return found
        counts[kind] += 1
        return Counted(found)

    return operate


for _kind, _names in KINDS.items():
    for _name in _names:
        setattr(Counted, f"__{_name}__", _counting(_name, _kind))
Counted.__neg__ = lambda self: Counted(float.__neg__(self))  # type: ignore[method-assign]


def count_value(value: Any) -> Any:
    """Return a float, or all floats of a tuple, named or not, as ones that count."""
    if isinstance(value, tuple):
        parts = [count_value(each) for each in value]
        return value._make(parts) if hasattr(value, "_make") else tuple(parts)
    return Counted(value) if isinstance(value, float) else value


def let_count(module: Any) -> None:
    """Make all numbers that a kernel gets out of arrays count, and all square roots."""
    for name in (name for name in LOADS if hasattr(module, name)):
        setattr(module, name, _wrap(getattr(module, name)))
    root = math.sqrt

    def sqrt(x: float) -> float:
        counts["square roots"] += 1
        return Counted(root(x))

    if math.sqrt.__name__ == "sqrt" and not hasattr(math.sqrt, "__wrapped__"):
        sqrt.__wrapped__ = root  # type: ignore[attr-defined]
        math.sqrt = sqrt  # type: ignore[assignment]


def _wrap(load: Callable[..., Any]) -> Callable[..., Any]:
    return load if hasattr(load, "counts") else _marked(lambda *arguments: count_value(load(*arguments)))


def _marked(load: Any) -> Callable[..., Any]:
    load.counts = True
    return load


def count_step(name: str, kind: str, module: str, dt: float) -> dict[str, float]:
    """Return the operations of a step of a method, of one body, on average."""
    let_count(kernels(module))
    bodies, found = draw(kind, BODIES), []
    for n_steps in (20, 60):
        run = registry.method(name).prepare_many(bodies, Grid(dt, n_steps, n_steps))
        counts.clear()
        with np.errstate(all="ignore"):
            run()
        found.append(counts.copy())
    return {kind: (found[1][kind] - found[0][kind]) / (40 * BODIES) for kind in (*KINDS, "square roots")}


def main() -> None:
    """Print the operations of each of `CASES`."""
    if COMPILED:
        raise SystemExit("set NUMBA_DISABLE_JIT=1: compiled kernels do not count")
    print(json.dumps([[*case, count_step(*case)] for case in CASES]))


if __name__ == "__main__":
    main()
