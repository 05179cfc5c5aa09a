"""`conservative new`."""

from __future__ import annotations

import tomllib
from functools import reduce
from typing import Any

import click

from .options import Command, epilog


@click.command(
    cls=Command,
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
    from conservative.scene_files.scene_file import choices, template
    from conservative.toml_reader import key_lines

    from ..document import json

    text = template()
    if as_json:
        values, lines, keys = tomllib.loads(text), text.splitlines(), []
        for key, line in key_lines(text).items():
            value: Any = reduce(lambda table, name: table[name], key, values)
            if not isinstance(value, dict):
                meaning = lines[line - 1].partition("#")[2].strip()  # the comment in its line
                keys.append({"key": ".".join(key), "value": value, "line": line, "meaning": meaning})
        click.echo(json.render({"keys": keys, "choices": choices(), "text": text}))
    else:
        click.echo(text, nl=False)
