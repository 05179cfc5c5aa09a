"""The study of stability: how long a step each method can take on the hard cases, and what happens at the first it cannot.

A method takes `STEPS` steps at each rung of a ladder of |w| dt, with |w| that of the scene's start, until one does not work:

    ok               the run reached its end, and nothing below applies
    not converged    the equations of a step could not be solved, as the method itself reports
    wrong branch     the method reports that the equations have only solutions which the state does not lead to continuously;
                     or, of any method and while the body turns by no more than pi, where angles are not ambiguous: the first
                     step ends further from the true attitude than a body that did not move
    diverged at t    the state is not finite from t on, or the energy is off by more than its own scale
    timeout          the run took longer than `LIMIT` s
    unsupported      the method does not have the scene, or not the step
    engine error     an engine raised an exception of its own

Accuracy is not asked for: a step of 3 rad that stays on the right branch is as inaccurate as its order makes it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from conservative.attitude import Array, angle_between
from conservative.benchmarks.studies.case import OK
from conservative.errors import Diverged, NotConverged, WrongBranch
from conservative.method import Grid, Method
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.measurement import Measurement
from .case import ENGINE_ERROR, UNSUPPORTED, Case, Done, Failed, at_no_step, attempt
from .selection import Missing
from .time_limit import TooLong, within

if TYPE_CHECKING:
    from .studies import Progress, Study

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
"""Free bodies and bodies in fields on which a long step is hard in different ways; one of each kind."""

UNIT = 0.1
RUNGS = (1, 2, 3, 5, 7, 10, 15, 20, 25, 30, 40, 50, 70, 100)
"""The ladder: |w| dt in units of `UNIT` rad."""
STEPS = 24
LIMIT, FIRST_LIMIT = 1.0, 60.0
"""Time, s, that a run is waited for. The first of a method on a scene may have to compile."""
SLACK = 1e-6
"""How much further off, rad, is not called further: a body at rest turns by round-off only."""

WRONG_BRANCH, DIVERGED, TIMEOUT = WrongBranch.kind, "diverged at t", "timeout"
KINDS = (OK, NotConverged.kind, WRONG_BRANCH, DIVERGED, TIMEOUT, UNSUPPORTED, ENGINE_ERROR)
LARGEST, FIRST = "largest |w| dt that works", "first |w| dt that does not"
MEASURES = ((LARGEST, "rad"), (FIRST, "rad"))


def kind(status: str) -> str:
    """Return which of `KINDS` a status is; what is none of them, such as "missing", as it is."""
    return next((known for known in KINDS if status.startswith(known)), status)


def stability(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield two rows for each method with a step on each scene: the largest |w| dt that works, and the first that does not.

    The status of the second is the kind of the failure; that of the first is the same where no rung works.
    """
    methods = [method for method in study.methods if method.order is not None or isinstance(method, Missing)]
    total = len(study.scenes) * len(methods)
    for i, scene in enumerate(study.scenes):
        known = Known.of(study, scene)
        for j, method in enumerate(methods):
            progress(i * len(methods) + j, total, f"{scene.name}: {method.name}")
            yield from climbed(study, known, method)


@dataclass(frozen=True, eq=False)
class Known:
    """A scene, its rate |w| at the start (rad/s), and its true attitudes (n, 3, 3) at whole units of |w| t, for half a turn."""

    scene: Scene
    rate: float
    R_WB: Array

    @classmethod
    def of(cls, study: Study, scene: Scene) -> Known:
        """Return what is known of a scene. One at rest is measured in its own steps."""
        rate = float(np.linalg.norm(scene.w_WB_B0)) or UNIT / scene.dt
        truth = study.truth(scene, Grid(UNIT / rate, math.floor(math.pi / UNIT))).trajectory
        turned = np.cumsum(np.linalg.norm(truth.w_WB_B, axis=1)) * UNIT / rate
        return cls(scene, rate, truth.R_WB[: np.count_nonzero(turned <= math.pi)])

    def grid(self, rung: int) -> Grid:
        """Return the steps of a rung."""
        return Grid(UNIT * rung / self.rate, STEPS)


def climbed(study: Study, known: Known, method: Method) -> list[Measurement]:
    """Return the rows of one method on one scene."""
    works, limit = math.nan, FIRST_LIMIT
    case = Case(study.name, known.scene, method, known.grid(RUNGS[0]))
    for rung in RUNGS:
        failed = failure_at(study, known, method, rung, limit)
        if failed is not None:
            status = kind(failed.status)
            first = UNIT * rung if works > 0 else math.nan
            detail = "; ".join(filter(None, (failed.status, failed.detail)))
            rows = [
                case.row(LARGEST, works, "rad", OK if works > 0 else status, detail),
                case.row(FIRST, first, "rad", status, detail),
            ]
            return [at_no_step(row) for row in rows]
        works, limit = UNIT * rung, LIMIT
    rows = [case.row(LARGEST, works, "rad"), case.row(FIRST, math.nan, "rad", OK, "the whole ladder works")]
    return [at_no_step(row) for row in rows]


def failure_at(study: Study, known: Known, method: Method, rung: int, limit: float) -> Failed | None:
    """Return how a method fails at a rung, None where it works."""
    case = Case(study.name, known.scene, method, known.grid(rung))
    try:
        outcome = within(limit, lambda: attempt(case, study.skip_missing))
    except TooLong as late:
        return Failed(TIMEOUT, str(late))
    if isinstance(outcome, Failed):
        return Failed(outcome.status.replace("diverged after t", DIVERGED), outcome.detail)
    return diverged(outcome) or jumped(outcome.trajectory, known, rung)


def diverged(done: Done) -> Failed | None:
    """Return the failure of a run whose energy leaves its own scale."""
    trajectory = done.trajectory
    energy = next(invariant for invariant in trajectory.scene.invariants if invariant.name == "energy")
    with np.errstate(over="ignore", invalid="ignore"):
        off = ~(np.abs(trajectory.drift(energy)) <= 1.0)
    if not off.any():
        return None
    return Failed(
        Diverged(float(trajectory.t[int(np.argmax(off))]), "energy").outcome.__str__().replace("diverged after t", DIVERGED)
    )


def jumped(trajectory: Trajectory, known: Known, rung: int) -> Failed | None:
    """Return the failure of a run whose first step ends further from the truth than where it began."""
    if rung >= len(known.R_WB):
        return None
    true = known.R_WB[rung]
    off, turn = (float(angle_between(true, R)) for R in (trajectory.R_WB[1], known.R_WB[0]))
    if off <= turn + SLACK:
        return None
    return Failed(WRONG_BRANCH, f"first step {off:.2g} rad off, the body turns by {turn:.2g} rad")
