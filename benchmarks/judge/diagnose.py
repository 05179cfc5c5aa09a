"""The verdict on a recorded motion, and the mistakes that explain its error. A verdict does not depend on the diagnoses."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import product
from time import monotonic
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.errors import BadInput
from conservative.flight import rotation_only
from conservative.invariants import find_energy, kinetic_energy, sizes
from conservative.needs import IN_TIME, Need
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from . import mistakes
from .mistakes import ATTITUDES, BARE, QUATERNION, READINGS, STEPS, Step
from .motion import Equations, States, closed, truth
from .table import Recording

FLOOR, ACCURATE = 1e-9, 1e-6  # errors that round-off makes in double precision, and that a good solver may leave
SIGMAS, UNITS_OF_DIGITS = 7.0, 6.0  # of noise and of the last digit, that the largest error may have
MOST_NOISE = 0.05  # of the largest rate, or rad; what is more is motion
LONGEST, FEWEST, MOST = 100.0, 100, 2500  # rad and rows that are explained, and rows at most
NUMERICAL = 5000.0  # rad that are compared without a closed form
ROUND_OFF, PERTURBED = 2e-15, 1e-8  # of an exact motion; of initial states, to see how the motion multiplies it
STEPS_AT_MOST, PARTS = 20_000, 2000  # steps of a method over the file, and between two rows
LIMIT = 60.0  # s, after which the search ends
NOT_INTEGRAL = "The rates are right, but the attitudes are not their integral: they follow"
FAR, LINEAR, HOPELESS = 0.05, 0.3, 30.0  # of another motion; taken as small; of noise, that no other first row explains
ROWS_OF_NOISE, MOST_BREAKS = 4000, 50  # rows that noise is estimated from; breaks of loads, if numbers are fitted
Motion = Callable[[Array, Array, Array], tuple[Array, Array]]
"""From initial attitudes (B, 3, 3), rates (B, 3) and other numbers (B, k) to motions (B, n, 3, 3), (B, n, 3)."""


def _rows(data: States, rows: Any) -> States:
    """Return some rows of a motion."""
    return None if data[0] is None else data[0][rows], None if data[1] is None else data[1][rows]


@dataclass(frozen=True)
class Explanation:
    """A mistake that was tried: its name, the sentence that it states about the file, and its numbers in SI units.

    `left` and `plain` are the largest errors with it and without it, over the rows that it was tried on: of attitudes, rad, and
    of rates, relative to the largest. `share` is the share of the error that is left, `size` the root of the mean square in
    units of the noise, and `explains` is True if what is left is noise.
    """

    name: str
    sentence: str
    values: dict[str, float]
    left: list[float]
    plain: list[float]
    share: float
    size: float = math.inf
    explains: bool = False
    numbers: int = 0


@dataclass(frozen=True, eq=False)
class Case:
    """Rows of a file and the scene whose motion they should be, from its initial state at `start`, s.

    `allowed` and `noise` (2,) are errors of attitudes, rad, and rates, relative to `scale`, rad/s. `free` says which of six
    numbers of the initial state, turn and rates, are fitted to all rows, because the first one has digits or noise. `growth` is
    the factor by which the motion multiplies an error of the first row, and every `stride`-th row is here.
    """

    scene: Scene
    t: Array
    data: States
    start: float
    scale: float
    allowed: Array
    noise: Array
    free: tuple[int, ...] = ()
    growth: float = 1e6
    stride: int = 1

    def take(self, rows: Any) -> Case:
        """Return some of the rows."""
        return replace(self, t=self.t[rows], data=_rows(self.data, rows))

    def first(self, angle: float, least: int) -> Case:
        """Return the rows in which the body turns by an angle, rad, or at least so many."""
        return self.take(slice(0, max(least, int(np.searchsorted(self.t, self.t[0] + angle / self.scale)))))

    def read(self, R: Array | None, w: Array | None) -> Case:
        """Return the case of other attitudes and rates, from the first row on."""
        changes = {name: x[0] for name, x in (("R_WB0", R), ("w_WB_B0", w)) if x is not None and self.start == self.t[0]}
        return replace(self, scene=self.scene.rename(self.scene.name, **changes), data=(R, w))

    @cached_property
    def exact(self) -> tuple[Array, Array]:
        """The exact motion at the times of the rows."""
        return truth(self.scene, self.start, self.t)

    @cached_property
    def error(self) -> Array:
        """The errors (2, n) of the rows against the exact motion."""
        return self.errors(*self.exact)

    def differences(self, R: Array, w: Array) -> Array:
        """Return motions (..., n, 3, 3), (..., n, 3) minus the data, (..., n, 12), rad and relative; 0 where there are none."""
        out = np.zeros((*w.shape[:-1], 12))
        if self.data[0] is not None:
            out[..., :9] = (R - self.data[0]).reshape(*w.shape[:-1], 9) / np.sqrt(2)
        if self.data[1] is not None:
            out[..., 9:] = (w - self.data[1]) / self.scale
        return np.clip(np.nan_to_num(out, nan=1e3), -1e3, 1e3)

    def errors(self, R: Array, w: Array) -> Array:
        """Return the sizes (2, n) of differences: angles between attitudes, rad, and differences of rates."""
        d = self.differences(R, w)
        return np.stack(
            [2 * np.arcsin(np.minimum(np.linalg.norm(d[..., :9], axis=-1) / 2, 1)), np.linalg.norm(d[..., 9:], axis=-1)]
        )

    def passes(self, error: Array) -> bool:
        """Return whether errors (2, n) are those of digits and noise: the largest, and the mean of squares."""
        n = error.shape[1]
        mean = np.sqrt((error**2).mean(axis=1))
        noisy = self.noise * SIGMAS > 0.5 * self.allowed
        most = np.where(noisy, 1.3 * np.sqrt(3) * (1 + 3 / np.sqrt(n)) * self.noise, self.allowed)
        return bool((error.max(axis=1) <= self.allowed).all() and (mean <= most).all())

    def size(self, error: Array) -> float:
        """Return the root of the mean square of errors, in units of the noise."""
        return float(np.sqrt((error**2).mean(axis=1) / self.noise**2).max())

    def fit(self, motion: Motion, extra: Array, changed: Array, most: int = 8) -> tuple[Array, Array, tuple[Array, Array]]:
        """Return initial numbers (6,), other numbers (k,), and the motion that fit the rows best (Levenberg and Marquardt).

        The fit starts at `extra` and at the initial state of the scene, and takes more and more of the rows. `changed` are the
        small changes of the other numbers, for slopes.
        """
        free = list(self.free)
        p, weights = np.concatenate([np.zeros(6), extra]), 1 / np.repeat(self.noise, [9, 3])
        moved = [*free, *range(6, 6 + len(extra))]
        small = np.concatenate([np.full(6, 1e-6), changed])
        n = len(self.t)

        def evaluate(many: Array) -> tuple[Array, Array]:
            turns = Rotation.from_rotvec(many[:, :3]).as_matrix()
            return motion(self.scene.R_WB0 @ turns, self.scene.w_WB_B0 + many[:, 3:6] * self.scale, many[:, 6:])

        rows = [n] if not free else [k for k in (n // 64, n // 16, n // 4) if k >= 8] + [n]
        found = evaluate(p[None])
        for k in rows if moved else ():
            damping, (R, w) = 1e-6, found
            now = (self.differences(R, w)[0] * weights)[:k].ravel()
            for _ in range(most):
                R, w = evaluate(p + np.concatenate([small * np.eye(6 + len(extra))[i][None] for i in moved]))
                slopes = ((self.differences(R, w) * weights)[:, :k].reshape(len(moved), -1) - now) / small[moved][:, None]
                better = False
                while damping < 1e3 and not better:
                    normal = slopes @ slopes.T
                    step = np.linalg.lstsq(normal + damping * np.diag(np.diag(normal) + 1e-300), -slopes @ now, rcond=1e-15)[0]
                    q = p.copy()
                    q[moved] += step
                    R, w = evaluate(q[None])
                    new = (self.differences(R, w)[0] * weights)[:k].ravel()
                    better = bool(new @ new < now @ now)
                    damping = damping / 30 if better else max(damping, 1e-6) * 30
                if not better:
                    break
                gain = 1 - (new @ new) / (now @ now)
                p, now, found = q, new, (R, w)
                if gain < 1e-3 or np.sqrt(now @ now / len(now)) < 1e-3:
                    break
        return p[:6], p[6:], (found[0][0], found[1][0])

    def at(self, initial: Array) -> Case:
        """Return the case whose initial state is changed by six numbers, as `fit` finds them."""
        R0, w0 = self.scene.R_WB0 @ Rotation.from_rotvec(initial[:3]).as_matrix(), self.scene.w_WB_B0 + initial[3:] * self.scale
        return replace(self, scene=self.scene.rename(self.scene.name, R_WB0=R0, w_WB_B0=w0))


def differ(R0: Array, w0: Array, R: Array, w: Array, scale: float) -> Array:
    """Return motions (..., n) minus another one (n), (..., n, 6): turns in body axes, rad, and relative rates."""
    turn = np.nan_to_num(np.swapaxes(R0, -1, -2) @ R) + 0.0
    turn[np.abs(np.linalg.det(turn)) < 0.5] = np.eye(3)
    vector = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_rotvec().reshape(*turn.shape[:-2], 3)
    return np.concatenate([vector, np.nan_to_num(w - w0) / scale], axis=-1)


def linearise(case: Case) -> tuple[Array, Array, Array]:
    """Return the exact motion (n, 3, 3), (n, 3), and the matrices (n, 6, 6) that carry small changes of its start along."""
    turns, shifts = np.split(np.vstack([np.zeros(6), PERTURBED * np.eye(6)]), 2, axis=1)
    R0 = case.scene.R_WB0 @ Rotation.from_rotvec(turns).as_matrix()
    R, w = exact(case)(R0, case.scene.w_WB_B0 + shifts * case.scale, np.zeros((7, 0)))
    return R[0], w[0], np.moveaxis(differ(R[0], w[0], R[1:], w[1:], case.scale), 0, -1) / PERTURBED


def exact(case: Case) -> Motion:
    """Return the exact motion as a function of initial states."""

    def motion(R: Array, w: Array, _: Array) -> tuple[Array, Array]:
        if closed(case.scene) and (case.t[-1] - case.start) * case.scale > 3 * LONGEST:
            each = [truth(case.scene.rename("file", R_WB0=a, w_WB_B0=b), case.start, case.t) for a, b in zip(R, w, strict=True)]
            return np.stack([a for a, _ in each]), np.stack([b for _, b in each])
        return Equations(case.scene).solve(case.start, R, w, case.t)

    return motion


def estimate_noise(t: Array, data: States) -> tuple[Array, Array]:
    """Return the noise (2,) of attitudes, rad, and rates, rad/s, of one axis, and whether the rows are close enough to tell.

    It is the smallest robust estimate from differences of order 3 to 9. Of a smooth motion they fall with each order, and those
    of noise do not.
    """
    noise, resolved = np.zeros(2), np.zeros(2, bool)
    for i, (values, size) in enumerate(zip(data, (2.0, 1.0), strict=True)):
        if values is None or len(t) < 14:
            continue
        x = values
        if i == 0:
            x = to_quaternion(values)
            x = x * np.cumprod(np.append(1.0, np.sign(np.sum(x[1:] * x[:-1], axis=1)) + 0.0))[:, None]
        found = []
        for order in range(3, 10):
            near = np.stack([t[k : len(t) - order + k] for k in range(order + 1)])
            gaps = near[:, None] - near[None] + np.eye(order + 1)[:, :, None] * np.ptp(near, axis=0)
            weights = 1 / np.prod(gaps / np.ptp(near, axis=0), axis=1)
            weights = weights / np.sqrt((weights**2).sum(axis=0))
            d = sum(weights[k][:, None] * x[k : len(t) - order + k] for k in range(order + 1))
            found.append(size * float(np.median(np.linalg.norm(d, axis=1))) / 1.538)
        noise[i] = min(found)
        resolved[i] = found[-1] > 0.5 * found[-3] or noise[i] < 1e-11
    return noise, resolved


def judge(
    scene: Scene,
    recording: Recording,
    from_row: bool = True,
    error: float | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the summary of a recording as a motion of a scene, and rows with t, quantity and value.

    Times of the file are those of the scene. The exact motion has the state of the first row at its time, or, if that has noise
    or few digits, the state that fits all rows best; or the scene's initial state at t = 0.

    The summary has the verdict: "right", "wrong" or "undecided", with what decides it. Without `error` digits and noise decide.
    It also has what was compared, the columns that were not, and why; the largest errors, of attitudes, rad, and of rates,
    relative to the largest; the unit of each in the file and its size, 0 if the file has none; and the diagnoses. `tell` gets
    the name of the next piece of work.

    Raises `BadInput` for an error that is not a number of 1e-12 or more, and for times at which a load has no value.
    """
    if error is not None and not (math.isfinite(error) and error >= 1e-12):
        raise BadInput("error", f"{error:g}", "a finite number of 1e-12 or more, which the exact motion is rounded to")
    case, notes, noise, resolved = _read(rotation_only(scene), recording, from_row, error)
    tell("compare")
    whole, undecided = case, ""
    if not closed(case.scene) and len(near := case.first(NUMERICAL, 2).t) < len(case.t):
        case = case.take(slice(0, len(near)))
        undecided = f"Rows after {case.t[-1]:g} s are not compared: no closed form is known. A shorter file decides"
    parts, missing = _stretches(case, from_row)
    errors = np.concatenate([part.error for part in parts], axis=1)
    passed = all(part.passes(part.error) for part in parts)
    if not passed and (len(parts) > 1 or (parts[0].error[:, 0] > case.allowed).any()):  # stretches and starts of right motions
        parts, errors = [replace(case, growth=parts[0].growth)], case.error
    worst, compared = errors, len(case.t)
    outliers = _outliers(errors, case)
    if (passed or outliers) and recording.rows > len(recording.t) and not undecided:
        worst, compared, bad = _compare_all(parts, recording, whole.t[0] - recording.t[0] if from_row else 0.0)
        passed = passed and bad is None
        outliers = outliers or ([] if bad is None else [bad])
    elif recording.rows > len(recording.t):
        notes.append(f"{compared:,} of {recording.rows:,} rows are compared.")
    shape_allowed = max(1e-6, UNITS_OF_DIGITS * recording.digits[1], SIGMAS * noise[0]) if error is None else error
    shaped = recording.shape is None or np.abs(recording.shape).max() <= shape_allowed
    named: list[Explanation] = []
    tried: list[Explanation] = []
    if outliers and not passed:
        number, at, size = outliers[0]
        text = f"Single rows are off, the first of them row {number:,} at {at:g} s, by {size:.2g}; the others agree"
        values = {"row": float(number), "time": at, "error": size}
        named = [Explanation("single rows", text, values, [0.0, 0.0], worst.max(axis=1).tolist(), 0.0, 0.0, True)]
    elif not passed:
        tell("explain")
        named, tried = diagnose(replace(case, growth=parts[0].growth), recording.layout.attitude in (None, "quaternion"), tell)
        if (corners := len(case.scene.breaks)) > MOST_BREAKS:
            notes.append(f"Other bodies, axes and damping are not fitted: the loads have {corners} jumps and corners.")
    verdict = "right" if passed and shaped else "wrong"
    if verdict == "right":
        undecided = undecided or missing
    elif error is None and shaped and not any(each.explains for each in named):
        undecided = _doubt(case, errors, resolved, recording)
    else:
        undecided = ""
    if len(parts) > 1:
        notes.append(f"The exact motion starts again in {len(parts) - 1} rows: it multiplies the rounding of a row too much.")
    found = _Findings(
        case.take(slice(0, errors.shape[1])), parts, errors, worst, compared, named, tried, verdict, undecided, notes, noise,
        shaped, from_row, error, float(recording.t[0] - whole.t[0]),
    )  # fmt: skip
    return _summary(found, recording)


