"""Progress on stderr: a bar with the time left on a terminal, nothing elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread
from time import monotonic

Step = Callable[[float, str], None]
"""Called with the share of all work that is done, 0 to 1, and what comes next."""
Expect = Callable[[float], None]
"""Called with the time, s, that the rest is expected to take."""
DELAY = 1.0
"""Time, s, that one piece of work takes before a bar appears."""


def has_terminal() -> bool:
    """Return whether there is a terminal to show progress on."""
    return sys.stderr.isatty()


@contextmanager
def progress() -> Iterator[Step]:
    """Yield the function to call before each step."""
    if not has_terminal():
        yield lambda share, what: None
        return
    from .bars import Bar

    with Bar() as bar:
        task = bar.add_task("", total=1.0)
        yield lambda share, what: bar.update(task, completed=share, description=what)


@contextmanager
def show_waiting(what: str, clock: Callable[[], float] = monotonic) -> Iterator[Expect | None]:
    """Show, if it takes long, that one piece of work goes on; yield the function to tell how long, None without a terminal."""
    if not has_terminal():
        yield None
        return
    from .bars import Bar

    bar, done = Bar(clock), Event()
    task = bar.add_task(what, total=None)

    start = clock()

    def expect(seconds: float) -> None:
        # Compiled code keeps the interpreter locked, and the bar standing: so its text has the time as well.
        bar.update(task, total=clock() - start + seconds, description=f"{what}, about {seconds:.0f} s")
        if seconds > DELAY:
            bar.start()

    def tick() -> None:
        while not done.wait(0.1):
            if clock() - start > DELAY:
                bar.start()
            bar.update(task, completed=clock() - start)

    ticking = Thread(target=tick, daemon=True)
    ticking.start()
    try:
        yield expect
    finally:
        done.set()
        ticking.join()
        bar.stop()
