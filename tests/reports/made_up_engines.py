"""Made-up measurements of engines."""

import math

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.engines_at_one_step import AS_INSTALLED
from conservative.outcome import OK

from .rows import row

SCENE = "brick_flip"
STEPS = (0.1, 0.05, 0.025, 0.0125)


def at_step(engine, setting, error, **facts):
    """Rows of one setting at the scene's step; `outcome` is that of the run."""
    outcome = facts.get("outcome", OK)
    values = {
        Measure.ATTITUDE_MAX: error,
        "energy drift max": facts.get("energy", 1e-12),
        "momentum drift max": facts.get("momentum", 1e-6),
        Measure.TURNS_OVER: facts.get("turns", 2),
        Measure.TURNS_OVER_TRUE: 2,
        Measure.TIME_PER_STEP: 1e-6,
        Measure.TIME: 1e-4,
    }
    known = {Measure.PRECISION: facts.get("bits", 64), Measure.ORDER_EXPECTED: facts.get("expected", 4)}
    detail = AS_INSTALLED if facts.get("as_installed") else ""
    found = [
        _row(engine, setting, measure, value, 0.01, "engines_at_one_step", detail=detail) for measure, value in known.items()
    ]
    for measure, value in values.items():
        shown = value if outcome == OK else math.nan
        said = facts.get("direction", "lost") if measure == "energy drift max" else ""
        found.append(_row(engine, setting, measure, shown, 0.01, "engines_at_one_step", outcome=outcome, detail=said))
    return found


def over_steps(engine, setting, errors, order, **fields):
    """Errors and times of one setting over `STEPS`, and the order that was seen."""
    found = []
    for dt, error in zip(STEPS, errors, strict=True):
        found.append(_row(engine, setting, Measure.ATTITUDE_MAX, error, dt))
        found.append(_row(engine, setting, Measure.TIME, 1e-6 / dt, dt))
    for measure, value in ((Measure.ORDER, order), (Measure.ORDER_STDERR, 0.01)):
        found.append(_row(engine, setting, measure, value, math.nan, **fields))
    return found


def _row(engine, setting, measure, value, dt, study="engines_over_steps", **fields):
    family, _, version = engine.partition("==")
    names = {"label": f"{engine}/{setting}", "family": family, "version": version, "setting": setting, "role": "engine"}
    return row(study, f"{family}@{version}:{setting}", measure, value, dt, scene=SCENE, **names, **fields)
