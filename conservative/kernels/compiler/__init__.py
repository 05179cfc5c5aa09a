"""One source for one body and for several, compiled by `njit`.

`traced` runs a function without branches once with symbols, and emits LLVM instructions for one float or for one float per body
(`lanes`). `vector` has the arithmetic of `conservative.arithmetic` in this form, `series` the recurrences of Taylor series, and
`signals` is Ctrl-C during a kernel. The same Taylor step (order 12, heavy body), written as array loops for `njit`, takes
2.6 times as long, and 5 times as long as in lanes.

Numba and llvmlite do not document the parts of their interface in this list, and have no other way to do the same. If one
changes, importing or compiling a kernel raises:

* `traced`, `lanes`: `cpu_target.target_context` with `get_value_type`, `make_tuple`, `make_array`, `codegen().magic_tuple()`;
  `numba.core.cgutils`; `types.BaseTuple.from_types`, `types.BaseNamedTuple.instance_class`.
* `signals`, `kernels.function_field`: `context.get_python_api` with `gil_ensure`, `gil_release`, `pyobj` and `decref`;
  `context.call_conv.return_exc`; `context.insert_const_string`.
* `kernels`: `Dispatcher.stats.cache_path`, `Dispatcher._cache.save_overload`, `global_compiler_lock`, and that an index of
  cached code is a file `*.nbi`.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from numba import config
from numba.extending import register_jitable

COMPILED = not config.DISABLE_JIT  # type: ignore[attr-defined]  # made from the environment
"""True if kernels are machine code, False if they are plain Python."""


def kernel(function: Any, **options: Any) -> Any:
    """Compile a function that only kernels call, with `options` of `njit`. Without compilation it is returned unchanged.

    IEEE arithmetic as written: no fastmath, as compensated sums must survive.
    """
    return register_jitable(error_model="numpy", **options)(function) if COMPILED else function


SMALL: Any = {"forceinline": True, "fastmath": {"contract"}}
"""Options of small functions in inner loops: no calls, and a product that is added at once is rounded once (FMA)."""

small: Any = partial(kernel, **SMALL)
"""Compile a small function in an inner loop. Contraction is safe in compensated sums: they have no product to contract with."""
