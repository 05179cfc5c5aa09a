"""Versions of engines: their order, and which to name instead of one that does not exist."""

from __future__ import annotations

import re

Key = tuple[tuple[int, int, str], ...]


def version_key(version: str) -> Key:
    """Return what sorts versions: numbers by value, and 4.0.0rc1 before 4.0.0."""
    parts = re.findall(r"\d+|[a-z]+", version.lower().partition("+")[0])
    keys = [(1, int(part), "") if part.isdigit() else (2 if part == "post" else -1, 0, part) for part in parts]
    return (*keys, (0, 0, ""))


def describe_versions(version: str, known: list[str]) -> str:
    """Return what to say is allowed instead of a version that does not exist: the nearest one first."""
    if not known:
        return "a version that exists"
    newest = sorted(known, key=version_key, reverse=True)
    nearest = next((each for each in newest if version_key(each) <= version_key(version)), newest[-1])
    return f"{nearest} (nearest), or one of {', '.join(newest)}"
