"""What the script `conservative` runs: the command line, or one line that says what to install for it.

Little is imported before the command is supervised: until then, Ctrl-C ends Python as it ends any of its programs.
"""

from __future__ import annotations

import sys

from ..terminal.supervision import supervise


def launch() -> None:
    """Run the command line; exit with 2 where click, which it is made with, is not installed."""
    supervise()
    from conservative.errors import MissingExtra, require_extra

    try:
        require_extra("conservative", "report", "click")
    except MissingExtra as missing:
        print(f"Error: {missing}", file=sys.stderr)
        sys.exit(2)
    from .main import main

    main()
