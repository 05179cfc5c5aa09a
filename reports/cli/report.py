"""`conservative report`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from conservative.errors import require_extra

from . import completion
from .options import (
    FAILED,
    Command,
    FilePath,
    engines_option,
    epilog,
    methods_option,
    names_option,
    option,
    quick_option,
    skip_missing_option,
    split_list,
    split_names,
)


@click.command(
    cls=Command,
    codes={1: f"{FAILED}, or a part of the page could not be made"},
    short_help="Measure the paper's two scenes and write a report.",
    epilog=epilog(
        "conservative report",
        "conservative report --full                   everything",
        "conservative report --quick --out quick_report",
        "conservative report --scenes lagrange_top,my_body.toml --methods reduced,mujoco:RK4,heyoka",
        "conservative report --engines all --methods reduced",
        "conservative report --resume                 continue after Ctrl-C, with the same options",
    ),
)
@names_option("scenes", "Scenes.  [default: the paper's two]", complete=completion.scenes)
@methods_option(
    "Methods. A name without settings, such as mujoco, selects all its variants (`run --methods` runs the default one).  "
    "[default: a selection; with --full all]"
)
@engines_option
@click.option(
    "--bodies",
    type=click.IntRange(0),
    metavar="N",
    help="Random bodies in each of five fields.  [default: 1 in three fields with three methods; with --full 3]",
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the random bodies.")
@click.option(
    "--full",
    is_flag=True,
    help="Measure all methods, and add random bodies, many bodies, hard cases, longest steps, and runs with every step stored.",
)
@quick_option
@skip_missing_option
@click.option(
    "--time-limit",
    type=float,
    metavar="S",
    help="Time budget per run, s. Slower methods get fewer points. Slow runs of a study on a scene, such as runs with a "
    "potential in Python, may take up to 100 budgets together; further ones are skipped, with the reason. A run beyond ten "
    "times the budget (at least 60 s) is stopped.  [default: 0.15; with --full or --engines 0.6]",
)
@click.option("--png", is_flag=True, help="Write pictures as PNG as well as SVG.")
@click.option("--latex", is_flag=True, help="Write a table of errors, drifts, orders and times as LaTeX, report.tex.")
@click.option("--json", "as_json", is_flag=True, help="Print the content of measurements.json instead of tables.")
@click.option("--resume", is_flag=True, help="Continue an interrupted report, with the same options.")
@option(
    "out", "Folder of the report. An earlier report there is replaced.", type=FilePath(), default="report", show_default=True
)
def report(out: Path, resume: bool, as_json: bool, **options: Any) -> None:
    """Measure our methods, MuJoCo, Pinocchio, heyoka and SciPy on the paper's two scenes and three random bodies.

    The report shows drift of energy and momentum, attitude error, order of convergence, time per step, and time against error.
    Open OUT/index.html. With --engines, OUT/engine_NAME.html is a page about each engine. The folder OUT is replaced when the
    report is complete. Until then, finished studies are in OUT.partial.json. If a part cannot be drawn, a sentence takes its
    place and the exit code is 1. --resume then draws it without measuring.
    """
    require_extra("conservative report", "report")
    from .. import report as work
    from ..document import terminal
    from ..run.checkpoint import find_unfinished
    from ..run.plan import plan_report
    from ..terminal.progress import progress
    from ..terminal.report_folder import MANIFEST

    scenes, methods = (split_names(name, options.pop(name)) for name in ("scenes", "methods"))
    plan = plan_report(scenes, methods, split_list("engines", options.pop("engines")), **options)
    if not resume and (unfinished := find_unfinished(out)):
        click.echo(f"{unfinished}: replacing an unfinished report. With --resume its studies are not measured again.", err=True)
    with progress() as tell:
        document = work.write(plan, out, tell, resume)
    if as_json:
        click.echo((out / MANIFEST).read_text(encoding="utf-8"))
    else:
        terminal.show(document)
        click.echo(out / "index.html")
    if document.failures:
        raise click.ClickException("; ".join(document.failures))
