"""What the script `conservative` runs: the command line, or one line that says what to install for it."""

from __future__ import annotations

import sys

from conservative.errors import MissingExtra, require_extra


def launch() -> None:
    """Run the command line; exit with 2 where click, which it is made with, is not installed."""
    try:
        require_extra("conservative", "report", "click")
    except MissingExtra as missing:
        print(f"Error: {missing}", file=sys.stderr)
        sys.exit(2)
    from .main import main

    main()