@dataclass(frozen=True, eq=False)
class _Findings:
    """All that a judgement found: the rows that were compared, in stretches, the errors of each and the worst of the file."""

    case: Case
    parts: list[Case]
    errors: Array
    worst: Array
    compared: int
    named: list[Explanation]
    tried: list[Explanation]
    verdict: str
    undecided: str
    notes: list[str]
    noise: Array
    shaped: bool
    from_row: bool
    error: float | None
    shift: float


def _doubt(case: Case, errors: Array, resolved: Array, recording: Recording) -> str:
    """Return what would decide about errors that a mistake or something harmless could have made; "" if they are wrong."""
    single = max(recording.digits[1:]) > 1e-9
    if errors.max() <= (1e-4 if single else ACCURATE) and errors.max() > case.allowed.min():
        return (
            f"The error is larger than the digits of the file allow, and as small as that of a good solver in "
            f"{'single' if single else 'double'} precision. An allowed error decides: --error"
        )
    if not resolved[[x is not None for x in case.data]].all() and errors.max() <= 2 * MOST_NOISE and len(case.t) >= 14:
        d = case.differences(*case.exact)
        if abs(float((d[1:] * d[:-1]).sum() / (d * d).sum())) < 0.3:
            return "What is left looks like noise, but the rows are too far apart to tell. More rows a turn, or --error, decide"
    return ""


