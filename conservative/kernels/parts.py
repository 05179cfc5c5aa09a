"""Functions of machine code that only other machine code calls: each is compiled as a part of its callers.

`njit` makes a program of its own out of every function: optimised machine code and two wrappers with which Python calls it.
A method has 40 to 80 inner functions, so that took more than half of the time of its first run. Here an inner function is
translated to LLVM's intermediate code only. That code is linked into the callers, and the whole is optimised once.

CPU seconds of a method's first run with an empty cache, `njit` against parts: 11.2 against 4.4 (Reduced), 8.8 against 5.1
(MoserVeselov), 14.5 against 6.4 (Lame), 7.7 against 4.7 (Gauss).

In Python the functions do not change. Linking uses parts of numba that it does not document, tested with numba 0.63 to 0.68.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from numba.core import compiler, types
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target
from numba.core.typing.templates import infer, infer_global, make_intrinsic_template


class PartLibrary(JITCodeLibrary):
    """Intermediate code of a function and of the functions that it calls, for linking into other libraries."""

    ahead = False
    """True if it is optimised before it is linked as well as after."""

    def _optimize_functions(self, ll_module) -> None:
        ll_module.data_layout = self._codegen._data_layout  # LLVM links modules of the same layout only

    def finalize(self) -> None:
        """Link the parts that this one calls; the rest is left to the caller's library."""
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

    def find_type(_, *kinds):
        flags, context = compiler.Flags(), cpu_target.target_context
        cpu_target.options.parse_as_flags(flags, {"nopython": True, **options})
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        library = PartLibrary(context.codegen(), function.__qualname__)
        library.ahead = ahead
        part = compiler.compile_extra(cpu_target.typing_context, context, function, kinds, None, flags, {}, library)

        def call(context, builder, signature, arguments):
            context.active_code_library.add_linking_library(part.library)
            return context.call_internal(builder, part.fndesc, signature, arguments)

        return part.signature, call

    parameters = inspect.signature(function).parameters.values()
    context = inspect.Parameter("_", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    find_type.__signature__ = inspect.Signature([context, *parameters])  # type: ignore[attr-defined]
    template = make_intrinsic_template(function, find_type, function.__name__)
    infer(template)
    infer_global(function, types.Function(template))
    return function
