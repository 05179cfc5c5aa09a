"""Tables of text: CSV, and fields separated by semicolons, tabs or blanks, with or without a header."""

from __future__ import annotations

import re
from functools import partial

from ..names import UNITS
from .table import Start, Table, cells, words

_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?|nan|NaN")


def read(start: Start) -> Table | None:
    """Return the table of a file; None without a row of numbers."""
    lines = [line for line in start.lines if line.strip()]
    rows = [_separate(line) is not None for line in lines]
    # A row of numbers behind which text follows belongs to the header, such as numbers of bodies.
    first = next((i for i, row in enumerate(rows) if row and all(rows[i + 1 : i + 2])), None)
    first = next((i for i, row in enumerate(rows) if row), None) if first is None else first
    if first is None:
        return None
    separator, fields = _separate(lines[first]) or (",", [])
    flat = [number for field in fields for number in field]
    comma = separator != "," and any(re.fullmatch(r"[-+]?\d+,\d+([eE][-+]?\d+)?", field) for field in flat)
    names = _unique(_names([line.strip() for line in lines[:first]], separator, fields))
    skip = start.lines.index(lines[first])
    return Table(
        names, partial(start.separated, names, separator=separator, skip=skip, comma=comma, lists=len(flat) > len(fields))
    )


def _names(before: list[str], separator: str | None, fields: list[list[str]]) -> list[str]:
    """Return the names of columns in the lines of a header: of the last one, below which units may be, with those above it."""
    units, names = list[str](), list[str]()
    for line in reversed(before):
        header = words(line.lstrip("#% "), separator)
        if len(header) != len(fields) + (line.startswith(("#", "%")) and header[:1] == [""]):
            continue
        below = [word.strip("()[] ").lower() for word in header]
        if not names and not units and len(before) > 1 and all(unit in UNITS or len(unit) < 2 for unit in below):
            units = [f" ({unit})" if unit not in ("", "-") else "" for unit in below]  # a line of units below the names
        elif not names:
            names = header
        elif len(set(filter(None, names))) < len(list(filter(None, names))) and not line.startswith(("#", "%")):
            names = [f"{above} {name}".strip() for above, name in zip(_filled(header), names, strict=True)]
        else:
            break
    if not names:
        return [str(i + 1) for i in range(sum(map(len, fields)))]
    out = list[str]()
    for name, unit, field in zip(names, units or [""] * len(names), fields, strict=False):
        out += [f"{name}.{i}{unit}" for i in range(len(field))] if len(field) > 1 else [name + unit]
    return out


def _filled(header: list[str]) -> list[str]:
    """Return a line of a header whose empty fields continue the one before."""
    out, last = list[str](), ""
    for word in header:
        last = word or last
        out.append(last)
    return out


def _unique(names: list[str]) -> list[str]:
    """Return names of which those that were there before have the number of their column."""
    known, out = set[str](), list[str]()
    for i, name in enumerate(names):
        out.append(f"{name} #{i + 1}" if name in known else name)
        known.add(name)
    return out


def _separate(line: str) -> tuple[str | None, list[list[str]]] | None:
    """Return the separator of a row of numbers and its fields, each as a list of texts; None for another line."""
    if not line.strip() or line.lstrip().startswith(("#", "%")):
        return None
    for separator in (";", "\t", ",", None):
        fields = cells(line, separator)
        while fields and fields[-1] == [""]:
            fields.pop()
        flat = [text for field in fields for text in field]
        numbers = sum(bool(_NUMBER.fullmatch(text)) for text in flat)
        if len(fields) > 1 and numbers >= max(2, len(flat) // 2):
            return separator, fields
    return None
