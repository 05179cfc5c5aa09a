"""The verdict on a recorded motion: right, wrong or undecided. It does not depend on the mistakes that explain it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from conservative.attitude import Array
from conservative.check import describe, real_number
from conservative.errors import BadInput, shorten
from conservative.invariants import find_energy, kinetic_energy, sizes
from conservative.number_text import number
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..compare import FEWEST_FOR_NOISE, MOST_NOISE, SIGMAS, UNITS_OF_DIGITS, Compared
from ..explain import Diagnosis, diagnose, fit_moments
from ..explanation import Explanation
from ..finding import Cause, Finding, Verdict, Verification, uncapitalised
from ..mistakes import BY_KEY
from .comparison import LONGEST_FIT, Comparison, Rows, compare, prepare
from .describe import Description, at_rest, only_noise, unseen
from .rows import OUTSIDE, REPEATED
from .table import Recording
from .windows import find_stretch

ACCURATE, ACCURATE_SINGLE = 1e-6, 1e-4
"""Errors that a good solver may leave, in double and in single precision."""
SHAPE = 1e-6
"""Departure from a rotation that a good solver may leave."""
SHAPE_OF_ONE = 1e-3
"""Departure that an attitude that never changes may have: it can be written with three digits."""
UNITS = "rad", "of the largest rate"
FAR = 0.05
"""Error, rad or relative to the largest rate, above which a motion is a different one."""
NOT_FREE = "that are not free motion"
"""Reason to leave a row of a throw out."""
HIDDEN = (
    "The motion multiplies the digits or the noise of the first row to the size of the error. More digits, a shorter file "
    "(--until), or --start scene decide"
)

RESTING = (
    "The body is at rest in all rows, and the scene starts with {rate:.3g} rad/s, so that the file does not show its motion. "
    "--start scene decides"
)
FAR_APART = (
    "The body turns by {angle:.2g} rad from row to row, so that the digits of the first row decide where it is in all others. "
    "Closer rows decide, or the unit of the time in the header, such as time (ms)"
)
NOISE_ONLY = (
    "The rows are noise as large as their motion, as of a body at rest, and show no motion. Rows of a motion, or --error, "
    "decide"
)


CUT = "The fit of the start to all rows takes too many motions. A shorter file (--until), --start scene or --error decide"


class Unit(NamedTuple):
    """The unit in which errors are shown, and its number for an error of 1: 1 rad, or the largest rate; 0 without data."""

    name: str
    size: float

    def show(self, error: float) -> str:
        """Return an error as a number with its unit."""
        return f"{number(error * self.size)} {self.name}"


@dataclass(frozen=True)
class Quantity:
    """An error or a drift: its name with its unit, the largest value, the value in the last row, and the allowed one or nan."""

    name: str
    largest: float
    final: float
    allowed: float = math.nan


@dataclass(frozen=True, eq=False)
class Details:
    """What the verification of a recording compared, how, and what it measured.

    Pairs are of attitudes, rad, and of rates, relative to the largest rate of the motion.

    Attributes
    ----------
    description
        What the recording is: its rows, times, digits and noise.
    error, allowed, by, noise
        Largest errors, the allowed ones, what allows them, and the noise of one axis.
    digits
        Largest rounding of times, s, attitudes, rad, and rates, rad/s, by the digits of the file.
    first_row
        Errors of the motion that starts exactly in the first row, if a fitted start has smaller ones; else 0.
    units, scale
        Units in which attitudes and rates are shown, and the largest rate, rad/s.
    compared, in_file
        Numbers of rows.
    used
        Columns by quantity, such as rates.
    unused
        Reasons of the columns that were not used.
    shape
        Sentence on quaternions or matrices that are not rotations; "" if they are.
    explaining
        The mistakes that explain the file, all equally well.
    candidates
        The best mistakes, if none explains the file.
    tried
        All mistakes that were tried, best first.
    quantities
        Errors and drifts.
    stretch
        First and last row of the free motion in a recording of a throw; None if all rows are compared.
    times, series
        Times (n,), s, and values (n,) of each quantity at them.
    """

    description: Description
    error: tuple[float, float]
    allowed: tuple[float, float]
    by: tuple[str, str]
    noise: tuple[float, float]
    digits: tuple[float, float, float]
    first_row: tuple[float, float]
    units: tuple[Unit, Unit]
    scale: float
    compared: int
    in_file: int
    used: Mapping[str, Sequence[str]]
    unused: Mapping[str, str]
    shape: str
    explaining: Sequence[Explanation]
    candidates: Sequence[Explanation]
    tried: Sequence[Explanation]
    quantities: Sequence[Quantity]
    stretch: tuple[int, int] | None
    times: Array = field(repr=False)
    series: Mapping[str, Array] = field(repr=False)

    def show(self, errors: Sequence[float]) -> str:
        """Return errors of attitudes and rates, as far as the recording has them, in their units."""
        return " and ".join(unit.show(error) for error, unit in zip(errors, self.units, strict=True) if unit.size)

    @property
    def lines(self) -> tuple[str, str]:
        """Two sentences on what the recording is: on rows and times, and on digits and noise."""
        attitudes, rates = self.units
        return self.description.lines(bool(attitudes.size), bool(rates.size), self.scale, rates.name == "deg/s")

    @property
    def worse(self) -> int:
        """The quantity with the larger ratio of error and allowed error: 0 for attitudes, 1 for rates."""
        return int(np.argmax([e / a * bool(u.size) for e, a, u in zip(self.error, self.allowed, self.units, strict=True)]))

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield all values of all quantities as rows with t, quantity and value."""
        for name, values in self.series.items():
            for t, value in zip(self.times.tolist(), values.tolist(), strict=True):
                yield {"t": t, "quantity": name, "value": value}


