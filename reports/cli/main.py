"""The command line `conservative`. What needs more than click is imported when a command runs, so that --help is instant."""

from __future__ import annotations

import errno
import io
import signal
import sys
from typing import Any

import click

from ..terminal.interrupts import Terminated, interruptible, notes
from .engines import engines
from .gate import gate
from .list import list_all
from .new import new
from .options import epilog
from .published import published
from .recommend import recommend
from .report import report
from .run import run
from .study import study
from .track import track


class _UserError(click.ClickException):
    exit_code = 2


class _Interrupted(click.ClickException):
    exit_code = 130

    def show(self, file: Any = None) -> None:
        """Print the message on a line of its own, below the ^C that a terminal shows."""
        click.echo("\n" * sys.stderr.isatty() + self.message, err=True)


class _Terminated(_Interrupted):
    exit_code = 143


class Commands(click.Group):
    """Commands whose user errors end as one line on stderr and an exit code, never as a traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with interruptible(signal.SIGINT):
                return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            kind = _Terminated if isinstance(stop, Terminated) else _Interrupted
            raise kind("; ".join(["Interrupted", *notes(stop)])) from None
        except OSError as error:
            raise _as_full(error) from None
        except (ValueError, ImportError, ArithmeticError) as error:
            raise _as_click(error) from None

    def main(self, *args: Any, **kwargs: Any) -> Any:
        kwargs.setdefault("prog_name", "conservative")
        return super().main(*args, **kwargs)


def _as_full(error: OSError) -> Exception:
    """Return the click exception for output that the disk has no room for; what else the system refuses is a bug, or a pipe."""
    if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return error
    sys.stdout = io.StringIO()  # what could not be written is not tried again at the end of the process
    return _UserError(f"stdout: got {error.strerror!r}; allowed: a file, a pipe or a terminal that takes all of the output")


def _as_click(error: Exception) -> Exception:
    """Return the click exception for what a user can act on; anything else is a bug and keeps its traceback."""
    from conservative.errors import BadInput, IntegrationFailed, MissingEngine, MissingExtra

    text = "; ".join([str(error), *notes(error)])
    if isinstance(error, BadInput | MissingEngine | MissingExtra):
        return _UserError(text)
    return click.ClickException(text) if isinstance(error, IntegrationFailed) else error


@click.group(
    cls=Commands,
    epilog=epilog(
        "conservative report                      everything, into report/",
        "conservative run brick_flip --dt 0.01    one run",
        "conservative list                        scenes and methods",
    ),
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(package_name="conservative-rotation", message="%(prog)s %(version)s")
def main() -> None:
    """Integrate the rotation of rigid bodies so that energy and momentum stay, and measure that beside other engines.

    Completion of names and files: eval "$(_CONSERVATIVE_COMPLETE=bash_source conservative)", or zsh_source, or fish_source.
    """


for command in (report, run, list_all, recommend, gate, new, engines, track, published, study):
    main.add_command(command)
