"""`conservative judge`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from conservative.errors import require_extra

from ..document import SVG_MARK
from . import completion
from .options import FilePath, Output, OutputCommand, epilog, json_option, output_files, show

FILES = {"judge.md": "# Judged: ", "judge.json": '{\n  "judged": ', "judge.csv": "t,quantity,value", "judge.svg": SVG_MARK}
"""The files of `--out`, and how each begins."""


@click.command(
    cls=OutputCommand,
    short_help="Compare a recorded motion with the exact one.",
    epilog=epilog(
        "conservative judge run.csv --body my_body.toml",
        "conservative judge run.csv --body my_body.toml --quaternion xyzw --units deg --out judged",
        "conservative judge flight.parquet --body brick_flip --euler zyx --rates world --error 1e-3 --json",
    ),
)
@click.argument("run", type=FilePath())
@click.option("--body", required=True, shell_complete=completion.scenes, help="Scene file or scene: body, field and start.")
@click.option("--quaternion", type=click.Choice(["wxyz", "xyzw"]), help="Order of numbered columns.  [default: what fits]")
@click.option("--euler", metavar="ZYX", help="Sequence of Euler angles: zyx for yaw, pitch, roll.")
@click.option("--rates", type=click.Choice(["body", "world"]), default="body", show_default=True, help="Axes of the rates.")
@click.option("--units", type=click.Choice(["deg", "rad"]), help="Unit of angles and rates whose columns name none.")
@click.option(
    "--start", type=click.Choice(["row", "scene"]), default="row", show_default=True, help="First row, or the scene's t = 0."
)
@click.option(
    "--error", type=float, default=1e-6, show_default=True, help="Allowed error: rad, or relative to the largest rate."
)
@json_option
@click.option("--out", type=Output(FILES), help=f"Write {', '.join(FILES)} into this folder.")
def judge(run: Path, body: str, rates: str, start: str, error: float, as_json: bool, out: Path | None, **reading: Any) -> None:
    """Compare the motion in the file RUN with the exact motion of a body, and name what explains the difference.

    RUN is a table (CSV, Parquet or JSON lines) of times with attitudes, rates or both. The exit code is 1 if its error is
    larger than --error.
    """
    require_extra("conservative judge", "report")
    from conservative import registry
    from conservative.benchmarks.judge import diagnose, table

    from ..charts import figures, style
    from ..sections.judge import build
    from ..terminal.progress import show_waiting

    with output_files(out, FILES) as write, show_waiting(run.name):
        recording = table.read(run, world=rates == "world", **reading)
        summary, rows = diagnose.judge(registry.scene(body), recording, start == "row", error)
        document = build(summary, run.name, error)
        drawn = {"csv": lambda: rows.to_csv(index=False), "svg": lambda: style.svg_text(figures.judged(rows, run.name))}
        write(document, **drawn)
    show(document, as_json, silent=True)
