"""When two values are the same: a digest of all that their behaviour depends on, the same in every process.

A value is followed by its parts. Functions of Python are their code and all that the code reads: globals, attributes of
modules, closures and defaults (`conservative.code_reads`). Objects are their class, their attributes, and the parts that pickle
would store, which covers objects of C such as bound methods. Libraries whose functions depend on their arguments only (`PURE`)
are followed by name. Frozen dataclasses of this package are their fields, without those declared with `NOT_OF_MOTION`.

One rule covers everything else: a value of which any part cannot be followed equals itself only, and nothing is cached by it.
Examples are open files, generators, random numbers, environment variables, pointers, modules that are passed on, functions that
write to variables outside of themselves, and code that keeps earlier values of what it reads (numba, `lru_cache`).
"""

from __future__ import annotations

import builtins
import copy
import hashlib
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, cached_property
from types import CodeType, FunctionType, GetSetDescriptorType, MappingProxyType, MemberDescriptorType, MethodType, ModuleType
from typing import Any
from uuid import uuid4

import numpy as np

from .code_reads import LOCAL, MISSING, Reads, reads_of, resolve

_PACKAGE = __name__.partition(".")[0]


def _names(text: str) -> frozenset[str]:
    return frozenset(text.split())


PURE = _names(f"""
    {_PACKAGE} abc bisect builtins cmath collections contextlib copy copyreg dataclasses datetime enum fractions
    functools heapq itertools math numba numbers numpy operator scipy statistics types typing
    _bisect _collections _collections_abc _functools _heapq _operator
""")
"""Packages whose functions depend on their arguments only, and whose functions and classes are represented by their names."""
_NOT_PURE = _names("""
    builtins.open builtins.input builtins.eval builtins.exec builtins.compile builtins.globals builtins.__import__ builtins.hash
    builtins.id builtins.breakpoint numpy.random numpy.load numpy.loadtxt numpy.genfromtxt numpy.fromfile numpy.fromregex
    numpy.memmap numpy.lib numpy.ctypeslib scipy.io scipy.datasets
""")
"""Their parts that read files, the state of the interpreter, or random numbers."""
_HIDDEN = _names("__globals__ __closure__ __code__ __self__ __func__ f_globals f_locals tb_frame now today utcnow")
"""Attributes that read something else than parts of a value."""
_NOT_OF_BEHAVIOUR = _names("""
    __dict__ __weakref__ __doc__ __module__ __annotations__ __firstlineno__ __static_attributes__ __annotate__
    __annotate_func__ __annotations_cache__ __abstractmethods__ _abc_impl __parameters__ __orig_bases__ __dataclass_fields__
    __dataclass_params__ __match_args__ __slots__ __slotnames__ __replace__ __qualname__
""")
"""Attributes of a class on which the behaviour of its instances does not depend, or that repeat others."""
_OF_CONSTRUCTION = _names("""
    __init__ __new__ __post_init__ __init_subclass__ __set_name__ __del__ __reduce__ __reduce_ex__ __getstate__ __setstate__
    __getnewargs__ __getnewargs_ex__ __copy__ __deepcopy__ __class_getitem__
""")
"""Methods that make or copy an instance. They matter if the class is a value, or if any code may make another instance."""
_MAKERS = type, copy.copy, copy.deepcopy, replace
"""Functions that can make an instance from another one, without the name of its class."""
_NUMBERS = frozenset({bool, int, float, complex, str, bytes, type(None), type(...), type(NotImplemented)})
_OF_KERNELS = f"{_PACKAGE}.potentials.callback"
"""Module of an attribute that kernels add to a value."""
_MOST_PARTS = 10_000
"""Largest number of parts, 0.2 s of work: a table of another package can lead to all of its code."""
NOT_OF_MOTION = {"of motion": False}
"""Metadata of a field that does not change the motion, such as a name."""


class _NotFollowed(Exception):
    """A part cannot be followed. The argument names it."""


@dataclass(frozen=True)
class Identity:
    """The identity of a value.

    Attributes
    ----------
    text
        Equal for values with the same behaviour; another one at each call if `unknown`.
    unknown
        The part that cannot be followed, in words, or "".
    fixed
        True if the value cannot change: it contains numbers and texts, and no functions or objects that refer to others.
    """

    text: str
    unknown: str
    fixed: bool


def identify(value: object) -> Identity:
    """Return the identity of a value as it is now."""
    walk = _Walk()
    try:
        text = walk.follow(value)
        if walk.makes:
            walk = _Walk(makes=True)
            text = walk.follow(value)
        return Identity(text, "", walk.fixed)
    except _NotFollowed as part:
        return equal_to_nothing(str(part))
    except Exception as error:  # a class of a user whose attributes raise an exception; or RecursionError
        return equal_to_nothing(f"{type(value).__name__} ({type(error).__name__})")


