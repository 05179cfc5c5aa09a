"""Rows of a recording next to the exact motion of a scene: where it starts, which rows are compared, and their errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, angle_between, hat
from conservative.errors import BadInput
from conservative.features import IN_TIME
from conservative.scene import Scene

from ..compare import (
    FEWEST_FOR_NOISE,
    FLOOR,
    HOPELESS,
    MOST_NOISE,
    NUMERICAL,
    QUARTER,
    SIGMAS,
    TINY,
    UNITS_OF_DIGITS,
    Allowed,
    Compared,
    Effort,
    allow,
    estimate_noise,
    exact,
    is_noise,
    linearise,
    take_rows,
)
from ..solution import States, has_closed_form, truth
from .table import Recording
from .units import no_unit

ROUND_OFF = 2e-15
"""Error of an exact motion, rad."""
EFFORT = 30_000
"""Work of the fits of the start, before a mistake is searched for: about 5 s of an idle core."""
LONGEST_FIT = 500.0
"""Largest turn, rad, over which the start of rows whose noise is open is fitted."""
SAME_START = 1e-8
"""Largest change of a start, rad or relative to the largest rate, that is none."""
COLOURED = (
    "What is left is as large as the noise of the rows, and no noise: it is not white. --error decides, or more rows a turn"
)
OTHER_START = "It agrees with a start with other {name} than the scene's. A column of {name} decides, or --start scene"
ROWS_OF_NOISE = 4000
"""Largest number of rows from which noise is estimated."""
CLEARLY = 2.0
"""Smallest median error of single rows that are off, in allowed errors."""
MOST_PARTS = 200
"""Largest number of parts of a recording that are compared one after another."""
ROWS_OF_READINGS = 200
"""Largest number of rows by which readings of a file are chosen."""
FITS = 0.1
"""Largest mean error of a reading in its unit, rad and relative to the largest rate, and relative to other units."""
CLEAR = 1e-3
"""Smallest mean error of readings in other units. A body at rest and one that turns uniformly fit in all."""
STARTS = 1e-3
"""Largest difference of a first row from the start of a scene, rad and relative."""


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows of a recording that are kept for fits, as a case, with what is allowed, and notes on how they are read.

    `recording` has the order of quaternions that fits better, if no name has it. `noise` (2,) is the deviation of one axis of
    attitudes, rad, and of rates, relative to the largest. `resolved` (2,) is False if the rows are too far apart to tell noise
    from motion.
    """

    recording: Recording
    case: Compared
    allowed: Allowed
    noise: Array
    resolved: Array
    notes: list[str]


