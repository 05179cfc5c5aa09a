"""Progress on stderr: a bar with the time left on a terminal, elsewhere a line every ten seconds."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from threading import Timer
from time import monotonic

Tell = Callable[[float, str], None]
"""Called with the finished share of all work, 0 to 1, and a description of the next piece."""
DELAY = 1.0
"""Time, s, after which the bar of `show_waiting` appears, or without a terminal a title."""
SILENCE = 10.0
"""Time, s, between two lines where there is no bar."""


def has_terminal() -> bool:
    """Return whether there is a terminal to show progress on."""
    return sys.stderr.isatty()


def announce(what: str) -> None:
    """Write a line about the next piece of work to stderr, where no bar shows it."""
    if not has_terminal():
        print(what, file=sys.stderr, flush=True)


@contextmanager
def progress(title: str = "") -> Iterator[Tell]:
    """Yield the function to call before each piece of work. Without a terminal, the title is a line after `DELAY`."""
    if not has_terminal() or find_spec("rich") is None:  # the gate runs without the extra `report`, which has rich
        written = start = monotonic()
        timer = Timer(DELAY, announce, [title])
        timer.daemon = True

        def tell(share: float, what: str) -> None:
            nonlocal written
            if (now := monotonic()) - written >= SILENCE:
                # The first pieces compile, so an estimate from them would be many times too long.
                left = f", about {(now - start) * (1 - share) / share:.0f} s left" if share > 0.1 else ""
                print(f"{share:.0%}{left}: {what}", file=sys.stderr, flush=True)
                written = now

        if title:
            timer.start()
        try:
            yield tell
        finally:
            timer.cancel()
        return
    from .bars import Bar

    with Bar() as bar:
        task = bar.add_task(title, total=1.0)
        yield lambda share, what: bar.update(task, completed=share, description=what)


@contextmanager
def show_waiting(what: str, line: bool = False) -> Iterator[Tell]:
    """Show a bar if a piece of work takes longer than `DELAY`. Yield a function that does nothing.

    Without a terminal nothing is shown, or with `line` a line after the same time.
    """

    def ignore(share: float, what: str) -> None: ...

    if not has_terminal() or find_spec("rich") is None:
        timer = Timer(DELAY, announce, [f"{what} ..."])
        timer.daemon = True
        if line:
            timer.start()
        try:
            yield ignore
        finally:
            timer.cancel()
        return
    from .bars import Bar

    bar = Bar()
    bar.add_task(what, total=None)
    timer = Timer(DELAY, bar.start)
    timer.daemon = True
    timer.start()
    try:
        yield ignore
    finally:
        timer.cancel()
        timer.join()
        bar.stop()