def verify_recording(
    scene: Scene,
    recording: Recording,
    from_row: bool = True,
    error: float | None = None,
    tell: Callable[[str], object] = lambda _: None,
    name: str = "",
) -> Verification:
    """Verify that a recording is a motion of a scene. The result has one finding, and `Details`.

    Times of the file are times of the scene. The exact motion has the state of the first row at its time, or, if that has noise
    or few digits, the state that fits all rows best; or the scene's initial state at t = 0.

    Parameters
    ----------
    scene, recording
        The motion that it should be, and the rows.
    from_row
        False if the exact motion starts as the scene does.
    error
        Allowed error, rad and relative to the largest rate. By default digits and noise decide.
    tell
        Receives the name of the next piece of work.
    name
        Name of the subject; by default the name of the file.

    Raises
    ------
    BadInput
        For an error that is not a number of 1e-12 or more, and for times at which a load has no value.
    """
    if error is not None and not 1e-12 <= (real_number(error) or 0.0) < math.inf:
        got = describe(error) if real_number(error) is None else f"{error:g}"
        raise BadInput("error", got, "a finite number of 1e-12 or more, which the exact motion is rounded to")
    name = name or (recording.path.name if recording.path else "recording")
    rows = prepare(scene.rotation_only, recording, from_row, error)
    recording, notes = rows.recording, rows.notes
    tell("compare")
    comparison = compare(rows.case, recording, from_row)
    shape_allowed = error or _allow_shape(rows, recording)
    shaped, explained = comparison.shape[0] <= shape_allowed, Diagnosis()
    if comparison.outliers and not comparison.passed:
        explained = Diagnosis([_single_rows(comparison)])
    elif not comparison.passed and not (error is None and only_noise(comparison.case)):
        tell("explain")
        whole = replace(comparison.case, growth=comparison.parts[0].growth)
        explained = diagnose(whole, recording.layout.attitude in (None, "quaternion"), tell)
    # Numbers that are fitted to rows that a start can explain as well prove nothing.
    decided = comparison.passed or comparison.outliers or comparison.case.far
    unclear = "" if decided or error is not None else _unclear(comparison.case)
    proven = [explanation for explanation in explained.named if explanation.explains and not (unclear and explanation.numbers)]
    verdict, doubt = Verdict.WRONG, ""
    if comparison.passed and shaped:
        verdict, doubt = Verdict.RIGHT, comparison.undecided or recording.doubt(error)
        if from_row and at_rest(comparison.case) and scene.w_WB_B0.any():
            doubt = doubt or RESTING.format(rate=float(np.linalg.norm(scene.w_WB_B0)))
    elif error is None and shaped and not proven:
        doubt = unclear or _doubt(comparison.case, comparison.errors, rows.resolved, recording)
    verdict = Verdict.UNDECIDED if doubt else verdict
    case = comparison.case
    if verdict is Verdict.WRONG and not proven and from_row and shaped and not comparison.outliers:
        tell("free motion")
        if (made := _thrown(scene, recording, case, error, name)) is not None:
            return made
    # With noise, the fit shows how well the recording determines the moments.
    if (
        verdict is Verdict.RIGHT
        and not case.far
        and case.noise.max() > 1e-6
        and case.scene.free
        and case.scene.body.rotor_momentum is None
    ):
        tell("moments")
        fit = fit_moments(case)
        notes += [f"{fit.sentence}."] * bool((np.array(fit.left) <= case.allowed).all())
    notes += [*explained.notes, *(unseen(case) if verdict is Verdict.RIGHT else [])]
    if len(comparison.parts) > 1:
        notes.append(
            f"The exact motion starts again in {len(comparison.parts) - 1} rows: it multiplies the rounding of a row too much."
        )
    if comparison.compared < recording.rows:
        notes.append(f"{comparison.compared:,} of {recording.rows:,} rows are compared.")
    series, units = _series(comparison, recording, from_row)
    limits = [size * x for (_, size), x in zip(units, case.allowed.tolist(), strict=True) if size]
    largest = comparison.worst.max(axis=1)
    details = Details(
        description=recording.describe((float(rows.noise[0]), float(rows.noise[1]) * case.scale)),
        error=_pair(largest),
        allowed=_pair(case.allowed),
        by=rows.allowed.by,
        noise=_pair(rows.noise),
        digits=recording.digits,
        first_row=_pair(comparison.alone),
        units=units,
        scale=case.scale,
        compared=comparison.compared,
        in_file=recording.rows + sum(recording.left_out.values()),
        used={kind: tuple(part) for kind, part in recording.layout.used.items() if part},
        unused={shorten(column): reason for column, reason in recording.layout.unused.items()},
        shape="" if shaped else _misshapen(comparison, recording),
        explaining=tuple(proven),
        candidates=() if proven else tuple(explained.named[:3]),
        tried=tuple(explained.tried),
        quantities=[
            Quantity(quantity, float(x.max()), float(x[-1]), limits[i] if i < len(limits) else math.nan)
            for i, (quantity, x) in enumerate(series.items())
        ],
        stretch=None,
        times=comparison.case.t[: len(comparison.errors[0])] + comparison.shift,
        series=series,
    )
    worse = details.worse
    causes = tuple(_cause(explanation, worse) for explanation in proven)
    finding = Finding(
        name,
        "recording",
        "",
        verdict,
        details.error[worse],
        details.allowed[worse],
        UNITS[worse],
        details.by[worse],
        causes,
        doubt or details.shape,
    )
    notes += [*_instability(comparison), *(note for note in recording.layout.notes if note != "unit")]
    return Verification(name, "recording", [finding], _reason(finding, details, proven), notes, details)


