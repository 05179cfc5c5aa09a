"""Programs of the user as engines: registration, and the classes of methods that run them. PROTOCOL.md is for their authors."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from types import ModuleType

from conservative import registry
from conservative.deferred_imports import list_entries
from conservative.errors import BadInput, MissingEngine
from conservative.files import make_folder, write_text
from conservative.programs import Program, list_programs, project_file, user_file
from conservative.scene_files.toml_reader import key_lines

from ..worker.client import EngineCrashed, EngineTimeout, Worker
from .adapter import method_class
from .engine_method import EngineMethod
from .environment import MEMORY, Environment, temporary_folder, worker_of
from .plain_numbers import FIELDS


class UnusableProgram(MissingEngine):
    """A registered program cannot be used. The message names its file and what to do."""

    def __init__(self, program: Program, problem: str, remedy: str) -> None:
        self.engine = self.package = program.name
        ImportError.__init__(self, f"{program.name}, a program of {program.file}: {problem}. {remedy}")


@dataclass(frozen=True)
class ProgramEnvironment(Environment):
    """The environment of a program: that of the user. `words` is the command line."""

    words: tuple[str, ...] = ()

    @property
    def command(self) -> tuple[str | Path, ...]:
        return self.words

    def start_worker(self, variables: Mapping[str, str] | None = None, memory: int = 0) -> Worker:
        """Return a new worker, which has the variables of this process."""
        return Worker(self.command, temporary_folder(), memory=memory or MEMORY)


class ProgramMethod(EngineMethod):
    """A program as a method. Its settings are those that it describes."""

    @property
    def environment(self) -> Environment:
        """The environment. Raises `UnusableProgram` if another version is asked for."""
        environment: Environment = self.adapter.environment
        if self.version not in ("", environment.version):
            problem = f"its version is {environment.version}, not {self.version}"
            raise UnusableProgram(self.adapter.program, problem, "Name it without a version")
        return environment


def __getattr__(name: str) -> type[EngineMethod]:
    if name.startswith("_") or name not in (programs := list_programs()):
        raise AttributeError(name)
    return program_class(programs[name])


@cache
def program_class(program: Program) -> type[EngineMethod]:
    """Return the class of a program, which is started for its description. Raise `UnusableProgram` if that fails."""
    module = ModuleType(program.name, f"{program.name}, a program.")
    words = program.words
    if shutil.which(words[0]) is None:
        remedy = f"Build it, or run: conservative engines remove {program.name}"
        raise UnusableProgram(program, f"{words[0]} does not exist or cannot be executed", remedy)
    environment = ProgramEnvironment(program.name, "", Path(shlex.join(words)), "", (), words=words)
    try:
        greeting = worker_of(environment).greet()
    except (EngineCrashed, EngineTimeout) as failure:
        remedy = f"Run: conservative engines check {shlex.quote(shlex.join(words))}"
        raise UnusableProgram(program, str(failure.outcome), remedy) from None
    try:
        every = {"package": program.name, "module": "", "fields": [kind.__name__ for kind in FIELDS]}
        module.ENGINE = {**every, **greeting.get("engine", {})}  # type: ignore[attr-defined]
        module.environment = replace(environment, version=str(greeting["version"]))  # type: ignore[attr-defined]
        module.program, module.__file__ = program, words[0]  # type: ignore[attr-defined]
        made = method_class(module, ProgramMethod)
        for method in made.settings_for("variants"):
            method.order  # noqa: B018 - for its exception
        return made
    except Exception as error:  # a description can be wrong in any way
        problem = f"its answer to `hello` cannot be used ({type(error).__name__}: {error})"
        raise UnusableProgram(program, problem, "PROTOCOL.md describes `version` and `engine`") from None


def read_program(text: str, name: str = "", project: bool = False) -> Program:
    """Return the program of an executable or a command line; its name is by default that of the last file in it.

    Its file is the user's, or the project's, to which its paths are relative. Raise `BadInput` if the name cannot be used.
    """
    file = project_file() if project else user_file()
    words = [text] if Path(text).is_file() else shlex.split(text)
    if not words:
        raise BadInput("command", repr(text), "the path of an executable, or a command line")

    def place(word: str) -> str:
        path = Path(word).absolute()
        inside = project and path.is_relative_to(file.parent)
        return (f"./{path.relative_to(file.parent)}" if inside else str(path)) if path.is_file() else word

    last = [word for word in words if Path(word).is_file()] or words
    name = name or re.sub(r"\W", "_", Path(last[-1]).stem)
    taken = {*registry.list_methods(), *registry.list_engines()}.difference(list_programs())
    if not re.fullmatch(r"[A-Za-z]\w*", name) or name in taken:
        raise BadInput("name", repr(name), "letters, digits and '_', and not the name of a method or an engine")
    return Program(name, file, shlex.join(map(place, words)))


def add(program: Program) -> Program:
    """Register a program. Raise `UnusableProgram` if it does not start, or `BadInput` if its file cannot be changed."""
    program_class(program)
    _edit(program, [f"{program.name} = {json.dumps(program.command)}"])
    return program


def remove(name: str) -> Program:
    """Take a program out of the file that it is registered in. Raise `BadInput` if the file cannot be changed."""
    program = list_programs()[name]
    _edit(program, [])
    return program


def _edit(program: Program, new: list[str]) -> None:
    """Replace the line of a program in its file; all other lines stay."""
    file, name = program.file, program.name
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    numbers = key_lines("\n".join(lines))
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
            return
    raise BadInput("engines", str(file), f"a table [engines] with {name} on a line of its own, or none")
