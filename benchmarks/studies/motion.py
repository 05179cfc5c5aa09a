"""Motions that a report shows: the methods in the charts, each at its usual step, and the exact motion.

A run of a method in the charts has ten durations of its scene (`long_runs.end_of`), or one if it fails after that; a run of any
other setting has one. It yields the errors and drifts of the first duration. Methods in the charts also have lines: attitudes
and rates of the first duration, the drift of each invariant with its sign, and a curve on a sphere. The curve of a free body is
its polhode: the angular momentum in principal axes, relative to its initial length. The curve of a body in a field is the trace
of an axis, a unit vector in world axes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from conservative.attitude import Array, angle_between, to_quaternion
from conservative.grid import ROUNDING, Grid, grid_for
from conservative.invariants import sizes
from conservative.method import Method, Role
from conservative.outcome import Outcome
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.references.exact.method import Exact
from conservative.references.precise import Precise
from conservative.scene import Scene
from conservative.trajectory import Trajectory, head

from ..measures import errors
from ..measures.measurement import Samples
from .case import Case, Success
from .declaration import Declaration
from .long_runs import end_of
from .study import Finding, Progress, Study

SAMPLES = 700
"""Largest number of samples of a curve."""
TURN = 0.35
"""Mean angle between two samples of attitudes, rad. Animations turn the shorter way between them: right only below pi."""
FRAMES, MOST_FRAMES = 200, 2000
"""Smallest and largest number of samples of attitudes and rates, after the first one, and of the frames of an animation."""
POINTS = 120
"""Largest number of samples of a drift."""
AXES = ("x", "y", "z")
"""Quantities of a curve, in units of the sphere's radius."""
STATES = ("q_w", "q_x", "q_y", "q_z", "w_x", "w_y", "w_z")
"""Quantities of the first duration: attitude as a quaternion, body to world, and rates, rad/s, body axes."""
MOST_SAMPLES = 10**6
"""Largest number of samples of one duration: three hours of a satellite are 5,400,000 steps of an engine."""
SIGNED = "drift of "
"""Begins the quantities of relative drifts. The drift of a vector is the change of its length."""
LARGEST = "largest drift of "
"""Begins the quantities of the largest relative drift so far, over all steps of the run, at the times of the states."""
ERROR = "largest attitude error"
"""Quantity of the largest attitude error so far, rad, over all steps of the run, at the times of the states."""


def findings(study: Study, progress: Progress) -> Iterator[Finding]:
    """Yield the rows of each run, and the lines of the methods in charts, the exact motion first.

    A run that fails has rows with its outcome and no lines.
    """
    drawn = select_methods(study.methods)
    tell = study.count(progress, len(study.competitors) + 1)
    for scene in study.scenes:
        tell(f"{scene.name}: exact")
        exact = truth_of_frames(study, scene)
        solver = Exact() if Exact().unsupported(scene) is None else Precise()
        if isinstance(exact, Trajectory):
            grid = Grid(scene.t_end / FRAMES, FRAMES)
            yield from _lines(Case(study.name, scene, solver, grid), exact, exact, exact)
        runs = {method: list_runs(study, scene, method, method in drawn) for method in study.competitors}
        skipped = study.skip_slow([run[-1] for run in runs.values()], [run[0] for run in runs.values() if len(run) > 1])
        for method, cases in runs.items():
            tell(f"{scene.name}: {method.name}")
            first = cases[-1].grid
            for case in cases:
                done = skipped.get(case) or study.attempt(case)
                if isinstance(done, Success):
                    begin, truth = head(done.trajectory, first.n_samples), study.find_truth(scene, first)
                    yield from case.accuracy_rows(begin, truth)
                    if method in drawn and isinstance(exact, Trajectory) and isinstance(truth, Trajectory):
                        yield from _lines(case, done.trajectory, begin, exact, angle_between(truth.R_WB, begin.R_WB))
                    break
            if isinstance(done, Outcome):
                yield from case.rows(errors.blanks(scene), done)


