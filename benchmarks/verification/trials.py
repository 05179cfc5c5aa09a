"""The motion that mistakes make in a case, from the effects that the catalogue declares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.errors import BadInput
from conservative.features import Feature
from conservative.scene import Scene

from .compare import Compared, Solution, exact
from .explanation import Trial
from .mistakes.attitudes import BIASED, BODY, Drift, Rule, integrate
from .mistakes.equations import EquationsMistake
from .mistakes.habits import Habit
from .mistakes.mistake import Mistake
from .mistakes.readings import ATTITUDES, RATES, Reading
from .mistakes.scenes import SceneMistake
from .mistakes.times import Time
from .solution import ANGLE, Equations, integrate_rates, truth

FASTEST = 1.1
"""Largest factor of times."""
AHEAD = 8
"""Number of steps that the exact motion first runs ahead of a habit."""
_DEFAULTS = {field.name: field.default for field in fields(Equations) if field.name not in ("scene", "tolerance", "most")}


def compose(*mistakes: Mistake, remark: str = "") -> Trial:
    """Return the trial of readings, times, scenes and equations with mistakes, all at once."""
    numbers = tuple(number for mistake in mistakes for number in mistake.numbers)
    return Trial(mistakes, lambda case: _build(mistakes, case), numbers, remark)


def fits(mistake: Mistake, case: Compared) -> bool:
    """Return whether a case has the attitudes, rates and step that a mistake needs."""
    R, w = case.data
    if isinstance(mistake, Reading):
        have = {ATTITUDES: R is not None, RATES: w is not None}.get(mistake.of, True)
        return have and not (mistake.both and (R is None or w is None))
    if isinstance(mistake, Time):
        return not (mistake.of_step and case.step is None) and not (mistake.both and (R is None or w is None))
    if isinstance(mistake, SceneMistake):
        return not (mistake.start and case.from_row)
    return True


def equations_of(
    mistakes: Sequence[Mistake], scene: Scene, values: dict[str, Any], tolerance: float, most: float
) -> Equations | None:
    """Return the equations with mistakes in the scene and in the equations; None if a mistake makes no difference."""
    changes: dict[str, Any] = {}
    for mistake in mistakes:
        numbers = [values[number.name] for number in mistake.numbers]
        if isinstance(mistake, SceneMistake):
            try:
                other = mistake.change(scene, *numbers)
            except BadInput:  # a number that no scene has
                return None
            if other is None and not numbers:
                return None
            scene = other or scene  # without a change by numbers of no size
    for mistake in mistakes:
        if isinstance(mistake, EquationsMistake):
            made = mistake.build(scene, *(values[number.name] for number in mistake.numbers))
            if made is None:
                return None
            changes |= {name: getattr(made, name) for name, value in _DEFAULTS.items() if getattr(made, name) is not value}
    return Equations(scene, tolerance=tolerance, most=most, **changes)


def _build(mistakes: Sequence[Mistake], case: Compared) -> Solution | None:
    if not all(fits(mistake, case) for mistake in mistakes):
        return None
    readings = [mistake for mistake in mistakes if isinstance(mistake, Reading)]
    time = next((mistake for mistake in mistakes if isinstance(mistake, Time)), None)
    moved = [mistake for mistake in mistakes if isinstance(mistake, SceneMistake | EquationsMistake)]
    own = any(mistake.numbers for mistake in mistakes if isinstance(mistake, SceneMistake))
    numbers = [number for mistake in mistakes for number in mistake.numbers]
    starts = any(isinstance(mistake, SceneMistake) and mistake.start for mistake in mistakes)
    exactly = case.equations()

    def equations(p: Array) -> Equations | None:
        return equations_of(moved, case.scene, dict(zip((number.name for number in numbers), p, strict=True)),
                            tolerance=exactly.tolerance, most=exactly.most)  # fmt: skip

    probe = np.array([number.start + 0.5 for number in numbers])  # with the numbers of the start the scene does not change
    if any(mistake.numbers and mistake.change(case.scene, *(number.start + 0.5 for number in mistake.numbers)) is None
           for mistake in mistakes if isinstance(mistake, SceneMistake)) or equations(probe) is None:  # fmt: skip
        return None
    plain = exact(case) if not moved and time is None else None
    flows: list[Any] = []  # if the start is not fitted, trials are other times of one motion

    def read(reading: Reading, p: Array, R: Array, w: Array, back: bool) -> tuple[Array, Array]:
        if not reading.numbers:
            made = (reading.read if back else reading.write)(R, w)
        else:  # one reading for each motion
            at = [numbers.index(number) for number in reading.numbers]
            many = [(reading.read if back else reading.write)(R[i], w[i], *row[at]) for i, row in enumerate(p)]
            made = tuple(np.stack(list(x)) for x in zip(*many, strict=True))  # type: ignore[assignment]
        return made  # type: ignore[return-value]

    def solve(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
        if plain is not None:
            return plain(R, w, p, n)
        if own:
            made = [one(equations(row) or case.equations(), R[[i]], w[[i]], row[None], n) for i, row in enumerate(p)]
            return np.concatenate([a for a, _ in made]), np.concatenate([b for _, b in made])
        return one(equations(p.T) or case.equations(), R, w, p, n)

    def one(equations: Equations, R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
        if starts:
            R, w = (np.broadcast_to(x, y.shape) for x, y in ((equations.scene.R_WB0, R), (equations.scene.w_WB_B0, w)))
        if time is None:
            return equations.solve(case.start, R, w, case.t[:n])
        return _at_times(time, case, equations, R, w, p[:, [numbers.index(number) for number in time.numbers]], n, flows)

    def motion(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
        for reading in reversed(readings) if case.from_row else ():
            R, w = read(reading, p, R, w, True)
        R, w = solve(R, w, p, n)
        for reading in readings:
            R, w = read(reading, p, R, w, False)
        return R, w

    return motion


def _at_times(
    time: Time, case: Compared, equations: Equations, R: Array, w: Array, p: Array, n: int, flows: list[Any]
) -> tuple[Array, Array]:
    """Return motions at other times; the first row keeps its time."""
    t = case.t[:n] - case.start
    gap = float(np.median(np.diff(case.t)))
    end = float(case.t[-1] + 0.1 * (case.t[-1] - case.start) + 2 * gap)
    if 0 < time.unit < 1:  # in the unit of the file, the motion may have any number of turns
        end = case.start + (end - case.start) * time.unit
    if case.free or not flows:
        flows[:] = [equations.flow(case.start, R, w, end)]
    of_attitudes, of_rates = (
        np.broadcast_to(np.atleast_2d(times), (len(p), n)).copy()
        for times in time.at(t, case.step, *(column[:, None] for column in p.T))
    )
    out = []
    for times in (of_attitudes, of_rates):
        times[:] = np.clip(times, 0.0 * t, np.maximum(t * FASTEST, end - case.start))
        if time.after and case.from_row:
            times[:, 0] = t[0]
        out.append(flows[0].at_own_times(np.clip(times + case.start, case.start, end)))
    return out[0][0], out[1][1]


def by_rule(rule: Rule, parts: int) -> Trial:
    """Return the trial of a rule that integrates attitudes from exact rates, with `parts` steps between two rows."""

    def build(case: Compared) -> Solution | None:
        if case.data[0] is None:
            return None

        def motion(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
            t = case.t[:n] if case.from_row else np.append(case.start, case.t[:n])
            count = parts if case.step is None else max(1, round(float(np.median(np.diff(t))) / case.step))
            fine = np.append((t[:-1, None] + np.diff(t)[:, None] * np.arange(count) / count).ravel(), t[-1])
            turned, rates = [], []
            for a, b in zip(R, w, strict=True):
                scene = case.scene.rename(case.scene.name, R_WB0=a, w_WB_B0=b)
                made = truth(scene, case.start, fine)[1]
                turned.append(integrate(rule.matrices, a, made, np.diff(fine), count)[-n:])
                rates.append(made[::count][-n:])
            return np.stack(turned), np.stack(rates)

        return motion

    return Trial((rule,), build)


def by_drift(drift: Drift) -> Trial:
    """Return the trial of attitudes that turn away from the exact motion at a constant rate."""

    def build(case: Compared) -> Solution | None:
        if case.data[0] is None:
            return None
        motion = exact(case)

        def drifting(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
            turned, rates = motion(R, w, p, n)
            some = case.take(slice(0, n))
            return np.stack([Drifting(some, *each)(drift, row) for *each, row in zip(R, w, turned, p, strict=True)]), rates

        return drifting

    return Trial((drift,), build, drift.numbers)


class Drifting:
    """Attitudes that drift against a motion of a case: the motion from R0, w0 has the attitudes R (n, 3, 3)."""

    def __init__(self, case: Compared, R0: Array, w0: Array, R: Array) -> None:
        self.case, self.start, self.R = case, (R0, w0), R

    @cached_property
    def between(self) -> tuple[Array, Callable[[Array], Array]]:
        """The ends of stretches, s, and the attitudes at times between them."""
        case, end = self.case, float(self.case.t[-1])
        breaks = [time for time in case.scene.smoothness(end).breaks.tolist() if case.start < time < end]
        count = 2 + int((end - case.start) * case.scale / ANGLE)
        known: dict[int, Array] = {}  # the same times for each rate

        def attitudes(times: Array) -> Array:
            if not known:
                flat, place = np.unique(times, return_inverse=True)
                at = replace(case, t=flat, data=(None, None))
                turned = exact(at)(self.start[0][None], self.start[1][None], np.zeros((1, 0)), len(flat))[0][0]
                known[0] = turned[place.reshape(times.shape)]
            return known[0]

        return np.unique([*np.linspace(case.start, end, count), *breaks]), attitudes

    def __call__(self, drift: Drift, numbers: Array) -> Array:
        """Return the attitudes (n, 3, 3) that drift."""
        rate, after = drift.rate(numbers), self.case.t - self.case.start
        if drift.about == BIASED:  # (P R)' = P R [w + b] holds for P' = P [R b], the turn of the world
            ends, attitudes = self.between
            return integrate_rates(lambda times: attitudes(times) @ rate, ends, self.case.t) @ self.R
        away = Rotation.from_rotvec(after[:, None] * rate).as_matrix()
        return self.R @ away if drift.about == BODY else away @ self.R


def by_habit(habit: Habit, step: float | None) -> Trial:
    """Return the trial of a habit after each step, s; None for one step between two rows."""

    def build(case: Compared) -> Solution | None:
        if case.data[1] is None and case.data[0] is None:
            return None
        points, rows = _points(case, case.step or step)
        equations = case.equations()

        def motion(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
            last = rows[n - 1] + 1
            made = [
                _with_habit(case, equations, points[:last], a, b, partial(_after, habit, numbers))
                for a, b, numbers in zip(R, w, p, strict=True)
            ]
            return np.stack([a[rows[:n]] for a, _ in made]), np.stack([b[rows[:n]] for _, b in made])

        return motion

    return Trial((habit,), build, habit.numbers)


def _after(habit: Habit, numbers: Array, rates: Array) -> Array:
    return habit.after(rates, *numbers)


def _points(case: Compared, step: float | None) -> tuple[Array, Any]:
    """Return the times at the ends of steps, s, from the start on, and the places of the rows among them."""
    points, rows = [case.start], [] if case.t[0] > case.start else [0]
    for a, b in pairwise(([case.start] if case.t[0] > case.start else []) + case.t.tolist()):
        parts = 1 if step is None else max(1, round((b - a) / step))
        points += [a + (b - a) * k / parts for k in range(1, parts)] + [b]
        rows.append(len(points) - 1)
    return np.array(points), np.array(rows)


def _with_habit(
    case: Compared, equations: Equations, t: Array, R: Array, w: Array, after: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Return the states at the ends of steps. The exact motion runs ahead until the habit changes its rates."""
    turned, rates = np.empty((len(t), 3, 3)), np.empty((len(t), 3))
    turned[0], rates[0], done, ahead = R, w, 0, AHEAD
    while done < len(t) - 1:
        some = slice(done + 1, min(done + 1 + ahead, len(t)))
        a, b = (x[0] for x in equations.solve(float(t[done]), turned[[done]], rates[[done]], t[some]))
        case.effort.spend(1)
        if case.effort.over or not np.isfinite(b).all():
            turned[done + 1 :], rates[done + 1 :] = np.nan, np.nan
            break
        kept = after(b)
        off = np.flatnonzero((kept != b).any(axis=1))
        count = int(off[0]) + 1 if len(off) else len(b)
        turned[done + 1 : done + 1 + count], rates[done + 1 : done + 1 + count] = a[:count], kept[:count]
        done, ahead = done + count, 1 if len(off) else min(2 * ahead, 10 * AHEAD)
    return turned, rates


def remark_on_damping(scene: Scene) -> str:
    """Return the end of a sentence on damping."""
    return ", in addition to the damping of the scene" * (Feature.DAMPING in scene.features)
