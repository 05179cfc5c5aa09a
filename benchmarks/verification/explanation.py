"""A mistake that was tried as an explanation of a recorded motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from conservative.attitude import Array

from .compare import HOPELESS, Compared, Solution

HALF, PROVEN = 0.5, 0.2  # of the error: what an explanation may leave, and what the best of them may, to be proven


@dataclass(frozen=True)
class Explanation:
    """A mistake that was tried: its name, the sentence that it states about the file, and its numbers in SI units.

    `left` and `plain` are the largest errors with it and without it, over the rows that it was tried on: of attitudes, rad, and
    of rates, relative to the largest. `share` is the share of the error that is left, `size` the root of the mean square in
    units of the noise, and `explains` is True if what is left is noise. `numbers` are those that were fitted, and `made` is the
    motion (n, 3, 3), (n, 3), None for another reading of the file. `rest` is the share of the root of the mean square.
    """

    name: str
    sentence: str
    values: dict[str, float]
    left: list[float]
    plain: list[float]
    share: float
    size: float = math.inf
    explains: bool = False
    numbers: int = 0
    made: tuple[Array, Array] | None = field(default=None, compare=False, repr=False)
    rest: float = 0.0


def explain(
    case: Compared,
    name: str,
    text: str,
    made: tuple[Array, Array],
    values: Mapping[str, float] = MappingProxyType({}),
    read: Compared | None = None,
    numbers: int | None = None,
) -> Explanation:
    """Return the explanation by the motion that a mistake makes, next to the file, or to another reading of it.

    `text` is a format of `values`; `numbers` counts those that were fitted, by default all.
    """
    of, plain = read or case, case.plain.max(axis=1)
    error = of.errors(*made)
    share, rest = float(error.max() / max(plain.max(), 1e-15)), of.size(error) / max(case.size(case.plain), 1e-15)
    return Explanation(
        name,
        text.format(**values),
        dict(values),
        error.max(axis=1).tolist(),
        plain.tolist(),
        share,
        of.size(error),
        of.passes(error) and rest < HALF,
        len(values) if numbers is None else numbers,
        made if read is None else None,
        rest,
    )


def attempt(
    case: Compared,
    name: str,
    text: str,
    motion: Solution,
    extra: Sequence[float] = (),
    values: Callable[[Array], dict[str, float]] = lambda _: {},
    small: float = 1e-6,
    most: int = 8,
    read: Compared | None = None,
) -> Explanation:
    """Return the explanation by a motion whose initial state and other numbers are fitted as far as they are open.

    `extra` (k,) are the numbers to start with, `small` is their change for slopes, `values` names the fitted ones in SI units,
    and `most` is the number of iterations. `read` has another reading of the rows.
    """
    of, p = read or case, np.array(extra, float)
    _, p, made = replace(of, free=()).fit(motion, p, np.full(len(p), small), most)
    error = of.errors(*made)
    if of.free and not of.passes(error) and (error.max(axis=1) <= HOPELESS * of.noise * of.growth).any():
        _, p, made = of.fit(motion, p, np.full(len(p), small), most)
    return explain(case, name, text, made, values(p), read)
