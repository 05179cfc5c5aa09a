"""`conservative motions`."""

from __future__ import annotations

from pathlib import Path

import click

from .options import FilePath, epilog


@click.command(
    short_help="Write exact motions as files, for the tests of an engine.",
    epilog=epilog("conservative motions --out motions"),
)
@click.option("--out", required=True, type=FilePath(), help="Folder for the files, two for each motion.")
def motions(out: Path) -> None:
    """Write 48 short motions as JSON and CSV, with tolerances and the mistakes that they catch.

    The files are those of references/motions, to the last digit. Solutions are computed again in multi-precision and tolerances
    measured again, which takes a minute.
    """
    from conservative.benchmarks.motions.files import write

    click.echo(f"{write(out)} files in {out}")
