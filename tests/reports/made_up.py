"""Made-up measurements of a whole report, and of engines."""

import math
from functools import cache

import numpy as np

from conservative import Reduced, registry
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import Samples
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.paper import AS_INSTALLED
from conservative.benchmarks.studies.selection import Missing
from conservative.benchmarks.studies.study import Study
from conservative.errors import MissingEngine
from conservative.method import Role
from conservative.outcome import OK
from conservative.reports.run.measure import Measurements

from . import rows
from .rows import frame, parts, point


def row(study, method, measure, value, dt=0.1, scene="brick_flip", **fields):
    return rows.row(study, method, measure, value, dt, scene=scene, **fields)


def convergence(method, order, scene="brick_flip"):
    """Errors over steps of a method that has just this order."""
    return [
        row("convergence", method, "attitude error max", dt**order, dt, scene) for dt in (0.1, 0.05, 0.025, 0.0125, 0.00625)
    ]


def table():
    """Rows of every study but the hard cases."""
    lines = [
        *point("reduced", "ours", 1e-2, 1e-6, scene="brick_flip"),
        *point("reduced", "ours", 1e-4, 1e-5, 0.01, scene="brick_flip"),
    ]
    lines += [*point("scipy:DOP853", "engine", 1e-3, 1e-4, scene="brick_flip")]
    drift = [
        row("long_runs", "reduced", "energy drift max", 2e-15),
        row("long_runs", "mujoco", "energy drift max", 3e-2, role="engine"),
    ]
    return frame([*lines, *drift, *convergence("reduced", 2), row("speed", "reduced", "first call time", 0.25)])


@cache  # integrating the motions takes most of a second
def measurements():
    """Rows and lines."""
    t = np.linspace(0.5, 60, 120)
    common = {"study": "motion", "scene": "brick_flip", "role": Role.OURS, "dt": 0.1, "quantity": "drift of energy"}
    names = ({"method": name, "label": name, "series": name, **parts(name)} for name in ("reduced", "mujoco"))
    lines = [Samples(**names_of, t=t, value=1e-15 * t, **common) for names_of in names]
    return Measurements(
        table().drop(columns=["name", "line"]),
        measurement.samples_frame([*lines, *curves_of("brick_flip")]),
    )


@cache
def curves_of(name):
    """Lines of the motion of `reduced` on a registered scene."""
    return curves(registry.scene(name), Reduced())


def curves(scene, *methods):
    """Lines of the motions of methods, which are integrated."""
    found = studies.findings(Study("motion", (scene,), methods))
    return [each for each in found if isinstance(each, Samples) and each.role != Role.TRUTH]


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
    found = [_row("paper", engine, setting, measure, value, 0.01, detail=detail) for measure, value in known.items()]
    for measure, value in values.items():
        shown = value if outcome == OK else math.nan
        said = facts.get("direction", "lost") if measure == "energy drift max" else ""
        study = "speed" if measure in (Measure.TIME, Measure.TIME_PER_STEP) else "paper"
        found.append(_row(study, engine, setting, measure, shown, 0.01, outcome=outcome, detail=said))
    return found


def over_steps(engine, setting, errors, order, **fields):
    """Errors and times of one setting over `STEPS`, and the order that was seen."""
    found = []
    for dt, error in zip(STEPS, errors, strict=True):
        found += [_row(study, engine, setting, Measure.ATTITUDE_MAX, error, dt) for study in ("convergence", "work_precision")]
        found.append(_row("work_precision", engine, setting, Measure.TIME, 1e-6 / dt, dt))
    for measure, value in ((Measure.ORDER, order), (Measure.ORDER_STDERR, 0.01)):
        found.append(_row("convergence", engine, setting, measure, value, math.nan, **fields))
    return found


def named(*groups):
    """The engines of rows, to be named in a plan. They cannot run."""
    names = dict.fromkeys(row.method for row in (row for group in groups for row in group) if row.role == Role.ENGINE)
    return tuple(Missing(name, error=MissingEngine(name, name)) for name in names)


def _row(study, engine, setting, measure, value, dt, **fields):
    family, _, version = engine.partition("==")
    names = {"family": family, "engine": family.partition("@")[0], "version": version, "setting": setting}
    names |= {"label": f"{engine}/{setting}", "role": "engine"}
    return rows.row(study, f"{family}@{version}:{setting}", measure, value, dt, scene=SCENE, **names, **fields)
