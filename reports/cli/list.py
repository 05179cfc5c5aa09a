"""`conservative list`."""

from __future__ import annotations

import click

from conservative.errors import require_extra

from .options import epilog


@click.command(
    "list",
    short_help="Show scenes and methods.",
    epilog=epilog(
        "conservative list",
        "conservative list --json | jq '.methods[] | select(.available) | .name'",
    ),
)
@click.option("--json", "as_json", is_flag=True, help="JSON on stdout.")
def list_all(as_json: bool) -> None:
    """Show the scenes, grouped, and the methods, with what they conserve and whether their engine is installed."""
    require_extra("conservative list", "report", "rich")
    from ..tables.catalogue import json_text, tables
    from ..terminal.tables import print_tables

    if as_json:
        click.echo(json_text())
    else:
        print_tables(tables())
