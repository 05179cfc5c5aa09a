"""Work against precision: error and wall time over step sizes, and over tolerances of adaptive methods."""

from __future__ import annotations

import math
from collections.abc import Iterator

from conservative.method import Method
from conservative.references.environments.engine_method import EngineMethod
from conservative.scene import Scene

from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from ..measures.processes import Processes
from . import step_ladder
from .case import Case
from .declaration import Declaration
from .line import LinePoint, list_settings, measure_line
from .selection import tolerance_setting
from .speed import time_cases
from .study import Progress, Study

ERRORS = (Measure.ATTITUDE_FINAL, Measure.ATTITUDE_MAX)
TIME = Value(Measure.TIME, math.nan)
"""The time of a point that is not timed."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield error and time of every point. Rows of a point share scene, method and dt; those of a line share their series."""
    tell = study.count(progress, len(study.lines) + 1)
    with Processes(study.processes) as processes:
        for scene in study.scenes:
            good: list[LinePoint] = []
            for method, same in study.programs(scene):
                tell(f"{scene.name}: errors of {method.name}")
                if same:
                    yield Case(study.name, scene, method, step_ladder.samples(scene, method)).row(TIME, same)
                    continue
                truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
                for point in measure_line(study, list_cases(study, scene, method), truth, ERRORS):
                    yield from point.rows()
                    if point.outcome.ok:
                        good.append(point)
                    else:
                        yield point.case.row(TIME, point.outcome)
            tell(f"{scene.name}: timing {len(good)} points")
            yield from time_cases(study, good, processes)


def list_cases(study: Study, scene: Scene, method: Method) -> list[Case]:
    """Return the cases of one line, coarse to fine: step sizes, or tolerances of an adaptive method.

    Most game engines, which are in environments of their own, are of first order, so that such an engine has all step sizes.
    More steps of any other method of first order are slow and still inaccurate.
    """
    few = method.order == 1 and not isinstance(method, EngineMethod)
    grids = step_ladder.steps(scene, method)[: step_ladder.LENGTH if few else None]
    tolerances = set(step_ladder.TOLERANCES)  # all of them also in a quick study, as an engine is fastest at one of them
    if setting := tolerance_setting(method):
        tolerances.add(getattr(method, setting))
    case = Case(study.name, scene, method, step_ladder.samples(scene, method))
    return list_settings(case, grids[:: 2 if study.quick else 1], sorted(tolerances, reverse=True))


STUDY = Declaration(findings, named=True, timed=True, in_turn=True)
