"""Where tests and the plugin leave what the gate and the terminal summary read: keys of pytest's stash."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

REPEAT = pytest.StashKey[Callable[[], float]]()
"""On a test: a function that measures its time ratio again, should the gate ask for it."""
MEASURED = pytest.StashKey[list[dict[str, Any]]]()
"""On the configuration: the rows that pytest-benchmark shows."""
