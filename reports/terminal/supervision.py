"""A command in a process of its own, and the process that waits for it and can end it at any moment.

Python runs the handler of a signal between two of its own instructions: not while compiled code runs, and in the middle of what
is being imported, which makes other errors of it. A kill knows no such moments, and all that is written outlives it (see
`conservative.files`). So the parent does nothing but wait. On Ctrl-C or SIGTERM it kills the child with all that this has
started, removes what is left over, and says what is kept: the child leaves that in memory that both share.

The child leads a process group of its own, with what it starts; a terminal sends its signals to the parent, which hands Ctrl-Z
on. Should the parent be killed, a pipe is closed, of which the kernel tells the group by a signal that ends it.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from mmap import mmap
from typing import NoReturn

Tidy = Callable[[str], bool]
"""What removes leftovers beside a place, and says whether all are gone."""
EXIT_CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}
_SLOT = 1 << 16
"""Bytes of what a child leaves."""
_TIDY_TIME = 0.2
"""Time, s, that what the child has started may take to be gone."""
_CLEAR = "\r\x1b[2K\x1b[?25h"
"""What removes a bar that was being drawn, and shows the cursor again."""


class SharedStatus:
    """What a child leaves for its parent to read after a kill: what is kept, in words, and the places being written.

    The memory has two slots, and before them a byte that says which one is whole: a kill can come while the other is written.
    """

    def __init__(self) -> None:
        self._memory = mmap(-1, 1 + 2 * _SLOT)
        self._message = ""
        self._places: list[str] = []

    def tell(self, message: str) -> None:
        """Say what is kept, should this process be killed from now on."""
        self._message = message
        self._write()

    def list_places(self, places: Iterable[object]) -> None:
        """Say which places are being written."""
        self._places = list(map(str, places))
        self._write()

    def _write(self) -> None:
        content = os.fsencode("\0".join([self._message, *self._places]))
        if len(content) > _SLOT - 4:  # names of thousands of letters: better nothing than a half
            content = b""
        slot = 1 - self._memory[0]
        record = len(content).to_bytes(4, "little") + content
        self._memory[1 + slot * _SLOT : 1 + slot * _SLOT + len(record)] = record
        self._memory[0] = slot

    def read(self) -> tuple[str, list[str]]:
        """Return the words and the places."""
        start = 1 + self._memory[0] * _SLOT
        length = int.from_bytes(self._memory[start : start + 4], "little")
        message, *places = os.fsdecode(self._memory[start + 4 : start + 4 + length]).split("\0")
        return message, places


shared_status: SharedStatus | None = None
"""What this process tells the one that supervises it; None where it is not supervised, and handles its signals itself."""


def tell(message: str) -> None:
    """Say what is kept, should this process be killed from now on."""
    if shared_status is not None:
        shared_status.tell(message)


def list_places() -> bool:
    """Have the places listed that are being written from now on; return whether this process is supervised."""
    if shared_status is None:
        return False
    from conservative import files  # here, since a --help writes nothing

    files.add_observer(shared_status.list_places)
    return True


def supervise(tidy: Tidy) -> None:
    """Go on in a child; in the parent wait for that and exit as it does. Where there is no fork, go on as it is."""
    global shared_status
    if not hasattr(os, "fork"):
        return
    stops = (*EXIT_CODES, signal.SIGTSTP)
    waited = {number for number in stops if signal.getsignal(number) != signal.SIG_IGN} | {signal.SIGCHLD}
    signal.signal(signal.SIGCHLD, lambda number, frame: None)  # where it is ignored, a child leaves no exit code
    signal.pthread_sigmask(signal.SIG_BLOCK, waited)
    shared, (ours, theirs) = SharedStatus(), os.pipe()
    child = os.fork()
    if child:
        with suppress(OSError):
            os.setpgid(child, child)  # the child does so too: the first of them makes the group
        os.close(ours)  # `theirs` stays open as long as this process lives
        _wait(child, waited, shared, tidy)
    os.close(theirs)
    _end_with_the_parent(ours)
    for number in waited:
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)  # the group is in the background of its terminal, and writes there
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {*EXIT_CODES, *waited})
    shared_status = shared


def _end_with_the_parent(pipe: int) -> None:
    """Lead a group that gets SIGIO, which ends it, when the other end of the pipe is closed."""
    import fcntl  # here, as only POSIX has it

    os.setpgid(0, 0)
    os.set_blocking(pipe, False)
    with suppress(OSError):  # not every system has it for pipes
        fcntl.fcntl(pipe, fcntl.F_SETOWN, -os.getpid())
        fcntl.fcntl(pipe, fcntl.F_SETFL, os.O_NONBLOCK | fcntl.FASYNC)
    try:
        os.read(pipe, 1)
    except BlockingIOError:
        return
    os._exit(1)  # the parent was gone before that


def _wait(child: int, waited: set[signal.Signals], shared: SharedStatus, tidy: Tidy) -> NoReturn:
    """Wait for signals: that the child has ended, that it has to, that it has to pause. Exit as it does."""
    while True:
        number = signal.sigwait(waited)
        if number == signal.SIGTSTP:
            _signal_group(child, signal.SIGSTOP)
            os.kill(os.getpid(), signal.SIGSTOP)
            _signal_group(child, signal.SIGCONT)
            continue
        if number in EXIT_CODES:
            _signal_group(child, signal.SIGKILL)
        ended, status = os.waitpid(child, 0 if number in EXIT_CODES else os.WNOHANG)
        if ended:
            if not os.WIFEXITED(status):
                _signal_group(child, signal.SIGKILL)
                _tidy(shared.read()[1], tidy)
            _exit(status, number, shared)


def _signal_group(child: int, number: signal.Signals) -> None:
    """Send a signal to the child and all that it has started; of these some can be left when the child is gone."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(child, number)


def _exit(status: int, number: int, shared: SharedStatus) -> NoReturn:
    """Exit as a child did, or as one that was ended by the signal `number`."""
    if os.WIFEXITED(status):
        sys.exit(os.WEXITSTATUS(status))
    cause = signal.Signals(number if number in EXIT_CODES else os.WTERMSIG(status))
    words = "Interrupted" if cause in EXIT_CODES else f"Ended by {cause.name}"
    _say("; ".join(filter(None, [words, shared.read()[0]])))
    if cause in EXIT_CODES:
        sys.exit(EXIT_CODES[cause])
    if cause != signal.SIGKILL:
        signal.signal(cause, signal.SIG_DFL)
    os.kill(os.getpid(), cause)
    sys.exit(128 + cause)


def _tidy(places: list[str], tidy: Tidy) -> None:
    """Remove what is left over beside places that were being written."""
    end = time.monotonic() + _TIDY_TIME
    while (places := [place for place in places if not tidy(place)]) and time.monotonic() < end:
        time.sleep(0.01)


def _say(text: str) -> None:
    """Print a line on stderr; on a terminal below the ^C that this shows, in place of a bar."""
    clear = _CLEAR if os.environ.get("TERM") not in (None, "dumb", "unknown") else "\n"
    os.write(2, f"{clear if os.isatty(2) else ''}{text}\n".encode(errors="surrogateescape"))
