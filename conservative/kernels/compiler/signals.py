"""Signals during a kernel: Ctrl-C ends a run of any length.

Kernels run without the interpreter's lock, and Python's handlers of signals wait until the main thread is back in Python. A
kernel therefore asks for them between two blocks of steps, outside of its innermost loop, whose registers a call would take.
An exception of a handler, such as KeyboardInterrupt, ends the kernel and reaches its caller. The samples of the run are lost.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from . import COMPILED, kernel


@intrinsic
def _check_compiled(typingctx):
    """Take the interpreter's lock and call the handlers of signals that are there."""

    def code(context, builder, signature, arguments):
        python = context.get_python_api(builder)
        lock = python.gil_ensure()
        kind = ir.FunctionType(ir.IntType(32), [])
        raised = builder.call(cgutils.get_or_insert_function(builder.module, kind, "PyErr_CheckSignals"), [])
        python.gil_release(lock)
        with cgutils.if_unlikely(builder, cgutils.is_not_null(builder, raised)):
            context.call_conv.return_exc(builder)  # what a handler raised is Python's current exception
        return context.get_dummy_value()

    return types.none(), code


_check = _check_compiled if COMPILED else lambda: None  # between the lines of plain Python handlers are called anyway


@kernel
def call_handlers():
    """Call the handlers of signals that have come since the last call; does nothing in threads other than the main one."""
    _check()


@kernel
def end_of_block(done, n_steps, block):
    """Return the last step of a block of `block` steps (0: all) that begins after `done` steps."""
    return n_steps if block <= 0 else min(n_steps, done + block)
