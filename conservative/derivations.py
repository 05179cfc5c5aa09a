"""What is derived from a value that never changes, kept as long as the value is. Source: our own."""

from __future__ import annotations

import threading
from collections.abc import Hashable
from typing import Any

MOST = 64
"""Entries kept at most; the oldest goes first."""


class Derivations(threading.local):
    """A bounded store, one for each thread: what it keeps may have buffers that two runs at a time must not share.

    A pickle or a deep copy of it is empty.
    """

    def __init__(self) -> None:
        self.entries: dict[tuple[Hashable, ...], Any] = {}

    def add(self, key: tuple[Hashable, ...], value: Any) -> None:
        """Keep a value."""
        if len(self.entries) >= MOST:
            del self.entries[next(iter(self.entries))]
        self.entries[key] = value

    def __reduce__(self) -> tuple[type[Derivations], tuple[()]]:
        return Derivations, ()
