"""TOML read strictly: every complaint names the file, the line, the key, what was got and what is allowed."""

from __future__ import annotations

import inspect
import re
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from ..errors import BadInput, nearest

Key = tuple[str, ...]
Built = TypeVar("Built")

LARGEST = 1_000_000
"""Bytes of a file that are read at most: a scene has less than a hundredth of it."""
MOST_LINES = 100
"""Lines of one statement: finding its end takes the square of them, seconds at this limit."""


class BadFile(BadInput):
    """A file that cannot be used. Attributes beyond a `BadInput`'s: `path`, and `line` (from 1; None where there is none)."""

    def __init__(self, path: Path, line: int | None, key: str, got: object, allowed: str) -> None:
        self.path, self.line = path, line
        where = str(path) if line is None else f"{path}, line {line}"
        super().__init__(f"{where}: {key}" if key else where, got, allowed)


@dataclass(frozen=True, eq=False)
class Table:
    """A table of a TOML file that knows where each of its keys stands.

    Attributes
    ----------
    path
        The file.
    name
        Key of the table from the top of the file: `()`, `("body",)`.
    values
        What `tomllib` reads in it.
    lines
        Line of every key of the file, counted from 1.
    """

    path: Path
    name: Key
    values: Mapping[str, Any]
    lines: Mapping[Key, int] = field(repr=False)

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def bad(self, key: str, got: object, allowed: str) -> BadFile:
        """Return the complaint about `key` at its line; at that of the table's own header if the table does not have it."""
        line = self.lines.get((*self.name, key)) or self.lines.get(self.name, 1)
        return BadFile(self.path, line, ".".join((*self.name, key)), got, allowed)

    def only(self, known: Collection[str]) -> None:
        """Raise `BadFile` for the first key that is not one of `known`, with the nearest of them."""
        for key in self.values:
            if key not in known:
                raise self.bad(key, f"the unknown key {key!r}", nearest(key, known))

    def value(self, key: str, allowed: str) -> Any:
        """Return what stands under `key`: text, a number, or an array of numbers; `BadFile` if it is missing or neither."""
        if key not in self.values:
            raise self.bad(key, "nothing: the key is missing", allowed)
        found = self.values[key]
        if isinstance(found, list | int) and not isinstance(found, bool) and not _numeric(found):
            raise self.bad(key, repr(found), f"{allowed} (numbers, and arrays of them)")
        return found

    def text(self, key: str, allowed: str) -> str:
        """Return a text that is not empty; `BadFile` otherwise."""
        found = self.value(key, allowed)
        if not isinstance(found, str) or not found:
            raise self.bad(key, repr(found), allowed)
        return found

    def choice(self, key: str, known: Collection[str]) -> str:
        """Return a text that is one of `known`; `BadFile`, with the nearest, otherwise."""
        found = self.text(key, f"one of {', '.join(known)}")
        if found not in known:
            raise self.bad(key, repr(found), nearest(found, known))
        return found

    def table(self, key: str, allowed: str) -> Table:
        """Return the table under `key`; `BadFile` if it is missing or no table."""
        if key not in self.values:
            raise self.bad(key, f"nothing: the table [{key}] is missing", allowed)
        if not isinstance(self.values[key], dict):
            raise self.bad(key, repr(self.values[key]), f"a table: {allowed}")
        return Table(self.path, (*self.name, key), self.values[key], self.lines)

    @contextmanager
    def blame(self, **keys: str) -> Iterator[None]:
        """Turn a `BadInput` about an argument into a `BadFile` about the key of that name, or the one that `keys` says."""
        try:
            yield
        except BadFile:
            raise
        except BadInput as error:
            raise self.bad(keys.get(error.argument, error.argument), error.got, error.allowed) from None

    def call(self, function: Callable[..., Built], **given: Any) -> Built:
        """Return `function` of what is `given` and, under its other parameters' names, of what the table has.

        Parameters without a default are required.
        """
        parameters = {name: p for name, p in inspect.signature(function).parameters.items() if name not in given}
        allowed = f"{function.__name__.strip('_')} takes {', '.join(parameters)}"
        wanted = [name for name, parameter in parameters.items() if parameter.default is parameter.empty or name in self]
        with self.blame():
            return function(**given, **{name: self.value(name, allowed) for name in wanted})


