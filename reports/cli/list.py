"""`conservative list`."""

from __future__ import annotations

import click

from .options import Command, epilog, json_option, show


@click.command(
    "list",
    cls=Command,
    short_help="List scenes and methods.",
    epilog=epilog(
        "conservative list",
        "conservative list --json | jq '.methods[] | select(.available) | .name'",
    ),
)
@json_option
def list_all(as_json: bool) -> None:
    """List the scenes, our methods and the installed engines, with the invariants that they conserve."""
    from ..sections.catalogue import build

    show(build(), as_json)
