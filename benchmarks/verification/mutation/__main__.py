"""What tests notice: `python -m conservative.benchmarks.verification.mutation [NAME ...] [--sample N] [--seed S] [--jobs N]`.

Small faults made by cosmic-ray are planted one at a time in a copy of the tree, and the tests that `mutation.toml` names for
the file are run, with kernels as plain Python. NAME is a room of that table or a file of one; without any, all are tried. Of
each room a random sample is drawn, evenly over all places that can be changed. Printed are the share that is killed, with its
95 % interval, by file and by room, and each survivor with the reason, where one is known. Exit status 1: a room below 90 %.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter
from pathlib import Path

from . import table
from .judges import Judges, Verdict, start_judges
from .mutants import draw_mutants

ROOT = Path(__file__).resolve().parents[3]
GOAL = 0.9
"""Least share of the mutants of a room that tests kill."""


def measure_room(judges: Judges, room: table.Room, files: list[str], count: int, seed: int) -> float:
    """Print what the tests of a room notice, and return the share of killed mutants."""
    mutants, places = draw_mutants(ROOT, files, count, seed)
    print(f"\n{room.name}: {len(mutants)} mutants at {places} places", flush=True)
    verdicts = []
    for verdict in judges.judge_all(ROOT, [(mutant, room.tests_of(mutant.file)) for mutant in mutants]):
        verdicts.append(verdict)
        if verdict.survived:
            print(f"  survived: {verdict.mutant}\n    {table.find_reason(verdict.mutant) or 'no reason known'}", flush=True)
    print_shares(verdicts)
    return share(verdicts)[0]


def print_shares(verdicts: list[Verdict]) -> None:
    """Print what was killed, by file and together."""
    for file in sorted({verdict.mutant.file for verdict in verdicts}):
        of_file = [verdict for verdict in verdicts if verdict.mutant.file == file]
        print(f"  {sum(not each.survived for each in of_file):4} of {len(of_file):4} killed: {file}")
    killed, low, high = share(verdicts)
    reasons = Counter(bool(table.find_reason(each.mutant)) for each in verdicts if each.survived)
    late = sum(each.late for each in verdicts)
    print(f"  killed {killed:.1%} (95 %: {low:.1%} to {high:.1%}), {late} of them by the time limit;", end=" ")
    print(f"survived {reasons[True]} with a reason, {reasons[False]} without", flush=True)


def share(verdicts: list[Verdict]) -> tuple[float, float, float]:
    """Return the share of killed mutants and the ends of its 95 % interval (Wilson 1927)."""
    n, z = max(len(verdicts), 1), 1.96
    p = sum(not verdict.survived for verdict in verdicts) / n
    middle, half = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return p, (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)


def main(arguments: list[str] | None = None) -> int:
    """Run, print, and return the exit status."""
    command = "python -m conservative.benchmarks.verification.mutation"
    parser = argparse.ArgumentParser(prog=command, description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="rooms or files; all if there are none")
    parser.add_argument("--sample", type=int, default=100, help="mutants of each room (100)")
    parser.add_argument("--seed", type=int, default=11, help="of the sample (11)")
    parser.add_argument("--jobs", type=int, default=2, help="mutants judged at once (2)")
    options = parser.parse_args(arguments)
    chosen = table.choose_rooms(options.names, ROOT)
    with start_judges(ROOT, options.jobs) as judges:
        found = {room.name: measure_room(judges, room, files, options.sample, options.seed) for room, files in chosen}
    below = [name for name, killed in found.items() if killed < GOAL]
    print(f"\n{len(found)} rooms, seed {options.seed}: {len(below)} below {GOAL:.0%} {' '.join(below)}")
    return 1 if below else 0


if __name__ == "__main__":
    sys.exit(main())
