"""Functions of machine code that only other machine code calls: each is compiled as a part of its callers.

`njit` makes a program of its own out of every function: optimised machine code and two wrappers with which Python calls it.
A method has 40 to 80 inner functions, so that took more than half of the time of its first run. Here an inner function is
translated to LLVM's intermediate code only. That code is linked into the callers, and the whole is optimised once.

CPU seconds of a method's first run with an empty cache, `njit` against parts: 11.2 against 4.4 (Reduced), 8.8 against 5.1
(MoserVeselov), 14.5 against 6.4 (Lame), 7.7 against 4.7 (Gauss).

In Python the functions do not change. On a version of numba that was not tried, `njit` compiles them.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache, partial
from typing import Any

from . import COMPILED, LINKED

if LINKED:
    from numba.core import compiler, types
    from numba.core.codegen import JITCodeLibrary
    from numba.core.registry import cpu_target
    from numba.extending import lower_builtin, type_callable

    class PartLibrary(JITCodeLibrary):
        """Intermediate code of a function and of the functions that it calls, for linking into other libraries."""

        ahead = False
        """True if it is optimised before it is linked as well as after."""

        def _optimize_functions(self, ll_module) -> None:
            ll_module.data_layout = self._codegen._data_layout  # LLVM links modules of the same layout only

        def finalize(self) -> None:
            """Link the parts that this one calls; the rest is left to the caller's library."""
            # Each once: every call of a part has added its library.
            for library in dict.fromkeys(self._linking_libraries):
                self._reload_init.update(library._reload_init)
                self._final_module.link_in(library._get_module_for_linking(), preserve=True)
            if self.ahead:
                self._optimize_final_module()
            self._finalized = True

    def as_part(function: Callable[..., Any], *, ahead: bool = False, **options: Any) -> Callable[..., Any]:
        """Return the function itself, after making it known to numba as a part, compiled with `options` of `njit`.

        With `ahead` it is optimised once by itself and again with its callers. That takes time, and can make a loop faster.
        """

        @cache
        def find_part(*kinds):
            flags, context = compiler.Flags(), cpu_target.target_context
            cpu_target.options.parse_as_flags(flags, {"nopython": True, **options})
            flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
            library = PartLibrary(context.codegen(), function.__qualname__)
            library.ahead = ahead
            return compiler.compile_extra(cpu_target.typing_context, context, function, kinds, None, flags, {}, library)

        @type_callable(function)
        def find_type(_):
            def signature_of(*kinds):
                return find_part(*kinds).signature

            signature_of.pysig = inspect.signature(function)
            return signature_of

        @lower_builtin(function, types.VarArg(types.Any))
        def call(context, builder, signature, arguments):
            part = find_part(*signature.args)
            context.active_code_library.add_linking_library(part.library)
            return context.call_internal(builder, part.fndesc, signature, arguments)

        return function

else:
    from numba.extending import register_jitable

    def as_part(function: Callable[..., Any], *, ahead: bool = False, **options: Any) -> Callable[..., Any]:
        """Return the function itself, after making it known to numba as one that `njit` compiles with `options`."""
        return register_jitable(**options)(function)


def kernel(function: Any, **options: Any) -> Any:
    """Compile a function that only kernels call.

    IEEE arithmetic as written: no fastmath, as compensated sums must survive.
    """
    return as_part(function, error_model="numpy", **options) if COMPILED else function


SMALL: Any = {"forceinline": True, "fastmath": {"contract"}}
"""Options of small functions in inner loops: no calls, and a product that is added at once is rounded once (FMA)."""

small: Any = partial(kernel, **SMALL)
"""Compile a small function in an inner loop. Contraction is safe in compensated sums: they have no product to contract with."""