def _thrown(scene: Scene, recording: Recording, case: Compared, error: float | None, name: str) -> Verification | None:
    """Return the verification of the rows of free motion in a recording of a throw; None if it is none, or these are wrong."""
    stretch = find_stretch(case)
    part = None if stretch is None else recording.between(stretch.first, stretch.last)
    if stretch is None or part is None:
        return None
    made = verify_recording(scene, part, error=error, name=name)
    if made.verdict is not Verdict.RIGHT:
        return None
    first, last = part.number(0), part.number(len(part.t) - 1)
    assert isinstance(made.details, Details)
    left_out = {NOT_FREE if reason == OUTSIDE else reason: count for reason, count in part.left_out.items()}
    details = replace(made.details, stretch=(first, last), description=replace(made.details.description, left_out=left_out))
    made = replace(made, details=details)
    rows = f"rows {first:,} to {last:,} ({part.t[0]:.6g} to {part.t[-1]:.6g} s) are free motion"
    if not stretch.open:
        return replace(made, reason=f"{rows}; the other rows are not, and are not compared; {made.reason}")
    start, end = part.options.start_time, part.options.end_time
    doubt = f"{rows[:1].upper()}{rows[1:]}, and {stretch.open}. --from {start!r} --until {end!r} compares these rows alone"
    findings = [replace(finding, verdict=Verdict.UNDECIDED, detail=doubt) for finding in made.findings]
    return replace(made, findings=findings, reason=f"{doubt}; {made.reason}")


