"""Say which numbers no measured row supports: `python -m conservative.reports.documentation.audit`, of README.

With folders of reports, of those. The exit code is 1 where there are any.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..evidence.store import Evidence
from . import readme

README = Path(__file__).resolve().parents[3] / "README.md"


def main() -> None:
    """Print what has no support, a line each."""
    parser = argparse.ArgumentParser(prog="python -m conservative.reports.documentation.audit", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, help="of reports [default: README, against the evidence that is kept]")
    parser.parse_args()
    found = readme.audit(README.read_text(encoding="utf-8"), Evidence(), readme.CLAIMS.read_text(encoding="utf-8"))
    print("\n".join(found) or "README.md: every number is supported")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
