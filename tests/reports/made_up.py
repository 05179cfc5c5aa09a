"""Made-up measurements of a whole report."""

import numpy as np

from conservative import Reduced, registry
from conservative.benchmarks.measures import samples
from conservative.benchmarks.measures.samples import Samples
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.study import Study
from conservative.method import Role
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


def measurements():
    """Rows and lines."""
    t = np.linspace(0.5, 60, 120)
    common = {"study": "long_runs", "scene": "brick_flip", "role": Role.OURS, "dt": 0.1, "quantity": "energy"}
    names = ({"method": name, "label": name, "series": name, **parts(name)} for name in ("reduced", "mujoco"))
    lines = [Samples(**names_of, t=t, value=1e-15 * t, **common) for names_of in names]
    return Measurements(
        table().drop(columns=["name", "line"]), samples.frame([*lines, *curves(registry.scene("brick_flip"), Reduced())])
    )


def curves(scene, *methods):
    """Lines of the curves on spheres, which are integrated."""
    return list(studies.findings(Study("sphere_curves", (scene,), methods)))
