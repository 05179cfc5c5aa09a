"""Both sides on random bodies, at each decade: what ours needs on each body, and what an engine needs.

What a side needs on a body to reach an error is the least that any of its lines needs (see `cost_at_error`). The ratio is above
1 where ours is faster. A body on which a side does not reach the error has no ratio there and is counted.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import pandas as pd

from conservative.benchmarks.measures.cost_at_error import cost
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.random import DECADES
from conservative.benchmarks.studies.studies import RANDOM
from conservative.method import Role
from conservative.outcome import OutcomeKind

ANY = "cheapest engine"
"""Stands for all engines: on each body, the cheapest of them."""


class Cheapest(NamedTuple):
    """The cheapest line of a side at an error, and its time, s per simulated second."""

    time: float
    line: str


class Pair(NamedTuple):
    """What both sides need on a body; None where a side does not get there."""

    scene: str
    body: int
    ours: Cheapest | None
    engine: Cheapest | None

    @property
    def ratio(self) -> float:
        """The engine's time over ours; nan where a side does not get there."""
        return self.engine.time / self.ours.time if self.ours and self.engine else math.nan


@dataclass(frozen=True)
class Contest:
    """A field, an engine, an error, and what both sides need on each body."""

    field: str
    engine: str
    error: float
    pairs: tuple[Pair, ...]

    @property
    def both(self) -> list[Pair]:
        """Bodies on which both sides reach the error, those on which ours does worst first."""
        return sorted((pair for pair in self.pairs if pair.ours and pair.engine), key=lambda pair: pair.ratio)

    @property
    def mean(self) -> float:
        """Geometric mean of the ratios; nan without any."""
        logs = [math.log(pair.ratio) for pair in self.both]
        return math.exp(math.fsum(logs) / len(logs)) if logs else math.nan

    @property
    def worst(self) -> float:
        """Least ratio; nan without any."""
        return self.both[0].ratio if self.both else math.nan

    @property
    def best(self) -> float:
        """Largest ratio; nan without any."""
        return self.both[-1].ratio if self.both else math.nan

    @property
    def only_ours(self) -> int:
        """Bodies on which only ours reaches the error."""
        return sum(1 for pair in self.pairs if pair.ours and not pair.engine)

    @property
    def only_engine(self) -> int:
        """Bodies on which only the engine reaches the error."""
        return sum(1 for pair in self.pairs if pair.engine and not pair.ours)


Costs = Mapping[tuple[str, str], Mapping[str, tuple[list[float], list[float]]]]
"""Errors and times of the settings of each line, coarse to fine, by scene and side, and by series."""


def contests(table: pd.DataFrame) -> tuple[Contest, ...]:
    """Return all contests in the rows of the study: first against the cheapest engine, then against each one."""
    lines = costs(table)
    scenes = list(dict.fromkeys(scene for scene, _ in lines))
    engines = list(dict.fromkeys(side for _, side in lines if side != Role.OURS))
    drawn = {row["scene"]: (row["field"], int(row["body"])) for row in table[table["study"] == RANDOM].to_dict("records")}
    fields: dict[str, list[str]] = {}
    for scene in scenes:
        fields.setdefault(drawn[scene][0], []).append(scene)
    rivals = {ANY: engines, **{engine: [engine] for engine in engines}} if engines else {}
    return tuple(
        Contest(field, rival, error, tuple(_pair(lines, scene, drawn[scene][1], members, error) for scene in bodies))
        for rival, members in rivals.items()
        for field, bodies in fields.items()
        if any(lines.get((scene, member)) for scene in bodies for member in members)
        for error in DECADES
    )


def costs(table: pd.DataFrame, by_family: bool = False) -> Costs:
    """Return errors and times as `Costs`; a setting that was not timed has a time of nan.

    A side is ours or the family of an engine; of ours, too, it is a family where that is asked for.
    """
    found: dict[tuple[str, str], dict[str, dict[tuple[str, float], dict[str, float]]]] = {}
    rows = table[(table["study"] == RANDOM) & (table["outcome"] != OutcomeKind.UNSUPPORTED)]
    for row in rows.to_dict("records"):
        side = str(row["role"]) if row["role"] == Role.OURS and not by_family else str(row["family"])
        line = found.setdefault((row["scene"], side), {}).setdefault(row["series"], {})
        line.setdefault((row["method"], row["dt"]), {})[row["measure"]] = float(row["value"])
    return {key: {name: _columns(line.values()) for name, line in lines.items()} for key, lines in found.items()}


def _columns(points: Iterable[Mapping[str, float]]) -> tuple[list[float], list[float]]:
    """Return the errors and the times of a line's settings that reach their end."""
    good = [point for point in points if math.isfinite(point.get(Measure.ATTITUDE_MAX.text, math.nan))]
    return [point[Measure.ATTITUDE_MAX.text] for point in good], [point.get(Measure.TIME.text, math.nan) for point in good]


def _pair(lines: Costs, scene: str, body: int, engines: Iterable[str], error: float) -> Pair:
    return Pair(scene, body, _cheapest(lines, scene, [Role.OURS], error), _cheapest(lines, scene, engines, error))


def _cheapest(lines: Costs, scene: str, sides: Iterable[str], error: float) -> Cheapest | None:
    every = [entry for side in sides for entry in lines.get((scene, str(side)), {}).items()]
    costs = [Cheapest(cost(errors, times, error), name) for name, (errors, times) in every]
    return min((found for found in costs if not math.isnan(found.time)), default=None)
