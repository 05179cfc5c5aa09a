"""An engine's process killed in the middle of a report, while it computes.

    conservative engines install exudyn
    python -m conservative.benchmarks.verification.report_kills --method exudyn:RK44 --count 30

Every report comes to its end. At most one row is marked; what is missing beside it is what that row would have given.
"""

from __future__ import annotations

import random
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import click
import psutil

from conservative.references.environments import worker

from .kills import REPORT as REPORT_LEFT_ALONE
from .kills import SAME, rows, undisturbed
from .processes import Started

REPORT = ("report", "--quick", "--scenes", "brick_flip:t_end=1", "--methods")
BESIDE = REPORT_LEFT_ALONE[-1]
"""A method of ours, whose rows have to be the same."""

Row = tuple[str, ...]


def attack(method: str, count: int, seed: int) -> Iterator[tuple[bool, list[str]]]:
    """Yield, of each report in which a process was killed, whether a row is marked, and what is wrong."""
    draw, report = random.Random(seed), (*REPORT, f"{method},{BESIDE}")
    with tempfile.TemporaryDirectory() as place:
        undisturbed(Path(place) / "first", report)  # which may compile
        expected, span = undisturbed(Path(place) / "alone", report)
        for number in range(count):
            folder = Path(place) / str(number)
            folder.mkdir()
            yield run_and_kill(report, folder, expected, draw.uniform(0, span))


def run_and_kill(report: Sequence[str], folder: Path, expected: list[Row], moment: float) -> tuple[bool, list[str]]:
    """Return whether a row is marked in a report whose engine was killed after a moment, s, and what is wrong with it."""
    started = Started(report, folder)
    killed = False
    if not started.ended_within(moment):
        killed = kill_engine(started)
    ended = started.end()
    if ended.code:
        return False, [f"exit code {ended.code}: {ended.err.strip()[-300:]!r}"]
    found = rows(folder)
    return killed and found != expected, list(compare(expected, found))


def kill_engine(started: Started, patience: float = 30.0) -> bool:
    """Kill an engine's process that a command has started, as soon as one computes; return whether one did."""
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline and started.process.poll() is None:
        if any(_kill_if_busy(process) for process in psutil.Process(started.process.pid).children(recursive=True)):
            return True
        time.sleep(0.001)
    return False


def _kill_if_busy(process: psutil.Process) -> bool:
    try:
        busy = process.status() == psutil.STATUS_RUNNING and worker.__file__ in process.cmdline()
        if busy:
            process.send_signal(signal.SIGKILL)
    except psutil.Error:  # it has just ended
        return False
    return busy


def compare(expected: list[Row], found: list[Row]) -> Iterator[str]:
    """Yield what is wrong with the rows of a report in which an engine was killed, beside one that was left alone."""
    more, fewer = (
        list((Counter(first) - Counter(second)).elements()) for first, second in ((found, expected), (expected, found))
    )
    runs = {_run(row) for row in more if "crashed" in row}
    if len(runs) > 1:
        yield f"{len(runs)} runs are marked: {sorted(runs)}"
    if fewer and not runs:
        yield f"{len(fewer)} rows are missing, and none is marked"
    engines = {(study, label) for study, label, _ in runs}
    yield from (f"another row is missing: {row}" for row in fewer if runs and _run(row)[:2] not in engines)
    yield from (f"an unknown row: {row}" for row in more if _run(row)[:2] not in engines)


def _run(row: Row) -> tuple[str, str, str]:
    """Return what a row is of: study, label, step."""
    return row[SAME.index("study")], row[SAME.index("label")], row[SAME.index("dt")]


@click.command()
@click.option("--method", default="exudyn:RK44", help="An engine in an environment.")
@click.option("--count", default=30, help="Reports.")
@click.option("--seed", default=0)
def main(method: str, count: int, seed: int) -> None:
    """Kill the engine once in each report, at a random moment; exit with 1 where more than its row was lost."""
    marked = wrong = 0
    for number, (is_marked, complaints) in enumerate(attack(method, count, seed), start=1):
        marked, wrong = marked + is_marked, wrong + bool(complaints)
        click.echo(f"report {number}: {'; '.join(complaints) or ('a row marked' if is_marked else 'nothing lost')}")
    click.echo(f"{count} reports, {marked} with a row marked, {wrong} that lost more")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
