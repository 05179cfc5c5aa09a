"""What the formats share: the table that they return, the start of a file, and its lines in parts of bounded size."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from io import TextIOWrapper
from itertools import chain, islice
from pathlib import Path
from typing import IO

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput
from conservative.files import open_file

CHUNK = 50_000
"""Number of rows that are read at a time."""
FIRST = 1000
"""Number of rows of the first part."""
LOOKED = 200
"""Number of lines in which the header and the first row of numbers are searched."""
LONGEST = 1_000_000
"""Largest length of a line, and of the `LOOKED` lines together, characters."""
LONGEST_LIST = 1000
"""Largest length of a list of numbers in a field, characters."""
AT_ONCE = 64 * LONGEST
"""Largest number of characters that are read at a time."""
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?|[nN]a[nN]"
_MARKS = frozenset('"[({')
_GROUP = re.compile(r'"[^"]*"|\[[^\[\]]*\]|\([^()]*\)|\{[^{}]*\}')
_INSIDE: Mapping[str | None, re.Pattern[str]] = {None: re.compile(r"\s+"), **{mark: re.compile(mark) for mark in ";\t,"}}
_BETWEEN = re.compile(r"\s*[,;]\s*|\s+")
_LIST = re.compile(
    rf"(?:[A-Za-z_]\w{{0,19}})?[\[({{]{{0,2}}\s*((?:{_NUMBER})(?:(?:\s*[,;]\s*|\s+)(?:{_NUMBER})){{2,15}})\s*[\])}}]{{0,2}}"
)
_CLOCK = re.compile(r"(\d{1,2}):(\d\d):(\d\d(?:\.\d+)?)")
_DATED = re.compile(r"\d{4}[-/]\d\d[-/]|\d{1,2}:\d\d:|\d{1,2}[ -][A-Za-z]{3}[ -]\d{4}")
_SPOKEN = re.compile(r"(\d{1,2})[ -]([A-Za-z]{3})[ -](\d{4})\s+(\d\d:\d\d:\d\d(?:\.\d+)?)")
_DATE = re.compile(r"(\d{4}[-/]\d\d[-/]\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?)?)\s?(?:Z|UTC|([-+])(\d\d):?(\d\d))?")
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
                lines = _wanted(islice(_each_line(stream), skip, None), comments)
                yield from chunks(islice(lines, FIRST), FIRST, AT_ONCE)  # a small part for those who look at it only
                yield from chunks(lines, CHUNK, AT_ONCE)
        except UNREADABLE as error:
            raise self.fail(error) from None

    def separated(
        self,
        names: Sequence[str],
        wanted: Sequence[str],
        separator: str | None,
        skip: int,
        comma: bool = False,
        lists: bool = False,
    ) -> Iterator[Array]:
        """Yield the numbers in some columns of lines whose fields are separated, by blanks if `separator` is None.

        `comma` is for decimal commas, and `lists` for fields with several numbers.
        """
        numbers = {name: i for i, name in enumerate(names)}
        places, done = [numbers[name] for name in wanted], 0
        for lines in self.parts(skip):
            if lists:
                lines = [(separator or " ").join(chain(*cells(line, separator))) for line in lines]
            if comma:
                lines = [line.replace(",", ".") for line in lines]
            yield _parse(self.path, lines, separator, wanted, places, done)
            done += len(lines)


def words(line: str, separator: str | None) -> list[str]:
    """Return the fields of a line; a separator in quotation marks does not separate."""
    if '"' in line and separator is not None:
        line = re.sub(r'"([^"]*)"', lambda match: match[1].replace(separator, " "), line)
    return [word.strip().strip('"').strip() for word in line.strip("\r\n").split(separator)]


def cells(line: str, separator: str | None) -> list[list[str]]:
    """Return the fields of a line, each as a list: [0.1, 0.2, 0.3], (0.1 0.2 0.3) and "1 0 0 0" are several numbers."""
    if _MARKS.intersection(line):
        line = _GROUP.sub(lambda match: _INSIDE[separator].sub(" " if separator else ",", match[0]), line)
    fields = [field.strip().strip('"').strip() for field in line.strip("\r\n").split(separator)]
    return [list_numbers(field) or [field] for field in fields]


def list_numbers(text: str) -> list[str]:
    """Return the numbers of a text that is a list of three numbers or more; [] for another text."""
    if len(text) > LONGEST_LIST or not (match := _LIST.fullmatch(text)):
        return []
    return _BETWEEN.split(match[1].strip())


def read_date(text: str) -> float:
    """Return a date, as s since 1970, or a time of the day, s. Raises `ValueError` for another text."""
    if match := _CLOCK.fullmatch(text):
        return 3600 * float(match[1]) + 60 * float(match[2]) + float(match[3])
    if match := _SPOKEN.fullmatch(text):  # 29 Nov 2026 12:00:00.000 of GMAT and STK
        month = 1 + ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"].index(match[2].lower())
        text = f"{match[3]}-{month:02d}-{int(match[1]):02d} {match[4]}"
    if not (match := _DATE.fullmatch(text)):
        raise ValueError(f"not a date: {text[:40]!r}")
    seconds = float(np.datetime64(match[1].replace("/", "-").replace(" ", "T"), "ns").astype(np.int64) * 1e-9)
    sign, hours, minutes = match[2] or "+", float(match[3] or 0), float(match[4] or 0)
    return seconds - (3600 * hours + 60 * minutes) * (-1 if sign == "-" else 1)


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
    dates = bool(rows) and len(rows[0]) > places[0] and bool(_DATED.match(rows[0][places[0]]))
    out = np.full((len(rows), len(places)), np.nan)
    for number, row in enumerate(rows):
        for i, place in enumerate(places):
            text = row[place] if place < len(row) else ""
            if not text and separator is not None:
                continue
            try:
                out[number, i] = read_date(text) if dates and i == 0 else float(text)
            except ValueError:
                got = f"{path}, row {done + number + 1}, column {wanted[i]}: {text!r}"
                raise BadInput("run", got, "a number there, or the row removed; decimals with one sign throughout") from None
    return out
