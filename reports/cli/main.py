"""The command line `conservative`. What needs more than click is imported when a command runs, so that --help is instant.

Only `study --help` takes a second: it imports the studies for their names.
"""

from __future__ import annotations

import errno
import io
import sys
from contextlib import suppress
from typing import Any

import click

from ..terminal.interrupts import notes, received
from .engines import engines
from .gate import gate
from .list import list_all
from .motions import motions
from .new import new
from .options import Group, epilog
from .recommend import recommend
from .report import report
from .run import run
from .study import study
from .sweep import sweep
from .track import track
from .verify import verify
from .watch import watch


class _UserError(click.ClickException):
    exit_code = 2


class _Stopped(click.ClickException):
    """A command that a signal ended."""

    def __init__(self, error: BaseException) -> None:
        super().__init__("; ".join(["Interrupted", *notes(error)]))
        self.exit_code = received[0].exit_code if received else 130  # type: ignore[misc]  # click declares it for the class

    def show(self, file: Any = None) -> None:
        """Print the message on a line of its own, below the ^C that a terminal shows."""
        with suppress(OSError):  # a terminal that was closed
            click.echo("\n" * sys.stderr.isatty() + self.message, err=True)


class Commands(Group):
    """Commands whose user errors end as one line on stderr and an exit code, never as a traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, Exception) as error:
            # A signal can end in another exception: compiled code that is interrupted while it is loaded raises SystemError.
            if received or isinstance(error, KeyboardInterrupt):
                raise _Stopped(error) from None
            raise _as_click(error) from None


def _as_click(error: Exception) -> Exception:
    """Return the click exception for an error that a user can act on; other errors are bugs and show their traceback."""
    from conservative.errors import BadInput, IntegrationFailed, MissingEngine, MissingExtra, PotentialFailed, TorqueFailed

    text = "; ".join([str(error), *notes(error)])
    if isinstance(error, BadInput | MissingEngine | MissingExtra | PotentialFailed | TorqueFailed):
        return _UserError(text)
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        sys.stdout = io.StringIO()  # otherwise Python tries again to write the rest when it ends
        return _UserError(f"stdout: got {error.strerror!r}; expected a file, pipe or terminal that accepts all output")
    return click.ClickException(text) if isinstance(error, IntegrationFailed) else error


FIRST = """\
conservative run brick_flip                      integrate a tumbling brick, and show its errors
conservative watch brick_flip                    see the motion
conservative recommend brick_flip --error 1e-6   find the method and the step to use
conservative verify run.csv --body my_body.toml  is a recorded motion right, and if not, what is wrong?
conservative report                              compare methods and engines: a page, in a minute or two
conservative new > my_body.toml                  describe your own body; every command accepts this file
conservative --help                              all commands"""
"""First steps, for a user who types only the name of the command."""


@click.group(
    cls=Commands,
    invoke_without_command=True,
    epilog=epilog(
        "conservative report                      measure the paper's two scenes, write report/",
        "conservative run brick_flip --dt 0.01    integrate a scene once",
        "conservative list                        list scenes and methods",
    ),
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(package_name="conservative-rotation", message="%(prog)s %(version)s")
@click.pass_context
def main(context: click.Context) -> None:
    """Measure, verify and gate the rotation of rigid bodies in integrators, engines, programs and recordings.

    Tab completion in bash: eval "$(_CONSERVATIVE_COMPLETE=bash_source conservative)". In zsh and fish: zsh_source, fish_source.
    """
    if context.invoked_subcommand is None:
        click.echo(FIRST)


for command in (
    report,
    run,
    watch,
    sweep,
    list_all,
    recommend,
    gate,
    new,
    engines,
    track,
    study,
    verify,
    motions,
):
    main.add_command(command)