def prepare(scene: Scene, recording: Recording, from_row: bool, error: float | None) -> Rows:
    """Return the rows of a recording next to the motion of a scene from the first row, or from the scene's start at t = 0.

    Raises `BadInput` for times at which the scene has no motion.
    """
    recording, notes = _settle(scene, recording, from_row)
    scene, t, start = _begin(scene, recording, from_row)
    (R, w), first = recording.data, float(recording.t[0])
    if first != 0 and not from_row:
        notes.append(f"The first row is compared with the motion of the scene at {first:g} s.")
    rates = np.linalg.norm(scene.w_WB_B0[None] if w is None else w, axis=1)
    scale = largest = float(rates.max())
    if largest > 10 * np.linalg.norm(scene.w_WB_B0) > 0:  # a motion that diverges is compared at the scale of the exact one
        scale = min(largest, float(np.linalg.norm(np.vstack([truth(scene, start, t)[1], scene.w_WB_B0]), axis=1).max()))
    if scale == 0 and w is None and R is not None:
        turned = Rotation.from_matrix(np.swapaxes(R[:-1], 1, 2) @ R[1:]).as_rotvec()
        scale = float((np.linalg.norm(turned, axis=1) / np.diff(t)).max())
    scale = scale or 1.0
    rounded = _rounded(recording, t, rates, scale)
    noise, resolved = _find_noise(scene, recording, start, float(t[0]) - first, scale, allow(rounded).errors)
    allowed = allow(rounded, noise, error)
    have = np.array([R is not None, w is not None])
    unknown = have & np.logical_not(resolved) & (len(t) >= FEWEST_FOR_NOISE and error is None)
    inexact = from_row and bool((rounded > 1e-13).any() or (noise > 1e-11).any() or unknown.any())
    free = [*range(3)] * (R is not None) + [*range(3, 6)] * (w is not None)
    case = Compared(
        scene,
        t,
        recording.data,
        start,
        scale,
        allowed.errors,
        allowed.noise,
        tuple(free) if inexact else (),
        rounded=tuple(allowed.rounded.tolist()),
        flipped=recording.flipped,
        open=(bool(unknown[0]), bool(unknown[1])),
        effort=Effort(EFFORT),
    )
    some = case.first(LONGEST_FIT, FEWEST_FOR_NOISE)
    if any(case.open) and some.turned <= 2 * LONGEST_FIT and (some.error.max(axis=1) > case.allowed).any():
        # The rows alone do not show their noise. The exact motion may leave nothing else.
        usual = np.where(case.open, np.maximum(case.noise, MOST_NOISE / 5), case.noise)
        initial, _, _ = replace(some, noise=usual).fit(exact(some), np.zeros(0), np.zeros(0))
        made = some.at(initial).exact
        white = some.leaves_noise(*made)
        if white.any() and (white | (some.errors(*made).max(axis=1) <= case.allowed)).all():
            left = np.sqrt((some.errors(*made) ** 2).mean(axis=1) / 3)
            noise = np.where(white, left, noise)
            allowed, resolved = allow(rounded, noise, error), np.logical_or(resolved, white)
            case = replace(case, allowed=allowed.errors, noise=allowed.noise, open=(False, False))
    return Rows(recording, case, allowed, noise, resolved, notes)


def _begin(scene: Scene, recording: Recording, from_row: bool) -> tuple[Scene, Array, float]:
    """Return the scene that starts as a recording does, the times of its rows, and the time of its start."""
    (R, w), t, first = recording.data, recording.t, float(recording.t[0])
    timed = bool(scene.loads or scene.features & IN_TIME)
    if first < 0 and (timed or not from_row):
        raise BadInput("run", recording.label(f"a first row at {first:g} s"), "times of the scene, from 0 on")
    if timed:  # its loads need values in all rows
        try:
            scene = scene.rename(scene.name, t_end=max(scene.t_end, float(t[-1])))
        except BadInput as short:
            got = recording.label(f"rows until {t[-1]:g} s, and {short.argument}: {short.got}")
            raise BadInput("run", got, f"rows within the table (--until), or {short.allowed}") from None
    elif from_row:  # sums of steps and a large time would lose digits
        t = t - first
    if from_row:
        changes = {name: x[0] for name, x in (("R_WB0", R), ("w_WB_B0", w)) if x is not None}
        if len(changes) == 1 and timed and 0 < first <= scene.t_end:
            Rs, ws = truth(scene, 0.0, np.array([0.0, first]))
            changes = {"R_WB0": Rs[1], "w_WB_B0": ws[1]} | changes
        scene = scene.rename(scene.name, **changes)
    return scene, t, float(t[0]) if from_row else 0.0


