"""Strict reading of TOML: every error contains file, line, key, value and the valid values."""

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
"""Largest size of a file, bytes. A scene has less than a hundredth of it."""
MOST_LINES = 100
"""Most lines of one statement. Finding its end takes a time that grows with their square: seconds at this limit."""


class BadFile(BadInput):
    """An invalid file: a `BadInput` with the attributes `path` and `line` (from 1, or None)."""

    def __init__(self, path: Path, line: int | None, key: str, got: object, allowed: str) -> None:
        self.path, self.line = path, line
        where = str(path) if line is None else f"{path}, line {line}"
        super().__init__(f"{where}: {key}" if key else where, got, allowed)


@dataclass(frozen=True, eq=False)
class TomlTable:
    """A table of a TOML file and the lines of its keys.

    Attributes
    ----------
    path
        The file.
    name
        Key of the table from the top of the file: `()`, `("body",)`.
    values
        Contents of the table.
    lines
        Line of every key of the file, from 1.
    """

    path: Path
    name: Key
    values: Mapping[str, Any]
    lines: Mapping[Key, int] = field(repr=False)

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def bad(self, key: str, got: object, allowed: str) -> BadFile:
        """Return the error for `key`, at its line or, if the key is missing, at the line of the table's header."""
        line = self.lines.get((*self.name, key)) or self.lines.get(self.name, 1)
        return BadFile(self.path, line, ".".join((*self.name, key)), got, allowed)

    def only(self, known: Collection[str]) -> None:
        """Raise `BadFile` for the first key that is not one of `known`."""
        for key in self.values:
            if key not in known:
                raise self.bad(key, f"the unknown key {key!r}", nearest(key, known))

    def value(self, key: str, allowed: str) -> Any:
        """Return the value of `key`. Raise `BadFile` if it is missing, or an array of anything but numbers."""
        if key not in self.values:
            raise self.bad(key, "nothing: the key is missing", allowed)
        value = self.values[key]
        if isinstance(value, list | int) and not isinstance(value, bool) and not _numeric(value):
            raise self.bad(key, repr(value), f"{allowed} (numbers, and arrays of them)")
        return value

    def text(self, key: str, allowed: str) -> str:
        """Return a text that is not empty."""
        value = self.value(key, allowed)
        if not isinstance(value, str) or not value:
            raise self.bad(key, repr(value), allowed)
        return value

    def choice(self, key: str, known: Collection[str]) -> str:
        """Return a text that is one of `known`."""
        value = self.text(key, f"one of {', '.join(known)}")
        if value not in known:
            raise self.bad(key, repr(value), nearest(value, known))
        return value

    def table(self, key: str, allowed: str) -> TomlTable:
        """Return the table under `key`."""
        if key not in self.values:
            raise self.bad(key, f"nothing: the table [{key}] is missing", allowed)
        if not isinstance(self.values[key], dict):
            raise self.bad(key, repr(self.values[key]), f"a table: {allowed}")
        return TomlTable(self.path, (*self.name, key), self.values[key], self.lines)

    @contextmanager
    def blame(self, **keys: str) -> Iterator[None]:
        """Turn a `BadInput` for an argument into a `BadFile` for the key of that name, or that `keys` maps it to."""
        try:
            yield
        except BadFile:
            raise
        except BadInput as error:
            raise self.bad(keys.get(error.argument, error.argument), error.got, error.allowed) from None

    def call(self, function: Callable[..., Built], **given: Any) -> Built:
        """Call `function` with the `given` arguments and, for its other parameters, with the values of the table.

        Keys of parameters without a default are required.
        """
        parameters = {name: p for name, p in inspect.signature(function).parameters.items() if name not in given}
        allowed = f"{function.__name__.strip('_')} takes {', '.join(parameters)}"
        wanted = [name for name, parameter in parameters.items() if parameter.default is parameter.empty or name in self]
        with self.blame():
            return function(**given, **{name: self.value(name, allowed) for name in wanted})


def keys_of(function: Callable[..., object]) -> list[str]:
    """Return the names of a function's parameters: the keys that `TomlTable.call` reads."""
    return list(inspect.signature(function).parameters)


def read(path: Path) -> TomlTable:
    """Return the top table of a TOML file.

    Raise `BadFile` if the file cannot be read, is not UTF-8, is larger than `LARGEST`, has a statement of more than
    `MOST_LINES` lines, or is not TOML.
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
        match = re.search(r"line (\d+)", str(error))  # tomllib has the line in its message only
        line = int(match[1]) if match else source.rstrip().count("\n") + 1
        raise BadFile(path, line, "", f"a text that is not TOML: {error}", "TOML 1.0") from None
    try:
        return TomlTable(path, (), values, key_lines(source))
    except OverflowError as error:
        raise BadFile(path, error.args[0], "", f"a statement of more than {MOST_LINES} lines", "shorter statements") from None


def key_lines(source: str) -> dict[Key, int]:
    """Return the line, from 1, of the first occurrence of every key of a valid TOML text.

    `tomllib` does not report lines. A TOML file is a sequence of statements, and no proper prefix of a statement is valid TOML.
    A statement therefore ends at the first line up to which it parses. Raise `OverflowError` with the line of a statement that
    has more than `MOST_LINES` lines.
    """
    lines: dict[Key, int] = {}
    header: Key = ()
    statement, start = "", 1
    for number, line in enumerate(source.split("\n"), start=1):
        statement, start = (statement + "\n" + line, start) if statement else (line, number)
        try:
            parsed = tomllib.loads(statement)
        except tomllib.TOMLDecodeError:
            if number - start >= MOST_LINES:
                raise OverflowError(start) from None
            continue
        is_header = statement.lstrip().startswith("[")
        keys = list(_paths(parsed, () if is_header else header))
        if is_header:
            header = keys[-1]
        for key in keys:
            lines.setdefault(key, start)
        statement = ""
    return lines


def _paths(value: object, prefix: Key) -> Iterator[Key]:
    """Yield the keys of nested tables, outer ones first. The tables of an array count as one."""
    if isinstance(value, list):
        for item in value:
            yield from _paths(item, prefix)
    elif isinstance(value, dict):
        for name, item in value.items():
            yield (*prefix, name)
            yield from _paths(item, (*prefix, name))


def _numeric(value: object) -> bool:
    """Return whether a value is a number or nested lists of numbers. NumPy would also convert texts and booleans."""
    if isinstance(value, list):
        return all(_numeric(item) for item in value)
    if isinstance(value, int) and not isinstance(value, bool):
        return abs(value) < 2**63  # the range of TOML; larger integers may be out of the range of floats
    return isinstance(value, float)
