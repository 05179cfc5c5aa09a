"""The body whose free rotation a recording is, found from the rows alone: its inertia up to a factor, if they determine it.

Without a field, torque or damping, R J w is constant. This is linear in J, so that a recording with attitudes and rates shows
without a search whether there is such a body. The exact motion is then fitted to the rows, and compared with all of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation, RotationSpline

from conservative.attitude import Array, hat
from conservative.errors import BadInput
from conservative.scene import Scene

from ..compare import LONGEST, QUARTER, SIGMAS, Compared, Effort, estimate_noise
from ..explain import FEWEST, motion_with_inertia, stretched
from ..mistakes.scenes import body_of
from ..solution import States
from .comparison import Rows, compare, prepare
from .kinematics import find_contradiction
from .table import Recording

ROWS = 400
"""Largest number of rows from which a body is estimated, and to which it is fitted."""
FEWEST_ROWS = 8
"""Smallest number of rows that can contradict a body: start and inertia have eleven numbers, three of them in the first row."""
EFFORT = 4_000
"""Work of a fit (`Effort`): about a second of an idle core."""
SMALL = 1e-5
"""Change of the numbers of an inertia for slopes."""
LEAST_NOISE, LEAST_VISIBLE = 1e-12, 1e-8
"""Smallest noise with which the intervals of an inertia are computed, and with which it is decided whether it is determined:
differences for slopes are not better than 1e-10."""
DETERMINED = 0.01
"""Largest relative standard deviation of an inertia that a recording determines."""
FLATTEST = 1e-5, 0.02
"""Smallest moments with which a fit begins, relative to the largest one: noise can make estimates negative."""
POOR = 1e-4
"""Smallest moment of an estimate, relative to their sum, that a fit trusts: smaller ones were negative."""
NULL = 1e-6
"""Relative singular value below which an inertia in this direction is arbitrary."""
LEFT, LEFT_BY_SPLINES, LEFT_BY_NOISE = 1e-6, 0.02, 30.0
"""Largest residuals of an estimate: of attitudes with rates, of either alone with a spline, and over the noise."""
_BASIS = np.array([np.eye(3)[[i]].T * np.eye(3)[[j]] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))])
_BASIS = _BASIS + np.swapaxes(_BASIS, 1, 2) * np.array([0, 1, 1, 0, 1, 0])[:, None, None]


class Freedom(StrEnum):
    """Whether a recording is a free rotation of some body."""

    FREE = "free"
    NOT_FREE = "not free"
    OPEN = "open"
    """The rows are too few, too far apart or too noisy to decide."""


@dataclass(frozen=True, eq=False)
class FreeBody:
    """The body that fits a recording best.

    Attributes
    ----------
    recording
        The recording, in the reading (order of quaternions, units) in which it is a free rotation.
    freedom
        Whether it is a free rotation of this body.
    scene
        The body, whose inertia has the trace 1, and the state of the first row.
    directions, sizes
        Changes (5, 6) of the numbers of `stretched`, and their standard deviations (5,) for the noise of the rows.
    determined
        Whether the rows determine the inertia up to a factor.
    left
        The largest error of attitudes, rad, beside the motion of this body; nan without attitudes, or if it was not fitted.
    """

    recording: Recording
    freedom: Freedom
    scene: Scene
    directions: Array
    sizes: Array
    determined: bool = False
    left: float = math.nan

    @property
    def ratios(self) -> str:
        """The ratios of the principal moments, for a sentence."""
        moments = np.sort(self.scene.body.moments)
        digits = int(np.clip(-math.log10(max(float(self.sizes.max()), 1e-9)), 2, 5)) if self.determined else 2
        return " : ".join(f"{x:.{digits}g}" for x in moments / moments[0])

    def uncertainty(self, case: Compared) -> Array:
        """Return the errors (2,) of the motion of this body in the rows of a case that the intervals of its inertia make."""
        inertia = stretched(self.scene.body.inertia, True)
        numbers = np.hstack([np.zeros((1 + len(self.sizes), 6)), np.vstack([np.zeros(6), self.directions * SMALL])])
        R, w = case.evaluate(motion_with_inertia(case, inertia), numbers)
        off = (case.differences(R[1:], w[1:]) - case.differences(R[:1], w[:1])) / SMALL * self.sizes[:, None, None]
        parts = [np.sqrt((off[..., part] ** 2).sum(axis=(0, 2))).max() for part in (slice(9), slice(9, 12))]
        return SIGMAS * np.array(parts)


def fit_free_body(recording: Recording, error: float | None = None, guesses: Sequence[Array] = ()) -> FreeBody:
    """Return the body that fits a recording best, from estimates of its inertia and other `guesses` (3, 3)."""
    fits = [_fit(reading, error, guesses) for reading in recording.readings or [recording]]
    return next((fit for fit in fits if fit.freedom is Freedom.FREE), fits[0])


def _fit(recording: Recording, error: float | None, guesses: Sequence[Array]) -> FreeBody:
    recording = replace(recording, readings=())
    first = (np.eye(3), np.zeros(3))
    best: FreeBody | None = None
    estimates, w0, left, close = _estimate(recording.t[:ROWS], (_some(recording.data[0]), _some(recording.data[1])))
    for J in [] if left > _most_left(recording) else [*estimates, *guesses]:
        scene = _scene(J, first[0] if recording.data[0] is None else recording.data[0][0], w0)
        try:
            rows = prepare(scene, recording, True, error)
        except BadInput:  # a motion that has no exact solution at these times
            continue
        made = _refine(rows, recording, error)
        if best is None or made.freedom is Freedom.FREE:
            best = made
        if best.freedom is Freedom.FREE:
            return best
    if best is None:
        freedom = Freedom.NOT_FREE if left > _most_left(recording) else Freedom.OPEN
        best = FreeBody(recording, freedom, _scene(estimates[0], *first), np.zeros((5, 6)), np.full(5, math.inf))
    few = len(recording.t) < FEWEST_ROWS
    # An estimate that no body has is far from the best one, so that a fit can miss it.
    poor = left <= _most_left(recording) and np.linalg.eigvalsh(estimates[0])[0] < POOR * np.trace(estimates[0])
    contradiction = find_contradiction(recording, explain=False)
    contradicts = contradiction is not None and contradiction.large
    open_ = few or (not contradicts and (poor or not close or best.freedom is Freedom.OPEN))
    if best.freedom is not Freedom.FREE:
        best = replace(best, freedom=Freedom.OPEN if open_ else Freedom.NOT_FREE)
    return best


def _most_left(recording: Recording) -> float:
    """Return the largest residual of an estimate, relative to the momentum, that noise, digits or splines may explain."""
    (R, w), t = recording.data, recording.t
    noise, _ = estimate_noise(t, recording.data)  # of rows that are too far apart to tell, it is larger than the noise
    scale = 1.0 if w is None else float(np.abs(w).max()) or 1.0
    small = float(noise[0] + noise[1] / scale + recording.digits[1] + recording.digits[2] / scale)
    return max(LEFT_BY_NOISE * small, LEFT_BY_SPLINES if R is None or w is None else LEFT)


def _some(x: Array | None) -> Array | None:
    return None if x is None else x[:ROWS]


def _scene(J: Array, R0: Array, w0: Array) -> Scene:
    return Scene("free rotation", body_of((J + J.T) / (2 * np.trace(J))), R0, w0, 1.0)


def _refine(rows: Rows, recording: Recording, error: float | None) -> FreeBody:
    """Return the body whose motion fits the rows best, from the inertia of their scene on."""
    case = rows.case.first(LONGEST, FEWEST)
    case = case.take(np.unique(np.linspace(0, len(case.t) - 1, ROWS).astype(int)))
    attitudes = [*range(3)] * (case.data[0] is not None)
    case = replace(case, free=(*attitudes, 3, 4, 5), effort=Effort(EFFORT))
    inertia = stretched(case.scene.body.inertia, True)
    initial, p, _ = case.fit(motion_with_inertia(case, inertia), np.zeros(6), np.full(6, 1e-6), 12)
    found = case.at(initial).scene
    scene = _scene(inertia(p), found.R_WB0, found.w_WB_B0)
    # A start is compared as in any recording: from the first row, or fitted if that has noise or few digits.
    start = scene.rename(scene.name, R_WB0=rows.case.scene.R_WB0) if recording.data[0] is not None else scene
    again = prepare(start, recording, True, error)
    compared = compare(again.case, recording, True)
    freedom = Freedom.FREE if compared.passed else Freedom.NOT_FREE
    if compared.undecided:
        freedom = Freedom.OPEN
    directions, sizes = _intervals(replace(case, scene=scene), LEAST_NOISE)
    moments, determined = scene.body.moments, bool(_intervals(replace(case, scene=scene), LEAST_VISIBLE)[1].max() < DETERMINED)
    if determined and 2 * moments.max() > (1 + 1e-6 + SIGMAS * float(sizes.max())) * moments.sum():
        freedom = Freedom.NOT_FREE  # no body has these moments
    left = math.nan if recording.data[0] is None else float(compared.errors[0].max())
    return FreeBody(recording, freedom, scene, directions, sizes, determined and freedom is Freedom.FREE, left)


def _intervals(case: Compared, least: float) -> tuple[Array, Array]:
    """Return directions (5, 6) in the numbers of an inertia, without its factor, and their standard deviations (5,)."""
    motion = motion_with_inertia(case, stretched(case.scene.body.inertia, True))
    moved = [*case.free, *range(6, 12)]
    R, w = case.evaluate(motion, np.vstack([np.zeros(12), SMALL * np.eye(12)[moved], -SMALL * np.eye(12)[moved]]))
    d = case.differences(R, w) / np.repeat(np.maximum(case.noise, least), [9, 3])
    d = d.reshape(len(d), -1)
    n = len(moved)
    slopes = (d[1 : 1 + n] - d[1 + n :]).T / (2 * SMALL)
    starts, own = slopes[:, :-6], slopes[:, -6:]
    own = own - starts @ np.linalg.lstsq(starts, own, rcond=None)[0]
    factor = np.array([1.0, 0, 0, 1, 0, 1]) / math.sqrt(3)  # a factor of the inertia, which the motion does not show
    directions = null_space(factor[None]).T
    _, sizes, turned = np.linalg.svd(own @ directions.T, full_matrices=False)
    return turned @ directions, 1 / np.maximum(sizes, 1e-300)


def _estimate(t: Array, data: States) -> tuple[list[Array], Array, float, bool]:
    """Return estimates of an inertia (3, 3), the first rates (3,), the residual, and whether the rows are close enough.

    Rates alone obey J w' = (J w) x w, which is integrated over the rows; the rates of attitudes alone are those of a spline.
    """
    R, w = data
    close = True
    if len(t) < 3:
        return [np.eye(3)], np.zeros(3) if w is None else w[0], 0.0, False
    if R is not None and w is None:
        turns = Rotation.from_matrix(R)
        w = RotationSpline(t, turns)(t, 1)
        close = float((turns[:-1].inv() * turns[1:]).magnitude().max()) < QUARTER
    assert w is not None
    scale = float(np.linalg.norm(w, axis=1).max()) or 1.0
    momenta = np.moveaxis(_BASIS @ (w / scale).T, -1, 0).swapaxes(1, 2)  # (n, 3, 6): J w
    if R is not None:
        matrix = R @ momenta
        matrix = (matrix - matrix.mean(axis=0)).reshape(-1, 6)
    else:
        close = float(np.median(np.diff(t))) * scale < QUARTER
        torques = CubicSpline(t, (hat(w) @ momenta).reshape(len(t), -1)).antiderivative()(t).reshape(momenta.shape)
        matrix = (momenta - momenta[0] + torques).reshape(-1, 6)
    if not np.isfinite(matrix).all():
        return [np.eye(3)], w[0], 0.0, False
    _, sizes, rows = np.linalg.svd(matrix, full_matrices=False)
    estimates = [*_candidates(sizes, rows)]
    return estimates, w[0], float(sizes[-1]) / math.sqrt(len(t)) * close, close


def _candidates(sizes: Array, rows: Array) -> Iterator[Array]:
    """Yield the inertias that a matrix with these singular values (6,) and rows (6, 6) maps nearly to 0, and a ball's."""
    ball = np.array([1.0, 0, 0, 1, 0, 1])
    null = rows[sizes <= NULL * max(float(sizes[0]), 1e-300)]
    vectors = [rows[-1]] if len(null) < 2 else [null.T @ (null @ ball)]
    vectors.append(ball)
    for vector in vectors:
        J = np.tensordot(vector, _BASIS, 1)
        moments, axes = np.linalg.eigh(J * (np.sign(np.trace(J)) or 1.0))
        for flattest in FLATTEST if moments[0] < FLATTEST[1] * moments[-1] else FLATTEST[:1]:
            yield (axes * np.maximum(moments, flattest * moments[-1])) @ axes.T
