"""Kills at any moment: `python -m conservative.benchmarks.verification.kills --count 100`.

A small report is killed at random moments, by SIGKILL or SIGTERM, and resumed each time until it is whole; then another one
begins. Each has the rows of one that was left alone, apart from times; beside it nothing is left.
"""

from __future__ import annotations

import csv
import json
import random
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from .processes import Ended, Started, read_options, temporaries

REPORT = ("report", "--quick", "--scenes", "brick_flip", "--methods", "moser_veselov:order=2")
TIMES = ("s", "s/s")
"""Units of what differs from one run to the next."""
SAME = ("study", "scene", "method", "label", "role", "dt", "quantity", "measure", "unit", "outcome")
"""What even a row with a time has the same."""
SIGNALS = (signal.SIGKILL, signal.SIGTERM)


class Kill(NamedTuple):
    """A signal, the moment it was sent, s, and what was wrong then, or with the report that was whole before it came."""

    number: signal.Signals | None
    moment: float
    complaints: Sequence[str]

    def __str__(self) -> str:
        what = self.number.name if self.number else "whole"
        return f"{what} after {self.moment:.3f} s: {'; '.join(self.complaints) or 'ok'}"


def kills(count: int, seed: int, report: Sequence[str] = REPORT) -> Iterator[Kill]:
    """Yield so many kills, and between them the reports that became whole; the last one does, or ends it by being wrong."""
    draw = random.Random(seed)
    with tempfile.TemporaryDirectory() as place:
        expected, span = undisturbed(Path(place) / "alone", report)
        folder, done = Path(place) / "killed", 0
        folder.mkdir()
        while True:
            number, moment, resume = draw.choice(SIGNALS), draw.uniform(0, 1.2 * span), _resume(folder)
            started, start = Started([*report, *resume], folder), time.monotonic()
            if done == count or started.ended_within(moment):
                complaints = list(_wrong_whole(started.end(), folder, expected))
                if not resume:  # the first report may have compiled code, and takes longer
                    span = min(span, time.monotonic() - start)
                yield Kill(None, moment, complaints)
                if done == count or complaints:  # what is wrong once would be for ever
                    return
            else:
                done += 1
                started.process.send_signal(number)
                yield Kill(number, moment, list(_wrong_killed(started.end(), number, folder)))


def undisturbed(folder: Path, report: Sequence[str]) -> tuple[list[tuple[str, ...]], float]:
    """Return the rows of a report that is left alone, and the time it takes, s."""
    folder.mkdir()
    start = time.monotonic()
    ended = Started(report, folder).end()
    if ended.code:
        raise RuntimeError(f"a report that was left alone failed: {ended.err}")
    return rows(folder), time.monotonic() - start


def rows(folder: Path) -> list[tuple[str, ...]]:
    """Return the rows of a report, without times."""
    with (folder / "report" / "measurements.csv").open(encoding="utf-8", newline="") as stream:
        found = list(csv.DictReader(stream))
    return [tuple(row[name] for name in (*SAME, *_values(row))) for row in found]


def _values(row: Mapping[str, str]) -> list[str]:
    """Return the columns in which a row is the same again, beside `SAME`: none of a row with a time."""
    return [] if row["unit"] in TIMES else [name for name in row if name not in SAME]


def _resume(folder: Path) -> list[str]:
    return ["--resume"] if (folder / "report.partial.json").exists() else []


def _wrong_killed(ended: Ended, number: signal.Signals, folder: Path) -> Iterator[str]:
    """Yield what is wrong after a kill, in words; SIGKILL may leave temporary files until the next report."""
    if ended.orphans:
        yield "processes went on"
    if number == signal.SIGTERM and temporaries(folder):
        yield f"left {', '.join(temporaries(folder))}"
    if "Traceback" in ended.err and "supervis" in ended.err:
        yield f"said {ended.err!r}"
    kept = folder / "report.partial.json"
    if kept.exists():
        json.loads(kept.read_text(encoding="utf-8"))


def _wrong_whole(ended: Ended, folder: Path, expected: Sequence[tuple[str, ...]]) -> Iterator[str]:
    """Yield what is wrong with a report that came to its end, in words."""
    if ended.code:
        yield f"exit code {ended.code}: {ended.err!r}"
        return
    if rows(folder) != list(expected):
        yield "other rows"
    if names := sorted(path.name for path in folder.iterdir() if path.name != "report"):
        yield f"left {', '.join(names)}"
    listed = json.loads((folder / "report" / "measurements.json").read_text(encoding="utf-8"))["files"]
    if sorted(path.name for path in (folder / "report").iterdir()) != sorted(listed):
        yield "other files in the folder than it lists"


def main() -> None:
    """Print a line for each kill and each report, and one with the counts; exit with 1 where something was lost."""
    options = read_options("kills", __doc__)
    found = []
    for each in kills(options.count, options.seed):
        found.append(each)
        print(each, flush=True)
    killed, wrong = sum(each.number is not None for each in found), sum(bool(each.complaints) for each in found)
    print(f"{killed} kills of {options.count}, {len(found) - killed} whole reports, equal but for times: {wrong} complaints")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
