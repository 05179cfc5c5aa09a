"""The study of the hard cases: every registered scene with every method, one or two settings of each.

Rows are errors of attitude and rates and drifts of all invariants over `TURN` rad at the scene's step size. Cases that a method
does not support have rows with that outcome.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from conservative import registry
from conservative.grid import Grid, grid_for
from conservative.method import Method, Role
from conservative.scene import Scene

from ..measures.measurement import Measurement
from .case import Case
from .paper import accuracy
from .selection import Missing
from .study import HANG_FACTOR, Progress, Study
from .time_limit import attempt_apart

TURN = 60.0
"""Length of the runs, rad at the initial rate. Limited, because multi-precision reference solutions take seconds."""
LIMIT = 20.0
"""Wall-time limit of a run, s, including compilation; longer if the time budget is more than a tenth of it."""


def scenes() -> tuple[Scene, ...]:
    """Return every registered scene with its default parameters, by group."""
    return tuple(sorted(map(registry.scene, registry.list_scenes()), key=lambda scene: scene.group))


def settings(methods: tuple[Method, ...]) -> tuple[Method, ...]:
    """Return one or two settings of each family: the first and the last for our methods, the first two for an engine."""
    families: dict[str, list[Method]] = {}
    for method in methods:
        if method.role != Role.TRUTH:
            families.setdefault(method.name if isinstance(method, Missing) else method.family, []).append(method)
    return tuple(method for members in families.values() for method in dict.fromkeys((members[0], _second(members))))


def _second(members: list[Method]) -> Method:
    """Return the second setting of a family, which can be the first again."""
    return members[-1] if members[0].role == Role.OURS else members[:2][-1]


def grid(scene: Scene) -> Grid:
    """Return the steps of a scene: its own, over its duration or `TURN`, whichever is shorter."""
    rate = float(np.linalg.norm(scene.w_WB_B0))
    end = min(scene.t_end, TURN / rate) if rate else scene.t_end
    return grid_for(scene, min(scene.dt, end), end)


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield all errors, drifts and work of every method on every scene."""
    methods = study.competitors
    total, limit = len(study.scenes) * len(methods), max(LIMIT, HANG_FACTOR * study.longest_run)
    for i, scene in enumerate(study.scenes):
        progress(i * len(methods), total, f"{scene.name}: truth")
        steps = grid(scene)
        truth = study.truth(scene, steps).trajectory
        for j, method in enumerate(methods):
            progress(i * len(methods) + j, total, f"{scene.name}: {method.name}")
            case = Case(study.name, scene, method, steps)
            yield from accuracy(case, attempt_apart(limit, case, study.skip_missing), truth)
