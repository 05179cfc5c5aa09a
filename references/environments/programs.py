"""Programs of the user as engines: registration, and the classes of methods that run them. PROTOCOL.md is for their authors."""

from __future__ import annotations

import json
import os
import re
import shlex
import tomllib
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from conservative import registry
from conservative.check import describe
from conservative.deferred_imports import list_entries
from conservative.errors import BadInput, MissingEngine
from conservative.files import make_folder, write_text
from conservative.programs import Program, list_programs, project_file, user_file
from conservative.toml_reader import read

from ..worker.client import START_LIMIT, is_number, is_text
from .engine_method import EngineMethod, engine_class
from .environment import Environment, worker_of
from .kind import EnvironmentKind
from .plain_numbers import FIELDS


@dataclass(frozen=True)
class OwnProgram(EnvironmentKind):
    """A program of the user, by the words of its command line. It has the variables of this process; nothing is installed."""

    words: tuple[str, ...]

    name = "program"

    def command(self, folder: Path) -> tuple[str | Path, ...]:
        return self.words

    def variables(self, folder: Path) -> None:
        return None


class UnusableProgram(MissingEngine):
    """A program does not start, does not speak the protocol, or describes itself in another way than PROTOCOL.md does."""

    def __init__(self, program: Program, error: Exception) -> None:
        self.engine = self.package = program.name
        unusable = f"its answer to `hello` cannot be used ({type(error).__name__}: {error})"
        self.cause, self.problem = error, getattr(error, "outcome", unusable)
        remedy = f"Build it or change it as PROTOCOL.md describes, or run: conservative engines remove {program.name}"
        ImportError.__init__(self, f"{program.name}, a program of {program.file}: {self.problem}. {remedy}")


def __getattr__(name: str) -> type[EngineMethod]:
    if name.startswith("_") or name not in (programs := list_programs()):
        raise AttributeError(name)
    return program_class(programs[name])


def _are_texts(value: object) -> bool:
    return isinstance(value, list) and all(map(is_text, value))


def _is_setting(value: object) -> bool:
    return isinstance(value, str | bool) or is_number(value) or (isinstance(value, float) and is_number(-value))


def _is_order(value: object) -> bool:
    return value is None or (is_number(value) and value == int(value))  # type: ignore[call-overload]  # a number


def _each(is_right: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, dict) and all(map(is_right, value.values()))


_TEXTS, _FORMATS = (_are_texts, "a list of texts"), ("urdf", "mjcf", "sdf", "usd")
_NAMES = tuple(kind.__name__ for kind in FIELDS)
FORMER = {"ways": "descriptions", "card": "method_info"}
"""Former names of fields, which programs may still use."""
DESCRIPTION: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "settings": (_each(_is_setting), "an object of texts, numbers, true or false"),
    "order": (_is_order, "an integer or null"),
    "orders": (_each(_is_order), "an object of integers or null"),
    "choices": (_each(_are_texts), "an object of lists of texts"),
    "tolerance": (is_text, "a text"),
    "precision": (lambda value: value in ("f64", "f32"), "'f64' or 'f32'"),
    "fields": (lambda value: _are_texts(value) and {*value} <= {*_NAMES}, f"a list of {', '.join(_NAMES)}"),
    "formats": (lambda value: _are_texts(value) and {*value} <= {*_FORMATS}, f"a list of {', '.join(_FORMATS)}"),
    "descriptions": _TEXTS,
    "method_info": (lambda value: isinstance(value, dict), "an object"),
    "variants": _TEXTS,
    "flight": (lambda value: isinstance(value, bool), "true or false"),
    "rotors": (lambda value: isinstance(value, bool), "true or false"),
}
"""Fields of `engine` in the answer to `hello`, and of its `method_info`, and what they have to be."""
_COMMAND = "an executable or a command line"


