"""Verify planted files in two processes: `python -m tests.attack.planted results.jsonl 0 1000 [--page] [--processes 2]`.

An interrupted run goes on where it was. Complaints are printed, then the tables; `--page` puts them into the page.
"""

import argparse
from pathlib import Path

from .run import run_all
from .tables import PAGE, tables, write_page


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(prog="python -m tests.attack.planted", description=__doc__)
    parser.add_argument("results", type=Path, help="JSON lines, one for each file")
    parser.add_argument("first", type=int)
    parser.add_argument("end", type=int)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--page", action="store_true", help="write the tables into the page")
    given = parser.parse_args()
    rows = run_all(given.results, range(given.first, given.end), given.processes)
    print(tables(rows))
    if given.page:
        write_page(PAGE, rows)


if __name__ == "__main__":
    main()