def equal_to_nothing(part: str) -> Identity:
    """Return the identity of a value with a part that cannot be followed."""
    return Identity(uuid4().hex, part, False)


def digest(value: object) -> str:
    """Return a text that is equal for values with the same behaviour; another one at each call if it cannot be followed."""
    return identify(value).text


@cache
def fields_of_motion(kind: Any) -> tuple[str, ...]:
    """Return the names of the fields of a dataclass that its digest contains."""
    return tuple(field.name for field in fields(kind) if field.metadata.get("of motion", True))


def _is_dataclass(kind: Any) -> bool:
    return is_dataclass(kind)


def _top(module: object) -> str:
    return module.partition(".")[0] if isinstance(module, str) else ""


def _is_pure(name: str) -> bool:
    """Return whether a dotted name is in a library that is followed by name."""
    parts = name.split(".")
    return parts[0] in PURE and not any(".".join(parts[:n]) in _NOT_PURE for n in range(1, len(parts) + 1))


def _hash(parts: object) -> str:
    return hashlib.sha256(repr(parts).encode("utf-8", "surrogatepass")).hexdigest()


class _Walk:
    """One digest. `path` are the values around the current one: a cycle is a reference to its place there.

    Texts of values that were followed are in `known`, and the values in `kept`, so that their ids stay valid. `makes` is True
    if code may make an instance from another one. A second walk then also follows the constructors of the classes of values,
    which may read what cannot be followed, such as a file.
    """

    def __init__(self, makes: bool = False) -> None:
        self.with_constructors = self.makes = makes
        self.path: list[int] = []
        self.known: dict[int, str] = {}
        self.kept: list[object] = []
        self.fixed = True
        self.reads = 0
        self.in_library = False

    def follow(self, value: Any) -> str:
        """Return the text of a value. Raise `_NotFollowed`."""
        kind = type(value)
        if kind in _NUMBERS:
            return repr(value)
        if kind is np.ndarray or isinstance(value, np.generic):
            return self._follow_array(value)
        if id(value) in self.known:
            return self.known[id(value)]
        if id(value) in self.path:
            return f"cycle {self.path.index(id(value))}"
        self.path.append(id(value))
        self.kept.append(value)
        if len(self.kept) > _MOST_PARTS:
            raise _NotFollowed(f"more than {_MOST_PARTS} parts, the last a {kind.__name__}")
        text = _hash([f"{kind.__module__}.{kind.__qualname__}", *self._list_parts(value)])
        self.path.pop()
        self.known[id(value)] = text
        return text

    def _all(self, values: Iterable[Any]) -> list[str]:
        return [self.follow(value) for value in values]

    def _follow_array(self, value: Any) -> str:
        if value.dtype.hasobject:
            self.fixed = False
            return _hash(["objects", value.shape, self._all(value.ravel().tolist())])
        if isinstance(value, np.ndarray) and value.flags.writeable:
            self.fixed = False
        kind = f"{type(value).__module__}.{type(value).__qualname__}"
        content = hashlib.sha256(value.tobytes()).hexdigest()
        return _hash([kind, np.lib.format.dtype_to_descr(value.dtype), value.shape, content])

    def _list_parts(self, value: Any) -> Iterator[Any]:  # noqa: C901, PLR0912  # a branch for each kind of value
        """Yield the texts of the parts of a value that is neither a number, a text nor an array."""
        kind: Any = type(value)
        if kind is tuple:
            yield self._all(value)
            return
        if kind is frozenset:
            yield sorted(self._all(value))
            return
        if _is_dataclass(kind) and _top(kind.__module__) == _PACKAGE and "<" not in kind.__qualname__:
            yield [(name, self.follow(getattr(value, name))) for name in fields_of_motion(kind)]
            return
        self.fixed = False
        if kind is CodeType:
            raise _NotFollowed("code that is passed on")
        if kind is list:
            yield self._all(value)
        elif kind in (dict, MappingProxyType):
            yield [(self.follow(key), self.follow(item)) for key, item in value.items()]
        elif kind is set:
            yield sorted(self._all(value))
        elif isinstance(value, ModuleType):
            if not (self.in_library and _is_pure(value.__name__)):
                raise _NotFollowed(f"the module {value.__name__}, which is passed on")
            yield value.__name__
        elif (name := _library_name(value)) is not None:
            yield name
        elif kind is FunctionType:
            yield from self._list_of_function(value)
        elif kind is MethodType:
            yield self.follow(value.__func__)
            yield self.follow(value.__self__)
        elif kind in (staticmethod, classmethod):
            self.makes |= kind is classmethod
            yield self.follow(value.__func__)
        elif kind is property:
            yield self._all((value.fget, value.fset, value.fdel))
        elif kind is cached_property:
            yield self.follow(value.func)
        elif kind in (MemberDescriptorType, GetSetDescriptorType):
            yield [self.follow(value.__objclass__), value.__name__]
        elif isinstance(value, type):
            yield from self._list_of_class(value, called=True)
        elif _keeps_values(kind):
            yield from self._list_of_keeper(value)
        else:
            yield from self._list_of_object(value)

    # ------------------------------------------------------------------------------------------------ functions

    def _list_of_function(self, value: Any) -> Iterator[Any]:
        before, self.in_library = self.in_library, _is_pure(f"{value.__module__}.{value.__qualname__}")
        code, cells = value.__code__, {}
        for name, cell in zip(code.co_freevars, value.__closure__ or (), strict=True):
            try:
                cells[name] = cell.cell_contents
            except ValueError:  # a variable that has no value yet
                cells[name] = MISSING
        yield self._follow_code(code, value.__globals__, cells)
        yield self._all((value.__defaults__, value.__kwdefaults__))
        yield [(name, self.follow(attribute)) for name, attribute in sorted(vars(value).items())]
        self.in_library = before

    def _follow_code(self, code: CodeType, known: Mapping[str, Any], cells: Mapping[str, Any]) -> str:
        """Return the text of code with globals `known`; `cells` has the variables of enclosing functions, or `LOCAL`."""
        reads: Reads = reads_of(code)
        if reads.writes_global or any(cells.get(name, MISSING) is not LOCAL for name in reads.written):
            raise _NotFollowed(f"{code.co_name}, which writes to a variable outside of itself")
        if hidden := _HIDDEN.intersection(code.co_names):
            raise _NotFollowed(f"{code.co_name}, which reads .{min(hidden)}")
        self.makes |= not _OF_CONSTRUCTION.isdisjoint(code.co_names) or "__class__" in code.co_names
        parts: list[Any] = [code.co_code, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars, code.co_flags]
        parts += [code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_exceptiontable]
        for read in reads.reads:
            value, name = resolve(read, known, cells, _is_pure)
            if value is LOCAL:
                continue
            if value is MISSING and (read.imported or "." in name):  # not yet imported, or made by the module when it is read
                raise _NotFollowed(f"{code.co_name}, which reads {name}")
            self.makes |= any(value is maker for maker in _MAKERS)
            self.reads += not (value is MISSING or _library_name(value) is not None)
            if isinstance(value, ModuleType) and not self.in_library:
                raise _NotFollowed(f"{code.co_name}, which passes on the module {name}")
            if name == "__class__":  # `super` without arguments uses it
                parts.append((name, self._follow_class(value, called=False)))
            else:
                parts.append((name, "missing" if value is MISSING else self.follow(value)))
        inside = {**cells, **dict.fromkeys(code.co_cellvars, LOCAL)}
        for name, read in reads.bound.items():
            if name in code.co_cellvars:
                inside[name] = resolve(read, known, cells, _is_pure)[0]
        for constant in code.co_consts:
            parts.append(
                self._follow_code(constant, known, inside) if isinstance(constant, CodeType) else self.follow(constant)
            )
        return _hash(parts)

    def _list_of_keeper(self, value: Any) -> Iterator[Any]:
        """Follow compiled code or a cache, with earlier values of what their function reads: it may read libraries only."""
        function = next((wrapped for name in ("py_func", "__wrapped__") if (wrapped := getattr(value, name, None))), None)
        if not isinstance(function, FunctionType):
            raise _NotFollowed(f"a value of type {type(value).__name__}")
        reads, self.reads = self.reads, 0
        text = self.follow(function)
        defaults = *(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).values()
        if self.reads or function.__closure__ or not all(type(default) in _NUMBERS for default in defaults):
            raise _NotFollowed(f"{function.__name__}, which keeps earlier values of what it reads ({type(value).__name__})")
        self.reads += reads
        yield text

    # ------------------------------------------------------------------------------------------------ classes and objects

    def _list_of_class(self, value: Any, called: bool) -> Iterator[Any]:
        """Yield the parts of a class, with its constructors if it may be `called`."""
        yield value.__qualname__
        metaclass = type(value)
        yield metaclass.__qualname__ if metaclass is type else self._follow_class(metaclass, called=True)
        yield [self._follow_class(base, called) for base in value.__bases__]
        left_out = _NOT_OF_BEHAVIOUR if called else _NOT_OF_BEHAVIOUR | _OF_CONSTRUCTION
        if "__dataclass_fields__" in vars(value):
            described = [
                (field.name, field.init, field.kw_only, field.default, field.default_factory) for field in fields(value)
            ]
            yield [self._all(field) for field in described]
            left_out |= {name for name, attribute in vars(value).items() if _is_generated(attribute)}
        own = ((name, attribute) for name, attribute in sorted(vars(value).items()) if name not in left_out)
        slots = MemberDescriptorType, GetSetDescriptorType
        yield [(name, "a slot" if isinstance(attribute, slots) else self.follow(attribute)) for name, attribute in own]

    def _follow_class(self, value: Any, called: bool) -> str:
        """Return the text of a class: its name in a library, otherwise its parts."""
        if called or self.with_constructors:
            return self.follow(value)
        if (name := _library_name(value)) is not None:
            return name
        if _top(value.__module__) in sys.stdlib_module_names and _top(value.__module__) != "__main__":
            raise _NotFollowed(f"a value of type {value.__module__}.{value.__qualname__}")
        if id(value) in self.path:
            return f"cycle {self.path.index(id(value))}"
        self.path.append(id(value))
        text = _hash(list(self._list_of_class(value, called=False)))
        self.path.pop()
        return text

    def _list_of_object(self, value: Any) -> Iterator[Any]:
        """Yield class, attributes, slots and, for what else it may consist of, the parts that pickle stores."""
        kind: Any = type(value)
        name = f"{kind.__module__}.{kind.__qualname__}"
        if hasattr(kind, "__next__") or (not _is_pure(name) and _top(name) in PURE):
            raise _NotFollowed(f"a value of type {name}")
        yield self._follow_class(kind, called=False)
        before, self.in_library = self.in_library, _top(name) in (_PACKAGE, "numpy", "scipy")
        derived = _derived_names(kind)
        attributes = sorted(getattr(value, "__dict__", {}).items())
        own = [(key, part) for key, part in attributes if key not in derived and type(part).__module__ != _OF_KERNELS]
        yield [(key, self.follow(part)) for key, part in own]
        for base in kind.__mro__:
            for key, slot in sorted(vars(base).items()):
                if isinstance(slot, MemberDescriptorType):
                    with suppress(AttributeError):  # a slot without a value
                        yield key, self.follow(slot.__get__(value))
        if not derived:
            try:
                reduced = value.__reduce_ex__(4)
            except Exception:
                raise _NotFollowed(f"a value of type {name}") from None
            if isinstance(reduced, str):
                raise _NotFollowed(f"{reduced}, a value of type {name}")
            make, arguments, state, *others = (*reduced, None, None, None)[:5]
            yield ["its class" if part is kind else self.follow(part) for part in (make, *arguments)]
            yield self.follow(state)
            yield [self.follow(list(other)) for other in others if other is not None]
        self.in_library = before


