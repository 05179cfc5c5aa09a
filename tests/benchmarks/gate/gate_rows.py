"""Results of a gate: those of an untouched run, and the same with one thing worse."""

from dataclasses import replace

from conservative.benchmarks.gate import compare, yardstick
from conservative.benchmarks.gate.results import Row, Status
from conservative.benchmarks.suite import points
from conservative.registry import method, scene

BRICK = scene("brick_flip:t_end=1")
MACHINE = "this one"
METHODS = ("reduced", "reduced:order=4", "mujoco:Euler")
SECOND, FOURTH, ENGINE = METHODS


COMPILE_REFERENCE = yardstick.compile_reference
STEP, TURN = 1e-7, 2e-8
"""Time, s, of a step of any method and of a turn of the yardstick on a clock that only counts them."""


def row_of(name, instead=None):
    """The row of a method; with `instead`, measured with another one that goes by its name."""
    point = points.Point(BRICK, method(name))
    labels = point.labels
    found = points.measure(replace(point, method=instead or point.method))
    values, spreads = ({key: getattr(each, kind) for key, each in found.items()} for kind in ("value", "spread"))
    ratio = yardstick.time_ratio(instead or point.method, BRICK, BRICK.dt) if name == SECOND and not instead else None
    return Row(point.id, BRICK.name, name, Status.PASSED, labels["engine"], labels["definition"], values, spreads, ratio)


def with_row(untouched, name, **changes):
    """The results with one row changed; a change of `values` is merged into those it has."""
    (id,) = (id for id, row in untouched.rows.items() if row.method == name)
    row = untouched.rows[id]
    changes["values"] = {**row.values, **changes.get("values", {})}
    return replace(untouched, rows={**untouched.rows, id: replace(row, **changes)})


def failures(kept, found, times="required"):
    """The violations as (measure, method), and their text."""
    verdict = compare.judge(kept, found, times)
    assert verdict.passed == (not verdict.violations)
    return {(each.measure, each.method) for each in verdict.violations}, str(verdict)