def keys_of(function: Callable[..., object]) -> list[str]:
    """Return the names of a function's parameters: what `Table.call` takes from a table for it."""
    return list(inspect.signature(function).parameters)


def read(path: Path) -> Table:
    """Return the top table of a TOML file.

    Raises
    ------
    BadFile
        The file cannot be read, is not text in UTF-8, is larger than `LARGEST`, has a statement of more than `MOST_LINES`
        lines, or is not TOML.
    """
    allowed = "a TOML file that can be read; `conservative new` writes one"
    try:
        with path.open("rb") as stream:
            content = stream.read(LARGEST + 1)
        source = content.decode().replace("\r\n", "\n")
    except OSError as error:
        raise BadFile(path, None, "", error.strerror or str(error), allowed) from None
    except UnicodeDecodeError as error:
        raise BadFile(path, content[: error.start].count(b"\n") + 1, "", "bytes that are not UTF-8", allowed) from None
    except ValueError as error:  # a NUL in the path
        raise BadFile(path, None, "", str(error), allowed) from None
    if len(content) > LARGEST:
        raise BadFile(path, None, "", f"more than {LARGEST} bytes", allowed)
    try:
        values = tomllib.loads(source)
    except (ValueError, RecursionError) as error:  # more than TOMLDecodeError: numbers of 5,000 digits, arrays 5,000 deep
        found = re.search(r"line (\d+)", str(error))
        line = int(found[1]) if found else source.rstrip().count("\n") + 1
        raise BadFile(path, line, "", f"what is not TOML: {error}", "TOML 1.0") from None
    try:
        return Table(path, (), values, key_lines(source))
    except OverflowError as error:
        raise BadFile(path, error.args[0], "", f"a statement of more than {MOST_LINES} lines", "shorter ones") from None


def key_lines(source: str) -> dict[Key, int]:
    """Return the line, from 1, on which every key of a valid TOML text first stands.

    `tomllib` does not report lines. A TOML file is a sequence of statements, and no proper prefix of a statement is valid TOML,
    so growing the text line by line until it parses finds where each ends. Raise `OverflowError`, with its line, for a
    statement of more than `MOST_LINES` lines.
    """
    lines: dict[Key, int] = {}
    header: Key = ()
    statement, start = "", 1
    for number, line in enumerate(source.split("\n"), start=1):
        statement, start = (statement + "\n" + line, start) if statement else (line, number)
        try:
            found = tomllib.loads(statement)
        except tomllib.TOMLDecodeError:
            if number - start >= MOST_LINES:
                raise OverflowError(start) from None
            continue
        is_header = statement.lstrip().startswith("[")
        keys = list(_paths(found, () if is_header else header))
        if is_header:
            header = keys[-1]
        for key in keys:
            lines.setdefault(key, start)
        statement = ""
    return lines


def _paths(value: object, prefix: Key) -> Iterator[Key]:
    """Yield the key of everything in nested tables, outer ones first; of an array of tables the tables count as one."""
    if isinstance(value, list):
        for item in value:
            yield from _paths(item, prefix)
    elif isinstance(value, dict):
        for name, item in value.items():
            yield (*prefix, name)
            yield from _paths(item, (*prefix, name))


def _numeric(value: object) -> bool:
    """Whether a value is a number, or nested lists hold nothing else. NumPy would make numbers of texts and truths too."""
    if isinstance(value, list):
        return all(_numeric(item) for item in value)
    if isinstance(value, int) and not isinstance(value, bool):
        return abs(value) < 2**63  # what TOML has; Python's go on where a float cannot follow
    return isinstance(value, float)
