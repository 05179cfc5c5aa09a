"""`conservative gate`."""

from __future__ import annotations

from pathlib import Path

import click

from .options import FilePath, epilog

TIMES = "known: where the baseline has no times of this machine, compare all but times, and say so; required: fail."


@click.command(
    short_help="Compare benchmarks with a baseline.",
    epilog=epilog(
        "pytest --benchmark --gate                     run and compare; leaves the results where this command finds them",
        "conservative gate                             compare them again",
        'conservative gate --update "Fewer corrections"   accept them, with the reason',
        "conservative gate --json | jq '.verdicts[].violations'",
    ),
)
@click.argument("results", nargs=-1, type=FilePath())
@click.option("--baseline", type=FilePath(), help="The baseline.  [default: benchmarks/baseline.json]")
@click.option("--times", type=click.Choice(["required", "known"]), default="known", show_default=True, help=TIMES)
@click.option(
    "--update", metavar="REASON", help="Accept RESULTS, all runs of one commit, and write the reason into the history."
)
@click.option("--json", "as_json", is_flag=True, help="Violations and notes, or the new entry of the history, as JSON.")
def gate(results: tuple[Path, ...], baseline: Path | None, times: str, update: str | None, as_json: bool) -> None:
    """Compare RESULTS of `pytest --benchmark` with the baseline; by default those of the last run with --gate.

    Exits with 1 and a line for each violation, or with 2 where there is no baseline to compare with.
    """
    from ..tables.gate import accept, compare

    answer = compare(results, baseline, times) if update is None else accept(results, baseline, update)
    click.echo(answer.json_text() if as_json else answer)
    if not answer.passed:
        raise click.exceptions.Exit(1)
