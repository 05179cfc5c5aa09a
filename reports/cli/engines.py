"""`conservative engines`: environments of engines that are not installed beside us."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import click

from conservative.errors import require_extra

from .options import allow_build_option, epilog, find_links_option


def _require() -> None:
    require_extra("conservative engines", "environments")


def _source(find_links: Path | None, allow_build: bool) -> object:
    from conservative.references.environments.lock import Source

    return Source(find_links, allow_build)


@click.group(
    short_help="Install engines in environments of their own.",
    epilog=epilog(
        "conservative engines install exudyn mujoco==3.6.0",
        "conservative run brick_flip --method exudyn:RK44",
        "conservative engines list",
    ),
)
def engines() -> None:
    """Have engines, in any version, each in an environment of its own in the user's cache folder."""


@engines.command(short_help="Make environments.", epilog=epilog("conservative engines install drake exudyn==1.13.6"))
@click.argument("names", nargs=-1, required=True, metavar="NAME[==VERSION]...")
@find_links_option
@allow_build_option
@click.pass_context
def install(ctx: click.Context, names: tuple[str, ...], find_links: Path | None, allow_build: bool) -> None:
    """Make the environment of each NAME, by default of its newest version, unless it is there.

    The exit code is 1 if an engine was installed but cannot be imported.
    """
    _require()
    from conservative.references.environments.install import check, install

    source = _source(find_links, allow_build)
    for name in names:
        check(name)  # all of them, before the first takes minutes
    trouble = False
    for name in names:
        click.echo(f"{name}: looking for it, and installing it where it is not there", err=True)
        done = install(name, source)  # type: ignore[arg-type]
        found, trouble = done.environment, trouble or bool(done.trouble)
        click.echo(
            f"{found.engine}=={found.version}: {'installed' if done.new else 'was there'}, {len(found.packages)} packages, "
            f"Python {found.python}" + (f"; cannot be imported: {done.trouble}" if done.trouble else "")
        )
    ctx.exit(int(trouble))


@engines.command("list", short_help="Show them.", epilog=epilog("conservative engines list --json"))
@click.option("--json", "as_json", is_flag=True, help="JSON on stdout, with every package's version.")
def list_engines(as_json: bool) -> None:
    """Show the engines that can be had, and the environments that are there."""
    _require()
    from ..tables.engines import json_text, lines

    _print([json_text()] if as_json else lines())


@engines.command(short_help="Remove environments.", epilog=epilog("conservative engines remove mujoco==3.6.0"))
@click.argument("names", nargs=-1, required=True, metavar="NAME[==VERSION]...")
def remove(names: tuple[str, ...]) -> None:
    """Remove the environment of each NAME==VERSION, or all of NAME."""
    _require()
    from conservative.references.environments.install import remove

    for name in names:
        _print(f"{environment.engine}=={environment.version}: removed" for environment in remove(name))


@engines.command(short_help="Find and mend broken ones.", epilog=epilog("conservative engines doctor"))
@click.option("--dry-run", is_flag=True, help="Only say what is wrong; exit code 1 if anything is.")
@find_links_option
@allow_build_option
@click.pass_context
def doctor(ctx: click.Context, dry_run: bool, find_links: Path | None, allow_build: bool) -> None:
    """Check each environment against what was recorded of it, and make those anew that differ."""
    _require()
    from conservative.references.environments.doctor import examine

    ill = False
    for finding in examine(not dry_run, _source(find_links, allow_build)):  # type: ignore[arg-type]
        ill = ill or (bool(finding.trouble) and finding.remedy not in ("made anew", "removed"))
        click.echo(f"{finding.name}: " + ("; ".join(filter(None, (finding.trouble, finding.remedy))) or "whole"))
    ctx.exit(int(ill))


def _print(lines: Iterable[str]) -> None:
    for line in lines:
        click.echo(line)
