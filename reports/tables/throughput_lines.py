"""Lines of the study of throughput: what a body costs among many at an error, and contests of ours with each engine."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from conservative.benchmarks.measures.cost_at_error import cost
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.studies import THROUGHPUT
from conservative.benchmarks.studies.throughput import ERRORS, MEDIAN, MOST

from .classes import OF_ENGINES, MethodClass, class_of

Setting = dict[tuple[str, int], float]
"""Values of one setting by measure and number of bodies; errors by which one they are, and 0."""


@dataclass(frozen=True, eq=False)
class Line:
    """A method in one way of running many bodies of a kind.

    Attributes
    ----------
    kind, name, way
        Kind of bodies, name of the method without its tolerance, and how it runs them: "" for at once, on one thread.
    family, group
        Its family, and what it is compared as.
    settings
        What was found of each setting, coarse to fine.
    """

    kind: str
    name: str
    way: str
    family: str
    group: MethodClass
    settings: list[Setting] = field(default_factory=list)

    @property
    def ours(self) -> bool:
        """Whether it is ours."""
        return self.group not in OF_ENGINES

    @property
    def label(self) -> str:
        """Name and way."""
        return ", ".join(filter(None, (self.name, self.way)))

    @property
    def plain(self) -> bool:
        """Whether it runs bodies at once on one thread, or has no other way: what contests are about."""
        return not self.way or (not self.ours and self.way == "one at a time")

    @property
    def sizes(self) -> list[int]:
        """Numbers of bodies that were timed."""
        return sorted({size for setting in self.settings for what, size in setting if what == Measure.TIME.text})

    def cost(self, error: float, size: int, which: str = MEDIAN) -> float:
        """Return the time, s per body and simulated second, among `size` bodies at an error, rad; nan where there is none."""
        good = [setting for setting in self.settings if math.isfinite(setting.get((which, 0), math.nan))]
        errors = [setting[which, 0] for setting in good]
        return cost(errors, [setting.get((Measure.TIME.text, size), math.nan) for setting in good], error)

    def best(self, measure: Measure, pick: Any) -> float:
        """Return the least or the largest value of a measure, whatever the setting and the number of bodies; nan for none."""
        found = [value for setting in self.settings for (what, _), value in setting.items() if what == measure.text]
        return pick((value for value in found if math.isfinite(value)), default=math.nan)


def lines(table: pd.DataFrame) -> tuple[Line, ...]:
    """Return the lines in the named rows of the study (see `labels.with_names`), in their order."""
    found: dict[tuple[str, str, str], Line] = {}
    settings: dict[tuple[Any, ...], Setting] = {}
    for row in table[table["study"] == THROUGHPUT].to_dict("records"):
        if row["measure"] == Measure.AGREEMENT.text:
            continue
        way = row["way"]
        line = found.setdefault((row["scene"], row["line"], way), _line(row, way))
        key = (row["scene"], row["method"], row["dt"], way)
        if key not in settings:
            line.settings.append(settings.setdefault(key, {}))
        if math.isfinite(row["value"]):
            what = (row["quantity"], 0) if row["quantity"] else (row["measure"], int(row["bodies"]))
            settings[key][what] = float(row["value"])
    return tuple(line for line in found.values() if any(line.settings) or line.group is MethodClass.SOLUTION)


def _line(row: dict[Any, Any], way: str) -> Line:
    return Line(
        kind=str(row["scene"]),
        name=str(row["line"]),
        way=way,
        family=str(row["family"]),
        group=class_of(str(row["role"]), str(row["method"])),
    )


@dataclass(frozen=True)
class Cheapest:
    """The cheapest line of a side: its time, s per body and simulated second, and what it is called."""

    time: float
    label: str


@dataclass(frozen=True)
class Contest:
    """Ours of a class (`group`) against an engine, among `size` bodies of a kind, at an error, rad, of those `which` names.

    `ratio` is the engine's time over ours, nan where a side does not get there; above 1 ours is faster.
    """

    kind: str
    which: str
    error: float
    size: int
    engine: str
    group: MethodClass
    ours: Cheapest | None
    theirs: Cheapest | None

    @property
    def ratio(self) -> float:
        """The engine's time over ours."""
        return self.theirs.time / self.ours.time if self.ours and self.theirs else math.nan


def cheapest(found: Iterable[Line], error: float, size: int, which: str) -> Cheapest | None:
    """Return the cheapest of some lines that get to an error; None where none does."""
    costs = [Cheapest(line.cost(error, size, which), line.label) for line in found]
    return min((each for each in costs if not math.isnan(each.time)), key=lambda each: each.time, default=None)


def contests(found: Iterable[Line]) -> Iterator[Contest]:
    """Yield ours against each engine, both on one thread, at each error, where most bodies ran on both sides.

    Ours are our general integrators, and apart from them our solutions of integrable motions.
    """
    plain = [line for line in found if line.plain]
    for kind in dict.fromkeys(line.kind for line in plain):
        here = [line for line in plain if line.kind == kind]
        for group in (MethodClass.GENERAL, MethodClass.SOLUTION):
            ours = [line for line in here if line.group is group]
            for engine in dict.fromkeys(line.family for line in here if not line.ours):
                theirs = [line for line in here if not line.ours and line.family == engine]
                for which in (MEDIAN, MOST):
                    yield from (_contest((kind, which, error, engine), group, ours, theirs) for error in ERRORS if ours)


def _contest(what: tuple[str, str, float, str], group: MethodClass, ours: list[Line], theirs: list[Line]) -> Contest:
    """Return the contest among the largest number of bodies at which both sides get to the error."""
    kind, which, error, engine = what
    sizes = sorted({size for line in (*ours, *theirs) for size in line.sizes}, reverse=True) or [1]
    pairs = ((size, cheapest(ours, error, size, which), cheapest(theirs, error, size, which)) for size in sizes)
    every = list(pairs)
    size, mine, other = next(((n, a, b) for n, a, b in every if a and b), every[-1])
    return Contest(kind, which, error, size, engine, group, mine, other)