def _outliers(errors: Array, case: Case) -> list[tuple[int, float, float]]:
    """Return number, time and error of rows that are off while at least 98 of 100 others agree."""
    off = np.flatnonzero((errors > case.allowed[:, None]).any(axis=0))
    if not 0 < len(off) <= 0.02 * len(case.t) or 0 in off:
        return []
    return [(int(k) + 1, float(case.t[k]), float(errors[:, k].max())) for k in off]


def _misshapen(recording: Recording) -> str:
    """Return the finding that matrices are not rotations, or quaternions not of norm 1."""
    shape = recording.shape
    assert shape is not None
    k, matrix = int(np.argmax(np.abs(shape))), recording.layout.attitude == "matrix"
    what = "The matrices are not rotations: |R'R - 1| is" if matrix else "The quaternions are not of norm 1: it differs by"
    return f"{what} up to {abs(float(shape[k])):.3g}, at {recording.t[k]:g} s. They are repaired before they are compared"


def _read(scene: Scene, recording: Recording, from_row: bool, error: float | None) -> tuple[Case, list[str], Array, Array]:
    """Return the case of a recording, notes on its rows, its noise, and whether its rows are close enough to tell."""
    (R, w), t, first = recording.data, recording.t, float(recording.t[0])
    timed = bool(scene.loads or scene.needs & IN_TIME)
    if first < 0 and (timed or not from_row):
        raise BadInput("run", f"a first row at {first:g} s", "times of the scene, from 0 on")
    if timed:  # its loads need values in all rows
        scene = scene.rename(scene.name, t_end=max(scene.t_end, float(t[-1])))
    elif from_row:  # sums of steps and a large time would lose digits
        t = t - first
    notes = []
    if first != 0 and not from_row:
        notes.append(f"The first row is compared with the motion of the scene at {first:g} s.")
    chunk = next(recording.stream())
    noise, resolved = estimate_noise(chunk[0][:ROWS_OF_NOISE], _rows(chunk[1], slice(0, ROWS_OF_NOISE)))
    scale = float(np.linalg.norm(scene.w_WB_B0[None] if w is None else w, axis=1).max())
    if scale == 0 and w is None and R is not None:
        turned = Rotation.from_matrix(np.swapaxes(R[:-1], 1, 2) @ R[1:]).as_rotvec()
        scale = float((np.linalg.norm(turned, axis=1) / np.diff(t)).max())
    scale = scale or 1.0
    time, *digits = recording.digits
    acceleration = 0.0 if w is None else float((np.linalg.norm(np.diff(w, axis=0), axis=1) / np.diff(t)).max())
    rounded = np.array([digits[0] + time * scale, (digits[1] + time * acceleration) / scale])
    noise = np.where(resolved & (noise / np.array([1, scale]) <= MOST_NOISE), noise / np.array([1, scale]), 0.0)
    allowed = np.maximum(FLOOR, np.maximum(UNITS_OF_DIGITS * rounded, SIGMAS * noise))
    allowed = allowed if error is None else np.full(2, error)
    noise_of_fit = np.maximum(np.maximum(noise, rounded), 1e-13)
    inexact = from_row and bool((rounded > 1e-13).any() or (noise > 1e-11).any())
    free = [*range(3)] * (R is not None) + [*range(3, 6)] * (w is not None)
    case = Case(
        scene, t, recording.data, float(t[0]) if from_row else 0.0, scale, allowed, noise_of_fit, tuple(free) if inexact else ()
    )
    if from_row:
        changes = {name: x[0] for name, x in (("R_WB0", R), ("w_WB_B0", w)) if x is not None}
        if len(changes) == 1 and timed and 0 < first <= scene.t_end:
            Rs, ws = truth(scene, 0.0, np.array([0.0, first]))
            changes = {"R_WB0": Rs[1], "w_WB_B0": ws[1]} | changes
        case = replace(case, scene=scene.rename(scene.name, **changes))
    if not recording.order_known and R is not None:
        other = case.read(from_quaternion(np.roll(to_quaternion(R), 1, axis=1)), w)
        case, order = min((case, "wxyz"), (other, "xyzw"), key=lambda each: float(each[0].error.mean()))
        notes.append(f"The order of the quaternions is not named; {order} fits better.")
    return case, notes, noise, resolved


