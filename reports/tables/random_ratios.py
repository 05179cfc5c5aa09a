"""Engines' time over ours on random bodies, at each decade: over all bodies of a field, the mean, the worst and the best.

What a side needs on a body to reach an error is the least that any of its lines needs (see `cost_at_error`). The ratio is above
1 where ours is faster. A body on which a side does not reach the error has no ratio there and is counted.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas as pd

from conservative.benchmarks.measures.cost_at_error import cost
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.random import DECADES
from conservative.benchmarks.studies.studies import RANDOM
from conservative.method import Role
from conservative.outcome import OutcomeKind

from .cells import DASH, Cell, Grade, Table, finite_or_none

ANY = "cheapest engine"
"""Stands for all engines: on each body, the cheapest of them."""
MILESTONES = (1e-3, 1e-6, 1e-9, 1e-12)
"""Errors, rad, of the short table."""
TERMS = (
    "Each body is drawn from a seed: asymmetric, of condition 1.1 to 100, in a turned frame, no point and no rate on an axis, "
    "in uniform gravity, on a spring, attracted to a point, or in gravity's gradient, with a field about as strong as the "
    "motion. The ratio is the cheapest engine's time over ours, each in the cheapest of all forms and settings, for whole "
    "calls; above 1 ours is faster. The error is the largest of twelve instants, and that of a setting the largest of it and "
    "all finer ones, so that no lucky one counts. A body on which a side does not reach the error is counted and has no ratio."
)
"""What the tables mean."""
_FIELD, _INDEX = re.compile(r"field=(\w+)"), re.compile(r"index=(\d+)")


class Cheapest(NamedTuple):
    """The cheapest line of a side at an error, and its time, s per simulated second."""

    time: float
    line: str


class Pair(NamedTuple):
    """What both sides need on a body; None where a side does not get there."""

    scene: str
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


@dataclass(frozen=True, eq=False)
class RandomView:
    """What a report shows of random bodies: how many there are in each field, from which seed, and what was found.

    `points` has columns field, error, mean, worst, best of the contests against the cheapest engine, where both sides get
    there.
    """

    bodies: int
    seed: int
    statements: tuple[str, ...]
    ratios: Table
    engines: Table
    points: pd.DataFrame


def view(table: pd.DataFrame, bodies: int, seed: int) -> RandomView:
    """Return the view of the rows of the study."""
    found = contests(table)
    return RandomView(bodies, seed, statements(found), as_table(found), by_engine(found), chart_points(found))


Costs = Mapping[tuple[str, str], Mapping[str, tuple[list[float], list[float]]]]
"""Errors and times of the settings of each line, coarse to fine, by scene and side, and by series."""


def contests(table: pd.DataFrame) -> tuple[Contest, ...]:
    """Return all contests in the rows of the study: first against the cheapest engine, then against each one."""
    lines = _lines(table)
    scenes = list(dict.fromkeys(scene for scene, _ in lines))
    engines = list(dict.fromkeys(side for _, side in lines if side != Role.OURS))
    fields: dict[str, list[str]] = {}
    for scene in scenes:
        fields.setdefault(_field(scene), []).append(scene)
    rivals = {ANY: engines, **{engine: [engine] for engine in engines}} if engines else {}
    return tuple(
        Contest(field, rival, error, tuple(_pair(lines, scene, members, error) for scene in bodies))
        for rival, members in rivals.items()
        for field, bodies in fields.items()
        if any(lines.get((scene, member)) for scene in bodies for member in members)
        for error in DECADES
    )


def _field(scene: str) -> str:
    found = _FIELD.search(scene)
    return found[1] if found else scene


def _index(scene: str) -> str:
    found = _INDEX.search(scene)
    return found[1] if found else scene


def _lines(table: pd.DataFrame) -> Costs:
    """Return errors and times as `Costs`; a setting that was not timed has a time of nan."""
    found: dict[tuple[str, str], dict[str, dict[tuple[str, float], dict[str, float]]]] = {}
    rows = table[(table["study"] == RANDOM) & (table["outcome"] != OutcomeKind.UNSUPPORTED)]
    for row in rows.to_dict("records"):
        side = str(row["role"]) if row["role"] == Role.OURS else str(row["family"])
        line = found.setdefault((row["scene"], side), {}).setdefault(row["series"], {})
        line.setdefault((row["method"], row["dt"]), {})[row["measure"]] = float(row["value"])
    return {key: {name: _columns(line.values()) for name, line in lines.items()} for key, lines in found.items()}


def _columns(points: Iterable[Mapping[str, float]]) -> tuple[list[float], list[float]]:
    """Return the errors and the times of a line's settings that reach their end."""
    good = [point for point in points if math.isfinite(point.get(Measure.ATTITUDE_MAX.text, math.nan))]
    return [point[Measure.ATTITUDE_MAX.text] for point in good], [point.get(Measure.TIME.text, math.nan) for point in good]


def _pair(lines: Costs, scene: str, engines: Iterable[str], error: float) -> Pair:
    return Pair(scene, _cheapest(lines, scene, [Role.OURS], error), _cheapest(lines, scene, engines, error))


def _cheapest(lines: Costs, scene: str, sides: Iterable[str], error: float) -> Cheapest | None:
    every = [entry for side in sides for entry in lines.get((scene, str(side)), {}).items()]
    costs = [Cheapest(cost(errors, times, error), name) for name, (errors, times) in every]
    return min((found for found in costs if not math.isnan(found.time)), default=None)


