"""Mutants of a file, made by cosmic-ray: which are possible, a random choice of them, and what each one changes."""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from itertools import zip_longest
from pathlib import Path
from typing import Any

from conservative.errors import BadInput

TOOL = "cosmic-ray==8.7.0"
"""What makes the mutants. No extra installs it: it brings a web server's and a database's packages."""
TRIVIAL = ("BitOr", "BitAnd", "BitXor", "LShift", "RShift")
"""Operators that no float has: any test that reaches such a mutant kills it, which would flatter the share."""

COMPILERS = ("kernel", "small")
"""Decorators that leave kernels as they are, where they run as plain Python."""


@dataclass(frozen=True)
class Mutant:
    """One change of a file, its path relative to the root: the new text, and the first line that differs, before and after."""

    file: str
    line: int
    before: str
    after: str
    text: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}\n    - {self.before}\n    + {self.after}"


def draw_mutants(root: Path, files: list[str], count: int, seed: int) -> tuple[list[Mutant], int]:
    """Return up to `count` mutants, one for each of as many random places in the files, and the number of places.

    Places are drawn evenly over all files together; changes of annotations and docstrings do nothing and are passed over.
    """
    places = [(file, changes) for file in files for changes in list_places((root / file).read_text(encoding="utf-8"))]
    chosen = random.Random(seed)
    found: list[Mutant] = []
    for file, changes in chosen.sample(places, len(places)):
        if len(found) == count:
            break
        mutant = make_mutant(root, file, *chosen.choice(changes))
        found += [mutant] if mutant else []
    return found, len(places)


def list_places(source: str) -> list[list[tuple[str, int]]]:
    """Return, for each place that can be changed, the changes: names of operators, and which of their occurrences it is."""
    places: dict[Any, list[tuple[str, int]]] = {}
    cosmic_ray = _import_tool("ast")
    nodes = list(cosmic_ray.ast_nodes(cosmic_ray.get_ast(source)))
    for name, operator in _operators():
        positions = (position for node in nodes for position in operator.mutation_positions(node))
        for occurrence, position in enumerate(positions):
            places.setdefault(position, []).append((name, occurrence))
    return [places[position] for position in sorted(places)]


def make_mutant(root: Path, file: str, operator: str, occurrence: int) -> Mutant | None:
    """Return the mutant, or None where the code does the same or the tool makes none."""
    source = (root / file).read_text(encoding="utf-8")
    made = _import_tool("plugins").get_operator(operator)()
    try:
        text = _import_tool("mutating").mutate_code(source, made, occurrence)
    except AttributeError:  # of an `except` with a dotted name the tool makes none
        return None
    if text is None or _same_code(source, text):
        return None
    for line, (before, after) in enumerate(zip_longest(source.splitlines(), text.splitlines(), fillvalue=""), 1):
        if before != after:
            return Mutant(file, line, before.strip(), after.strip(), text)
    return None


def _operators() -> Iterator[tuple[str, Any]]:
    plugins = _import_tool("plugins")
    for name in plugins.operator_names():
        if "Variable" not in name and not name.endswith(TRIVIAL):
            yield name, plugins.get_operator(name)()


def _import_tool(module: str) -> Any:
    try:
        return import_module(f"cosmic_ray.{module}")
    except ImportError as error:
        raise BadInput("mutants", "no cosmic-ray", f"`pip install {TOOL}`") from error


def _same_code(one: str, other: str) -> bool:
    try:
        return _outline(one) == _outline(other)
    except SyntaxError:  # killed when it is imported
        return False


def _outline(source: str) -> str:
    """Return the code without what does nothing: annotations (all files defer them), texts that stand alone, compilation."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            compiled = [each for each in node.decorator_list if isinstance(each, ast.Name) and each.id in COMPILERS]
            node.decorator_list = [each for each in node.decorator_list if each not in compiled]
        for name in ("annotation", "returns"):
            if getattr(node, name, None) is not None:
                setattr(node, name, ast.Constant(None))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            node.value = ast.Constant(None)
    return ast.dump(tree)