def _settle(scene: Scene, recording: Recording, from_row: bool) -> tuple[Recording, list[str]]:
    """Return the reading of a recording that fits the motion of the scene, where no name has the order or the unit, and notes.

    A unit is the only one in which the first row is the start of the scene, or the only one in which the motion fits. An order
    is the one that fits better. Raises `BadInput` if the data do not decide the unit.
    """
    readings, notes = list(recording.readings), list[str]()
    if not readings:
        return recording, notes
    kinds, why = readings[0].layout.open, "is the first row the start of the scene"
    started = [reading for reading in readings if _starts(scene, reading)]
    if kinds and started and all(reading.layout.used == started[0].layout.used for reading in started):
        readings = [reading for reading in readings if reading.layout.used == started[0].layout.used]
    elif kinds:
        why = "does the motion fit the scene"
    ranked = sorted(((_misfit(scene, reading, from_row), i) for i, reading in enumerate(readings)))
    least, chosen = ranked[0][0], readings[ranked[0][1]]
    others = [misfit for misfit, i in ranked if readings[i].layout.used != chosen.layout.used]
    if others and not (least <= FITS * min(1.0, *others) and min(others) > CLEAR):
        raise no_unit(recording.path, [name for kind in kinds for name in chosen.layout.used[kind]])
    for kind in kinds:
        names = chosen.layout.used[kind]
        notes.append(f"{', '.join(names)}: read in {'rad' if 1.0 in names.values() else 'deg'}, because only so {why}.")
    if len({reading.options.quaternion for reading in readings}) > 1:
        notes.append(f"The order of the quaternions is not named; {chosen.options.quaternion} fits better.")
    return replace(chosen, readings=()), notes


def _misfit(scene: Scene, recording: Recording, from_row: bool) -> float:
    """Return the mean error of rows, rad and relative to their largest rate."""
    scene, t, start = _begin(scene, recording, from_row)
    some, w, usual = np.unique(np.linspace(0, len(t) - 1, ROWS_OF_READINGS).astype(int)), recording.data[1], allow()
    scale = 1.0 if w is None else float(np.abs(w).max()) or 1.0
    case = Compared(scene, t[some], take_rows(recording.data, some), start, scale, usual.errors, usual.noise)
    return float(case.error.max(axis=0).mean())


def _starts(scene: Scene, recording: Recording) -> bool:
    """Return whether the first row is the start of the scene, up to its digits."""
    R, w = recording.data
    size = float(np.linalg.norm(scene.w_WB_B0))
    turned = R is None or angle_between(R[:1], scene.R_WB0[None])[0] <= STARTS
    return bool(turned and (w is None or (size > 0 and np.linalg.norm(w[0] - scene.w_WB_B0) <= STARTS * size)))


def _rounded(recording: Recording, t: Array, rates: Array, scale: float) -> Array:
    """Return the errors (2,) that the digits of a file make: digits of attitudes, of rates, and of times along the motion."""
    time, attitude, rate = recording.digits
    w, acceleration = recording.data[1], 0.0
    if w is not None:
        # Where the body turns by more than 1 rad from row to row, rates have changed by more than the rows show.
        slopes = np.linalg.norm(np.diff(w, axis=0), axis=1) * np.maximum(1 / np.diff(t), scale)
        acceleration = float(slopes[rates[1:] <= 10 * scale].max(initial=0.0))
    if rate <= 2.0**-52 * rates.max():  # double precision is relative to each row
        rate = min(rate, 2.0**-53 * scale)
    return np.array([attitude + time * scale, (rate + time * acceleration) / scale])


