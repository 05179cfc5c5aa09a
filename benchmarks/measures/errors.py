"""Errors of a trajectory against a reference solution, and drifts of its invariants."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from conservative.attitude import Array, angle_between, orthonormality
from conservative.errors import BadInput
from conservative.invariants import sizes
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from .convergence_order import fit_line
from .measure import Measure, Value

CONSERVED, SMALL = 1e-10, 1e-3
"""Relative drift up to which a quantity is conserved, and up to which its drift is small."""
LOST = 1.0
"""Attitude error, rad, above which an attitude is lost."""

FAR_SIDE = 0.5
"""Fraction of the initial momentum along the spin axis that the reversed momentum has to reach for a flip."""
OF_TRUTH = ", loads of the truth"
"""Ends the name of the drift of a balance with the work or impulse of the truth."""


def is_lost(error: float) -> bool:
    """Return whether an attitude with this error, rad, is lost. Wherever "lost" is said of an attitude, this decides."""
    return error > LOST


def measure_errors(trajectory: Trajectory, truth: Trajectory) -> list[Value]:
    """Return every measure of a trajectory; `blanks(trajectory.scene)` returns the same measures without values.

    Attitude: the angle of R_ref' R, rad. Rates: |w - w_ref| relative to the largest exact |w|. In uniform gravity and in free
    flight also the error of the centre of mass, m. For each invariant of the scene: |I - I0| / scale with its initial value
    I0, and the slope of (I - I0) / scale over time. Orthonormality: the largest component of |R'R - 1|.

    Parameters
    ----------
    trajectory
        Can end early; its samples are measured.
    truth
        The exact motion at the same times.

    Raises
    ------
    BadInput
        The trajectory is empty, or its times are not the first ones of the truth.
    """
    n = len(trajectory)
    if n == 0:
        raise BadInput("trajectory", "no sample", "one sample or more")
    allowed = f"the {n} times of the trajectory, to {trajectory.t[-1]:g} s, or more"
    if len(truth) < n:
        raise BadInput("truth", f"{len(truth)} samples", allowed)
    off = np.abs(truth.t[:n] - trajectory.t).max()
    if off > 1e-12 * max(1.0, abs(float(trajectory.t[-1]))):
        raise BadInput("truth", f"times that differ by up to {off:.3g} s", allowed)
    R_ref, w_ref = truth.R_WB[:n], truth.w_WB_B[:n]
    attitude = angle_between(R_ref, trajectory.R_WB)
    rates = np.linalg.norm(trajectory.w_WB_B - w_ref, axis=1) / (np.linalg.norm(truth.w_WB_B, axis=1).max() or 1.0)
    measured = [
        Value(Measure.ATTITUDE_MAX, float(attitude.max())),
        Value(Measure.ATTITUDE_FINAL, float(attitude[-1])),
        Value(Measure.ATTITUDE_RMS, float(np.sqrt(np.mean(attitude**2)))),
        Value(Measure.RATES_MAX, float(rates.max())),
        Value(Measure.RATES_FINAL, float(rates[-1])),
    ]
    potential, flight, position = trajectory.scene.potential, trajectory.scene.flight, None
    if isinstance(potential, UniformGravity):
        position = np.linalg.norm((trajectory.R_WB - R_ref) @ potential.com_B, axis=1)
    elif flight:
        c, _ = flight.centre(trajectory.R_WB, trajectory.w_WB_B, *trajectory.place)
        position = np.linalg.norm(c - flight.fall(trajectory.scene, trajectory.t)[0], axis=1)
    if position is not None:
        measured += [Value(Measure.POSITION_MAX, float(position.max())), Value(Measure.POSITION_FINAL, float(position[-1]))]
    return measured + measure_drifts(trajectory, truth)


def measure_drifts(trajectory: Trajectory, truth: Trajectory | None = None) -> list[Value]:
    """Return the drift of each invariant, and orthonormality.

    With a truth, the drift of a balance is also given with the work or impulse of the truth, which is the truth's change of
    energy or momentum, in place of the method's own.
    """
    drifts: list[Value] = []
    scene, n = trajectory.scene, len(trajectory)
    relatives = {invariant.name: trajectory.drift(invariant) for invariant in scene.invariants}
    if truth is not None:
        for balance in (invariant for invariant in scene.invariants if invariant.supplied):
            off = trajectory.values_of(balance) - truth.values_of(balance)[:n]
            relatives[balance.name + OF_TRUTH] = np.asarray(off / balance.scale)
    for name, relative in relatives.items():
        size = sizes(relative)
        slope, stderr = secular_slope(trajectory.t, relative)
        drifts += [
            Value(Measure.DRIFT_MAX, float(size.max()), name),
            Value(Measure.DRIFT_FINAL, float(size[-1]), name),
            Value(Measure.DRIFT_SLOPE, slope, name),
            Value(Measure.DRIFT_SLOPE_STDERR, stderr, name),
        ]
    return [*drifts, Value(Measure.ORTHONORMALITY, float(orthonormality(trajectory.R_WB).max()))]


def blanks(scene: Scene) -> list[Value]:
    """Return the measures of `measure_errors` for a scene without values, for a run that failed."""
    start = Trajectory(scene, np.zeros(1), scene.R_WB0[None], scene.w_WB_B0[None], "start")
    return [replace(value, value=math.nan) for value in measure_errors(start, start)]


def count_turns_over(trajectory: Trajectory) -> int:
    """Return how often a body turned over.

    The momentum component along one principal axis changes its sign when the body turns over. The axis is the one with the
    largest component at the start. A sign counts only if the component reaches `FAR_SIDE` of its initial size, so that small
    oscillations about zero are ignored.
    """
    body, start = trajectory.scene.body, trajectory.scene.w_WB_B0
    along = (body.momentum(trajectory.w_WB_B) @ body.R_BP)[:, int(np.argmax(np.abs(body.momentum(start) @ body.R_BP)))]
    signs = np.sign(along[np.abs(along) >= FAR_SIDE * abs(along[0])])
    return int(np.count_nonzero(np.diff(signs)))


def secular_slope(t: Array, drift: Array) -> tuple[float, float]:
    """Return the least-squares slope of a drift (n,) over t (n,), 1/s, and its standard error; nan for less than three samples.

    For a vector (n, 3) it is the length of the three slopes. The standard error assumes independent residuals. A drift that
    only oscillates has a slope within a few standard errors, or one that decreases with the length of the run.
    """
    if len(t) < 3:
        return math.nan, math.nan
    if drift.ndim == 1:
        return fit_line(t, drift)[:2]
    lines = [fit_line(t, column) for column in drift.T]
    return math.hypot(*(line.slope for line in lines)), math.hypot(*(line.stderr for line in lines))
