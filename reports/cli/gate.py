"""`conservative gate`."""

from __future__ import annotations

from typing import Any

import click

from . import against as two_versions
from . import completion
from .options import FilePath, allow_build_option, epilog, find_links_option, split_names

TIMES = "known: where the baseline has no times of this machine, compare all but times, and say so; required: fail."


@click.command(
    short_help="Compare benchmarks with a baseline, or two versions with each other.",
    epilog=epilog(
        "conservative gate --against main              the files in this folder against a branch: no baseline, any machine",
        "conservative gate --against v1.2 --methods my_method --html gate.html",
        "pytest --benchmark --gate                     run and compare with the baseline; leaves the results for this command",
        "conservative gate                             compare them again",
        'conservative gate --update "Fewer corrections"   accept them, with the reason',
        "conservative gate --json | jq '.verdicts[].violations'",
    ),
)
@click.argument("results", nargs=-1, type=FilePath())
@click.option("--baseline", type=FilePath(), help="The baseline.  [default: benchmarks/baseline.json]")
@click.option("--times", type=click.Choice(["required", "known"]), help=f"{TIMES}  [default: known]")
@click.option(
    "--update", metavar="REASON", help="Accept RESULTS, all runs of one commit, and write the reason into the history."
)
@click.option(
    "--against",
    metavar="REF|FOLDER|WHEEL",
    help="Run two versions of a project in turn, each in its environment, and compare this one with the other.",
)
@click.option("--project", metavar="REF|FOLDER|WHEEL", help="With --against: what is compared with it.  [default: this folder]")
@click.option(
    "--scenes", multiple=True, metavar="A,B", shell_complete=completion.scenes, help="With --against. [default: the suite's]"
)
@click.option("--methods", multiple=True, metavar="A,B", help="With --against. [default: all that are nobody else's engine]")
@click.option(
    "--with", "requirements", multiple=True, metavar="PACKAGE|WHEEL", help="With --against: what both environments have, too."
)
@click.option(
    "--processes", type=click.IntRange(2), metavar="N", help="With --against: processes of each version.  [default: 7]"
)
@find_links_option
@allow_build_option
@click.option("--junit", type=FilePath(), help="With --against: write a report as JUnit has them.")
@click.option("--markdown", type=FilePath(), help="With --against: write verdict and table as Markdown.")
@click.option("--html", type=FilePath(), help="With --against: write a page with rows, ratios and filters.")
@click.option("--json", "as_json", is_flag=True, help="Violations and notes, or the new entry of the history, as JSON.")
@click.pass_context
def gate(context: click.Context, /, as_json: bool, **options: Any) -> None:
    """Compare RESULTS of `pytest --benchmark` with the baseline; by default those of the last run with --gate.

    With --against, compare two versions instead: errors, drifts, orders, counts and times of both, measured now. A row that is
    5 % slower with 99 % confidence is measured again in new processes, and fails if it still is.

    Exits with 1 and a line for each violation, or with 2 where there is nothing to compare with.
    """
    _check(context, options)
    answer = _judge(options) if options["against"] is None else two_versions.compare(_question(options))
    click.echo(answer.json_text() if as_json else answer)
    if not answer.passed:
        raise click.exceptions.Exit(1)


OF_BASELINE = ("results", "baseline", "times", "update")
OF_VERSIONS = (
    "project",
    "scenes",
    "methods",
    "requirements",
    "processes",
    "find_links",
    "allow_build",
    "junit",
    "markdown",
    "html",
)


def _check(context: click.Context, options: dict[str, Any]) -> None:
    """Refuse options of the one comparison together with the other."""
    with_versions = options["against"] is not None
    for name in OF_BASELINE if with_versions else OF_VERSIONS:
        if options[name]:
            parameter = next(each for each in context.command.params if each.name == name)
            said = "cannot be used with --against" if with_versions else "can be used with --against alone"
            raise click.UsageError(f"{parameter.get_error_hint(context)} {said}")


def _judge(options: dict[str, Any]) -> Any:
    from ..tables.gate import accept, compare

    results, baseline, update = (options[name] for name in ("results", "baseline", "update"))
    return compare(results, baseline, options["times"] or "known") if update is None else accept(results, baseline, update)


def _question(options: dict[str, Any]) -> dict[str, Any]:
    names = {name: split_names(name, options[name]) for name in ("scenes", "methods")}
    return {name: options[name] for name in (*OF_VERSIONS, "against")} | names
