"""Classes of methods that are compared within themselves: solutions of integrable motions are no general integrators."""

from __future__ import annotations

from enum import StrEnum
from functools import lru_cache

import pandas as pd

from conservative import registry
from conservative.benchmarks.studies.selection import tolerance_setting
from conservative.errors import BadInput, MissingEngine, NotLoadable
from conservative.method import Method, Role
from conservative.scene import Scene
from conservative.scenes.random_body import random_body


class MethodClass(StrEnum):
    """What a method is compared as; in the order of tables."""

    GENERAL = "our general integrators"
    SOLUTION = "our solutions of integrable motions"
    SOLVER = "ODE solvers"
    ENGINE = "physics engines"


OF_ENGINES = (MethodClass.SOLVER, MethodClass.ENGINE)
"""Classes of somebody else's code."""


def class_of(role: str, method: str) -> MethodClass:
    """Return the class of a method by its side and its name; one that cannot be loaded counts as the usual one of its side.

    Ours is a general integrator if it takes a body that nobody chose in a field, whose motion has no closed form. Of engines, a
    solver is told what the error may be, a physics engine how long the steps are.
    """
    found = _load(method)
    if role == Role.OURS:
        return MethodClass.SOLUTION if found and found.unsupported(_body()) else MethodClass.GENERAL
    return MethodClass.SOLVER if found and tolerance_setting(found) else MethodClass.ENGINE


def of_classes(found: pd.DataFrame, *kinds: MethodClass) -> pd.DataFrame:
    """Return points or costs of methods of some classes."""
    return found[found["class"].isin(kinds)]


def without_solutions(points: pd.DataFrame) -> pd.DataFrame:
    """Return points without those of our solutions of integrable motions."""
    return points[points["class"] != MethodClass.SOLUTION]


@lru_cache(maxsize=1024)
def _load(method: str) -> Method | None:
    try:
        return registry.method(method)
    except (BadInput, MissingEngine, NotLoadable):
        return None


@lru_cache(maxsize=1)
def _body() -> Scene:
    return random_body()