def _check_description(engine: dict[str, Any]) -> None:
    """Raise `ValueError` for a field of another kind. Unknown fields are found where they are used."""
    infos = [engine[name] for name in ("method_info", "card") if isinstance(engine.get(name), dict)]
    for name, value in [*engine.items(), *(item for info in infos for item in info.items())]:
        is_right, expected = DESCRIPTION.get(FORMER.get(name, name), (lambda value: True, ""))
        if not is_right(value):
            raise ValueError(f"`{name}` is {describe(value)}; expected {expected}")


@cache
def program_class(program: Program, limit: float = START_LIMIT) -> type[EngineMethod]:
    """Return the class of a program, started for its description within a limit in s. Raise `UnusableProgram` if that fails."""
    module: Any = ModuleType(program.name, f"{program.name}, a program.")
    environment = Environment(program.name, "", Path(shlex.join(program.words)), "", (), OwnProgram(program.words))
    defaults = {"package": program.name, "module": "", "fields": [kind.__name__ for kind in FIELDS]}
    try:
        greeting = worker_of(environment).greet(limit)
        engine = greeting.get("engine", {})
        _check_description(engine)
        module.ENGINE = {**defaults, **{FORMER.get(name, name): value for name, value in engine.items()}}
        module.environment = replace(environment, version=str(greeting["version"]))
        module.__file__ = program.words[0]
        made = engine_class(module)
        # These raise if the description is wrong.
        ["" in made.data.formats, *(method.order for method in made.settings_for("variants"))]
    except Exception as error:  # a program, or its description, can be wrong in any way
        raise UnusableProgram(program, error) from None
    return made


def find_program(text: str) -> Program | None:
    """Return the program registered under a name; None if the text is not one.

    With a version the program is started. Raise `UnusableProgram` if that fails, and `OtherVersion` if it has another version.
    """
    try:
        name = registry.read_name(text, settings=False)
    except BadInput:  # a command line
        return None
    program = list_programs().get(name.base)
    if program is not None and name.version:
        _ = program_class(program).at_version(name.version)().environment
    return program


def read_program(text: str, name: str = "", project: bool = False) -> Program:
    """Return the program of a command line, by default with the name of its last file. Raise `BadInput` for a bad one."""
    file = project_file() if project else user_file()
    try:
        words = [text] if Path(text).is_file() else shlex.split(text)
    except ValueError as error:  # a quote that is not closed
        raise BadInput("command", f"{text!r} ({error})", _COMMAND) from None
    if not words:
        raise BadInput("command", repr(text), _COMMAND)
    files = [word for word in words if Path(word).is_file()]
    here = [word for word in files if not Path(word).is_absolute()]
    places = {word: f"./{os.path.relpath(word, file.parent)}" if project else str(Path(word).absolute()) for word in here}
    name = name or re.sub(r"\W", "_", Path((files or words or [""])[-1]).stem)
    taken = {*registry.list_methods(), *registry.list_engines()}.difference(list_programs())
    if not re.fullmatch(r"[A-Za-z]\w*", name) or name in taken:
        raise BadInput("name", repr(name), "letters, digits and '_', and not the name of a method or an engine")
    return Program(name, file, shlex.join(places.get(word, word) for word in words))


def register(program: Program, undo: bool = False) -> Program:
    """Write the line of a program into its file, or take it out; other lines stay. Raise `UnusableProgram` or `BadInput`."""
    file, name, new = program.file, program.name, [] if undo else [f"{program.name} = {json.dumps(program.command)}"]
    if new:
        program_class(program)
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    numbers = read(file).lines if lines else {}
    if place := numbers.get(("engines", name)):
        lines[place - 1 : place] = new
    elif place := numbers.get(("engines",)):
        lines[place:place] = new
    else:
        lines += ["[engines]", *new]
    text = "\n".join([*lines, ""])
    with suppress(tomllib.TOMLDecodeError):
        if tomllib.loads(text)["engines"].get(name) == (program.command if new else None):
            make_folder(file.parent, "engines")
            write_text(file, text, "engines")
            list_entries.cache_clear()
            return program
    raise BadInput("engines", str(file), f"a table [engines] with {name} on a line of its own, or none")
