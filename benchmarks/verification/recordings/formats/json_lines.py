"""JSON lines: one object for each row, whose nested names are joined by points."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from conservative.attitude import Array

from .table import UNREADABLE, Start, Table, list_numbers, read_date

ENDINGS = ".jsonl", ".ndjson", ".json"


def read(start: Start) -> Table | None:
    """Return the table of a file; None for another ending."""
    if start.ending not in ENDINGS:
        return None
    try:
        names = list(_flat(json.loads(start.lines[0])))
    except (ValueError, IndexError, AttributeError, TypeError, RecursionError):
        raise start.fail("its first line is not a JSON object") from None
    return Table(names, partial(_rows, start))


def _rows(start: Start, wanted: Sequence[str]) -> Iterator[Array]:
    for lines in start.parts(comments=False):
        records = [_record(start, line) for line in lines]
        yield np.array([[_number(record.get(name)) for name in wanted] for record in records]).reshape(-1, len(wanted))


def _record(start: Start, line: str) -> dict[str, Any]:
    try:
        return _flat(json.loads(line))
    except AttributeError:
        raise start.fail(f"not a JSON object: {line[:40].strip()!r}") from None
    except UNREADABLE as error:
        raise start.fail(error) from None


def _flat(record: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Return the values of a JSON object by name. A nested value has a name such as angular_velocity.x, or q.0 in a list."""
    out: dict[str, Any] = {}
    for name, value in record.items():
        if isinstance(value, str) and (numbers := list_numbers(value)):
            value = numbers
        parts = dict(enumerate(value)) if isinstance(value, list) else value if isinstance(value, dict) else None
        out |= {f"{before}{name}": value} if parts is None else _flat({str(k): v for k, v in parts.items()}, f"{before}{name}.")
    return out


def _number(value: Any) -> float:
    """Return a value as a number: NaN for a gap, whose row is left out, and infinity for other values, which are refused."""
    try:
        if isinstance(value, str) and (":" in value or value.count("-") == 2):
            return read_date(value)
        return math.nan if value is None else math.inf if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        return math.inf