def _pair(values: Array) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _cause(explanation: Explanation, worse: int) -> Cause:
    return replace(explanation.cause, left=explanation.left[worse], of=explanation.plain[worse])


def _reason(finding: Finding, details: Details, proven: Sequence[Explanation]) -> str:
    """Return the reason of the verdict: the errors, the allowed errors, and the mistakes with the errors that they leave."""
    allowed = details.show(details.allowed)
    verb = "are" if all(unit.size for unit in details.units) else "is"
    no_gap = OUTSIDE, REPEATED, NOT_FREE
    left = sum(count for reason, count in details.description.left_out.items() if reason not in no_gap)
    decided = [
        f"its largest error is {details.show(details.error)}",
        f"{allowed} {verb} allowed by {'--error' if finding.by == 'error' else f'its {finding.by}'}",
        *([details.shape] if details.shape else []),
        *([f"{left:,} of {details.in_file:,} rows are left out"] if 2 * left > details.in_file else []),
    ]
    causes = [
        uncapitalised(explanation.sentence) + (f" (leaves {details.show(explanation.left)})" if max(explanation.plain) else "")
        for explanation in proven
    ]
    if finding.verdict is Verdict.UNDECIDED:
        return "; ".join([finding.detail, *decided])
    if causes:
        return "; ".join([" or ".join(causes), *decided])
    unknown = finding.verdict is Verdict.WRONG and not details.shape
    return "; ".join([*decided, *(["no known mistake explains it"] if unknown else [])])


def _single_rows(comparison: Comparison) -> Explanation:
    """Return the explanation by single rows that are off, or by spoiled rates where quaternions change their sign."""
    (row, at, size), case = comparison.outliers[0], comparison.case
    key, values = "single rows", {"row": float(row), "time": at, "error": size}
    flips = case.t[case.flipped] if case.flipped is not None else np.zeros(0)
    near = 1.5 * float(np.median(np.diff(case.t)))  # the row of the change, or a neighbour
    times = [time for _, time, _ in comparison.outliers]
    if len(times) > 1 and len(flips) and all(np.abs(flips - time).min() < near for time in times):
        key, values = "rates at sign changes", {"rows": float(len(times)), "first": float(row)}
    mistake, before = BY_KEY[key], comparison.worst.max(axis=1).tolist()
    return Explanation((key,), mistake.sentence.format(**values), values, [0.0, 0.0], before, 0.0, 0.0, True)


def _allow_shape(rows: Rows, recording: Recording) -> float:
    """Return the departure from a rotation that digits and noise allow. One attitude does not show how many digits it has."""
    R = rows.case.data[0]
    least = SHAPE_OF_ONE if R is not None and np.ptp(R, axis=0).max() == 0 else SHAPE
    return float(max(least, UNITS_OF_DIGITS * recording.digits[1], SIGMAS * rows.noise[0]))


def _unclear(case: Compared) -> str:
    """Return the sentence on rows that another start may explain; "" if no start does."""
    some = case.first(LONGEST_FIT, FEWEST_FOR_NOISE)
    cut = case.effort.over or (any(case.open) and not case.far and some.turned > 2 * LONGEST_FIT)
    return CUT if cut else HIDDEN if case.hidden() else ""