def _stretches(case: Case, from_row: bool) -> tuple[list[Case], str]:
    """Return the stretches of rows that are compared, each with its initial state, and what would decide if it was guessed.

    A new stretch begins where the motion multiplies the rounding of its first row to a tenth of the allowed error.
    """
    parts, missing, rest = list[Case](), "", case
    whole = all(x is not None for x in case.data) or (case.data[1] is not None and case.scene.free)
    while True:
        end = len(rest.t)
        if from_row and whole and end > 2:
            some = np.unique(np.linspace(0, end - 1, 200).astype(int))
            thin = replace(rest, t=rest.t[some], data=_rows(rest.data, some))
            flow = linearise(thin)[2][:, 3 * (case.data[0] is None) :, 3 * (case.data[0] is None) :]
            back = np.nan_to_num(np.linalg.pinv(np.nan_to_num(flow)))
            # Errors of the file's own steps grow from any row on: near a separatrix more than those of the first row.
            growth = np.array([np.linalg.norm(flow[k] @ back[: k + 1], axis=(1, 2)).max() for k in range(len(some))])
            over = np.flatnonzero(growth * ROUND_OFF > case.allowed.min() / 10)
            end = max(2, int(some[over[0]])) if len(over) else end
            rest = replace(rest, growth=float(growth[some < end].max()))
        part = rest.take(slice(0, end))
        if part.free and not part.passes(part.error):
            initial, _, _ = part.fit(exact(part), np.zeros(0), np.zeros(0))
            fitted = part.at(initial)
            part = min(part, fitted, key=lambda each: each.size(each.error))
        parts.append(part)
        if end >= len(rest.t) or len(parts) > 200:
            break
        rest = rest.take(slice(end, None))
        changes = {name: x[0] for name, x in zip(("R_WB0", "w_WB_B0"), rest.data, strict=True) if x is not None}
        rest = replace(rest, scene=rest.scene.rename(rest.scene.name, **changes), start=float(rest.t[0]))
    part = parts[0]
    if from_row and not whole and len(parts) == 1 and not part.passes(part.error) and len(part.t) > 3:
        guessed = replace(part, free=tuple(range(6)))
        initial, _, _ = guessed.fit(exact(guessed), np.zeros(0), np.zeros(0))
        guessed = replace(guessed.at(initial), free=part.free)
        if guessed.passes(guessed.error):
            name = "attitudes" if case.data[0] is None else "rates"
            missing = f"It agrees with a start with other {name} than the scene's. A column of {name} decides, or --start scene"
            parts = [guessed]
    return parts, missing


def _compare_all(parts: list[Case], recording: Recording, shift: float) -> tuple[Array, int, tuple[int, float, float] | None]:
    """Return the largest errors (2, 1) of all rows, their number, and the first that is off: its number, time and error."""
    worst, count, bad, current = np.zeros((2, 1)), 0, None, list(parts)
    ends = [part.start for part in parts[1:]] + [math.inf]
    for t, data, _ in recording.stream():
        at = t + shift
        for i, part in enumerate(current):
            some = (at >= (part.t[0] if i == 0 else parts[i].start)) & (at < ends[i])
            if not some.any():
                continue
            piece = replace(part, t=at[some], data=_rows(data, some))
            R, w = piece.exact
            error = piece.errors(R, w)
            off = np.flatnonzero((error > part.allowed[:, None]).any(axis=0))
            if len(off) and bad is None:
                row = int(np.flatnonzero(some)[off[0]])
                bad = count + row + 1, float(t[row]), float(error[:, off[0]].max())
            worst = np.maximum(worst, error.max(axis=1, keepdims=True))
            if not closed(part.scene):
                current[i] = replace(
                    part, scene=part.scene.rename("file", R_WB0=R[-1], w_WB_B0=w[-1]), start=float(piece.t[-1])
                )
        count += len(t)
    return worst, count, bad


