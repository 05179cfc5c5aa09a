"""The hard cases: every registered scene with every method, in one or two settings.

Rows are errors of attitude and rates and drifts of all invariants over `TURN` rad at the scene's step size. Cases that a method
does not support have rows with that outcome.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from conservative import registry
from conservative.grid import Grid, grid_for
from conservative.method import Method, Role
from conservative.scene import Scene

from ..measures.measurement import Measurement
from .case import Case
from .declaration import Declaration, Extent
from .paper import measure_accuracy
from .selection import Missing, in_tables
from .study import HANG_FACTOR, Progress, Study
from .time_limit import attempt_within

TURN = 60.0
"""Length of the runs, rad at the initial rate. Limited, because multi-precision reference solutions take seconds."""
LIMIT = 20.0
"""Wall-time limit of a run, s, including compilation; longer if the time budget is more than a tenth of it."""


def scenes() -> tuple[Scene, ...]:
    """Return every registered scene with its default parameters, by group."""
    return tuple(sorted(map(registry.scene, registry.list_scenes()), key=lambda scene: scene.group))


def settings(methods: Iterable[Method]) -> tuple[Method, ...]:
    """Return one or two settings of each family: the first and the last for our methods, the first two for an engine."""
    families: dict[str, list[Method]] = {}
    for method in methods:
        if method.role != Role.TRUTH:
            families.setdefault(method.name if isinstance(method, Missing) else method.family, []).append(method)
    pairs = ((m[0], m[-1] if m[0].role == Role.OURS else m[:2][-1]) for m in families.values())
    return tuple(method for pair in pairs for method in dict.fromkeys(pair))


def grid(scene: Scene) -> Grid:
    """Return the steps of a scene: its own, over its duration or `TURN`, whichever is shorter."""
    rate = float(np.linalg.norm(scene.w_WB_B0))
    end = min(scene.t_end, TURN / rate) if rate else scene.t_end
    return grid_for(scene, min(scene.dt, end), end)


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield all errors, drifts and work of every method on every scene."""
    limit = max(LIMIT, HANG_FACTOR * study.longest_run)
    tell = study.count(progress, len(study.competitors) + 1)
    for scene in study.scenes:
        tell(f"{scene.name}: truth")
        steps = grid(scene)
        truth = study.truth(scene, steps).trajectory
        for method in study.competitors:
            tell(f"{scene.name}: {method.name}")
            case = Case(study.name, scene, method, steps)
            done = attempt_within(limit, case, study.skip_missing, apart=True)
            yield from measure_accuracy(case, done, truth)


STUDY = Declaration(
    findings,
    Extent.LONG,
    apart=True,
    scenes=scenes,
    settings=lambda method: settings(in_tables(method)),
    of_engines=settings,
    in_report=settings,
)
