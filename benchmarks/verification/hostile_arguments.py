"""Hostile arguments: what a function may be handed instead of what it asks for. Source: the leaks that were found so far."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from random import Random
from typing import Any

import numpy as np


class _Failing:
    """Fails at everything that it is asked for."""

    def __repr__(self) -> str:
        raise RuntimeError("no text")

    def __float__(self) -> float:
        raise RuntimeError("no number")

    def __array__(self, *arguments: Any, **settings: Any) -> Any:
        raise RuntimeError("no array")


@dataclass(frozen=True)
class Try:
    """A call to make: what it is of, the call in words, and the call."""

    name: str
    words: str
    call: Callable[[], object]


HUGE = 10**400
NUMBERS: tuple[Any, ...] = (
    *(0, 1, -1, 2, 0.3, -0.0, HUGE, -HUGE, 10**30, 10**5000, 2**63, 2**64, float("nan"), float("inf"), float("-inf")),
    *(1e200, -1e200, 1e-200, 5e-324, 1.7e308, 1e101, 1e-101, 1e100, 1e-100, Fraction(HUGE), Fraction(1, HUGE), Fraction(1, 3)),
    *(
        Decimal("1e999"),
        Decimal("1.5"),
        Decimal("nan"),
        True,
        None,
        1j,
        np.float64("nan"),
        np.float32(2),
        np.int64(3),
        np.bool_(True),
    ),
    *(np.longdouble("1e4000"), np.array(1.0), np.array([1.0, 2.0]), np.array([object()]), np.datetime64("2026-01-01")),
)
TEXTS: tuple[Any, ...] = (
    "",
    "1",
    "abc",
    "\0",
    "a\0.toml",
    "\ud800",
    "x" * 10**5,
    "no.toml",
    "../..",
    "\n",
    b"bytes",
    "nan",
    "1e400",
)
OBJECTS: tuple[Any, ...] = (
    [],
    {},
    (),
    set(),
    [1.0],
    [[]],
    object(),
    _Failing(),
    int,
    len,
    lambda *_: None,
    iter(()),
    {"a": 1},
    range(3),
)
VECTORS: tuple[Any, ...] = (
    *(
        [1, 2],
        [1, 2, 3, 4],
        [[1, 2, 3]],
        [[1], [2, 3]],
        np.zeros((3, 0)),
        np.full(3, np.nan),
        [1, 2, float("inf")],
        [HUGE, 1, 1],
    ),
    *(["1", "2", "3"], [None, 1, 1], [True, False, True], [1j, 1, 1], [Fraction(HUGE), 1, 1], [Decimal("1e999"), 1, 1], "123"),
    *(
        [1e200, 1, 1],
        [1e-200, 1e-200, 1e-200],
        [0, 0, 0],
        [1e100, 1e100, 1e100],
        [1e-100] * 3,
        [1e100, 1e-100, 1],
        [5e-324, 1, 1],
    ),
    *(
        np.eye(3),
        -np.eye(3),
        np.eye(4),
        1e200 * np.eye(3),
        np.zeros((3, 3)),
        np.ones((3, 3)),
        np.eye(3)[None],
        np.eye(3, dtype=complex),
    ),
    *(
        np.array([1, 2, 3], dtype=object),
        np.array([[1, 1e-16, 0], [0, 1, 0], [0, 0, 1]]),
        [1, 1e-15, 1],
        [object(), 1, 2],
        [[[]]],
    ),
)


def _fail(*_: Any) -> Any:
    raise RuntimeError("somebody's own")


def _divide(*_: Any) -> Any:
    return 1 / 0


FUNCTIONS: tuple[Any, ...] = (
    *(_fail, _divide, lambda *_: "text", lambda *_: [1.0], lambda *_: None, lambda *_: np.nan, lambda *_: 1j, lambda *_: HUGE),
    *(lambda *_: np.zeros((3, 3)), lambda *_: np.zeros(3), lambda *_: np.full((3, 3), np.inf), lambda *_: 1e300, lambda: 1.0),
    *(lambda *_: True, lambda *_: np.array([1.0]), lambda *_: [["a"] * 3] * 3, lambda *_: _Failing(), lambda *_: 0.0),
)


def draw_hostile(rng: Random, usual: object) -> Any:
    """Return a hostile value instead of a usual one: mostly of the kind that the usual one is."""
    everything = (*NUMBERS, *TEXTS, *OBJECTS)
    own: tuple[Any, ...] = NUMBERS
    if isinstance(usual, str):
        own = TEXTS
    elif callable(usual):
        own = FUNCTIONS
    elif not isinstance(usual, int | float | None):
        own = VECTORS
    return rng.choice(own if rng.random() < 0.7 else everything)


def scramble(rng: Random, text: str) -> str:
    """Return a text in which something is cut out, doubled, or replaced by characters that do not belong there."""
    at, length = rng.randrange(len(text) + 1), rng.randint(0, 20)
    piece = text[at : at + length]
    others = ("", piece * 2, "\0", "\ud800", "9" * 400, "[[[[", "1e400", "\n", '"', "é", "-", "99999999999999999999", "nan")
    return text[:at] + rng.choice(others) + text[at + length :]
