"""The verdict on a recorded motion: right, wrong or undecided. It does not depend on the diagnosis."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, from_quaternion, hat, to_quaternion
from conservative.errors import BadInput, shorten
from conservative.flight import rotation_only
from conservative.invariants import find_energy, kinetic_energy, sizes
from conservative.needs import IN_TIME
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..compare import FLOOR, HOPELESS, NUMERICAL, SIGMAS, Compared, estimate_noise, exact, linearise, take_rows
from ..explain import Diagnosis, diagnose, fit_moments
from ..explanation import Explanation
from ..solution import closed, truth
from .table import Recording

ACCURATE = 1e-6  # errors that a good solver may leave
UNITS_OF_DIGITS = 6.0  # of the last digit, that the largest error may have
MOST_NOISE = 0.05  # of the largest rate, or rad; what is more is motion
ROUND_OFF = 2e-15  # of an exact motion
FAR = 0.05  # rad, or of the largest rate: of another motion
ROWS_OF_NOISE = 4000  # rows that noise is estimated from


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
    found = _compare(case, recording, from_row)
    shape_allowed = max(1e-6, UNITS_OF_DIGITS * recording.digits[1], SIGMAS * noise[0]) if error is None else error
    shaped, explained = found.shape[0] <= shape_allowed, Diagnosis()
    if found.outliers and not found.passed:
        explained = Diagnosis([_single_rows(found)])
    elif not found.passed:
        tell("explain")
        whole = replace(found.case, growth=found.parts[0].growth)
        explained = diagnose(whole, recording.layout.attitude in (None, "quaternion"), tell)
    right, undecided = found.passed and shaped, ""
    if right:
        undecided = found.undecided
    elif error is None and shaped and not any(each.explains for each in explained.named):
        undecided = _doubt(found.case, found.errors, resolved, recording)
    if right and case.noise.max() > 1e-6 and case.scene.free and case.scene.body.rotor_momentum is None:
        tell("moments")
        fit = fit_moments(found.case)
        notes += [f"{fit.sentence}."] * bool((np.array(fit.left) <= case.allowed).all())
    notes += explained.notes
    if len(found.parts) > 1:
        notes.append(
            f"The exact motion starts again in {len(found.parts) - 1} rows: it multiplies the rounding of a row too much."
        )
    if found.compared < recording.rows:
        notes.append(f"{found.compared:,} of {recording.rows:,} rows are compared.")
    by = "noise" if noise.max() * SIGMAS >= 0.99 * case.allowed.max() else "digits"
    proven = [each for each in explained.named if each.explains]
    series, units = _series(found, recording, from_row)
    names = [f"{name} error, {unit}" for name, (unit, _) in zip(("attitude", "rate"), units, strict=True)]
    summary = {
        "verdict": "undecided" if undecided else "right" if right else "wrong",
        "right": right and not undecided,
        "undecided": undecided,
        "error": found.worst.max(axis=1).tolist(),
        "allowed": case.allowed.tolist(),
        "by": by if error is None else "error",
        "noise": noise.tolist(),
        "digits": list(recording.digits),
        "first row": found.alone.tolist(),
        "units": units,
        "rows": {"compared": found.compared, "in file": recording.rows},
        "compared": {kind: list(part) for kind, part in recording.layout.used.items() if part},
        "not used": {shorten(name): reason for name, reason in recording.layout.unused.items()},
        "quantities": [{"quantity": name, "largest": float(x.max()), "final": float(x[-1])} for name, x in series.items()],
        "limits": {name: size * x for name, (_, size), x in zip(names, units, case.allowed.tolist(), strict=True) if size},
        "shape": "" if shaped else _misshapen(found, recording),
        "diagnosis": proven[0] if len(proven) == 1 else None,
        "equally good": proven if len(proven) > 1 else [],
        "candidates": [] if proven else explained.named[:3],
        "tried": explained.tried,
        "notes": [*notes, *_instability(found), *(note for note in recording.layout.notes if note != "unit")],
    }
    times = (found.case.t[: len(found.errors[0])] + found.shift).tolist()
    rows = [
        {"t": t, "quantity": name, "value": value}
        for name, x in series.items()
        for t, value in zip(times, x.tolist(), strict=True)
    ]
    return summary, rows


@dataclass(frozen=True, eq=False)
class _Comparison:
    """The rows `case` that are compared, in stretches with an initial state each, and their errors (2, n).

    `worst` has the largest errors of all rows in the file, `compared` their number, and `outliers` single rows that are off.
    `alone` are the largest errors (2,) from the first row of each stretch where a fitted start has smaller ones. `undecided`
    is what would decide, "" if nothing is open; `shape` is the largest departure from a rotation, and its time, s; `shift` is
    added to times of the case for those of the file.
    """

    case: Compared
    parts: list[Compared]
    errors: Array
    worst: Array
    compared: int
    alone: Array
    passed: bool
    outliers: list[tuple[int, float, float]]
    undecided: str
    shape: tuple[float, float]
    shift: float


def _compare(case: Compared, recording: Recording, from_row: bool) -> _Comparison:
    """Compare the rows that are kept for fits, and if they agree, all rows of the file."""
    undecided, shift = "", float(recording.t[0] - case.t[0])
    gap = float(np.median(np.diff(case.t))) * case.scale
    if not closed(case.scene) and gap > NUMERICAL / 10:
        got = f"rows between which the body turns by {gap:.2g} rad"
        raise BadInput("run", got, "closer rows, or the unit of the time in the header, such as time (ms)")
    if not closed(case.scene) and len(near := case.first(NUMERICAL, 2).t) < len(case.t):
        case = case.take(slice(0, len(near)))
        undecided = f"Rows after {case.t[-1] + shift:g} s are not compared: no closed form is known. A shorter file decides"
    parts, missing, alone = _stretches(case, from_row)
    errors = np.concatenate([part.error for part in parts], axis=1)
    passed = all(part.passes(part.error) and not _late(part) for part in parts)
    whole = len(parts) == 1 and len(errors[0]) == len(case.t)
    if not passed and not (whole and (parts[0].error[:, 0] <= case.allowed).all()):  # stretches and starts of right motions
        parts, errors = [replace(case, growth=parts[0].growth)], case.error
    worst, compared, outliers = errors, len(case.t), _outliers(errors, case)
    shape = _largest(recording.t, recording.shape)
    if (passed or outliers) and recording.rows > len(recording.t) and not undecided:
        worst, compared, bad, shape = _compare_all(parts, recording, -shift if from_row else 0.0)
        passed = passed and bad is None
        outliers = outliers or ([] if bad is None else [bad])
    return _Comparison(case, parts, errors, worst, compared, alone, passed, outliers, undecided or missing, shape, shift)


def _late(case: Compared) -> bool:
    """Return whether errors that pass as noise lie along the motion, as those of times do: noise has all directions."""
    (R, w), n = case.exact, len(case.t)
    if n < 14 or (case.error.max(axis=1) <= np.maximum(FLOOR, UNITS_OF_DIGITS * np.array(case.rounded))).all():
        return False
    turned = (R @ hat(w)).reshape(n, 9) / np.sqrt(2) * (case.data[0] is not None)
    moved = np.gradient(w, case.t, axis=0) / case.scale * (case.data[1] is not None)
    weights = 1 / np.repeat(case.noise, [9, 3])
    v, d = np.hstack([turned, moved]) * weights, case.differences(R, w) * weights
    v = v / (np.linalg.norm(v, axis=1, keepdims=True) + 1e-300)
    varied = np.linalg.eigvalsh(v.T @ v / n)[-1] < 0.9  # of a motion in one direction nothing can be told
    return bool(varied and ((d * v).sum(axis=1) ** 2).sum() > 0.8 * (d * d).sum())


def _largest(t: Array, shape: Array | None) -> tuple[float, float]:
    """Return the largest departure from a rotation, and its time, s."""
    k = 0 if shape is None else int(np.argmax(np.abs(shape)))
    return (0.0 if shape is None else float(np.abs(shape[k]))), float(t[k])


def _single_rows(found: _Comparison) -> Explanation:
    number, at, size = found.outliers[0]
    unit = ("rad", "of the largest rate")[int(np.argmax(found.worst.max(axis=1)))]
    text = f"Single rows are off, the first of them row {number:,} at {at:g} s, by {size:.2g} {unit}; the others agree"
    values = {"row": float(number), "time": at, "error": size}
    return Explanation(("single rows",), text, values, [0.0, 0.0], found.worst.max(axis=1).tolist(), 0.0, 0.0, True)


def _doubt(case: Compared, errors: Array, resolved: Array, recording: Recording) -> str:
    """Return the sentence on the data that would decide, if errors may be harmless; "" if they are wrong."""
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


def _outliers(errors: Array, case: Compared) -> list[tuple[int, float, float]]:
    """Return number, time and error of rows that are off while at least 98 of 100 others agree."""
    off = np.flatnonzero((errors > case.allowed[:, None]).any(axis=0))
    if not 0 < len(off) <= 0.02 * len(case.t) or 0 in off:
        return []
    return [(int(k) + 1, float(case.t[k]), float(errors[:, k].max())) for k in off]


def _misshapen(found: _Comparison, recording: Recording) -> str:
    """Return the finding that matrices are not rotations, or quaternions not of norm 1."""
    matrix, (size, t) = recording.layout.attitude == "matrix", found.shape
    what = "The matrices are not rotations: |R'R - 1| is" if matrix else "The quaternions are not of norm 1: it differs by"
    return f"{what} up to {size:.3g}, at {t:g} s. They are repaired before they are compared"


def _read(scene: Scene, recording: Recording, from_row: bool, error: float | None) -> tuple[Compared, list[str], Array, Array]:
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
    noise, resolved = estimate_noise(chunk[0][:ROWS_OF_NOISE], take_rows(chunk[1], slice(0, ROWS_OF_NOISE)))
    if from_row:
        changes = {name: x[0] for name, x in (("R_WB0", R), ("w_WB_B0", w)) if x is not None}
        if len(changes) == 1 and timed and 0 < first <= scene.t_end:
            Rs, ws = truth(scene, 0.0, np.array([0.0, first]))
            changes = {"R_WB0": Rs[1], "w_WB_B0": ws[1]} | changes
        scene = scene.rename(scene.name, **changes)
    start = float(t[0]) if from_row else 0.0
    rates = np.linalg.norm(scene.w_WB_B0[None] if w is None else w, axis=1)
    scale = largest = float(rates.max())
    if largest > 10 * np.linalg.norm(scene.w_WB_B0) > 0:  # a motion that diverges is compared at the scale of the exact one
        scale = min(largest, float(np.linalg.norm(np.vstack([truth(scene, start, t)[1], scene.w_WB_B0]), axis=1).max()))
    if scale == 0 and w is None and R is not None:
        turned = Rotation.from_matrix(np.swapaxes(R[:-1], 1, 2) @ R[1:]).as_rotvec()
        scale = float((np.linalg.norm(turned, axis=1) / np.diff(t)).max())
    scale = scale or 1.0
    time, *digits = recording.digits
    acceleration = (
        0.0
        if w is None
        else float((np.linalg.norm(np.diff(w, axis=0), axis=1) / np.diff(t))[rates[1:] <= 10 * scale].max(initial=0.0))
    )
    if digits[1] <= 2.0**-52 * largest:  # double precision is relative to each row
        digits[1] = min(digits[1], 2.0**-53 * scale)
    rounded = np.array([digits[0] + time * scale, (digits[1] + time * acceleration) / scale])
    noise = np.where(resolved & (noise / np.array([1, scale]) <= MOST_NOISE), noise / np.array([1, scale]), 0.0)
    allowed = np.maximum(FLOOR, np.maximum(UNITS_OF_DIGITS * rounded, SIGMAS * noise))
    allowed = allowed if error is None else np.full(2, error)
    noise_of_fit = np.maximum(np.maximum(noise, rounded), 1e-13)
    inexact = from_row and bool((rounded > 1e-13).any() or (noise > 1e-11).any())
    free = [*range(3)] * (R is not None) + [*range(3, 6)] * (w is not None)
    case = Compared(
        scene,
        t,
        recording.data,
        start,
        scale,
        allowed,
        noise_of_fit,
        tuple(free) if inexact else (),
        rounded=tuple((rounded if error is None else allowed).tolist()),
    )
    if not recording.order_known and R is not None:
        other = case.read(from_quaternion(np.roll(to_quaternion(R), 1, axis=1)), w)
        case, order = min((case, "wxyz"), (other, "xyzw"), key=lambda each: float(each[0].error.mean()))
        notes.append(f"The order of the quaternions is not named; {order} fits better.")
    return case, notes, noise, resolved


def _stretches(case: Compared, from_row: bool) -> tuple[list[Compared], str, Array]:
    """Return the stretches of rows that are compared, each with its initial state, and what would decide if it was guessed.

    The last value is the largest errors (2,) of motions that start exactly in a row, where a fitted start has smaller ones.
    A new stretch begins where the motion multiplies the rounding of its first row to a tenth of the allowed error.
    """
    parts, missing, rest, alone = list[Compared](), "", case, np.zeros(2)
    whole = all(x is not None for x in case.data) or (case.data[1] is not None and case.scene.free)
    while True:
        end = len(rest.t)
        if from_row and whole and end > 2:
            some = np.unique(np.linspace(0, end - 1, 200).astype(int))
            thin = replace(rest, t=rest.t[some], data=take_rows(rest.data, some))
            flow = linearise(thin)[2][:, 3 * (case.data[0] is None) :, 3 * (case.data[0] is None) :]
            back = np.nan_to_num(np.linalg.pinv(np.nan_to_num(flow)))
            # Errors of the file's own steps grow from any row on: near a separatrix more than those of the first row.
            growth = np.array([np.linalg.norm(flow[k] @ back[: k + 1], axis=(1, 2)).max() for k in range(len(some))])
            over = np.flatnonzero(growth * ROUND_OFF > case.allowed.min() / 10)
            end = max(2, int(some[over[0]])) if len(over) else end
            rest = replace(rest, growth=float(growth[some < end].max()))
        part = rest.take(slice(0, end))
        if part.free and not part.passes(part.error) and _near(part):
            alone = np.maximum(alone, part.error.max(axis=1))
            initial, _, _ = part.fit(exact(part), np.zeros(0), np.zeros(0))
            fitted = part.at(initial)
            part = min(part, fitted, key=lambda each: each.size(each.error))
        parts.append(part)
        if end >= len(rest.t) or len(parts) > 200 or not part.passes(part.error):
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
    return parts, missing, alone


def _near(part: Compared) -> bool:
    """Return whether the second row is as near as noise and digits of the first one let it be, so that a fit can help."""
    two = part.take(slice(0, 2))
    growth = max(1.0, float(np.linalg.norm(linearise(two)[2][-1])))
    return bool((two.error[:, -1] <= HOPELESS * two.noise * growth).all())


def _compare_all(
    parts: list[Compared], recording: Recording, shift: float
) -> tuple[Array, int, tuple[int, float, float] | None, tuple[float, float]]:
    """Compare all rows: the largest errors (2, 1), their number, the first row that is off, and the largest departure.

    A row that is off is its number, time and error; a departure from a rotation its size and time.
    """
    worst, count, bad, shape, current = np.zeros((2, 1)), 0, None, (0.0, 0.0), list(parts)
    ends = [part.start for part in parts[1:]] + [math.inf]
    for t, data, departure in recording.stream():
        at, shape = t + shift, max(shape, _largest(t, departure))
        for i, part in enumerate(current):
            some = (at >= (part.t[0] if i == 0 else parts[i].start)) & (at < ends[i])
            if not some.any():
                continue
            piece = replace(part, t=at[some], data=take_rows(data, some))
            R, w = piece.exact
            error = piece.errors(R, w)
            off = np.flatnonzero((error > part.allowed[:, None]).any(axis=0))
            if len(off) and bad is None:
                row = int(np.flatnonzero(some)[off[0]])
                bad = count + row + 1, float(t[row]), float(error[:, off[0]].max())
            worst = np.maximum(worst, error.max(axis=1, keepdims=True))
            if not closed(part.scene):
                scene = part.scene.rename("file", R_WB0=R[-1], w_WB_B0=w[-1])
                current[i] = replace(part, scene=scene, start=float(piece.t[-1]))
        count += len(t)
    return worst, count, bad, shape


def _series(found: _Comparison, recording: Recording, from_row: bool) -> tuple[dict[str, Array], list[tuple[str, float]]]:
    """Return errors and drifts (n,) by their names, and the unit of errors of attitudes and rates, with its size or 0."""
    case = found.case.take(slice(0, len(found.errors[0])))
    R, w = case.data
    unit = ("deg/s", float(np.degrees(case.scale))) if recording.degrees else ("rad/s", case.scale)
    units = [("rad", float(R is not None)), (unit[0], unit[1] * (w is not None))]
    series: dict[str, Array] = {
        f"{name} error, {unit}": each * size
        for name, (unit, size), each in zip(("attitude", "rate"), units, found.errors, strict=True)
        if size
    }
    series |= _drifts(case, from_row)
    if recording.shape is not None:
        name = "|R'R - 1|" if recording.layout.attitude == "matrix" else "quaternion norm, minus 1"
        series[name] = np.abs(recording.shape)[: len(case.t)]
    return series, units


def _instability(found: _Comparison) -> list[str]:
    """Return the note on energies that approach that of the intermediate axis."""
    scene, w = found.case.scene, found.case.data[1]
    if w is None or not scene.free or scene.body.rotor_momentum is not None or found.errors.max() <= FAR:
        return []
    J, L = np.sort(scene.body.moments), np.linalg.norm(scene.body.momentum(w), axis=1)
    gap = np.abs(kinetic_energy(scene.body, w) * 2 * J[1] / np.where(L == 0, math.inf, L) ** 2 - 1)
    near = gap[-len(gap) // 10 :].max() < 0.1 * gap[0]
    return ["The energy approaches L^2/(2 I2): intermediate axis instability is created by the integrator."] * bool(near)


def _drifts(case: Compared, from_row: bool) -> dict[str, Array]:
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
