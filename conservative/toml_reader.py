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

from .errors import BadInput, nearest
from .files import read_bytes

Key = tuple[str, ...]
Built = TypeVar("Built")

LARGEST = 1_000_000
"""Largest size of a file, bytes. A scene has less than a hundredth of it."""
DEEPEST = 32
"""Most parts of a key, and most tables and arrays in each other. Time and memory of `tomllib` grow with the cube and the
square of the parts of a key: 31 s and 2.4 GB for 20,000."""
_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"?|'[^'\n]*+'?)"""
_TOKENS = re.compile(
    rf"""(?s:\"\"\"(?:[^"\\]|\\.|"(?!""))*+"*|'''(?:[^']|'(?!''))*+'*)"""  # texts of several lines
    rf"|#[^\n]*|(?P<deep>{_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{DEEPEST}}})|{_PART}|[][{{}}\n]"
)
"""Comments, texts, keys, words, brackets and line breaks of TOML. Each match takes a time in proportion to its length."""


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
            raise self.bad(key, _text_of(value), f"{allowed} (numbers, and arrays of them)")
        return value

    def text(self, key: str, allowed: str) -> str:
        """Return a text that is not empty."""
        value = self.value(key, allowed)
        if not isinstance(value, str) or not value:
            raise self.bad(key, _text_of(value), allowed)
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
            raise self.bad(key, _text_of(self.values[key]), f"a table: {allowed}")
        return TomlTable(self.path, (*self.name, key), self.values[key], self.lines)

    def texts(self, key: str, allowed: str) -> dict[str, str]:
        """Return the texts in the table under `key`; none without such a table."""
        if key not in self:
            return {}
        table = self.table(key, allowed)
        return {name: table.text(name, allowed) for name in table.values}

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


def read(path: Path, allowed: str = "a TOML file that can be read; `conservative new` writes one") -> TomlTable:
    """Return the top table of a TOML file. `allowed` says in a message which file is expected.

    Raise `BadFile` if the file cannot be read, is a pipe or a device, is not UTF-8, is larger than `LARGEST`, has tables or
    arrays that are nested more than `DEEPEST` deep, or is not TOML.
    """
    try:
        content = read_bytes(path, LARGEST)
        source = content.decode().replace("\r\n", "\n")
    except OSError as error:
        raise BadFile(path, None, "", error.strerror or str(error), allowed) from None
    except UnicodeDecodeError as error:
        raise BadFile(path, content[: error.start].count(b"\n") + 1, "", "bytes that are not UTF-8", allowed) from None
    except ValueError as error:  # a NUL in the path
        raise BadFile(path, None, "", str(error), allowed) from None
    nested = f"tables and arrays nested at most {DEEPEST} deep"
    if deep := next((token for token in _TOKENS.finditer(source) if token["deep"]), None):
        raise BadFile(path, _line_of(deep), "", f"a key of more than {DEEPEST} parts, {deep['deep'][:40]!r}...", nested)
    try:
        values = tomllib.loads(source)
        is_deep = _is_deep(values)
    except RecursionError:
        is_deep = True
    except ValueError as error:  # more than TOMLDecodeError: numbers of 5,000 digits
        match = re.search(r"line (\d+)", str(error))  # tomllib has the line in its message only
        long = re.search(r"\d[\d_]{4000,}", source)
        line = int(match[1]) if match else _line_of(long) if long else source.rstrip().count("\n") + 1
        raise BadFile(path, line, "", f"a text that is not TOML: {error}", "TOML 1.0") from None
    if is_deep:
        raise BadFile(path, _line_of_deepest(source), "", "arrays or tables in many others", nested)
    return TomlTable(path, (), values, key_lines(source))


def key_lines(source: str) -> dict[Key, int]:
    """Return the line, from 1, of the first occurrence of every key of a valid TOML text. `tomllib` does not report lines."""
    lines: dict[Key, int] = {}
    header: Key = ()
    for start, statement in _statements(source):
        is_header = statement.lstrip().startswith("[")
        keys = list(_paths(tomllib.loads(statement), () if is_header else header))
        if is_header:
            header = keys[-1]
        for key in keys:
            lines.setdefault(key, start)
    return lines


def _line_of(token: re.Match[str]) -> int:
    return token.string.count("\n", 0, token.start()) + 1


def _line_of_deepest(source: str) -> int | None:
    """Return the line in which more than `DEEPEST` brackets are open; None if only parts of keys add up to such a depth."""
    depth = 0
    for token in _TOKENS.finditer(source):
        depth += _opens(token)
        if depth > DEEPEST:
            return _line_of(token)
    return None


def _opens(token: re.Match[str]) -> int:
    """Return 1 for a bracket that opens, -1 for one that closes, and 0 for any other token."""
    return (token[0] in "[{") - (token[0] in "]}")


def _statements(source: str) -> Iterator[tuple[int, str]]:
    """Yield the statements of a valid TOML text, each with its first line.

    A line break in brackets or in a text does not end a statement.
    """
    start, line, begin, depth = 1, 1, 0, 0
    for token in _TOKENS.finditer(source + "\n"):
        line, depth = line + token[0].count("\n"), depth + _opens(token)
        if token[0] == "\n" and depth == 0:
            yield start, source[begin : token.start()]
            start, begin = line, token.end()


def _is_deep(value: object) -> bool:
    """Return whether a value has tables or arrays that are nested more than `DEEPEST` deep."""
    level = [value]
    for _ in range(DEEPEST):
        level = [
            item
            for container in level
            if isinstance(container, list | dict)
            for item in (container.values() if isinstance(container, dict) else container)
            if isinstance(item, list | dict)
        ]
    return bool(level)


def _paths(value: object, prefix: Key) -> Iterator[Key]:
    """Yield the keys of nested tables, outer ones first. The tables of an array count as one."""
    if isinstance(value, list):
        for item in value:
            yield from _paths(item, prefix)
    elif isinstance(value, dict):
        for name, item in value.items():
            yield (*prefix, name)
            yield from _paths(item, (*prefix, name))


def _text_of(value: object) -> str:
    try:
        return repr(value)
    except ValueError:  # Python converts no integers of more than 4,300 digits
        return "an integer of thousands of digits"


def _numeric(value: object) -> bool:
    """Return whether a value is a number or nested lists of numbers. NumPy would also convert texts and booleans."""
    if isinstance(value, list):
        return all(_numeric(item) for item in value)
    if isinstance(value, int) and not isinstance(value, bool):
        return abs(value) < 2**63  # the range of TOML; larger integers may be out of the range of floats
    return isinstance(value, float)
