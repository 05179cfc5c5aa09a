"""Say which numbers no measured row supports: `python -m conservative.reports.documentation.audit`, of README.

With folders of reports, of those. The exit code is 1 where there are any. `--write` puts README's tables in their places first.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from . import readme, report


def main() -> None:
    """Print what has no support, a line each."""
    parser = argparse.ArgumentParser(prog="python -m conservative.reports.documentation.audit", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, help="of reports [default: README, against the evidence that is kept]")
    parser.add_argument("--write", action="store_true", help="write README's tables anew, as the evidence gives them")
    options = parser.parse_args()
    if options.write:
        readme.write_tables()
    found = [line for folder in options.folders for line in report.audit(folder)] if options.folders else readme.audit_here()
    print("\n".join(found) or "every number is supported")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