def as_table(found: Iterable[Contest], engine: str = ANY) -> Table:
    """Return the contests against an engine, a row for each field and error."""
    header = ["field", "error, rad", "bodies", "mean", "worst", "best", "worst body", "ours, most often", "engine, most often"]
    return header, [_row(contest) for contest in found if contest.engine == engine]


def _row(contest: Contest) -> list[str | Cell]:
    ratios = [_grade(value) for value in (contest.mean, contest.worst, contest.best)]
    winners = [_most_often(found) for found in ([p.ours for p in contest.both], [p.engine for p in contest.both])]
    worst = _index(contest.both[0].scene) if contest.both else DASH
    return [contest.field, f"{contest.error:.0e}", count_text(contest), *ratios, worst, *winners]


def records(found: Iterable[Contest]) -> list[dict[str, Any]]:
    """Return the contests as JSON has them; a ratio that nothing was found of is null."""
    return [
        {
            "field": contest.field,
            "engine": contest.engine,
            "error": contest.error,
            "bodies": len(contest.pairs),
            "both": len(contest.both),
            "only_ours": contest.only_ours,
            "only_engine": contest.only_engine,
            **{name: finite_or_none(getattr(contest, name)) for name in ("mean", "worst", "best")},
            "worst_scene": contest.both[0].scene if contest.both else None,
        }
        for contest in found
    ]


def by_engine(found: Iterable[Contest]) -> Table:
    """Return mean, worst and best ratio to each engine at `MILESTONES`, a row for each field and error."""
    chosen = [contest for contest in found if contest.engine != ANY and contest.error in MILESTONES]
    engines = list(dict.fromkeys(contest.engine for contest in chosen))
    places = dict.fromkeys((contest.field, contest.error) for contest in chosen)
    cells = {(contest.field, contest.error, contest.engine): _spread(contest) for contest in chosen}
    rows = [
        [field, f"{error:.0e}", *(cells.get((field, error, engine), DASH) for engine in engines)] for field, error in places
    ]
    return ["field", "error, rad", *engines], rows


def _spread(contest: Contest) -> str:
    """Return the mean with the worst and the best, and on how many bodies where that is not all."""
    bodies = f"{len(contest.both)} of {len(contest.pairs)}"
    if not contest.both:
        return f"{DASH} ({bodies})"
    counts = "" if len(contest.both) == len(contest.pairs) else f"; {bodies}"
    return f"{ratio_text(contest.mean)} ({ratio_text(contest.worst)} to {ratio_text(contest.best)}{counts})"


def chart_points(found: Iterable[Contest]) -> pd.DataFrame:
    """Return field, error, mean, worst and best of the contests against the cheapest engine in which both sides get there."""
    rows = [(c.field, c.error, c.mean, c.worst, c.best) for c in found if c.engine == ANY and c.both]
    return pd.DataFrame(rows, columns=["field", "error", "mean", "worst", "best"])


def _grade(ratio: float) -> Cell:
    """Return a ratio with a symbol that is not its colour alone."""
    if math.isnan(ratio):
        return Cell(DASH, Grade.NONE)
    return Cell(f"{'✓' if ratio >= 1 else '✗'} {ratio_text(ratio)}", Grade.GOOD if ratio >= 1 else Grade.BAD)


def ratio_text(ratio: float) -> str:
    """Return a ratio to two decimals, or to three digits where it is large."""
    return f"{ratio:.2f}" if ratio < 10 else f"{float(f'{ratio:.3g}'):,g}"


def count_text(contest: Contest) -> str:
    """Return on how many bodies both sides reach the error, of how many, and which side misses it on the others."""
    neither = len(contest.pairs) - len(contest.both) - contest.only_ours - contest.only_engine
    missing = {"only ours": contest.only_ours, "only engine": contest.only_engine, "neither": neither}
    reasons = ", ".join(f"{name} {count}" for name, count in missing.items() if count)
    return f"{len(contest.both)} of {len(contest.pairs)}" + (f" ({reasons})" if reasons else "")


def _most_often(found: Iterable[Cheapest | None]) -> str:
    """Return the line that is the cheapest on most bodies, and on how many where that is not all."""
    counts = Counter(each.line for each in found if each)
    if not counts:
        return DASH
    (name, count), total = counts.most_common(1)[0], counts.total()
    return name if count == total else f"{name} ({count} of {total})"


def statements(found: Iterable[Contest]) -> tuple[str, ...]:
    """Return what is found against the cheapest engine, a sentence or two for each field."""
    fields: dict[str, list[Contest]] = {}
    for contest in found:
        if contest.engine == ANY:
            fields.setdefault(contest.field, []).append(contest)
    return tuple(f"{field}: {' '.join(_sentences(members))}" for field, members in fields.items())


def _sentences(members: list[Contest]) -> Iterator[str]:
    compared = [contest for contest in members if contest.both]
    if not compared:
        yield "on no body do ours and an engine reach the same error."
        return
    low, high = min(compared, key=lambda c: c.mean), max(compared, key=lambda c: c.mean)
    worst, total = min(compared, key=lambda c: c.worst), sum(len(contest.pairs) for contest in members)
    yield f"over {len(members[0].pairs)} bodies the cheapest engine takes, in the geometric mean, {low.mean:.2f}"
    yield f"(at {low.error:.0e} rad) to {high.mean:.2f} (at {high.error:.0e} rad) times as long as ours; on the worst body"
    yield f"{worst.worst:.2f} times (at {worst.error:.0e} rad, {worst.both[0].scene})."
    missing = sum(contest.only_engine for contest in members)
    if missing:
        yield f"Only an engine reaches the error in {missing} of {total} cases."
