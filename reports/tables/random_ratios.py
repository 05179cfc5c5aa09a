"""Engines' time over ours on random bodies, as tables, words and data of a picture; see `random_contests`."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from ..labels import display_name
from .cells import DASH, Cell, Grade, Table, finite_or_none, tolerance
from .random_contests import ANY, Cheapest, Contest

MILESTONES = (1e-3, 1e-6, 1e-9, 1e-12)
"""Errors, rad, of the short table."""
TERMS = (
    "Each body is drawn from a seed: asymmetric, of condition 1.1 to 100, in a turned frame, no point and no rate on an axis, "
    "in uniform gravity, on a spring, attracted to a point, or in gravity's gradient, with a field about as strong as the "
    "motion. The ratio is the cheapest engine's time over that of our cheapest general integrator, each in the cheapest of all "
    "forms and settings, for whole calls of which the end is kept; above 1 ours is faster. What a sample costs where many are "
    "kept is measured on the scenes alone. The error is the largest of twelve instants, and that of a setting the largest of "
    "it and all finer ones, so that no lucky one counts. A body on which a side does not reach the error is counted and has no "
    "ratio."
)
"""What the tables mean."""


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


def view(found: Sequence[Contest], bodies: int, seed: int) -> RandomView:
    """Return the view of the contests of the study."""
    return RandomView(bodies, seed, statements(found), as_table(found), by_engine(found), chart_points(found))


def as_table(found: Iterable[Contest], engine: str = ANY) -> Table:
    """Return the contests against an engine, a row for each field and error."""
    header = ["field", "error, rad", "bodies", "mean", "worst", "best", "worst body", "ours, most often", "engine, most often"]
    return header, [_row(contest) for contest in found if contest.engine == engine]


def _row(contest: Contest) -> list[str | Cell]:
    ratios = [_grade(value) for value in (contest.mean, contest.worst, contest.best)]
    winners = [_most_often(found) for found in ([p.ours for p in contest.both], [p.engine for p in contest.both])]
    worst = str(contest.both[0].body) if contest.both else DASH
    return [contest.field, tolerance(contest.error), count_text(contest), *ratios, worst, *winners]


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
    """Return mean, worst and best ratio at `MILESTONES`, a row for each field and engine that takes it."""
    chosen = [contest for contest in found if contest.engine != ANY and contest.error in MILESTONES]
    cells = {(contest.field, contest.engine, contest.error): _spread(contest) for contest in chosen}
    places = dict.fromkeys((contest.field, contest.engine) for contest in chosen if contest.pairs)
    rows = [[*place, *(cells.get((*place, error), DASH) for error in MILESTONES)] for place in places]
    return ["field", "engine", *(tolerance(error) for error in MILESTONES)], rows


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
    shown = display_name("", "", name)
    return shown if count == total else f"{shown} ({count} of {total})"


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
    yield f"over {count_bodies(len(members[0].pairs))} the cheapest engine takes, in the geometric mean, {low.mean:.2f}"
    yield f"(at {tolerance(low.error)} rad) to {high.mean:.2f} (at {tolerance(high.error)} rad) times as long as our cheapest"
    yield f"general integrator; on the worst body {worst.worst:.2f} times"
    yield f"(at {tolerance(worst.error)} rad, {worst.both[0].scene})."
    missing = sum(contest.only_engine for contest in members)
    if missing:
        yield f"Only an engine reaches the error in {missing} of {total} cases."


def count_bodies(count: int) -> str:
    """Return a number of bodies in words."""
    return "one body" if count == 1 else f"{count} bodies"
