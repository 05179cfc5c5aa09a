"""Ctrl-C, SIGTERM and SIGHUP end a command by an exception, so that its temporary files and processes are removed.

Kernels call handlers of signals between blocks of steps (`kernels/compiler/signals.py`). During a call of an engine's compiled
code a signal waits until that call returns. It waits for llvmlite too: an exception between a call of LLVM and the line of
Python that notes which of the two owns the result makes both free it.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
from functools import partial
from types import FrameType
from typing import Any

from conservative.posix import SIGNALS

_AGAIN = 0.01
"""Time, s, after which a signal that was lost, or came while LLVM compiled, is sent again."""


class Interrupted(KeyboardInterrupt):
    """A signal ended the command. Attributes: `number` of the signal, and the `exit_code` of the command."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number, self.exit_code = number, 128 + number


received: list[Interrupted] = []
"""The interrupt of this process, once a signal has come."""


def handle_signals() -> None:
    """Make signals raise `Interrupted`, except ignored ones, such as SIGHUP under nohup.

    A second Ctrl-C ends the process at once. Other signals after the first are ignored, so that cleanup can finish.
    """
    for number in SIGNALS:
        if signal.getsignal(number) not in (None, signal.SIG_IGN):
            signal.signal(number, _interrupt)
    sys.unraisablehook = _send_again


def _interrupt(number: int, frame: FrameType | None) -> None:
    if not received:
        if any(caller.f_globals.get("__name__", "").startswith("llvmlite.") for caller, _ in traceback.walk_stack(frame)):
            _send_later(number)
            return
        received.append(Interrupted(number))
        raise received[0]
    if number == signal.SIGINT:
        signal.signal(number, signal.SIG_DFL)
        signal.raise_signal(number)


def _send_again(unraisable: Any) -> None:
    """Send a signal again if its exception was ignored, as in callbacks of weak references, which imports use."""
    if unraisable.exc_value in received:
        received.clear()
        _send_later(unraisable.exc_value.number)
    else:
        sys.__unraisablehook__(unraisable)


def _send_later(number: int) -> None:
    # On Windows os.kill would end the process at once. Elsewhere it also ends a wait of the main thread.
    send = signal.raise_signal if os.name == "nt" else partial(os.kill, os.getpid())
    threading.Timer(_AGAIN, send, (number,)).start()


def notes(error: BaseException) -> list[str]:
    """Return the notes of an exception, such as where the finished part of the work is."""
    return list(getattr(error, "__notes__", ()))
