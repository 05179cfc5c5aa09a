"""What tests notice: `python -m conservative.benchmarks.verification.mutation [NAME ...] [--sample N] [--seed S] [--jobs N]`.

Small faults made by cosmic-ray are planted one at a time in a copy of the tree, and the tests that `mutation.toml` names for
the file are run, with kernels as plain Python. NAME is a room of that table or a file of one; without any, all are tried. Of
each room a random sample is drawn, evenly over all places that can be changed. A mutant is killed where a test fails, fewer
pass than without it, or they take three times as long. Printed are the share that is killed, with its 95 % interval, by file
and by room, of all mutants and without those listed as equivalent, which nobody can notice, and each survivor with the reason,
where one is known. Exit status 1: in a room fewer than 90 % of those that can be noticed are killed.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from . import table
from .judges import Judges, Verdict, start_judges
from .mutants import draw_mutants

ROOT = Path(__file__).resolve().parents[3]
GOAL = 0.9
"""Least share of the mutants of a room that tests kill."""


def measure_room(judges: Judges, room: table.Room, files: list[str], count: int, seed: int) -> tuple[float, float]:
    """Print what the tests of a room notice, and return the share of killed mutants: of all, and of those to be noticed."""
    mutants, places = draw_mutants(ROOT, files, count, seed)
    print(f"\n{room.name}: {len(mutants)} mutants at {places} places", flush=True)
    verdicts = []
    for verdict in judges.judge_all(ROOT, [(mutant, room.tests_of(mutant.file)) for mutant in mutants]):
        verdicts.append(verdict)
        if verdict.survived:
            print(f"  survived: {verdict.mutant}\n    {table.find_reason(verdict.mutant) or 'no reason known'}", flush=True)
    print_shares(verdicts)
    return share(verdicts)[0], share(noticeable(verdicts))[0]


def print_shares(verdicts: list[Verdict]) -> None:
    """Print what was killed, by file and together."""
    for file in sorted({verdict.mutant.file for verdict in verdicts}):
        of_file = [verdict for verdict in verdicts if verdict.mutant.file == file]
        print(f"  {sum(not each.survived for each in of_file):4} of {len(of_file):4} killed: {file}")
    print(f"  {describe(verdicts)}, {sum(each.late for each in verdicts)} of them by the time limit")
    print(f"  without equivalents {describe(noticeable(verdicts))}", flush=True)


def noticeable(verdicts: list[Verdict]) -> list[Verdict]:
    """Return those of mutants that somebody could notice: not of survivors that are listed as equivalent."""
    return [verdict for verdict in verdicts if not (verdict.survived and table.find_reason(verdict.mutant))]


def describe(verdicts: list[Verdict]) -> str:
    """Return how many were killed, their share and its interval."""
    killed, low, high = share(verdicts)
    number = sum(not each.survived for each in verdicts)
    return f"killed {number} of {len(verdicts)}: {killed:.1%} (95 %: {low:.1%} to {high:.1%})"


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
    below = [name for name, (_, killed) in found.items() if killed < GOAL]
    shares = ", ".join(f"{name} {every:.1%} ({killed:.1%} without equivalents)" for name, (every, killed) in found.items())
    print(f"\nkilled, seed {options.seed}: {shares}; {len(below)} of {len(found)} rooms below {GOAL:.0%}")
    return 1 if below else 0


if __name__ == "__main__":
    sys.exit(main())
