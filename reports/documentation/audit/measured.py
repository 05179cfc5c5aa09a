"""How a number in a sentence of README follows from the evidence: what `from` in claims.toml names, a function each.

Each takes the evidence, and by name the other keys of its entry; it returns what the places of the sentence have to say.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib.metadata import entry_points
from itertools import takewhile

import pandas as pd

from conservative import registry
from conservative.benchmarks.measures.measure import Measure

from ...tables.cells import tolerance
from ...tables.random_contests import ANY, Contest
from ...tables.random_ratios import MILESTONES
from .. import readme_table
from ..evidence.store import Evidence
from .sentences import NoSupportError, Values


def drift(evidence: Evidence, scene: str, methods: Sequence[str]) -> Values:
    """Return `size`, the largest drift of the energy of each method over the scene at its own step, and that step, `dt`, s."""
    found = _measured(evidence, scene, Measure.DRIFT_MAX, "energy")
    return {"size": _values(found, methods), "dt": registry.scene(scene).dt}


def attitude(evidence: Evidence, scene: str, methods: Sequence[str]) -> Values:
    """Return `error`, rad, the largest of the attitude of each method over the scene at its own step."""
    return {"error": _values(_measured(evidence, scene, Measure.ATTITUDE_MAX, ""), methods)}


def _measured(evidence: Evidence, scene: str, measure: Measure, quantity: str) -> pd.DataFrame:
    """Return the rows of a measure at a scene's own step."""
    rows = evidence.rows
    found = rows[(rows["study"] == "paper") & (rows["scene"] == scene) & (rows["dt"] == registry.scene(scene).dt)]
    return found[(found["measure"] == measure.text) & (found["quantity"] == quantity)]


def _values(found: pd.DataFrame, methods: Sequence[str]) -> list[float]:
    return [_only(found[found["method"] == method]["value"], method) for method in methods]


def run_of(evidence: Evidence, scene: str) -> Values:
    """Return how long the scene was run for, `t_end`, and its step, `dt`, s."""
    found = re.search(rf"\b{scene}:t_end=([\d.]+)", evidence.origin["costs"]["command"])
    if not found:
        raise NoSupportError(f"the report's command does not say t_end of {scene}")
    return {"t_end": float(found[1]), "dt": registry.scene(scene).dt}


def ratios(evidence: Evidence, over: str, of: Sequence[str], scenes: Sequence[str] = (), kept: str = "") -> Values:
    """Return the least and the largest time of some columns of README's table over another's, `low` and `high`.

    That is at the errors of the table, where both get there, or in the rows whose label ends with `kept`; engines are named
    without their version.
    """
    every = [_ratio(members, name, over, error) for members, error in _entries(evidence, scenes, kept) for name in of]
    return _range([ratio for ratio in every if 0 < ratio < math.inf])


def _entries(evidence: Evidence, scenes: Sequence[str], kept: str) -> Iterator[tuple[dict[str, pd.DataFrame], float]]:
    """Yield the points of each column at each error; on some scenes, or on all."""
    labels = [tolerance(error) for error in readme_table.ERRORS]
    for scene, label, members, error in evidence.entries:
        chosen = label.endswith(kept) if kept else label in labels
        if chosen and (not scenes or scene in scenes):
            yield {_unversioned(name): points for name, points in members.items()}, error


def _unversioned(column: str) -> str:
    return column if column in list(readme_table.APART) else column.partition(" ")[0]


def _ratio(members: dict[str, pd.DataFrame], of: str, over: str, error: float) -> float:
    if of not in members or over not in members:
        return math.nan
    return readme_table.cheapest(members[of], error)[0] / readme_table.cheapest(members[over], error)[0]


def _range(values: Iterable[float]) -> Values:
    every = list(values)
    if not every:
        raise NoSupportError("no row is about it")
    return {"low": min(every), "high": max(every)}


def _only(values: pd.Series[float], what: str) -> float:
    if len(values) != 1:
        raise NoSupportError(f"the evidence has {len(values)} rows of {what}, not one")
    return float(values.iloc[0])


def random_bodies(evidence: Evidence, error: float | None = None) -> Values:
    """Return how many random bodies there are in each `field`, at how many errors, `milestones`, and in what cases ours loses.

    At one error, or at all milestones: in `lost` of `cases` an engine is faster, by up to `most` times; in `alone` ours does
    not get there. A case is a body at an error. From the `first` milestone to `won`, rad, ours is faster on every body.
    """
    found = [contest for contest in evidence.contests if contest.engine == ANY and contest.error in _errors(error)]
    lost = list(_lost(found))
    return {
        "field": len(found[0].pairs),
        "milestones": len(MILESTONES),
        "cases": sum(len(contest.pairs) for contest in found),
        "lost": len(lost),
        "most": max(lost, default=1.0),
        "alone": sum(contest.only_engine for contest in found),
        "first": MILESTONES[0],
        "won": _last_won(evidence.contests),
    }


def _errors(error: float | None) -> Sequence[float]:
    return MILESTONES if error is None else [each for each in MILESTONES if math.isclose(each, error)]


def _last_won(found: Iterable[Contest]) -> float:
    """Return the last milestone up to which ours is faster on every body, 0 without any."""
    beaten = {contest.error for contest in found if any(_lost([contest])) or contest.only_engine}
    return min(takewhile(lambda error: error not in beaten, MILESTONES), default=0.0)


def _lost(found: Iterable[Contest]) -> Iterator[float]:
    return (1 / pair.ratio for contest in found for pair in contest.both if pair.ratio < 1)


def origin(evidence: Evidence) -> Values:
    """Return `date` and `cores` of the report, and the `commit` that random bodies were measured at."""
    costs, random = evidence.origin["costs"], evidence.origin["random"]
    return {"date": costs["date"][:10], "cores": int(costs["cores"]), "commit": random["commit"][:7]}


def by_hand(evidence: Evidence, of: str, places: Sequence[str] = ()) -> Values:
    """Return what was measured by hand: `low` and `high` of the values, or each of them under the name of a place."""
    if of not in evidence.by_hand:
        raise NoSupportError(f"by_hand.csv has no row of {of!r}")
    values = evidence.by_hand[of]
    if places and len(places) != len(values):
        raise NoSupportError(f"by_hand.csv has {len(values)} values of {of!r}, not {len(places)}")
    return dict(zip(places, values, strict=True)) if places else _range(values)


def engines(evidence: Evidence, names: Sequence[str] = ()) -> Values:
    """Return, of the table of engines in references/README.md, errors of some at their best, and how many fail as installed.

    `low`, `high` and `error`, rad; `off`, how many end more than 1 rad off as installed, of `installed`, and how many have no
    default, `without`.
    """
    rows = evidence.engines
    if missing := [name for name in names if name not in rows]:
        raise NoSupportError(f"the table of engines has no {', '.join(missing)}")
    errors = [float(rows[name][6]) for name in names]
    installed = [float(cells[3]) for cells in rows.values() if cells[3] != "–"]
    counts = {"off": sum(error > 1 for error in installed), "installed": len(installed), "without": len(rows) - len(installed)}
    return {**(_range(errors) if errors else {}), "error": errors, **counts}


def registered(evidence: Evidence, group: str, without: Sequence[str] = ()) -> Values:
    """Return how many entry points a group has, `count`, apart from some."""
    return {"count": len({point.name for point in entry_points(group=group)} - set(without))}


FUNCTIONS: dict[str, Callable[..., Values]] = {
    function.__name__: function
    for function in (attitude, drift, run_of, ratios, random_bodies, origin, by_hand, engines, registered)
}
