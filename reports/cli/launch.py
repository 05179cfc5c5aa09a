"""The script `conservative`, and `python -m conservative`: prepare signals and streams, then run the command line."""

from __future__ import annotations

import io
import os
import sys
import warnings

from ..terminal.interrupts import handle_signals, received

_shown = set[str]()
"""Texts of warnings that were printed: several methods can give the same warning."""


def launch() -> None:
    """Run the command line."""
    handle_signals()
    _open_streams()
    _separate_stdout()
    warnings.showwarning = show_warning
    try:
        from .main import main  # here: an interrupt during these imports is handled as well

        main(prog_name="conservative")
    except (KeyboardInterrupt, Exception):
        if not received:  # after a signal, libraries can turn the interrupt into an exception of their own
            raise
        print("Interrupted", file=sys.stderr)
        sys.exit(received[0].exit_code)


def show_warning(message: Warning | str, *place: object, **options: object) -> None:
    """Print a warning as a line, once, without the place in our code that issues it."""
    if (text := str(message)) not in _shown:
        _shown.add(text)
        print(f"Warning: {text}", file=sys.stderr)


def _open_streams() -> None:
    """Open stdin, stdout and stderr if they are closed. Otherwise the next opened file would get their descriptor."""
    # A new descriptor is the smallest free one: while it is 2 or less, one of the three was closed.
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(descriptor, True)
    os.close(descriptor)
    # Python has set the stream of a closed descriptor to None.
    sys.stdin, sys.stdout, sys.stderr = (
        stream or os.fdopen(number, "w" if number else "r", closefd=False)
        for number, stream in enumerate((sys.stdin, sys.stdout, sys.stderr))
    )


def _separate_stdout() -> None:
    """Reserve stdout for the output of the command.

    Compiled code of engines, such as heyoka's log, writes to the descriptor of stdout. That output goes to stderr and does not
    damage --json. The new stream has a buffer also under PYTHONUNBUFFERED, because Python loses output on a full disk without
    one, and escapes characters outside its encoding.
    """
    own = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    encoding = sys.stdout.encoding
    sys.stdout = io.TextIOWrapper(own, encoding, errors="backslashreplace", line_buffering=own.isatty())
