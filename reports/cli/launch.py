"""What the script `conservative` runs: the command line, or one line that says what to install for it.

Nothing is imported at the top: until signals wait, Ctrl-C ends Python as it ends all of its programs, by a traceback.
"""


def launch() -> None:
    """Run the command line; exit with 2 where click, which it is made with, is not installed."""
    _let_signals_wait()
    _open_streams()
    import sys

    from ..terminal.supervision import supervise

    supervise(_tidy)
    _buffer_output()
    from conservative.errors import MissingExtra, require_extra

    try:
        require_extra("conservative", "report", "click")
    except MissingExtra as missing:
        print(f"Error: {missing}", file=sys.stderr)
        sys.exit(2)
    from .main import main

    main()


def _let_signals_wait() -> None:
    """Keep signals for the process that supervises this one. Of `_signal`, which is built in, `signal` takes 5 ms to import."""
    import _signal  # type: ignore[import-not-found]

    if hasattr(_signal, "pthread_sigmask"):
        _signal.pthread_sigmask(_signal.SIG_BLOCK, (_signal.SIGINT, _signal.SIGTERM))


def _open_streams() -> None:
    """Open those of stdin, stdout and stderr that are closed, or what is opened next would be taken for them."""
    import os
    import sys

    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(descriptor, True)
    os.close(descriptor)
    sys.stdin, sys.stdout, sys.stderr = (
        stream or os.fdopen(number, "w" if number else "r", closefd=False)
        for number, stream in enumerate((sys.stdin, sys.stdout, sys.stderr))
    )


def _tidy(place: str) -> bool:
    """Remove leftovers beside a place, and return whether all are gone."""
    from pathlib import Path

    from ..terminal.report_folder import recover

    return recover(Path(place))


def _buffer_output() -> None:
    """Put a buffer on stdout where PYTHONUNBUFFERED takes it away: without, Python loses what a full disk has no room for."""
    import io
    import sys

    raw = getattr(sys.stdout, "buffer", None)
    if isinstance(raw, io.RawIOBase):
        sys.stdout = io.TextIOWrapper(
            io.BufferedWriter(raw),
            encoding=sys.stdout.encoding,
            errors=sys.stdout.errors,
            line_buffering=sys.stdout.isatty(),
        )