def _doubt(case: Compared, errors: Array, resolved: Array, recording: Recording) -> str:
    """Return the sentence on the data that would decide, if errors may be harmless; "" if they are wrong."""
    if case.far:
        return FAR_APART.format(angle=case.gap)
    if only_noise(case):
        return NOISE_ONLY
    single = max(recording.digits[1:]) > 1e-9  # fewer than nine digits
    if errors.max() <= (ACCURATE_SINGLE if single else ACCURATE) and errors.max() > case.allowed.min():
        return (
            f"The error is larger than the digits of the file allow, and as small as the error of a good solver in "
            f"{'single' if single else 'double'} precision. An allowed error decides: --error"
        )
    if (
        not resolved[[x is not None for x in case.data]].all()
        and errors.max() <= 2 * MOST_NOISE
        and len(case.t) >= FEWEST_FOR_NOISE
    ):
        d = case.differences(*case.exact)
        lags = [abs(float((d[k:] * d[:-k]).sum() / (d * d).sum())) for k in range(1, min(20, len(d) // 4) + 1)]
        # Motion that looks like noise from row to row repeats after some rows, and errors of times lie along the motion.
        if max(lags) < 0.3 and not any(case.along(*case.exact)):
            return "What is left looks like noise, but the rows are too far apart to tell. More rows a turn, or --error, decide"
    return ""


def _misshapen(comparison: Comparison, recording: Recording) -> str:
    """Return the finding that matrices are not rotations, or quaternions not of norm 1."""
    matrix, (size, t) = recording.layout.attitude == "matrix", comparison.shape
    what = "The matrices are not rotations: |R'R - 1| is" if matrix else "The quaternions are not of norm 1: it differs by"
    return f"{what} up to {size:.3g}, at {t:g} s. They are repaired before they are compared"


def _series(comparison: Comparison, recording: Recording, from_row: bool) -> tuple[dict[str, Array], tuple[Unit, Unit]]:
    """Return errors and drifts (n,) by their names, and the unit of errors of attitudes and rates, with its size or 0."""
    case = comparison.case.take(slice(0, len(comparison.errors[0])))
    R, w = case.data
    unit = ("deg/s", float(np.degrees(case.scale))) if recording.degrees else ("rad/s", case.scale)
    units = Unit("rad", float(R is not None)), Unit(unit[0], unit[1] * (w is not None))
    series: dict[str, Array] = {
        f"{name} error, {unit}": error * size
        for name, (unit, size), error in zip(("attitude", "rate"), units, comparison.errors, strict=True)
        if size
    }
    series |= _drifts(case, from_row)
    if recording.unit_errors is not None:
        name = "|R'R - 1|" if recording.layout.attitude == "matrix" else "quaternion norm, minus 1"
        series[name] = np.abs(recording.unit_errors)[: len(case.t)]
    return series, units


def _instability(comparison: Comparison) -> list[str]:
    """Return the note on energies that approach the energy of rotation about the intermediate axis."""
    scene, w = comparison.case.scene, comparison.case.data[1]
    if w is None or not scene.free or scene.body.rotor_momentum is not None or comparison.errors.max() <= FAR:
        return []
    J, L = np.sort(scene.body.moments), np.linalg.norm(scene.body.momentum(w), axis=1)
    gap = np.abs(kinetic_energy(scene.body, w) * 2 * J[1] / np.where(L == 0, math.inf, L) ** 2 - 1)
    near = gap[-len(gap) // 10 :].max() < 0.1 * gap[0]
    return ["The energy approaches L^2/(2 I2): intermediate axis instability is created by the integrator."] * bool(near)


def _drifts(case: Compared, from_row: bool) -> dict[str, Array]:
    """Return the drifts (n,) of the invariants that the data determine. Balances also need the work of the loads."""
    (R, w), drifts = case.data, dict[str, Array]()
    # Rates alone determine the energy of a free body.
    energy = None if case.scene.potential else find_energy(case.scene.invariants)
    for invariant in case.scene.invariants if w is not None else ():
        if w is not None and invariant.supplied is None and (R is not None or invariant is energy):
            R_WB = np.broadcast_to(np.eye(3), (len(w), 3, 3)) if R is None else R
            drift = Trajectory(case.scene, case.t, R_WB, w, "file").drift(invariant)
            # The initial value is the value at t = 0, and the field may have turned until the first row.
            drifts[f"drift of {invariant.name}"] = sizes(drift - drift[0] if from_row else drift)
    return drifts