def _summary(found: _Findings, recording: Recording) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the summary of a judgement, and its rows."""
    case, (R, w), errors = found.case, found.case.data, found.errors
    notes = [*found.notes, *(note for note in recording.layout.notes if note != "unit")]
    unit = ("deg/s", float(np.degrees(case.scale))) if recording.degrees else ("rad/s", case.scale)
    units = [("rad", float(R is not None)), (unit[0], unit[1] * (w is not None))]
    names = [f"{name} error, {unit}" for name, (unit, _) in zip(("attitude", "rate"), units, strict=True)]
    series: dict[str, Array] = {name: each * size for name, (_, size), each in zip(names, units, errors, strict=True) if size}
    series |= _drifts(case, found.from_row)
    if w is not None and case.scene.free and case.scene.body.rotor_momentum is None and errors.max() > FAR:
        J, L = np.sort(case.scene.body.moments), np.linalg.norm(case.scene.body.momentum(w), axis=1)
        gap = np.abs(kinetic_energy(case.scene.body, w) * 2 * J[1] / L**2 - 1)
        if gap[-len(gap) // 10 :].max() < 0.1 * gap[0]:
            notes.append("The energy approaches L^2/(2 I2): intermediate axis instability is created by the integrator.")
    if recording.shape is not None:
        name = "|R'R - 1|" if recording.layout.attitude == "matrix" else "quaternion norm, minus 1"
        series[name] = np.abs(recording.shape)[: len(case.t)]
    t = (case.t + found.shift).tolist()
    proven, allowed = [each for each in found.named if each.explains], case.allowed.tolist()
    by = "noise" if found.noise.max() * SIGMAS >= 0.99 * case.allowed.max() else "digits"
    summary = {
        "verdict": "undecided" if found.undecided else found.verdict,
        "right": found.verdict == "right" and not found.undecided,
        "undecided": found.undecided,
        "error": found.worst.max(axis=1).tolist(),
        "allowed": allowed,
        "by": by if found.error is None else "error",
        "noise": found.noise.tolist(),
        "digits": list(recording.digits),
        "first row": found.parts[0].error[:, 0].tolist(),
        "units": units,
        "rows": {"compared": found.compared, "in file": recording.rows},
        "compared": {kind: list(part) for kind, part in recording.layout.used.items() if part},
        "not used": recording.layout.unused,
        "quantities": [{"quantity": name, "largest": float(x.max()), "final": float(x[-1])} for name, x in series.items()],
        "limits": {name: size * a for name, (_, size), a in zip(names, units, allowed, strict=True) if size},
        "shape": "" if found.shaped else _misshapen(recording),
        "diagnosis": proven[0] if len(proven) == 1 else None,
        "equally good": proven if len(proven) > 1 else [],
        "candidates": [] if proven else found.named[:3],
        "tried": found.tried,
        "notes": notes,
    }
    rows = [
        {"t": at, "quantity": name, "value": value}
        for name, x in series.items()
        for at, value in zip(t, x.tolist(), strict=True)
    ]
    return summary, rows


def _drifts(case: Case, from_row: bool) -> dict[str, Array]:
    """Return the drifts (n,) of the invariants that the data determine. Balances also need the work of the loads."""
    (R, w), drifts = case.data, dict[str, Array]()
    energy = None if case.scene.potential else find_energy(case.scene.invariants)  # rates alone determine that of a free body
    for each in case.scene.invariants if w is not None else ():
        if w is not None and each.supplied is None and (R is not None or each is energy):
            R_WB = np.broadcast_to(np.eye(3), (len(w), 3, 3)) if R is None else R
            drift = Trajectory(case.scene, case.t, R_WB, w, "file").drift(each)
            # The initial value is that at t = 0, and the field may have turned until the first row.
            drifts[f"drift of {each.name}"] = sizes(drift - drift[0] if from_row else drift)
    return drifts


def diagnose(
    whole: Case, quaternion: bool, tell: Callable[[str], None] = lambda _: None
) -> tuple[list[Explanation], list[Explanation]]:
    """Return the mistakes that explain the error, or the best candidates if none does, and all that were tried, best first.

    Those that make attitudes or rates worse than they are have no place in either, and a candidate leaves less than half of the
    error. A mistake explains a file if it leaves its noise or digits. Of several, the one with fewest fitted numbers is named,
    and all that leave as little. `quaternion` is True if the order of quaternions can be wrong.
    """
    case = whole.first(LONGEST, FEWEST)
    if case.error.max() <= case.allowed.max() and len(case.t) < len(whole.t):
        case = whole  # the error is later
    stride = -(-len(case.t) // MOST)
    case = replace(case.take(slice(None, None, stride)), stride=stride)
    tried: list[Explanation] = []
    end = monotonic() + LIMIT
    for search in (_changes, _readings, _times, _attitudes, _steps, _fits):
        tell(search.__name__[1:])
        for each in search(case, quaternion):
            tried.append(each)
            if monotonic() > end:
                break
        if search in (_readings, _attitudes, _steps) and any(each.explains for each in tried):
            break  # the searches that follow take longer and fit more numbers
    bounds = np.maximum(case.error.max(axis=1), case.allowed)
    tried = [each for each in tried if each.explains or bool((np.array(each.left) <= bounds).all())]  # none that is worse
    tried.sort(key=lambda each: (not each.explains, each.share))
    explaining = [each for each in tried if each.explains]
    if not explaining:
        return [each for each in tried if each.share < 0.5][:3], tried
    least = min(each.size for each in explaining)
    good = [each for each in explaining if each.size <= 3 * max(least, 1.0)]
    fewest = min(each.numbers for each in good)
    good = [each for each in good if each.numbers == fewest]
    return [each for each in good if each.name.removesuffix(BARE) == each.name or all(BARE in one.name for one in good)], tried


def _explain(
    case: Case,
    name: str,
    text: str,
    made: States,
    values: dict[str, float] | None = None,
    read: Case | None = None,
    numbers: int = -1,
) -> Explanation:
    """Return the explanation by the motion that a mistake makes, next to the file, or to another reading of it."""
    R, w = made
    error, plain = (read or case).errors(R, w), case.error  # type: ignore[arg-type]
    of = read or case
    share = float(error.max() / max(plain.max(), 1e-15))
    explains = of.passes(error) and share < 0.5
    count = len(values or {}) if numbers < 0 else numbers
    return Explanation(
        name,
        text.format(**(values or {})),
        values or {},
        error.max(axis=1).tolist(),
        plain.max(axis=1).tolist(),
        share,
        of.size(error),
        explains,
        count,
    )


def _try(
    case: Case,
    name: str,
    text: str,
    motion: Motion,
    extra: Sequence[float] = (),
    values: Callable[[Array], dict[str, float]] | None = None,
    small: float = 1e-6,
    most: int = 8,
    read: Case | None = None,
) -> Explanation:
    """Return the explanation by a motion whose initial state and other numbers are fitted as far as they are open."""
    of, p = read or case, np.array(extra, float)
    _, p, made = replace(of, free=()).fit(motion, p, np.full(len(p), small), most)
    error = of.errors(*made)
    if of.free and not of.passes(error) and (error.max(axis=1) <= HOPELESS * of.noise * of.growth).any():
        _, p, made = of.fit(motion, p, np.full(len(p), small), most)
    return _explain(case, name, text, made, values(p) if values else {}, read)


def _known(values: dict[str, float], p: Array) -> dict[str, float]:
    return values


def _readings(case: Case, quaternion: bool) -> Iterator[Explanation]:
    """Yield other readings of attitudes and rates."""
    first = ["", "transposed", *(QUATERNION if quaternion else ())] if case.data[0] is not None else [""]
    second = ["", *(name for name in READINGS if name not in (*first, *QUATERNION))] if case.data[1] is not None else [""]
    for name, other in list(product(first, second))[1:]:
        data = case.data
        if other == "world rates" and case.data[0] is None:
            continue
        for each in filter(None, (name, other)):
            data = READINGS[each][1](*data)
        read = case.read(*data)
        text = ". ".join(READINGS[each][0] for each in (name, other) if each)
        if data[1] is not None and other:
            read = replace(read, scale=float(np.linalg.norm(data[1], axis=1).max()) or 1.0)
        near = read.take(slice(0, 10))
        R, w = exact(near)(near.scene.R_WB0[None], near.scene.w_WB_B0[None], np.zeros((1, 0)))
        if (near.errors(R[0], w[0]) <= 2 * case.error[:, :10].max() + 10 * case.allowed.max()).all():
            yield _try(case, ", ".join(filter(None, (name, other))), text, exact(read), read=read)


def _changes(case: Case, _: bool) -> Iterator[Explanation]:
    """Yield motions of scenes and equations with a mistake."""
    for name, text, equations in mistakes.changes(case.scene):
        yield _try(case, name, text, _by(case, equations))


def _by(case: Case, equations: Equations) -> Motion:
    def motion(R: Array, w: Array, _: Array) -> tuple[Array, Array]:
        if closed(equations.scene) and equations == Equations(equations.scene):
            return exact(replace(case, scene=equations.scene))(R, w, _)
        return equations.solve(case.start, R, w, case.t)

    return motion


def _times(case: Case, _: bool) -> Iterator[Explanation]:
    """Yield the right states at other times: shifted, in proportion, with rows missing, jittered, or rates apart."""
    later = np.append(0, np.arange(max(1, len(case.t) // 20), len(case.t)))  # the first row, which is exact, and later ones
    rest, gap, unit = case.take(later), float(np.median(np.diff(case.t))), 1 / case.scale
    end = float(case.t[-1] + 0.1 * (case.t[-1] - case.start) + 2 * gap)

    def moved(both: bool) -> Motion:
        known: list[Any] = []

        def motion(R: Array, w: Array, p: Array) -> tuple[Array, Array]:
            if case.free or not known:
                known[:] = [Equations(case.scene).flow(case.start, R, w, end)]
            flow = known[0]
            times = (
                case.start + (rest.t - case.start) * (1 + np.clip(p[:, 1:].sum(axis=1), -0.5, 0.1))[:, None] + p[:, :1] * unit
            )
            times[:, 0] = rest.t[0]
            a, b = flow.shifted(np.clip(times, case.start, end))
            return (a if both else np.broadcast_to(flow.at(rest.t)[0], a.shape)), b

        return motion

    yield _try(
        rest, "time shift", "Constant time shift: the file is {shift:+.4g} s ahead of the exact motion after its first row",
        moved(True), [0.0], lambda p: {"shift": float(p[0]) * unit},
    )  # fmt: skip
    yield _try(
        rest, "phase drift", "The time is scaled: the file is {rate:+.3g} s per second too fast, and {shift:+.3g} s ahead",
        moved(True), [0.0, 0.0], lambda p: {"shift": float(p[0]) * unit, "rate": float(p[1])},
    )  # fmt: skip
    if all(x is not None for x in case.data):
        yield _try(
            rest, "rates at other times", "The rates are {late:+.4g} s late against the attitudes (leapfrog: half a step)",
            moved(False), [0.0], lambda p: {"late": -float(p[0]) * unit},
        )  # fmt: skip
    for size in (1e-3, 1e-6, 1e-9, 60.0):
        if (case.t[-1] - case.start) * size * case.scale < 2 * LONGEST and not case.scene.loads:
            read = replace(case, t=case.start + (case.t - case.start) * size)
            yield _try(case, f"time in {size:g} s", f"The times are in units of {size:g} s", exact(read), read=read)
    yield from _own_times(case, gap, end)


def _own_times(case: Case, gap: float, end: float) -> Iterator[Explanation]:
    """Yield the right states at times that are found row by row: with rows missing in between, or jittered."""
    tau, e = case.t.copy(), 1e-6 / case.scale
    end += min(end - case.start, 50 * gap)
    flow = Equations(case.scene).flow(case.start, case.scene.R_WB0[None], case.scene.w_WB_B0[None], end + e)

    def sample(t: Array) -> tuple[Array, Array]:
        R, w = flow.at(np.clip(t, case.start, end + e))
        return R[0], w[0]

    weights = 1 / np.repeat(case.noise, [9, 3]) ** 2
    for _ in range(8):
        d = case.differences(*sample(tau))
        v = (case.differences(*sample(tau + e)) - d) / e
        tau = tau - (d * v * weights).sum(axis=1) / ((v * v * weights).sum(axis=1) + 1e-300)
        tau = np.clip(tau, case.start, end)
        tau[0] = case.t[0]
    off = tau - case.t
    lost, size = np.rint(off / gap), float(np.sqrt(np.mean(off**2)))
    if lost.max() >= 1 and np.abs(off - lost * gap).max() < 0.2 * gap and (np.diff(lost) >= 0).all():
        at = float(case.t[np.flatnonzero(lost)[0]])
        text = "Rows are missing: {rows:.0f}, the first before {at:.6g} s, and the times are those of a file without gaps"
        values = {"rows": float(lost.max()), "at": at}
        yield _explain(case, "dropped rows", text, sample(case.t + lost * gap), values, numbers=2)
    elif abs(float(np.mean(off))) < 0.5 * size:
        text = "The time stamps are jittered by {jitter:.3g} s (root of the mean square)"
        yield _explain(case, "jittered times", text, sample(tau), {"jitter": size}, numbers=3)


def _attitudes(case: Case, _: bool) -> Iterator[Explanation]:
    """Yield attitudes by usual rules from the exact rates, if the rates of the file are exact."""
    R, w = case.data
    made = case.exact
    if R is None or w is None or case.errors(*made)[1].max() > case.allowed[1]:
        return
    for name, rule in ATTITUDES.items():
        wanted, seen, found = [case.stride, 1], set[int](), list[Explanation]()
        while wanted and len(seen) < 8:
            parts = wanted.pop()
            if parts in seen or not 1 <= parts <= PARTS or parts * len(case.t) > 4 * STEPS_AT_MOST:
                continue
            seen.add(parts)
            fine = np.append((case.t[:-1, None] + np.diff(case.t)[:, None] * np.arange(parts) / parts).ravel(), case.t[-1])
            rates = truth(case.scene, case.start, fine)[1] if parts > 1 else made[1]
            turned = mistakes.integrate(rule, case.scene.R_WB0, rates, np.diff(fine), parts)
            error, gone = turned - made[0], R - made[0]
            small = np.linalg.norm(gone, axis=(1, 2)) < LINEAR
            ratio = float((error * gone)[small].sum() / ((error * error)[small].sum() or 1.0)) if small.sum() > 2 else 1.0
            found.append(_explain(
                case, f"attitudes by {name}", f"{NOT_INTEGRAL} {name}, with a step of {{step:.4g}} s",
                (turned, made[1]), {"step": float(np.median(np.diff(case.t))) / parts},
            ))  # fmt: skip
            if found[-1].explains:
                break
            if ratio > 0:
                wanted += [max(1, round(parts * ratio ** (-1 / order))) for order in (1, 2)]
        yield min(found, key=lambda each: each.share)


@dataclass(frozen=True, eq=False)
class _Slope:
    """The derivative of states (7, n), at one time or at a time for each of them, s."""

    equations: Equations
    known: dict[str, Any] = field(default_factory=dict)

    @property
    def body(self) -> Any:
        return self.equations.scene.body

    def __call__(self, t: Any, y: Array) -> Array:
        if self.equations.steady:
            if "slope" not in self.known:
                self.known["slope"] = self.equations.at(np.zeros(1))
            return self.known["slope"](y[:, :, None])[:, :, 0]
        if np.ndim(t) == 0:
            return self.equations.at(np.array([t]))(y[:, :, None])[:, :, 0]
        return self.equations.at(np.asarray(t))(y[:, None])[:, 0]


def march(case: Case, method: Step, parts: int) -> Motion:
    """Return the motion by a method with so many steps between two rows, which are equally far apart."""
    equations = Equations(case.scene)
    f, h = _Slope(equations), float(case.t[-1] - case.start) / (_numbers(case)[-1] * parts)

    def motion(R: Array, w: Array, _: Array) -> tuple[Array, Array]:
        y, past, kept = equations.pack(case.start, R, w), list[Array](), []
        last, wanted = int(_numbers(case)[-1]) * parts, set((_numbers(case) * parts).tolist())
        with np.errstate(all="ignore"):
            for number in range(last + 1):
                if number in wanted:
                    kept.append(y)
                if number < last:
                    new = method.next(f, case.start + number * h, y, h, past)
                    past = [y, *past][: method.past]
                    y = new
                    if method.normalised:
                        y[:4] /= np.sqrt((y[:4] * y[:4]).sum(axis=0))
            return equations.states(np.stack(kept, axis=2), case.t)

    return motion


def _numbers(case: Case) -> Any:
    """Return the numbers of the rows, counted in the least distance of two."""
    return np.rint((case.t - case.start) / np.diff(case.t).min()).astype(int)


def _steps(case: Case, _: bool) -> Iterator[Explanation]:
    """Yield motions by methods with a step that divides the distance of the rows.

    The steps are found from errors to first order: those that a method makes between two rows, from the exact state, are
    carried along by the exact motion. The best methods then run from the first row.
    """
    numbers, gaps = _numbers(case), np.diff(case.t)
    if case.data[0] is not None and case.data[1] is not None and case.error[1].max() <= case.allowed[1]:
        return  # no method has exact rates
    if np.abs(case.t - case.start - numbers * (case.t[-1] - case.start) / numbers[-1]).max() > 1e-3 * gaps.min():
        return
    if numbers[-1] > 2 * STEPS_AT_MOST or numbers[0] > 0 or len(case.t) < 3:
        return
    case = case.take(slice(0, int(np.searchsorted(numbers, STEPS_AT_MOST))))
    if np.ptp(np.diff(_numbers(case))) > 0:  # rows of which only some were written
        return
    linear = _Linear(case)
    ranked = sorted(((*linear.best(method), name) for name, method in STEPS.items()), key=lambda each: each[0])
    proven = False
    for left, parts, name in ranked[:5]:
        if (left > 0.5 and linear.used > 8) or (proven and left > max(0.02, 10 * ranked[0][0])):
            continue
        for count in sorted({parts, *linear.others(STEPS[name], parts)}, key=lambda n: abs(n - parts)):
            for most in (2000, STEPS_AT_MOST):  # steps
                some = case.take(slice(0, max(4, most // count)))
                values = {"step": float(gaps.mean()) / count}
                text = f"The rows follow {name} with a step of {{step:.4g}} s"
                found = _try(some, name, text, march(some, STEPS[name], count), values=partial(_known, values))
                if found.share > 0.5 or len(some.t) == len(case.t):
                    break
            yield found
            if found.explains:
                proven = True
                break


class _Linear:
    """The rows' differences from the exact motion, and those that a method makes, to first order."""

    def __init__(self, case: Case) -> None:
        self.case, equations = case, Equations(case.scene)
        self.R, self.w, self.flow = linearise(case)
        data = self.R if case.data[0] is None else case.data[0], self.w if case.data[1] is None else case.data[1]
        self.wanted = differ(self.R, self.w, *data, case.scale)
        size = np.linalg.norm(self.wanted, axis=1)
        self.used = int(np.argmax(size > LINEAR)) if (size > LINEAR).any() else len(size)
        self.used = max(self.used, min(len(size), 8))
        have = [x is not None for x in case.data]
        self.weights = np.repeat(np.array(have) / case.noise, 3)
        self.f, self.equations = _Slope(equations), equations
        self.inverse = np.linalg.pinv(self.flow[: self.used])
        self.made: dict[tuple[int, int], Array] = {}
        open_ = (case.error.max(axis=1) <= HOPELESS * case.noise * case.growth).any()
        self.free = list(case.free) if open_ else []

    def errors(self, method: Step, parts: int) -> Array:
        """Return the errors (n, 6) of a method in the rows that are used."""
        if (id(method), parts) in self.made:
            return self.made[id(method), parts]
        case, n = self.case, self.used
        t, h = case.t[: n - 1], float(case.t[n - 1] - case.t[0]) / (n - 1) / parts
        y = np.concatenate([to_quaternion(self.R[: n - 1]).T, self.w[: n - 1].T + self.equations.wheel(t)])
        past: list[Array] = []
        for back in range(1, method.past + 1):
            a, b = truth(case.scene, case.start, np.maximum(t - back * h, case.start))
            past.append(np.concatenate([to_quaternion(a).T, b.T + self.equations.wheel(t)]))
            past[-1][:4] *= np.sign((past[-1][:4] * y[:4]).sum(axis=0))
        first, before = y[:, :1], list[Array]()  # a method begins without a past
        with np.errstate(all="ignore"):
            for number in range(parts):
                new = method.next(self.f, t + number * h, y, h, past)
                past, y = [y, *past][: method.past], new
                if method.past:
                    new = method.next(self.f, t[:1] + number * h, first, h, before)
                    first, before = new, [first, *before][: method.past]
            y[:, :1] = first if method.past else y[:, :1]
            a, b = self.equations.states(y[:, None], case.t[1:n])
        defect = differ(self.R[1:n], self.w[1:n], a[0], b[0], case.scale)
        carried = np.cumsum((self.inverse[1:n] @ defect[..., None])[..., 0], axis=0)
        found = np.concatenate([np.zeros((1, 6)), (self.flow[1:n] @ carried[..., None])[..., 0]])
        self.made[id(method), parts] = found
        return found

    def share(self, method: Step, parts: int) -> tuple[float, float]:
        """Return which share of the differences a method leaves, and the factor by which its errors fit best."""
        made, wanted = self.errors(method, parts) * self.weights, self.wanted[: self.used] * self.weights
        columns, free = [made.ravel()], self.free
        columns += [(self.flow[: self.used, :, k] * self.weights).ravel() for k in free]
        factor = float(np.linalg.lstsq(np.stack(columns, axis=1), wanted.ravel(), rcond=None)[0][0])
        rest = wanted - made
        if free:
            others = np.stack(columns[1:], axis=1)
            rest = rest.ravel() - others @ np.linalg.lstsq(others, rest.ravel(), rcond=None)[0]
        return float(np.linalg.norm(rest) / (np.linalg.norm(wanted) or 1.0)), factor

    def best(self, method: Step) -> tuple[float, int]:
        """Return the smallest share that a method leaves, and its number of steps between two rows."""
        found, parts = dict[int, float](), self.case.stride
        while parts not in found and len(found) < 8:
            found[parts], factor = self.share(method, parts)
            if factor <= 0:
                break
            parts = int(
                np.clip(
                    np.rint(parts * max(factor, 1e-12) ** (-1 / method.order)),
                    1,
                    max(1, min(PARTS, 4 * STEPS_AT_MOST // self.used)),
                )
            )
        return min((left, n) for n, left in found.items())

    def others(self, method: Step, parts: int) -> list[int]:
        """Return the numbers of steps next to the best one that leave almost as little."""
        near = [n for n in (parts - 1, parts + 1) if n >= 1]
        best = self.share(method, parts)[0]
        return [n for n in near if self.share(method, n)[0] < max(1.5 * best, best + 0.1)]


def _fits(case: Case, _: bool) -> Iterator[Explanation]:
    """Yield motions with numbers that are fitted."""
    scene = case.scene
    if len(scene.breaks) > MOST_BREAKS:
        return
    more = ", in addition to the damping of the scene" * (Need.DAMPING in scene.needs)
    for name, text, term in (("damped", "", 1.0), ("no gyroscopic term, damped", f"{mistakes.NO_TERM}. ", 0.0)):
        text += "The rates are damped by {damping:.4g} per second" + more

        def motion(R: Array, w: Array, p: Array, term: float = term) -> tuple[Array, Array]:
            return Equations(scene, term, damping=p[:, 0] * case.scale).solve(case.start, R, w, case.t)

        yield _try(case, name, text, motion, [0.0], lambda p: {"damping": float(p[0]) * case.scale})
    if not case.free and case.start == case.t[0]:
        have = [*range(3)] * (case.data[0] is not None) + [*range(3, 6)] * (case.data[1] is not None)
        rest = replace(case.take(slice(1, None)), free=tuple(have))
        if len(rest.t) > 3:
            initial, _extra, fitted = rest.fit(exact(rest), np.empty(0), np.empty(0))
            names = [f"start_{kind}_{i}" for kind in ("turn", "rate") for i in (1, 2, 3)]
            text = "The first row does not fit the others: the motion starts at another attitude or other rates"
            found = _explain(rest, "first row", text, fitted, {names[i]: float(initial[i]) for i in have})
            yield replace(found, numbers=len(have), explains=found.explains and found.size < 100)
    yield _turned_axes(case)
    yield _other_body(case)


def _turned_axes(case: Case) -> Explanation:
    """Return the explanation by body axes that are turned, fitted from the best of 24 directions."""

    def motion(of: Case) -> Motion:
        def turned(R: Array, w: Array, p: Array) -> tuple[Array, Array]:
            C = Rotation.from_rotvec(p).as_matrix()
            a, b = exact(of)(R @ np.swapaxes(C, 1, 2), (C @ w[..., None])[..., 0], p)
            return a @ C[:, None], (np.swapaxes(C, 1, 2)[:, None] @ b[..., None])[..., 0]

        return turned

    near, turns = case.first(3.0, 10), Rotation.create_group("O").as_rotvec()
    many = np.broadcast_to(case.scene.R_WB0, (24, 3, 3)), np.broadcast_to(case.scene.w_WB_B0, (24, 3))
    left = np.linalg.norm(near.differences(*motion(near)(*many, turns)), axis=(1, 2))
    text = "The body axes of the file are not those of the body: turn them by ({turn_1:.5g}, {turn_2:.5g}, {turn_3:.5g}) rad"

    def values(p: Array) -> dict[str, float]:
        back = Rotation.from_rotvec(p).as_rotvec()
        return {f"turn_{i + 1}": float(x) for i, x in enumerate(back)}

    found = [_try(case, "body axes", text, motion(case), turns[k].tolist(), values, most=30) for k in np.argsort(left)[:3]]
    return min(found, key=lambda each: (round(each.share, 3), np.linalg.norm([*each.values.values()])))


def _other_body(case: Case) -> Explanation:
    """Return the explanation by another inertia."""
    free = case.scene.free and case.scene.body.rotor_momentum is None
    J = case.scene.body.inertia

    def inertia(p: Array) -> Array:
        stretch = expm(np.clip(p, -3, 3)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])
        made = stretch @ J @ stretch
        return made * (np.trace(J) / np.trace(made)) if free else made

    def motion(R: Array, w: Array, p: Array) -> tuple[Array, Array]:
        out = []
        for a, b, numbers in zip(R, w, p, strict=True):
            scene = mistakes.with_inertia(case.scene, inertia(numbers)) or case.scene
            out.append(Equations(scene).solve(case.start, a[None], b[None], case.t))
        return np.concatenate([a for a, _ in out]), np.concatenate([b for _, b in out])

    names = [f"inertia_{ij}" for ij in (11, 12, 13, 22, 23, 33)]
    text = "It is the motion of another body, with the inertia ({inertia_11:.6g}, {inertia_22:.6g}, {inertia_33:.6g}; "
    text += "{inertia_12:.6g}, {inertia_13:.6g}, {inertia_23:.6g}) kg m^2"
    text += " or a multiple of it. Correct --body" if free else ". Correct --body"
    upper = np.triu_indices(3)
    found = _try(
        case, "another body", text, motion, [0.0] * 6, lambda p: dict(zip(names, inertia(p)[upper].tolist(), strict=True))
    )
    moments = np.linalg.eigvalsh(np.array([found.values[name] for name in names])[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])
    return replace(found, explains=found.explains and 2 * moments.max() < (1 + 1e-6) * moments.sum())
