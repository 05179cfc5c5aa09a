"""Results of a gate: rows with chosen values, real rows of an untouched run, and the same with one thing worse."""

from dataclasses import replace
from functools import cache

from conservative.benchmarks.gate import baseline, compare
from conservative.benchmarks.gate.results import Results, Row, Status
from conservative.benchmarks.suite import points
from conservative.registry import method, scene

ROW = Row(
    "file.py::test[a]",
    "brick",
    "reduced",
    Status.PASSED,
    "",
    "hash",
    {"energy drift max": 1e-3, "observed order": 2.0, "iterations": 30.0},
    {"energy drift max": 1e-5, "observed order": 0.001},
)
RUN = Results("here", {ROW.id: ROW}, "abc")
KEPT = baseline.update_baseline(None, [RUN], "first")
OTHER = Row("file.py::test[b]", "top", "gauss", Status.PASSED, "heyoka==7", "other", {"rate error max": 1.0})


def changed(row=ROW, **changes):
    """The run with its row changed; a change of `values` is merged into those it has."""
    if "values" in changes:
        changes["values"] = {**row.values, **changes["values"]}
    return Results("here", {row.id: replace(row, **changes)}, "abc")


BRICK = scene("brick_flip:t_end=1")
METHODS = SECOND, FOURTH, ENGINE = "reduced", "reduced:order=4", "mujoco:Euler"


def measured(name, instead=None):
    """The row of a method on the brick; with `instead`, measured with another one that goes by its name."""
    point = points.Point(BRICK, method(name))
    found = points.measure(replace(point, method=instead or point.method))
    values, spreads = ({key: getattr(each, kind) for key, each in found.items()} for kind in ("value", "spread"))
    labels = point.labels
    return Row(point.id, BRICK.name, name, Status.PASSED, labels["engine"], labels["definition"], values, spreads)


@cache
def untouched():
    return {name: measured(name) for name in METHODS}


@cache
def accepted():
    """The baseline that accepts the untouched run."""
    return baseline.update_baseline(None, [run()], "the first one")


def run(**changes):
    """The untouched run; `name={...}` merges values into those of a method."""
    rows = [replace(row, values={**row.values, **changes.get(name, {})}) for name, row in untouched().items()]
    return Results("here", {row.id: row for row in rows})


def failures(kept, found):
    """The violations as (measure, method)."""
    verdict = compare.judge(kept, found)
    assert verdict.passed == (not verdict.violations)
    return {(each.measure, each.method) for each in verdict.violations}
