"""`conservative engines`: engines in environments of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from shutil import which
from typing import TYPE_CHECKING, Any, TypeVar

import click

from conservative.errors import BadInput, require_extra

from .options import Group, allow_build_option, epilog, find_links_option, json_option, show

if TYPE_CHECKING:
    from conservative.references.environments.install import Installation

Value = TypeVar("Value")


@click.group(
    cls=Group,
    short_help="Install, list and remove engines.",
    epilog=epilog(
        "conservative engines install exudyn mujoco@3.6.0",
        "conservative run brick_flip -m exudyn:RK44",
        "conservative engines list",
    ),
)
def engines() -> None:
    """Install engines, in any version, each in its own environment in the user's cache folder.

    Engines that are installed with the package itself, such as MuJoCo, need no environment. `conservative list` shows them.
    """


@engines.command(
    short_help="Install engines.",
    codes={1: "an engine was installed but cannot be imported"},
    epilog=epilog("conservative engines install drake exudyn@1.13.6"),
)
@click.argument("names", nargs=-1, required=True, metavar="NAME[@VERSION]...")
@find_links_option
@allow_build_option
@click.option("--force", is_flag=True, help="Rebuild an existing environment with the same packages.")
@json_option
@click.pass_context
def install(
    ctx: click.Context, names: tuple[str, ...], find_links: Path | None, allow_build: bool, force: bool, as_json: bool
) -> None:
    """Install each engine NAME, by default in its newest version, in a new environment.

    The exit code is 1 if an engine was installed but cannot be imported.
    """
    require_extra("conservative engines", "environments")
    from conservative.references.environments.install import check, install
    from conservative.references.environments.kind import Source

    from ..sections.environments import installation_line
    from ..terminal.progress import announce

    for name in names:
        check(name)  # all of them, before the first takes minutes

    def install_each() -> Iterable[Installation]:
        for name in names:
            announce(f"installing {name}")
            yield install(name, Source(find_links, allow_build), force)

    done = _show(install_each(), installation_line, as_json, f"installing {', '.join(names)}")
    ctx.exit(int(any(engine.trouble for engine in done)))


@engines.command(
    short_help="Register a program as an engine.",
    epilog=epilog("conservative engines add ./my_engine", "conservative engines add 'node engine.js' --project"),
)
@click.argument("command")
@click.option("--name", default="", help="Name of the engine.  [default: the name of the program's file]")
@click.option("--project", is_flag=True, help="Register it in conservative.toml of this project, not for the user.")
@json_option
def add(command: str, name: str, project: bool, as_json: bool) -> None:
    """Register COMMAND, an executable or a command line that speaks the protocol of references/PROTOCOL.md, as an engine."""
    require_extra("conservative engines", "environments")
    from conservative.references.environments.programs import read_program, register

    _refuse_engine(command)
    _show([register(read_program(command, name, project))], lambda program: f"{program}: added", as_json)


def _refuse_engine(command: str) -> None:
    """Raise an error with the command that verifies an engine, if a text is the name of one and not a command."""
    from conservative.benchmarks.studies.engine_selection import select_engines

    if which(command) or Path(command).is_file():
        return
    try:
        select_engines([command])
    except BadInput:
        return
    raise BadInput("command", repr(command), f"a program. To verify this engine, run: conservative verify {command}")


@engines.command("list", short_help="List engines and environments.", epilog=epilog("conservative engines list --json"))
@json_option
def list_engines(as_json: bool) -> None:
    """List the engines that can be installed, and the environments with the version of every package."""
    require_extra("conservative engines", "environments")
    from ..sections.environments import build

    show(build(), as_json)


@engines.command(short_help="Remove engines.", epilog=epilog("conservative engines remove mujoco@3.6.0"))
@click.argument("names", nargs=-1, required=True, metavar="NAME[@VERSION]...")
@json_option
def remove(names: tuple[str, ...], as_json: bool) -> None:
    """Remove the environment of each NAME@VERSION, or all environments of NAME. A program is unregistered."""
    require_extra("conservative engines", "environments")
    from conservative.references.environments.install import remove

    from ..sections.environments import removal_line

    _show((gone for name in names for gone in remove(name)), removal_line, as_json)


def _show(values: Iterable[Value], line: Callable[[Any], str], as_json: bool, what: str = "") -> list[Value]:
    """Return values. Each is printed in a line as soon as it is available, after a bar titled `what`, or all as JSON."""
    from ..document import json
    from ..terminal.progress import show_waiting

    shown: list[Value] = []
    rest = iter(values)
    while True:
        with show_waiting(what):
            value = next(rest, None)
        if value is None:
            break
        shown.append(value)
        if not as_json:
            click.echo(line(value))
    if as_json:
        click.echo(json.render(shown))
    return shown
