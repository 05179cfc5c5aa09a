"""Reads of outside variables by the code of a function: globals, enclosing functions, imports, and their attributes.

`gains.k` and `import gains` inside of a function are read through modules: the value is the attribute `k` as it is now. The
bytecode is read, because the source of a function is often not available.
"""

from __future__ import annotations

import builtins
import dis
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import takewhile
from types import CodeType, MappingProxyType, ModuleType
from typing import Any, NamedTuple

LOCAL: Any = type("Local", (), {"__repr__": lambda self: "LOCAL"})()
"""A variable of a call, which is not read from outside."""
MISSING: Any = type("Missing", (), {"__repr__": lambda self: "MISSING"})()
"""A name without a value."""
_SKIPPED = frozenset(["RESUME", "NOP", "PUSH_NULL", "EXTENDED_ARG", "PRECALL", "COPY_FREE_VARS", "MAKE_CELL", "NOT_TAKEN"])
"""Instructions that neither read nor write a variable."""
_WHILE_IMPORTING = frozenset(["POP_TOP", "SWAP"])
"""Instructions between an import and the variables that it binds."""
_ATTRIBUTES = frozenset(["LOAD_ATTR", "LOAD_METHOD"])
"""Instructions that read an attribute."""
_TWO = re.compile(r"((?:LOAD|STORE)_FAST(?:_BORROW)?)_((?:LOAD|STORE)_FAST(?:_BORROW)?)")
"""The names of the two instructions in one."""


class Read(NamedTuple):
    """A read of the variable `name`, or of the module `name` if `imported`, and then of `attributes` as long as it is a module.

    `level` is the number of dots of a relative import. If `free`, the name is a variable of an enclosing function.
    """

    name: str
    attributes: tuple[str, ...] = ()
    free: bool = False
    imported: bool = False
    level: int = 0


@dataclass(frozen=True)
class Reads:
    """The `reads` of a code; its variables that are `bound` by imports; variables of enclosing functions that are `written`.

    `writes_global` is True if it writes to a global variable.
    """

    reads: tuple[Read, ...]
    bound: Mapping[str, Read]
    written: frozenset[str]
    writes_global: bool


@lru_cache(maxsize=1024)
def reads_of(code: CodeType) -> Reads:
    """Return the reads of a code, without the functions in it."""
    steps = list(_list_steps(code))
    bound, imports = _list_imports(steps)
    reads, written, writes_global = list(imports), set[str](), False
    for i, (kind, name) in enumerate(steps):
        if kind in ("STORE_GLOBAL", "DELETE_GLOBAL"):
            writes_global = True
        elif kind in ("STORE_DEREF", "DELETE_DEREF") and name in code.co_freevars:
            written.add(name)
        elif kind.startswith("LOAD_"):
            after = tuple(attribute for _, attribute in takewhile(lambda step: step[0] in _ATTRIBUTES, steps[i + 1 :]))
            if ("FAST" in kind or "DEREF" in kind) and name in bound:
                origin = bound[name]
                reads.append(origin._replace(attributes=origin.attributes + after))
            elif kind in ("LOAD_GLOBAL", "LOAD_NAME") or "DICT_OR_GLOBALS" in kind:
                reads.append(Read(name, after))
            elif "DEREF" in kind and name in code.co_freevars:
                reads.append(Read(name, after, free=True))
    return Reads(tuple(dict.fromkeys(reads)), MappingProxyType(bound), frozenset(written), writes_global)


def _list_steps(code: CodeType) -> Iterator[tuple[str, Any]]:
    """Yield names and arguments of instructions. Those that are two in one, such as LOAD_FAST_LOAD_FAST, are divided."""
    for instruction in dis.get_instructions(code):
        if isinstance(instruction.argval, tuple) and (two := _TWO.fullmatch(instruction.opname)):
            yield from zip(two.groups(), instruction.argval, strict=True)
        elif instruction.opname not in _SKIPPED:
            yield instruction.opname, instruction.argval


def _list_imports(steps: list[tuple[str, Any]]) -> tuple[dict[str, Read], list[Read]]:
    """Return the variables that imports bind, and reads of those that are more than modules."""
    bound: dict[str, Read] = {}
    reads: list[Read] = []
    current = item = None
    for i, (kind, argument) in enumerate(steps):
        if kind == "IMPORT_NAME":
            (_, level), (_, names) = steps[i - 2 : i]
            # `import a.b as c` has no names, and reaches b with IMPORT_FROM: `direct`. `import a.b` binds a.
            whole = argument if names or level else argument.partition(".")[0]
            current, item, direct = Read(whole, imported=True, level=level or 0), None, names is None
        elif current is None:
            continue
        elif kind == "IMPORT_FROM":
            item = current._replace(attributes=(*current.attributes, argument))
            current = item if direct else current
        elif kind.startswith("STORE_"):
            bound[argument] = item or current
            if item is not None and not direct:
                reads.append(item)
        elif kind not in _WHILE_IMPORTING:
            current = None
    return bound, reads


def resolve(
    read: Read, known: Mapping[str, Any], cells: Mapping[str, Any], is_library: Callable[[str], bool]
) -> tuple[Any, str]:
    """Return the value of a read in a function with globals `known` and variables `cells`, and its dotted name.

    The value is `LOCAL` for a variable of a call, and `MISSING` without one. Modules that are libraries may make attributes
    when they are read, as they do to import lazily.
    """
    name = read.name
    if read.imported:
        if read.level:
            package = str(known.get("__package__") or known.get("__name__", "")).split(".")
            name = ".".join([*package[: len(package) - read.level + 1], *filter(None, [name])])
        value = sys.modules.get(name, MISSING)
    elif read.free:
        value = cells.get(name, MISSING)
    else:
        value = known.get(name, MISSING)
        value = getattr(builtins, name, MISSING) if value is MISSING else value
    for attribute in read.attributes:
        if not isinstance(value, ModuleType):
            break
        inside = f"{value.__name__}.{attribute}"
        own = vars(value).get(attribute, sys.modules.get(inside, MISSING))
        value = getattr(value, attribute, MISSING) if own is MISSING and is_library(value.__name__) else own
        name = f"{name}.{attribute}"
    return value, name
