"""Interrupts: what they turn into, and where they have to wait."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from . import supervision

_AGAIN = 0.01
"""Time, s, after which a signal is sent again."""


class Terminated(KeyboardInterrupt):
    """SIGTERM, which `kill`, `timeout` and a CI that cancels a job send: the same as Ctrl-C but for the exit code."""


@contextmanager
def interruptible(number: signal.Signals) -> Iterator[None]:
    """Turn SIGINT into `KeyboardInterrupt`, SIGTERM into `Terminated`, also where another exception is made of it on the way.

    Compiled code that is interrupted while it is loaded raises `SystemError`, for one. A process that is supervised leaves its
    signals to the one that does it.
    """
    if supervision.list_places():
        yield
        return
    stops: list[KeyboardInterrupt] = []

    def stop(number: int, frame: object) -> None:
        stops.append(Terminated() if number == signal.SIGTERM else KeyboardInterrupt())
        raise stops[0]

    with _handle(stop, number), _repeat_ignored(stops, number):
        try:
            yield
        except Exception as error:
            if not stops:
                raise
            for note in notes(error):
                stops[0].add_note(note)
            raise stops[0] from error


@contextmanager
def _repeat_ignored(stops: list[KeyboardInterrupt], number: signal.Signals) -> Iterator[None]:
    """Send a signal again whose exception is ignored: the callback of a weak reference, as imports have them, cannot raise."""
    before = sys.unraisablehook

    def ignored(what: Any) -> None:
        if what.exc_value in stops:
            threading.Timer(_AGAIN, os.kill, (os.getpid(), number)).start()  # when this callback, too, is over
        else:
            before(what)

    sys.unraisablehook = ignored
    try:
        yield
    finally:
        sys.unraisablehook = before


@contextmanager
def unstoppable() -> Iterator[None]:
    """Ignore interrupts for the moment that a few renames take, which make sense only together."""
    with _handle(signal.SIG_IGN, signal.SIGINT, signal.SIGTERM):
        yield


def notes(error: BaseException) -> list[str]:
    """Return the notes of an exception: what has become of the work that it ended."""
    return list(getattr(error, "__notes__", ()))


@contextmanager
def _handle(handler: Any, *numbers: signal.Signals) -> Iterator[None]:
    """Handle signals that are not ignored already, as under nohup; only the main thread can."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    before = {number: signal.getsignal(number) for number in numbers} if in_main_thread else {}
    ours = [number for number, was in before.items() if was not in (None, signal.SIG_IGN)]
    for number in ours:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, before[number])
