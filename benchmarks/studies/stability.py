"""The longest step size at which each method succeeds on the hard cases, and the failure at the next longer step.

A method takes `STEPS` steps of each of `STEP_SIZES`, |w| dt with |w| the initial rate of the scene, until one fails:

    ok               the run reached its end, and nothing below applies
    not converged    the equations of a step could not be solved, as the method itself reports
    wrong branch     the method reports that the equations have only solutions which the state does not lead to continuously;
                     or, of any method and while the body turns by no more than pi, where angles are not ambiguous: the first
                     step ends further from the true attitude than a body that did not move
    diverged         the state is no longer finite, or the energy drift exceeds its reference scale
    timeout          the run of an engine exceeded `LIMIT` s or the time budget and was stopped
    unsupported      the method does not support the scene or the step size
    crashed          an engine raised an exception

Accuracy does not matter here: a step of 3 rad on the right branch passes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from conservative.attitude import Array, angle_between
from conservative.grid import Grid
from conservative.method import Method
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.scene import Scene
from conservative.trajectory import Bounds, Trajectory, cut_at_failure

from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from . import selection
from .case import Case, drop_step
from .declaration import Declaration, Extent
from .selection import Missing
from .study import Progress, Study
from .time_limit import attempt_within

SCENES = (
    "brick_flip",
    "turned_brick",
    "gazebo_box",
    "tumbling_box",
    "needle",
    "symmetric_body",
    "lagrange_top",
    "simo_wong_top",
    "asymmetric_top",
    "kovalevskaya_top",
    "sprung_body",
)
"""One free body or body in a field for each kind of difficulty with long steps."""

UNIT = 0.1
STEP_SIZES = (1, 2, 3, 5, 7, 10, 15, 20, 25, 30, 40, 50, 70, 100)
"""|w| dt in units of `UNIT` rad, short to long."""
STEPS = 24
LIMIT, FIRST_LIMIT = 1.0, 60.0
"""Wall-time limits, s: of a run, unless the time budget is longer, and of the first run of a method on a scene, which may
compile."""
TOLERANCE = 1e-6
"""Tolerance, rad, when comparing two angles: round-off turns even a body at rest."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield two rows for each method with a step size on each scene: the largest |w| dt that works, and the first that fails.

    The second row has the outcome of the failure, and so does the first row if no step size works.
    """
    methods = [method for method in study.methods if method.order is not None or isinstance(method, Missing)]
    tell = study.count(progress, len(methods))
    for scene in study.scenes:
        # A scene at rest is measured in units of its step size.
        rate = float(np.linalg.norm(scene.w_WB_B0)) or UNIT / scene.dt
        truth = study.truth(scene, Grid(UNIT / rate, math.floor(math.pi / UNIT))).trajectory
        turn = np.cumsum(np.linalg.norm(truth.w_WB_B, axis=1)) * UNIT / rate
        half_turn = truth.R_WB[: np.count_nonzero(turn <= math.pi)]
        for method in methods:
            tell(f"{scene.name}: {method.name}")
            yield from longest_step(study, scene, method, rate, half_turn)


def longest_step(study: Study, scene: Scene, method: Method, rate: float, R_WB: Array) -> list[Measurement]:
    """Return the rows of one method on a scene with the initial rate |w|, rad/s.

    `R_WB` are the exact attitudes (n, 3, 3) at whole units of |w| t, for half a turn.
    """
    works, fails, limit, outcome = math.nan, math.nan, max(FIRST_LIMIT, study.longest_run), OK
    for size in STEP_SIZES:
        case = Case(study.name, scene, method, Grid(UNIT * size / rate, STEPS))
        done = attempt_within(limit, case, study.skip_missing, apart=True)
        if isinstance(done, Outcome):
            outcome = done
        else:
            # Only divergence fails: drift and orthonormality are not bounded, because engines may lose both.
            kept = cut_at_failure(done.trajectory, frozenset(), Bounds(math.inf, math.inf))
            outcome = (detect_wrong_branch(kept, R_WB, size) or OK) if kept.ok else kept.outcome
        if not outcome.ok:
            fails = UNIT * size if works > 0 else math.nan
            break
        works, limit = UNIT * size, max(LIMIT, study.longest_run)
    rows = [
        case.row(Value(Measure.LONGEST_STEP, works), OK if works > 0 else outcome),
        case.row(Value(Measure.FAILING_STEP, fails), outcome, "every step works" if outcome.ok else ""),
    ]
    return [drop_step(row) for row in rows]  # of the last case, whose step is not the subject of either row


def detect_wrong_branch(trajectory: Trajectory, R_WB: Array, size: int) -> Outcome | None:
    """Return the outcome of a run whose first step ends further from the truth than it began, otherwise None."""
    if size >= len(R_WB):
        return None
    off, turn = (float(angle_between(R_WB[size], R)) for R in (trajectory.R_WB[1], R_WB[0]))
    if off <= turn + TOLERANCE:
        return None
    return Outcome(OutcomeKind.WRONG_BRANCH, f"first step {off:.2g} rad off, the body turns by {turn:.2g} rad")


STUDY = Declaration(findings, Extent.LONG, apart=True, scenes=lambda: selection.scenes(SCENES))
