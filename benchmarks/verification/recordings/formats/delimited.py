"""Tables of text: CSV, and fields separated by semicolons, tabs or blanks, with or without a header."""

from __future__ import annotations

import re
from functools import partial

from ..names import UNITS
from .table import Start, Table, words


def read(start: Start) -> Table | None:
    """Return the table of a file; None without a row of numbers."""
    lines = start.lines
    first = next((i for i, line in enumerate(lines) if _separate(line) is not None), None)
    if first is None:
        return None
    separator, fields = _separate(lines[first]) or (",", [])
    comma = separator != "," and any(re.fullmatch(r"[-+]?\d+,\d+([eE][-+]?\d+)?", field) for field in fields)
    names, before = list[str](), [line.strip() for line in lines[:first] if line.strip()]
    for line in reversed(before):
        header = words(line.lstrip("#% "), separator)
        if len(header) == len(fields) + (line.lstrip().startswith(("#", "%")) and header[:1] == [""]):
            units = [word.strip("()[] ").lower() for word in header]
            if not names and len(before) > 1 and all(unit in UNITS or len(unit) < 2 for unit in units):
                names = [f" ({unit})" if unit not in ("", "-") else "" for unit in units]  # a line of units below the names
                continue
            names = [word + unit for word, unit in zip(header, names or [""] * len(header), strict=True)]
            break
    names = names or [str(i + 1) for i in range(len(fields))]
    return Table(names, partial(start.separated, names, separator=separator, skip=first, comma=comma))


def _separate(line: str) -> tuple[str | None, list[str]] | None:
    """Return the separator of a row of numbers and its fields; None for another line."""
    if not line.strip() or line.lstrip().startswith(("#", "%")):
        return None
    for separator in (";", "\t", ",", None):
        fields = words(line, separator)
        while fields and fields[-1] == "":
            fields.pop()
        numbers = sum(bool(re.fullmatch(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|nan|NaN", field)) for field in fields)
        if len(fields) > 1 and numbers >= max(2, len(fields) // 2) and (numbers or fields[0][:4].isdigit()):
            return separator, fields
    return None