def list_runs(study: Study, scene: Scene, method: Method, drawn: bool) -> list[Case]:
    """Return the runs of a method of which the first that succeeds is shown: ten durations if it is drawn, and one."""
    step = min(scene.t_end, (method.order and method.method_info.usual_dt) or scene.dt)
    every = math.ceil(scene.t_end / step / MOST_SAMPLES)
    if every > 1:  # a run of ten durations would have other samples, and one duration is long enough
        drawn = False
    ends = dict.fromkeys((*([end_of(scene)] if drawn else []), scene.t_end))
    return [Case(study.name, scene, method, grid_for(scene, step, end, every)) for end in ends]


def select_methods(methods: Sequence[Method]) -> list[Method]:
    """Return the methods in the charts: the settings in `MethodInfo.pictures` of each family, or else the first."""
    competitors = [method for method in methods if method.role != Role.TRUTH]
    preferred = [method for method in competitors if method in method.settings_for("pictures")]
    firsts = {method.family: method for method in reversed(competitors)}
    return preferred + [method for family, method in reversed(firsts.items()) if family not in {m.family for m in preferred}]


def truth_of_frames(study: Study, scene: Scene) -> Trajectory | Outcome:
    """Return the exact motion at the times of frames: of the first duration, or of the part that `MOST_FRAMES` can show.

    If two reference solutions disagree, return the reason (`Study.find_truth`).
    """
    exact = study.find_truth(scene, Grid(scene.t_end / FRAMES, FRAMES))
    if isinstance(exact, Outcome):
        return exact
    fastest = float(np.linalg.norm(exact.w_WB_B, axis=1).max())
    if fastest * scene.t_end <= FRAMES * TURN:
        return exact
    end = min(scene.t_end, MOST_FRAMES * TURN / fastest)
    n = min(MOST_FRAMES, math.ceil(fastest * end / TURN))
    return study.find_truth(scene, Grid(end / n, n))


def _lines(
    case: Case, trajectory: Trajectory, begin: Trajectory, exact: Trajectory, error: Array | None = None
) -> Iterator[Samples]:
    """Yield the lines of a motion, of its first duration `begin` and its errors there, at the times of `exact` or fewer."""

    def line(quantity: str, values: Array, some: Array) -> Samples:
        return case.samples(quantity, trajectory.t[some], values[some])  # `begin` has the same times

    def spread(n: int, count: int) -> Array:
        return np.unique(np.linspace(0, n - 1, count).round().astype(int))

    last = min(len(begin) - 1, int(np.searchsorted(begin.t, exact.t[-1] * (1 - ROUNDING))))
    shown, states = spread(last + 1, len(exact)), np.hstack([to_quaternion(begin.R_WB), begin.w_WB_B])
    yield from (line(quantity, values, shown) for quantity, values in zip(STATES, states.T, strict=True))
    for invariant in case.scene.invariants:
        yield line(LARGEST + invariant.name, np.maximum.accumulate(sizes(begin.drift(invariant))), shown)
    if error is not None:
        yield line(ERROR, np.maximum.accumulate(error), shown)
    for invariant in case.scene.invariants:
        drift = trajectory.drift(invariant)
        if drift.ndim > 1:  # relative to the initial value, which is the scale of a vector that is not zero
            start = case.scene.initial_value(invariant) / invariant.scale
            drift = sizes(drift + start) - sizes(start)
        yield line(SIGNED + invariant.name, drift, spread(len(trajectory), POINTS))
    curve = project_on_sphere(trajectory).T
    yield from (line(axis, values, spread(len(trajectory), SAMPLES)) for axis, values in zip(AXES, curve, strict=True))


def project_on_sphere(trajectory: Trajectory) -> Array:
    """Return the points (n, 3) of a curve, in units of the sphere's radius at the start."""
    scene = trajectory.scene
    if scene.free:
        momentum = scene.body.momentum(trajectory.w_WB_B)
        return np.asarray(momentum @ np.linalg.eigh(scene.body.inertia)[1] / np.linalg.norm(momentum[0]))
    # The traced axis points to the centre of mass; without one it is the third body axis.
    com_B = np.asarray(scene.potential.com_B) if isinstance(scene.potential, UniformGravity) else np.zeros(3)
    length = float(np.linalg.norm(com_B))
    return np.asarray(trajectory.R_WB @ (com_B / length if length else np.eye(3)[2]))


STUDY = Declaration(findings, named=True)
