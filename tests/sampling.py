"""A sample of many cases for the default run. `pytest --all` runs all of them."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import Any

import pytest


def sampled(cases: Iterable[Any], size: int, keep: Iterable[Any] = ()) -> list[Any]:
    """Return the cases as parameters of pytest; those that are not in the sample of `size` cases carry the mark `slow`.

    A case is a value, a tuple of values or a `pytest.param`. The sample is the same in each run, and has the cases of `keep`.
    Each further case adds the most values that the sample does not have yet, then the most pairs of values; of cases that add
    as much, it is the one farthest from its neighbours in the list.
    """
    params = [case if isinstance(case, type(pytest.param())) else pytest.param(*_values(case)) for case in cases]
    parts = [[(place, repr(value)) for place, value in enumerate(param.values)] for param in params]
    pairs = [set(combinations(part, 2)) for part in parts]
    wanted = [[repr(value) for value in _values(case)] for case in keep]
    chosen = [i for i, part in enumerate(parts) if [text for _, text in part] in wanted]
    if len(chosen) != len(wanted):
        raise ValueError("keep: a case is not among the cases, or is twice")
    while len(chosen) < min(size, len(params)):
        seen = {value for i in chosen for value in parts[i]}
        crossed = set().union(*(pairs[i] for i in chosen))

        def gain(i: int, seen: set = seen, crossed: set = crossed) -> tuple[int, int, int, int]:
            nearest = min((abs(i - j) for j in chosen), default=0)
            return len(set(parts[i]) - seen), len(pairs[i] - crossed), nearest, -i

        chosen.append(max(set(range(len(params))) - set(chosen), key=gain))
    return [
        param if i in chosen else pytest.param(*param.values, id=param.id, marks=[*param.marks, pytest.mark.slow])
        for i, param in enumerate(params)
    ]


def _values(case: Any) -> tuple[Any, ...]:
    return case if isinstance(case, tuple) else (case,)
