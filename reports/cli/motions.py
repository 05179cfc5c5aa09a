"""`conservative motions`."""

from __future__ import annotations

from pathlib import Path

import click

from .options import Command, FilePath, epilog, json_option, option, require_replaceable


@click.command(
    cls=Command,
    short_help="Write exact motions as files, for the tests of an engine.",
    epilog=epilog("conservative motions --out motions"),
)
@option("out", "Folder for the files, two for each motion.", required=True, type=FilePath())
@click.option("--force", is_flag=True, help="Replace files that this command did not write.")
@json_option
def motions(out: Path, force: bool, as_json: bool) -> None:
    """Write 48 short motions as JSON and CSV, with tolerances and the mistakes that each motion reveals.

    The files equal the files of references/motions to the last digit. The command computes all solutions again in
    multi-precision, and measures all tolerances again with right programs of all designs, which takes some minutes.
    """
    from conservative.benchmarks.verification.motions import files

    from ..document import json

    for name, mark in files.marks():
        require_replaceable(out / name, mark, "out", force)
    names = files.write(out)
    click.echo(json.render({"out": str(out), "files": names}) if as_json else f"{len(names)} files in {out}")
