"""A sample of many cases for the default run. `pytest --all` runs all of them."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import Any

import pytest


def sampled(cases: Iterable[Any], size: int | None = None, keep: Iterable[Any] = (), leave: Iterable[Any] = ()) -> list[Any]:
    """Return the cases as parameters of pytest; those that are not in the sample of `size` cases carry the mark `slow`.

    A case is a value, a tuple of values or a `pytest.param`. The sample is the same in each run. It has the cases of `keep` and
    none of `leave`, which take long; without a size, it has all others. Each further case adds the most values that the sample
    does not have yet, then the most pairs of values; of cases that add as much, it is the one farthest from the others in the
    list.
    """
    params = [case if isinstance(case, type(pytest.param())) else pytest.param(*_values(case)) for case in cases]
    texts = [tuple(map(repr, param.values)) for param in params]
    parts = [list(enumerate(text)) for text in texts]
    pairs = [set(combinations(part, 2)) for part in parts]
    chosen = [_find(texts, case) for case in keep]
    left = set(range(len(params))) - {_find(texts, case) for case in leave} - set(chosen)
    while left and (size is None or len(chosen) < size):
        seen = {value for i in chosen for value in parts[i]}
        crossed = set().union(*(pairs[i] for i in chosen))

        def gain(i: int, seen: set = seen, crossed: set = crossed) -> tuple[int, int, int, int]:
            nearest = min((abs(i - j) for j in chosen), default=0)
            return len(set(parts[i]) - seen), len(pairs[i] - crossed), nearest, -i

        chosen.append(max(left, key=gain))
        left.remove(chosen[-1])
    return [
        param if i in chosen else pytest.param(*param.values, id=param.id, marks=[*param.marks, pytest.mark.slow])
        for i, param in enumerate(params)
    ]


def _values(case: Any) -> tuple[Any, ...]:
    return case if isinstance(case, tuple) else (case,)


def _find(texts: list[tuple[str, ...]], case: Any) -> int:
    """Return the place of a case. A name in `keep` or `leave` that no longer exists is an error."""
    return texts.index(tuple(map(repr, _values(case))))
