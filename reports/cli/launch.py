"""The script `conservative`, and `python -m conservative`: prepare signals and streams, then run the command line."""

from __future__ import annotations

import io
import os
import sys

from conservative.errors import MissingExtra, require_extra

from ..terminal.interrupts import handle_signals, received


def launch() -> None:
    """Run the command line. The exit code is 2 where click, which the command line is made with, is not installed."""
    handle_signals()
    _open_streams()
    _separate_stdout()
    try:
        require_extra("conservative", "report", "click")
        from .main import main

        main()
    except MissingExtra as missing:
        print(f"Error: {missing}", file=sys.stderr)
        sys.exit(2)
    except (KeyboardInterrupt, Exception):
        if not received:
            raise
        print("Interrupted", file=sys.stderr)
        sys.exit(received[0].exit_code)


def _open_streams() -> None:
    """Open those of stdin, stdout and stderr that are closed, or the next file that is opened would be taken for them."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(descriptor, True)
    os.close(descriptor)
    sys.stdin, sys.stdout, sys.stderr = (
        stream or os.fdopen(number, "w" if number else "r", closefd=False)
        for number, stream in enumerate((sys.stdin, sys.stdout, sys.stderr))
    )


def _separate_stdout() -> None:
    """Keep stdout for what the command prints.

    Compiled code of engines writes to the descriptor of stdout, as heyoka's log does: that goes to stderr, and leaves --json
    whole. The new stream has a buffer also under PYTHONUNBUFFERED, without which Python loses what a full disk has no room for,
    and escapes characters that its encoding does not have.
    """
    own = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    encoding = sys.stdout.encoding
    sys.stdout = io.TextIOWrapper(own, encoding, errors="backslashreplace", line_buffering=own.isatty())