def _find_noise(
    scene: Scene, recording: Recording, start: float, shift: float, scale: float, digits: Array
) -> tuple[Array, Array]:
    """Return the noise (2,) of rows, and whether they are close enough to tell it from motion.

    It is the smaller of two estimates: from the rows, and from the rows minus the exact motion. Corners of a torque, and turns
    by more than a quarter from row to row, look like noise. The exact motion itself shows how much of the first estimate they
    are; the second one has them only in fast turns. If digits allow more than the first estimate, it is enough.
    """
    t, data, *_ = next(recording.stream())
    t, data = t[:ROWS_OF_NOISE], take_rows(data, slice(0, ROWS_OF_NOISE))
    sizes = np.array([1.0, scale])
    resolved: Any
    other: Any
    noise, resolved = estimate_noise(t, data)
    if (SIGMAS * noise / sizes > digits).any() and len(t) >= FEWEST_FOR_NOISE:
        n = len(t) if has_closed_form(scene) else int(np.searchsorted(t + shift, start + NUMERICAL / scale))
        (R, w), (a, b) = truth(scene, start, t[:n] + shift), take_rows(data, slice(0, n))
        rest: States = None if a is None else np.swapaxes(R, 1, 2) @ a, None if b is None else b - w
        if n >= FEWEST_FOR_NOISE and all(x is None or np.isfinite(x).all() for x in (*rest, R, w)):
            moving = w, np.gradient(w, t[:n], axis=0)
            motion, other = estimate_noise(t[:n], (R, w))[0], estimate_noise(t[:n], rest, moving)
            slow = float(np.median(np.diff(t))) * scale < QUARTER
            # The estimate from the exact motion contains no noise. An estimate that is clearly larger is noise.
            resolved &= (motion < 0.3 * noise) | (noise < TINY)
            apart = other[1] & (slow | (motion < 0.3 * other[0]) | (other[0] < TINY))
            if not slow:  # what is left of an aliased motion looks like noise from row to row, and is not white
                turns = np.zeros((n, 3)) if rest[0] is None else Rotation.from_matrix(rest[0]).as_rotvec()
                rates = np.zeros((n, 3)) if rest[1] is None else rest[1] / scale
                white = [is_noise(left, along) for left, along in zip((turns, rates), moving, strict=True)]
                apart = apart & (np.array(white) | (other[0] < TINY))
            better = apart & (~resolved | (other[0] < noise))
            noise, resolved = np.where(better, other[0], noise), resolved | apart
    resolved = resolved & (noise / sizes <= MOST_NOISE)  # larger differences are motion between rows that are far apart
    return np.where(resolved, noise / sizes, 0.0), resolved


