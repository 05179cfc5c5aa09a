"""What the formats share: the table that they return, the start of a file, and its lines in parts of bounded size."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from io import TextIOWrapper
from itertools import islice
from pathlib import Path
from typing import IO

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput
from conservative.files import open_file

CHUNK = 50_000
"""Number of rows that are read at a time."""
LOOKED = 200
"""Number of lines in which the header and the first row of numbers are searched."""
LONGEST = 1_000_000
"""Largest length of a line, and of the `LOOKED` lines together, characters."""
AT_ONCE = 64 * LONGEST
"""Largest number of characters that are read at a time."""
UNREADABLE = OSError, ValueError, TypeError, RecursionError
"""Errors of files that cannot be read, and of values such as JSON in a thousand brackets."""


@dataclass(frozen=True)
class Table:
    """The table of a file: names of columns, and a function from some of these names to chunks of rows (n, columns).

    The function raises `BadInput` for text in the place of a number; empty fields are nan.
    """

    names: list[str]
    rows: Callable[[Sequence[str]], Iterator[Array]]


@dataclass(frozen=True)
class Start:
    """The start of a file, from which its format is recognised. `formats` are the names of all formats."""

    path: Path
    formats: str

    @property
    def ending(self) -> str:
        """The ending of the name, lower case."""
        return self.path.suffix.lower()

    @cached_property
    def head(self) -> bytes:
        """The first bytes."""
        try:
            with open_file(self.path) as stream:
                return stream.read(32)
        except UNREADABLE as error:
            raise self.fail(error) from None

    @cached_property
    def lines(self) -> list[str]:
        """The first lines."""
        try:
            with self.open() as stream:
                return next(chunks(_each_line(stream), LOOKED, LONGEST), [])
        except UNREADABLE as error:
            raise self.fail(error) from None

    def open(self) -> IO[str]:
        """Open the file as text."""
        return TextIOWrapper(open_file(self.path), encoding="utf-8-sig", errors="replace")

    def fail(self, reason: object) -> BadInput:
        """Return the error of a file without a table."""
        text = (str(reason).strip().splitlines() or ["empty"])[0]
        return BadInput("run", f"{self.path} ({text})", f"a table: {self.formats}")

    def parts(self, skip: int = 0, comments: bool = True) -> Iterator[list[str]]:
        """Yield the lines behind the first ones, in parts; without empty lines and comments."""
        try:
            with self.open() as stream:
                yield from chunks(_wanted(islice(_each_line(stream), skip, None), comments), CHUNK, AT_ONCE)
        except UNREADABLE as error:
            raise self.fail(error) from None

    def separated(
        self,
        names: Sequence[str],
        wanted: Sequence[str],
        separator: str | None,
        skip: int,
        comma: bool = False,
    ) -> Iterator[Array]:
        """Yield the numbers in some columns of lines whose fields are separated, by blanks if `separator` is None."""
        places, done = [names.index(name) for name in wanted], 0
        for lines in self.parts(skip):
            yield _parse(
                self.path, [line.replace(",", ".") for line in lines] if comma else lines, separator, wanted, places, done
            )
            done += len(lines)


def words(line: str, separator: str | None) -> list[str]:
    """Return the fields of a line; a separator in quotation marks does not separate."""
    if '"' in line and separator is not None:
        line = re.sub(r'"([^"]*)"', lambda match: match[1].replace(separator, " "), line)
    return [word.strip().strip('"').strip() for word in line.strip("\r\n").split(separator)]


def _each_line(stream: IO[str]) -> Iterator[str]:
    number = 0
    while line := stream.readline(LONGEST + 1):
        number += 1
        if len(line) > LONGEST:
            raise ValueError(f"line {number} has more than {LONGEST} characters")
        yield line


def _wanted(lines: Iterable[str], comments: bool) -> Iterator[str]:
    for line in lines:
        if line.strip() and not (comments and line.lstrip().startswith(("#", "%"))):
            yield line


def chunks(lines: Iterable[str], count: int, size: int) -> Iterator[list[str]]:
    """Yield lists of lines: of a number of lines at most, and up to the line that exceeds a number of characters."""
    chunk, length = list[str](), 0
    for line in lines:
        chunk.append(line)
        length += len(line)
        if len(chunk) == count or length > size:
            yield chunk
            chunk, length = [], 0
    if chunk:
        yield chunk


def _parse(path: Path, lines: list[str], separator: str | None, wanted: Sequence[str], places: list[int], done: int) -> Array:
    """Return the numbers in lines, nan for empty fields; name the row and the column that has another text."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return np.loadtxt(lines, delimiter=separator, usecols=places, ndmin=2, quotechar='"', comments=None)
    except ValueError:
        rows = [words(line, separator) for line in lines]
    dates = bool(rows) and len(rows[0]) > places[0] and bool(re.match(r"\d{4}-\d\d-\d\d", rows[0][places[0]]))
    out = np.full((len(rows), len(places)), np.nan)
    for number, row in enumerate(rows):
        for i, place in enumerate(places):
            text = row[place] if place < len(row) else ""
            if not text and separator is not None:
                continue
            try:
                out[number, i] = (
                    np.datetime64(text.rstrip("Z"), "ns").astype(np.int64) * 1e-9 if dates and i == 0 else float(text)
                )
            except ValueError:
                got = f"{path}, row {done + number + 1}, column {wanted[i]}: {text!r}"
                raise BadInput("run", got, "a number there, or the row removed; decimals with one sign throughout") from None
    return out
