"""`conservative judge`."""

from __future__ import annotations

import math
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from conservative.errors import require_extra

from ..document import SVG_MARK
from . import completion
from .options import (
    FilePath,
    Output,
    OutputCommand,
    epilog,
    error_option,
    json_option,
    option,
    output_files,
    picture_file,
    picture_option,
    show,
)

if TYPE_CHECKING:
    from conservative.benchmarks.verification.finding import Verification

FILES = {"judge.md": "# Judged: ", "judge.json": '{\n  "judged": ', "judge.csv": "t,quantity,value", "judge.svg": SVG_MARK}
"""The files of `--out`, and how each begins."""


@click.command(
    cls=OutputCommand,
    short_help="Compare a recorded motion with the exact one.",
    codes={1: "the file is wrong", 3: "its rows do not decide"},
    epilog=epilog(
        "conservative judge run.csv --body my_body.toml",
        "conservative judge run.csv --body my_body.toml --quaternion xyzw --units deg --out judged",
        "conservative judge flight.parquet --body brick_flip --euler zyx --rates world --error 1e-3 --json",
    ),
)
@click.argument("run", type=FilePath())
@click.option("--body", required=True, shell_complete=completion.scenes, help="Scene file or scene: body, field and start.")
@click.option(
    "--columns", metavar="MAP", help="Columns by name or number: time=1,w=2:3:4,q=5:6:7:8 (R, euler, rotvec, mrp, crp)."
)
@click.option("--quaternion", type=click.Choice(["wxyz", "xyzw"]), help="Order of numbered columns.  [default: what fits]")
@click.option("--euler", metavar="ZYX", help="Sequence of Euler angles: zyx for yaw, pitch, roll.")
@click.option("--rates", type=click.Choice(["body", "world"]), default="body", show_default=True, help="Axes of the rates.")
@click.option(
    "--units",
    type=click.Choice(["deg", "rad", "deg/s", "rad/s"]),
    help="Unit of angles and rates whose columns name none; with /s of rates only.",
)
@click.option(
    "--start", type=click.Choice(["row", "scene"]), default="row", show_default=True, help="First row, or the scene's t = 0."
)
@error_option("Allowed error: rad, or relative to the largest rate.  [default: digits and noise]")
@json_option
@option("out", f"Write {', '.join(FILES)} into this folder.", type=Output(FILES))
@picture_option
def judge(
    run: Path,
    body: str,
    rates: str,
    start: str,
    error: float | None,
    as_json: bool,
    out: Path | None,
    picture: Path | None,
    **reading: Any,
) -> None:
    """Compare the motion in the file RUN with the exact motion of a body, and name what explains the difference.

    RUN is a table (CSV, STK attitudes, JSON lines or Parquet) of times with attitudes, rates or both. The exit code is 0 if it
    is right, 1 if it is wrong, and 3 if its rows do not decide.
    """
    if picture is not None:
        require_extra("conservative judge --picture", "report")
    from conservative import registry
    from conservative.benchmarks.verification.finding import Verdict
    from conservative.benchmarks.verification.recordings import table, verdict

    from ..sections.judge import build
    from ..terminal.progress import show_waiting

    drawn = find_spec("pandas") is not None and find_spec("altair") is not None
    files = [name for name in FILES if drawn or not name.endswith("svg")]
    with output_files(out, files, picture=picture) as write, show_waiting(f"judging {run.name}", line=True) as step:
        recording = table.read(run, table.Options(world=rates == "world", **reading))
        found = verdict.verify_recording(
            registry.scene(body), recording, start == "row", error, lambda what: step(0.0, what), run.name
        )
        document = build(found)

        def draw(path: Path | None = None) -> bytes:
            return drawing(found, path)

        document = write(document, csv=lambda: table_text(found), svg=draw, picture=lambda: draw(picture))
    show(document, as_json, silent=True)
    if found.verdict is Verdict.UNDECIDED:
        raise click.exceptions.Exit(found.exit_code)


def table_text(found: Verification) -> str:
    """Return rows of t, quantity and value as CSV."""
    rows = found.details.rows()
    return "t,quantity,value\n" + "".join(f'{row["t"]!r},"{row["quantity"]}",{row["value"]!r}\n' for row in rows)


def drawing(found: Verification, path: Path | None) -> bytes:
    """Return errors and drifts over time beside what is allowed, as a picture in the format of a file, by default SVG."""
    import pandas as pd

    from ..charts import figures

    limits = {each.name: each.allowed for each in found.details.quantities if math.isfinite(each.allowed)}
    return picture_file(figures.judged(pd.DataFrame(found.details.rows()), found.subject, limits), path)