def _library_name(value: Any) -> str | None:
    """Return the name of a function or class of a library that is followed by name; None for another value."""
    module, name = getattr(value, "__module__", None), getattr(value, "__qualname__", None)
    if isinstance(value, type):
        full = f"{module}.{name}"
        return full if _is_pure(full) else None
    if isinstance(value, np.ufunc):
        name = value.__name__
        module = next((library for library in ("numpy", "scipy.special") if _is_in(library, name, value)), "")
    owner = getattr(value, "__self__", None)
    if isinstance(owner, ModuleType):
        module = owner.__name__
    elif owner is not None or not callable(value):
        return None
    full = f"{module}.{name}"
    if not isinstance(module, str) or not isinstance(name, str) or not _is_pure(full) or not _is_in(module, name, value):
        return None
    return full


def _is_in(module: str, name: str, value: object) -> bool:
    """Return whether a module that was imported has the value under a dotted name."""
    owner: Any = builtins if module == "builtins" else sys.modules.get(module)
    for part in name.split("."):
        owner = getattr(owner, part, None)
    return owner is value


def _is_generated(method: Any) -> bool:
    """Return whether `dataclass` made a method, from the fields, which are followed."""
    code = getattr(getattr(method, "__wrapped__", method), "__code__", None)
    return code is not None and code.co_qualname.startswith("__create_fn__.")


def _keeps_values(kind: type) -> bool:
    """Return whether values of a class have compiled or cached results of a function of Python."""
    return _top(kind.__module__) == "numba" or kind.__name__ == "_lru_cache_wrapper"


@cache
def _derived_names(kind: Any) -> frozenset[str]:
    """Return the attributes of a frozen dataclass that follow from its fields: cached properties, and those not of motion."""
    if not _is_dataclass(kind) or not kind.__dataclass_params__.frozen:
        return frozenset()
    cached = {name for base in kind.__mro__ for name, what in vars(base).items() if isinstance(what, cached_property)}
    return frozenset(cached | {field.name for field in fields(kind)} - {*fields_of_motion(kind)})
