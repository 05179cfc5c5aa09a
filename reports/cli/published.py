"""`conservative published`."""

from __future__ import annotations

from itertools import tee

import click

from conservative.errors import require_extra

from .options import epilog, split_names


@click.command(
    short_help="Measure figures anew that others have printed.",
    epilog=epilog(
        "conservative published                               all figures",
        "conservative published --only exudyn-lie,basilisk    of two sources",
        "conservative published --engines none --json         without any engine, as JSON",
    ),
)
@click.option("--json", "as_json", is_flag=True, help="JSON on stdout, with numbers in full.")
@click.option("--only", multiple=True, metavar="SOURCE,...", help="Figures of these sources.  [default: all]")
@click.option("--engines", multiple=True, metavar="all|none|NAME,...", help="Engines that may run.  [default: all]")
@click.pass_context
def published(ctx: click.Context, as_json: bool, only: tuple[str, ...], engines: tuple[str, ...]) -> None:
    """Say of figures that others have printed: reproduced, off by how much, or why it cannot be done.

    Every one is measured now: a figure of a motion on our truth, and beside it on each engine that is installed; a figure of an
    engine with that engine. Exits with 1 where a difference has no explanation, or an explanation no difference.
    """
    require_extra("conservative published", "environments", "platformdirs")
    from conservative.benchmarks.published.evaluate import check_engines, evaluate, passed, select_figures
    from conservative.benchmarks.published.figure import read

    from ..tables.published import json_text, lines

    named = split_names("engines", engines) or ["all"]
    check_engines(named)
    left, kept = tee(evaluate(select_figures(read(), split_names("only", only)), named))
    for line in () if as_json else lines(left):
        click.echo(line)  # at once, as measuring all of them takes minutes
    findings = list(kept)
    if as_json:
        click.echo(json_text(findings))
    ctx.exit(int(not passed(findings)))
