"""`conservative new`."""

from __future__ import annotations

import click

from .options import epilog


@click.command(
    short_help="Print a scene file to edit.",
    epilog=epilog(
        "conservative new > my_body.toml",
        "conservative run my_body.toml",
        "conservative new --json | jq '.choices.shape'",
    ),
)
@click.option("--json", "as_json", is_flag=True, help="Print keys, meanings, allowed values and the text as JSON.")
def new(as_json: bool) -> None:
    """Print a scene file with every key explained. Commands accept such a file instead of a scene's name."""
    from conservative.scene_files.scene_file import template

    from ..tables.scene_file import json_text

    click.echo(json_text() if as_json else template(), nl=as_json)
