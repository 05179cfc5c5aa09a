"""Keep what README's numbers follow from: `python -m conservative.reports.documentation.evidence report random`.

The folders are those of README's commands: of a report, and of a study of random bodies. What the audit then says of README is
what has to be written anew: `python -m conservative.reports.documentation.audit`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from .store import keep


def main() -> None:
    """Keep the rows of each folder, and print the files."""
    parser = argparse.ArgumentParser(prog="python -m conservative.reports.documentation.evidence", description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, help="of a report, or of a study of random bodies")
    for folder in parser.parse_args().folders:
        print(keep(folder))


if __name__ == "__main__":
    main()
