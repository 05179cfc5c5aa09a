"""`conservative report`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from conservative.errors import require_extra

from . import completion
from .options import FilePath, epilog, split_list, split_names


@click.command(
    short_help="Measure everything and write a report.",
    epilog=epilog(
        "conservative report",
        "conservative report --quick --out quick_report",
        "conservative report --scenes lagrange_top,my_body.toml --methods reduced,mujoco:RK4,heyoka",
        "conservative report --engines all --methods reduced",
        "conservative report --resume                 go on after Ctrl-C, with the same options",
    ),
)
@click.option("--scenes", multiple=True, metavar="A,B", shell_complete=completion.scenes, help="[default: the paper's two]")
@click.option("--methods", multiple=True, metavar="M,N", shell_complete=completion.methods, help="[default: all registered]")
@click.option(
    "--engines",
    multiple=True,
    metavar="E,F",
    shell_complete=completion.engine_lists,
    help="Engines to compare in a section of their own: NAME, NAME==VERSION, or all, which stands for all that are installed, "
    "in environments (see `conservative engines`) or beside us.",
)
@click.option(
    "--bodies",
    type=click.IntRange(0),
    metavar="N",
    help="Random bodies in each of four fields.  [default: 3; 1 with --quick, 0 with --scenes]",
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the random bodies.")
@click.option("--quick", is_flag=True, help="Coarser: fewer steps, fewer rounds of timing.")
@click.option("--skip-missing", is_flag=True, help="Rows that say so instead of an error where an engine is not installed.")
@click.option(
    "--time-limit",
    type=float,
    metavar="S",
    help="Longest run to plan for, s; a slower method gets fewer points, and one that goes on for ten times that, and at "
    "least a minute, is ended.  [default: 0.6, with --quick 0.15]",
)
@click.option("--png", is_flag=True, help="Pictures as PNG, too.")
@click.option("--json", "as_json", is_flag=True, help="The measurements on stdout, as measurements.json has them.")
@click.option("--resume", is_flag=True, help="Take the studies that an interrupted report has finished, and do the rest.")
@click.option("--out", type=FilePath(), default="report", show_default=True, help="Folder, replaced as a whole.")
def report(out: Path, resume: bool, as_json: bool, scenes: tuple[str, ...], methods: tuple[str, ...], **extent: Any) -> None:
    """Run our methods beside every engine and leave tables, pictures and measurements in a folder.

    The folder is there whole or not at all; until then, what is finished is in a file beside it, OUT.partial.json.
    A family's bare name, such as mujoco, stands for all its variants.
    """
    require_extra("conservative report", "report")
    from .. import document
    from ..run.plan import plan_report
    from ..terminal.progress import progress
    from ..terminal.report_folder import MANIFEST

    extent["engines"] = split_list("engines", extent["engines"])
    plan = plan_report(split_names("scenes", scenes), split_names("methods", methods), **extent)
    _announce(out, resume)
    with progress() as step:
        view = document.write(plan, out, step, resume)
    click.echo((out / MANIFEST).read_text(encoding="utf-8") if as_json else out / "report.md")
    for statement in view.random.statements if view.random else ():
        click.echo(statement, err=True)
    if view.failed:
        raise click.ClickException("; ".join(view.failed))


def _announce(out: Path, resume: bool) -> None:
    """Say which unfinished work a report that begins anew replaces."""
    from ..run.checkpoint import path_for

    path = path_for(out)
    if not resume and path.exists():
        click.echo(f"{path}: unfinished work that --resume goes on with; without it, to be replaced", err=True)