@dataclass(frozen=True, eq=False)
class Comparison:
    """The rows `case` that are compared, in stretches with an initial state each, and their errors (2, n).

    `worst` has the largest errors of all rows in the file, `compared` their number, and `outliers` single rows that are off.
    `alone` are the largest errors (2,) from the first row of each stretch where a fitted start has smaller ones. `undecided`
    is what would decide, "" if nothing is open; `shape` is the largest departure from a rotation, and its time, s; `shift` is
    added to times of the case to get times of the file.
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


def compare(case: Compared, recording: Recording, from_row: bool) -> Comparison:
    """Compare the rows that are kept for fits, and if they agree, all rows of the file."""
    undecided, shift = "", float(recording.t[0] - case.t[0])
    if not has_closed_form(case.scene) and case.gap > NUMERICAL / 10:
        got = f"rows between which the body turns by {case.gap:.2g} rad"
        raise BadInput("run", recording.label(got), "closer rows, or the unit of the time in the header, such as time (ms)")
    if not has_closed_form(case.scene) and len(near := case.first(NUMERICAL, 2).t) < len(case.t):
        case = case.take(slice(0, len(near)))
        undecided = f"Rows after {case.t[-1] + shift:g} s are not compared: no closed form is known. A shorter file decides"
    parts, missing, alone = _stretches(case, from_row)
    errors = np.concatenate([part.error for part in parts], axis=1)
    passed = all(part.passes(part.error) and not _late(part) for part in parts)
    coloured = passed and len(parts) == 1 and _coloured(parts[0])
    whole = len(parts) == 1 and len(errors[0]) == len(case.t)
    if not passed and not (whole and (parts[0].error[:, 0] <= case.allowed).all()):  # stretches and starts of right motions
        parts, errors = [replace(case, growth=parts[0].growth)], case.error
    worst, compared, outliers = errors, len(case.t), _outliers(errors, case, recording)
    shape = _largest(recording.t, recording.unit_errors)
    if (passed or outliers) and recording.rows > len(recording.t) and not undecided:
        worst, compared, bad, shape = _compare_all(parts, recording, -shift if from_row else 0.0)
        passed = passed and bad is None
        outliers = outliers or ([] if bad is None else [bad])
    return Comparison(
        case, parts, errors, worst, compared, alone, passed, outliers, undecided or missing or COLOURED * coloured, shape, shift
    )


def _stretches(case: Compared, from_row: bool) -> tuple[list[Compared], str, Array]:
    """Return the stretches of rows that are compared, each with its initial state, and what would decide if it was guessed.

    The last value is the largest errors (2,) of motions that start exactly in a row, where a fitted start has smaller ones.
    A new stretch begins where the motion multiplies the rounding of its first row to a tenth of the allowed error.
    """
    parts, missing, rest, alone = list[Compared](), "", case, np.zeros(2)
    whole = all(x is not None for x in case.data) or (case.data[1] is not None and case.scene.free)
    while True:
        end = len(rest.t)
        if from_row and whole and end > 2 and not case.far:
            end, growth = _reach(rest)
            rest = replace(rest, growth=growth)
        part = rest.take(slice(0, end))
        if part.free and not case.far and not part.passes(part.error) and _near(part):
            alone = np.maximum(alone, part.error.max(axis=1))
            initial, _, _ = part.fit(exact(part), np.zeros(0), np.zeros(0))
            fitted = part.at(initial)
            if not fitted.passes(fitted.error) and part.hidden():
                extended, good = part.extend()
                if good < len(part.t) and whole and (reached := _reach(extended)[0]) <= good:
                    extended, part, end = extended.take(slice(0, reached)), part.take(slice(0, reached)), reached
                    fitted = extended
                fitted = min(fitted, extended, key=lambda part: part.size(part.error))
            part = min(part, fitted, key=lambda candidate: candidate.size(candidate.error))
        parts.append(part)
        if end >= len(rest.t) or len(parts) > MOST_PARTS or not part.passes(part.error):
            break
        rest = rest.take(slice(end, None))
        changes = {name: x[0] for name, x in zip(("R_WB0", "w_WB_B0"), rest.data, strict=True) if x is not None}
        rest = replace(rest, scene=rest.scene.rename(rest.scene.name, **changes), start=float(rest.t[0]))
    part = parts[0]
    if from_row and not whole and not case.far and len(parts) == 1 and not part.passes(part.error) and len(part.t) > 3:
        guessed = replace(part, free=tuple(range(6)))
        initial, _, _ = guessed.fit(exact(guessed), np.zeros(0), np.zeros(0))
        guessed = replace(guessed.at(initial), free=part.free)
        if guessed.passes(guessed.error):
            name = "attitudes" if case.data[0] is None else "rates"
            # A start that is as good as the same only undoes round-off, which the motion multiplies.
            same = np.linalg.norm(initial[3 if name == "rates" else 0 :][:3]) <= SAME_START
            missing = "" if same else OTHER_START.format(name=name)
            parts = [guessed]
    return parts, missing, alone


def _reach(rest: Compared) -> tuple[int, float]:
    """Return the number of rows up to which round-off of the exact motion is small, and its growth there."""
    some = np.unique(np.linspace(0, len(rest.t) - 1, 200).astype(int))
    thin = replace(rest, t=rest.t[some], data=take_rows(rest.data, some))
    first = 3 * (rest.data[0] is None)
    flow = linearise(thin)[2][:, first:, first:]
    back = np.nan_to_num(np.linalg.pinv(np.nan_to_num(flow)))
    # Errors of the file's own steps grow from any row on: near a separatrix more than errors of the first row.
    growth = np.array([np.linalg.norm(flow[k] @ back[: k + 1], axis=(1, 2)).max() for k in range(len(some))])
    over = np.flatnonzero(growth * ROUND_OFF > rest.allowed.min() / 10)
    end = max(2, int(some[over[0]])) if len(over) else len(rest.t)
    return end, float(growth[some < end].max())


def _near(part: Compared) -> bool:
    """Return whether the second row is as near as noise and digits of the first one let it be, so that a fit can help."""
    two = part.take(slice(0, 2))
    flow = linearise(two)[2][-1].reshape(2, 3, 2, 3)
    growth = np.maximum(np.linalg.norm(flow, 2, axis=(1, 3)), np.eye(2))  # noise of rates also turns attitudes
    return bool((two.error[:, -1] <= HOPELESS * growth @ two.noise).all())


def _compare_all(
    parts: list[Compared], recording: Recording, shift: float
) -> tuple[Array, int, tuple[int, float, float] | None, tuple[float, float]]:
    """Compare all rows: the largest errors (2, 1), their number, the first row that is off, and the largest departure.

    A row that is off is its number, time and error; a departure from a rotation its size and time.
    """
    worst, count, bad, shape, current = np.zeros((2, 1)), 0, None, (0.0, 0.0), list(parts)
    ends = [part.start for part in parts[1:]] + [math.inf]
    for t, data, departure, numbers in recording.stream():
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
                bad = int(numbers[row]), float(t[row]), float(error[:, off[0]].max())
            worst = np.maximum(worst, error.max(axis=1, keepdims=True))
            if not has_closed_form(part.scene):
                scene = part.scene.rename("file", R_WB0=R[-1], w_WB_B0=w[-1])
                current[i] = replace(part, scene=scene, start=float(piece.t[-1]))
        count += len(t)
    return worst, count, bad, shape


def _coloured(case: Compared) -> bool:
    """Return whether noise allows the errors, and what the motion leaves is not noise, whatever the start is."""
    digits = np.maximum(FLOOR, UNITS_OF_DIGITS * np.array(case.rounded))
    noisy = (case.allowed > (1 + 1e-9) * digits) & [x is not None for x in case.data]
    if not noisy.any() or len(case.t) < FEWEST_FOR_NOISE:
        return False
    case = replace(case, open=(bool(noisy[0]), bool(noisy[1])))
    if (case.leaves_noise(*case.exact) == noisy).all():
        return False
    if not case.free:
        return True
    made = case.at(case.fit(exact(case), np.zeros(0), np.zeros(0))[0]).exact
    return not (case.leaves_noise(*made) == noisy).all()


def _late(case: Compared) -> bool:
    """Return whether errors that pass as noise lie along the motion, as errors of times do: noise has all directions."""
    (R, w), n = case.exact, len(case.t)
    if n < FEWEST_FOR_NOISE or (case.error.max(axis=1) <= np.maximum(FLOOR, UNITS_OF_DIGITS * np.array(case.rounded))).all():
        return False
    turned = (R @ hat(w)).reshape(n, 9) / np.sqrt(2) * (case.data[0] is not None)
    moved = np.gradient(w, case.t, axis=0) / case.scale * (case.data[1] is not None)
    weights = 1 / np.repeat(case.noise, [9, 3])
    v, d = np.hstack([turned, moved]) * weights, case.differences(R, w) * weights
    v = v / (np.linalg.norm(v, axis=1, keepdims=True) + 1e-300)
    varied = np.linalg.eigvalsh(v.T @ v / n)[-1] < 0.9  # a motion in one direction shows nothing
    # Noise has a third of its square along one of three directions, errors of times have nearly all.
    return bool(varied and ((d * v).sum(axis=1) ** 2).sum() > 0.8 * (d * d).sum())


def _outliers(errors: Array, case: Compared, recording: Recording) -> list[tuple[int, float, float]]:
    """Return number, time and error of rows that are clearly off while all others, at least 98 of 100 rows, agree.

    The first row has to agree, too.
    """
    wrong = (errors > case.allowed[:, None]).any(axis=0)
    off, rest = np.flatnonzero(wrong), case.take(~wrong)
    if not 0 < len(off) <= 0.02 * len(case.t) or 0 in off or not rest.passes(errors[:, ~wrong]) or _late(rest):
        return []
    if np.median((errors[:, off] / case.allowed[:, None]).max(axis=0)) < CLEARLY:
        return []
    return [(recording.number(k), float(case.t[k]), float(errors[:, k].max())) for k in off]


def _largest(t: Array, unit_errors: Array | None) -> tuple[float, float]:
    """Return the largest departure from a rotation, and its time, s."""
    k = 0 if unit_errors is None else int(np.argmax(np.abs(unit_errors)))
    return (0.0 if unit_errors is None else float(np.abs(unit_errors[k]))), float(t[k])
