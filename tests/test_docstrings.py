"""Public docstrings keep the rule of `docstring_rule`, formulas name a source, and the rule finds what is absent."""

from __future__ import annotations

import importlib
import inspect

import numpy as np
import pytest
from numpy.typing import ArrayLike

import conservative
from conservative import deferred_imports, registry
from conservative.attitude import Array
from conservative.check import positive_number
from conservative.errors import BadInput, MissingEngine

from .docstring_rule import SHAPE, SOURCE, UNIT, complaints, members, public_modules


@pytest.mark.parametrize("name", sorted(public_modules()))
def test_shapes_units_and_errors_are_documented(name):
    found = {n: lacking for n, *rest in members(importlib.import_module(name)) if (lacking := complaints(*rest))}
    assert not found, "\n".join(f"{name}.{n}: {', '.join(lacking)}" for n, lacking in found.items())


def test_everything_in_all_is_walked():
    walked = {n.partition(".")[0] for name in public_modules() for n, *_ in members(importlib.import_module(name))}
    functions = {name for name in conservative.__all__ if inspect.isfunction(getattr(conservative, name))}
    methods = {entry.load().__name__ for entry in deferred_imports.list_entries(deferred_imports.METHODS).values()}
    assert functions | methods <= walked


# --------------------------------------------------------------------------------------------------------------- the sources

WITHOUT_FORMULAS = {
    "conservative.check": "checks of arguments",
    "conservative.declarations": "values",
    "conservative.deferred_imports": "imports and names",
    "conservative.errors": "exceptions",
    "conservative.files": "files",
    "conservative.method": "the protocol",
    "conservative.outcome": "an enum and a value",
    "conservative.presentation": "tables and cards",
    "conservative.registry": "names",
    "conservative.scene": "a value",
    "conservative.scene_files.scene_file": "a file format",
    "conservative.scenes": "what its modules have",
    "conservative.scene_files.toml_reader": "line numbers",
    "conservative.trajectory": "a value",
    "conservative.version": "a number",
}
"""Modules that compute nothing, and what they are instead."""


def modules_with_formulas():
    """Yield all others; scenes carry their source as a value, see below."""
    yield from (
        name
        for name in public_modules()
        if name not in WITHOUT_FORMULAS and ".scenes." not in name and not hasattr(importlib.import_module(name), "__path__")
    )


@pytest.mark.parametrize("name", sorted(modules_with_formulas()))
def test_modules_with_formulas_name_a_source(name):
    assert SOURCE.search(words_of(importlib.import_module(name))), f"{name}: no source"


def words_of(module):
    """Return what a module, its classes and its functions say."""
    own = [found for found in vars(module).values() if getattr(found, "__module__", None) == module.__name__]
    return "\n".join([module.__doc__ or "", *(inspect.getdoc(found) or "" for found in own)])


@pytest.mark.parametrize("name", sorted(registry.list_scenes()))
def test_scenes_name_their_source(name):
    assert registry.scene(name).source


# ----------------------------------------------------------------------------------------------- what the rule must not accept


def good(inertia: ArrayLike, dt: float) -> Array:
    """Return rates (n, 3), rad/s, for moments (3,), kg m^2, and a step dt, s.

    Raises
    ------
    BadInput
        dt is not above 0.
    """
    return np.atleast_2d(inertia) * positive_number("dt", dt)


def one_shape(v: ArrayLike) -> Array:
    """Return the rotation vector v (3,) once more."""
    return np.asarray(v)


def no_unit(dt: float) -> float:
    """Return twice the step."""
    return 2 * dt


def other_unit(dt: float) -> float:
    """Return the angle, rad, turned in a step."""
    return 2 * dt


def hidden_check(dt: float) -> float:
    """Return a step, s, that is above 0."""
    return positive_number("dt", dt)


def _private(engine: str) -> None:
    raise MissingEngine(engine, engine)


def hidden_neighbour(engine: str) -> None:
    """Load an engine.

    Raises
    ------
    BadInput
        It has another name.
    """
    if not engine:
        raise BadInput("engine", engine, "a name")
    _private(engine)


def bare(n: int) -> int:
    return n


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (good, []),
        (one_shape, ["1 of 2 shapes"]),
        (no_unit, ["no unit", "no s for dt"]),
        (other_unit, ["no s for dt"]),
        (hidden_check, ["raises BadInput"]),
        (hidden_neighbour, ["raises MissingEngine"]),
        (bare, ["no docstring"]),
    ],
)
def test_the_rule_finds_what_is_missing(function, expected):
    assert complaints(function, inspect.getdoc(function) or "") == expected


@pytest.mark.parametrize("words", ["Step, s.", "V in J of a matrix", "3 rad", "moments (3,), kg m^2, of a body"])
def test_units_are_recognised(words):
    assert UNIT.search(words)


@pytest.mark.parametrize(
    "words", ["the J of a body", "m and n", "its steps", "J_1, J_2", "s' s", "so many", "in motion", "(see there)"]
)
def test_letters_are_not_taken_for_units(words):
    assert not UNIT.search(words)


@pytest.mark.parametrize(
    "words", ["(3,)", "(n, 3)", "(..., 3, 3)", "(n,)", "(...)", "(3, 3)", "(n, 3, 3)", "(n, 17)", "(stages,)"]
)
def test_shapes_are_recognised(words):
    assert SHAPE.fullmatch(words)


@pytest.mark.parametrize("words", ["(s)", "(29)(b)", "()", "(see)", "f(x, 3)"])
def test_other_brackets_are_not_shapes(words):
    assert not SHAPE.search(words)


@pytest.mark.parametrize("words", ["Fast.", "Order 2, 12 stages.", "Return the known solution (3,)."])
def test_words_that_are_no_source(words):
    assert not SOURCE.search(words)
