"""The search for the integrator and the step that made a recorded motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.scene import Scene

from .compare import HOPELESS, LINEAR, Compared, Solution, differ, linearise, weigh
from .explanation import Explanation, Trial, attempt
from .mistakes.steps import INTEGRATORS, Integrator, Step
from .solution import Derivative, Equations, slopes_of_motor, truth

CHUNK, CHUNK_EFFORT = 256, 100
"""Steps after which work is counted, and their work (`Effort`)."""
ROWS, STEP_EFFORT = 400, 1.0
"""Largest number of rows that candidates are compared with, and the work of one step from all of them."""
STEPS_AT_MOST, PARTS = 20_000, 2000
"""Largest numbers of steps of a method, over the file and between two rows."""
SINGLE, CLEAR = 2.0**-26, 1e-3
"""Rounding from which a file is in single precision, and the largest share that a method leaves whose steps round, too."""
MOST_KEPT = 50_000
"""Largest number of times whose loads are kept."""
CANDIDATES = 5
"""Number of methods that run from the first row."""
FIRST_STEPS = 2000
"""Steps of a first run, which shows that most candidates are wrong."""


@dataclass(frozen=True, eq=False)
class Slope:
    """The derivative of states (7, n), at one time or at a time for each of them, s.

    A state is a quaternion and rates, as simulators have it: a motor acts by its torque -h' at the times of the method, where
    `Equations` integrate its momentum. Loads at one time are kept: a method runs many times over the same times.
    """

    equations: Equations
    known: dict[float, tuple[Derivative, Array, Array]] = field(default_factory=dict)

    @property
    def body(self) -> Any:
        return self.equations.scene.body

    def rotor(self, t: Any) -> Any:
        """Return the momentum (3, n) or (3, 1) of the rotor, kg m^2/s; 0 without one."""
        if self.body.motor is not None:
            return np.array([self.body.motor.at(time) for time in np.atleast_1d(t).tolist()]).T
        return np.zeros((3, 1)) if self.body.rotor_momentum is None else self.body.rotor_momentum[:, None]

    def rates(self, t: Any, y: Array) -> Array:
        """Return the angular velocities (3, n) of states."""
        return y[4:]

    def __call__(self, t: Any, y: Array) -> Array:
        if np.ndim(t):
            derivative, wheel, faster = self._at(np.asarray(t))
            return self._apply(derivative, wheel, faster, y[:, None])[:, 0]
        t = 0.0 if self.equations.steady else float(t)
        if t not in self.known:
            if len(self.known) > MOST_KEPT:
                self.known.clear()
            self.known[t] = self._at(np.array([t]))
        return self._apply(*self.known[t], y[:, :, None])[:, :, 0]

    def _at(self, t: Array) -> tuple[Derivative, Array, Array]:
        """Return the derivative at times (n,), s, and J^-1 h and J^-1 h' (3, n) of a motor."""
        nothing = np.zeros((3, 1))
        if self.body.motor is None:
            return self.equations.at(t), nothing, nothing
        changes = slopes_of_motor(self.body.motor, t)
        return self.equations.at(t), self.equations.wheel(t), self.equations.reaction * (self.body.inverse @ changes.T)

    def _apply(self, derivative: Derivative, wheel: Array, faster: Array, y: Array) -> Array:
        if self.body.motor is None:
            return derivative(y)
        moved, shape = y.copy(), (3, 1, -1) if y.shape[1] == 1 else (3, -1, 1)
        moved[4:] += wheel.reshape(shape)
        out = derivative(moved)
        out[4:] -= faster.reshape(shape)
        return out


def pack(R: Array, w: Array) -> Array:
    """Return the states (7, n) of attitudes (n, 3, 3) and rates (n, 3)."""
    return np.concatenate([to_quaternion(R).T, w.T])


def unpack(y: Array) -> tuple[Array, Array]:
    """Return attitudes (..., 3, 3) and rates (..., 3) of states (7, ...)."""
    q = y[:4] / np.sqrt((y[:4] * y[:4]).sum(axis=0))
    return from_quaternion(np.moveaxis(q, 0, -1)), np.moveaxis(y[4:], 0, -1)


@lru_cache(maxsize=4)
def slope_of(scene: Scene) -> Slope:
    """Return the derivative of a scene, which trial runs share."""
    return Slope(Equations(scene))


def march(case: Compared, method: Step, parts: int) -> Solution:
    """Return the motion by a method with `parts` steps between two rows, which are equally far apart."""
    f, weight = slope_of(case.scene), weigh(case.scene)
    h = float(case.t[-1] - case.start) / (count_gaps(case)[-1] * parts)

    def motion(R: Array, w: Array, _: Array, n: int) -> tuple[Array, Array]:
        y, past, kept, numbers = pack(R, w), list[Array](), list[Array](), count_gaps(case)[:n] * parts
        last, wanted = int(numbers[-1]), set(numbers.tolist())
        with np.errstate(all="ignore"):
            for number in range(last + 1):
                if number % CHUNK == 0:
                    case.effort.spend(CHUNK_EFFORT * weight)
                    if case.effort.over:
                        kept += [y * np.nan] * (n - len(kept))
                        break
                if number in wanted:
                    kept.append(y)
                if number < last:
                    new = method.next(f, case.start + number * h, y, h, past)
                    past = [y, *past][: method.past]
                    y = new
                    if method.normalised:
                        y[:4] /= np.sqrt((y[:4] * y[:4]).sum(axis=0))
            return unpack(np.stack(kept, axis=2))

    return motion


def by_step(integrator: Integrator, parts: int) -> Trial:
    """Return the trial of an integrator with `parts` steps between two rows."""
    return Trial((integrator,), lambda case: march(case, integrator.step, parts))


def count_gaps(case: Compared) -> Any:
    """Return the times of the rows since the start, as whole numbers of the smallest distance of two rows."""
    return np.rint((case.t - case.start) / np.diff(case.t).min()).astype(int)


def find_steps(case: Compared) -> Iterator[Explanation]:
    """Yield motions by methods with a step that divides the distance of the rows.

    Candidates leave least of the differences between a row and the exact motion from the row before (`RowByRow`), or of the
    differences from the exact motion, to first order (`Linearised`). They then run from the first row.
    """
    numbers, gaps = count_gaps(case), np.diff(case.t)
    if case.data[0] is not None and case.data[1] is not None and case.error[1].max() <= case.allowed[1]:
        return  # no method has exact rates
    if np.abs(case.t - case.start - numbers * (case.t[-1] - case.start) / numbers[-1]).max() > 1e-3 * gaps.min():
        return
    if numbers[-1] > 2 * STEPS_AT_MOST or numbers[0] > 0 or len(case.t) < 3:
        return
    case = case.take(slice(0, int(np.searchsorted(numbers, STEPS_AT_MOST))))
    if np.ptp(np.diff(count_gaps(case))) > 0:  # some rows are missing
        return
    for ranking in (RowByRow, Linearised):
        if ranking is Linearised or (all(x is not None for x in case.data) and Equations(case.scene).steady):
            explained, linear = False, ranking(case)
            if not np.isfinite(linear.wanted).all():  # a row with a rate that no motion of the scene has
                continue
            for explanation in _run_best(case, linear):
                yield explanation
                explained |= explanation.explains
            if explained:
                return


def _run_best(case: Compared, linear: Linearised) -> Iterator[Explanation]:
    """Yield motions by the methods that leave the smallest shares."""
    step_of_rows = float(np.diff(case.t).mean())
    ranked = linear.rank()
    proven = False
    for left, parts, _, integrator in ranked[:CANDIDATES]:
        # Few rows do not rule out a method, and methods that leave much more than the best one are not it.
        if linear.used > 8 and left > min(0.5, max(0.02, 10 * ranked[0][0])):
            continue
        if proven and left > max(0.02, 10 * ranked[0][0]):
            continue
        if case.effort.over:
            return
        for count in sorted({parts, *linear.others(integrator.step, parts)}, key=lambda n: abs(n - parts)):
            for most in (FIRST_STEPS, STEPS_AT_MOST):
                some = case.take(slice(0, max(4, most // count)))
                if len(some.t) < len(case.t) and (some.plain.max(axis=1) <= some.allowed).all():
                    continue  # these rows do not differ from the exact motion
                step = step_of_rows / count
                explanation = attempt(some, by_step(integrator, count), known={"step": step}, ranked=True)
                if explanation is None or explanation.share > 0.5 or len(some.t) == len(case.t):
                    break
            if explanation is None:
                continue
            explanation = _with_rounding(case, explanation)
            yield explanation
            if explanation.explains:
                proven = True
                break


def _with_rounding(case: Compared, explanation: Explanation) -> Explanation:
    """Return the explanation by a method whose steps round in single precision, as the file does, if it leaves no more."""
    rounded = np.array(case.rounded)
    steps = float(case.t[-1] - case.start) / explanation.values["step"]
    grown = case.allowed * np.maximum(1.0, np.sqrt(steps))
    left = np.array(explanation.left)
    single = rounded.max() >= SINGLE and explanation.share < CLEAR
    return replace(explanation, explains=explanation.explains or bool(single and (left <= grown).all()))


class Linearised:
    """The rows' differences from the exact motion, and those that a method makes, to first order.

    `also` (n, 6) are differences for other numbers of the scene, which are fitted beside the method.
    """

    def __init__(self, case: Compared, also: Sequence[Array] = ()) -> None:
        self.case, self.f = case, slope_of(case.scene)
        self.equations = self.f.equations
        self.R, self.w, self.flow = linearise(case)
        data = self.R if case.data[0] is None else case.data[0], self.w if case.data[1] is None else case.data[1]
        self.away = differ(self.R, self.w, *data, case.scale)
        size = np.linalg.norm(self.away, axis=1)
        self.used = int(np.argmax(size > LINEAR)) if (size > LINEAR).any() else len(size)
        self.used = min(max(self.used, min(len(size), 8)), ROWS)
        have = [x is not None for x in case.data]
        self.weights = np.repeat(np.array(have) / case.noise, 3)
        self.inverse = np.linalg.pinv(self.flow[: self.used])
        self.made: dict[tuple[int, int], Array] = {}
        free = list(case.free) if (case.error.max(axis=1) <= HOPELESS * case.noise * case.growth).any() else []
        beside = [*(self.flow[:, :, k] for k in free), *also]
        self.starts = np.stack([(x[: self.used] * self.weights).ravel() for x in beside], axis=1) if beside else None
        self.wanted = self.beside_start(self.away)

    def errors(self, method: Step, parts: int) -> Array:
        """Return the errors (n, 6) of a method in the rows that are used."""
        if (id(method), parts) in self.made:
            return self.made[id(method), parts]
        case, n = self.case, self.used
        case.effort.spend(STEP_EFFORT * parts * weigh(case.scene))
        if method.recurrent:
            R, w = march(case.take(slice(0, n)), method, parts)(self.R[:1], self.w[:1], np.zeros((1, 0)), n)
            self.made[id(method), parts] = errors = differ(self.R[:n], self.w[:n], R[0], w[0], case.scale)
            return errors
        t, h = case.t[: n - 1], float(case.t[n - 1] - case.t[0]) / (n - 1) / parts
        y = pack(self.R[: n - 1], self.w[: n - 1])
        past: list[Array] = []
        for back in range(1, method.past + 1):
            a, b = truth(case.scene, case.start, np.maximum(t - back * h, case.start))
            past.append(pack(a, b))
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
            a, b = unpack(y)
        defect = differ(self.R[1:n], self.w[1:n], a, b, case.scale)
        carried = np.cumsum((self.inverse[1:n] @ defect[..., None])[..., 0], axis=0)
        errors = np.concatenate([np.zeros((1, 6)), (self.flow[1:n] @ carried[..., None])[..., 0]])
        self.made[id(method), parts] = errors
        return errors

    def beside_start(self, differences: Array) -> Array:
        """Return weighted differences without the part that a fitted start explains."""
        x = (differences[: self.used] * self.weights).ravel()
        return x if self.starts is None else x - self.starts @ np.linalg.lstsq(self.starts, x, rcond=None)[0]

    def share(self, method: Step, parts: int) -> tuple[float, float]:
        """Return the share of the differences that a method leaves, and the factor by which its errors fit best."""
        made = self.beside_start(self.errors(method, parts))
        left, size = np.linalg.norm(self.wanted - made), np.linalg.norm(self.wanted)
        return float(left / (size or 1.0)), float(made @ self.wanted / (made @ made or 1.0))

    def best(self, method: Step) -> tuple[float, int]:
        """Return the smallest share that a method leaves, and its number of steps between two rows."""
        shares, parts = dict[int, float](), self.case.stride
        sizes = [np.linalg.norm(self.beside_start(self.errors(method, n))) for n in (parts, 2 * parts)]
        order = float(np.clip(np.log2(sizes[0] / (sizes[1] or 1.0) or 1.0), 1, method.order))  # a torque can lower it
        while parts not in shares and len(shares) < 8 and not (shares and self.case.effort.over):
            shares[parts], factor = self.share(method, parts)
            if factor <= 0:
                break
            most = max(1, min(PARTS, 4 * STEPS_AT_MOST // self.used))
            wanted = parts * max(factor, 1e-12) ** (-1 / order)
            if wanted > 2 * most:
                break  # its errors are too large with the shortest step
            parts = int(np.clip(np.rint(wanted), 1, most))
        return min((left, n) for n, left in shares.items())

    def rank(self) -> list[tuple[float, int, str, Integrator]]:
        """Return integrators with the shares that they leave, smallest first, and their numbers of steps between two rows."""
        ranked = ((*self.best(method.step), method.key, method) for method in INTEGRATORS)
        return sorted(ranked, key=lambda candidate: candidate[:3])

    def others(self, method: Step, parts: int) -> list[int]:
        """Return the numbers of steps next to the best one that leave almost as little."""
        near = [n for n in (parts - 1, parts + 1) if n >= 1]
        best = self.share(method, parts)[0]
        return [n for n in near if self.share(method, n)[0] < max(1.5 * best, best + 0.1)]


class RowByRow(Linearised):
    """Differences of each row from the exact motion of the row before, and those that a method of one step makes there.

    They need attitudes, rates, and equations that do not depend on time. They hold at any distance from the exact motion.
    """

    def __init__(self, case: Compared) -> None:
        self.case, self.f = case, slope_of(case.scene)
        self.equations = Equations(case.scene, most=case.most)
        self.used = n = min(len(case.t), 200)
        self.made, self.starts = {}, None
        R, w = case.data
        assert R is not None
        assert w is not None
        self.gap = float(case.t[1] - case.t[0])
        self.R, self.w = R[:n], w[:n]
        a, b = self.equations.solve(0.0, self.R[:-1], self.w[:-1], np.array([self.gap]))
        self.exact, self.weights = (a[:, 0], b[:, 0]), np.repeat(1 / case.noise, 3)
        self.wanted = self.beside_start(differ(*self.exact, self.R[1:], self.w[1:], case.scale))

    def errors(self, method: Step, parts: int) -> Array:
        """Return the errors (n, 6) of a method from row to row; 0 for methods that need earlier states."""
        if method.past or method.recurrent:
            return np.zeros((self.used - 1, 6))
        if (id(method), parts) not in self.made:
            self.case.effort.spend(STEP_EFFORT * parts)
            y = pack(self.R[:-1], self.w[:-1])
            with np.errstate(all="ignore"):
                for _ in range(parts):
                    y = method.next(self.f, 0.0, y, self.gap / parts, [])
                made = unpack(y)
            self.made[id(method), parts] = differ(*self.exact, *made, self.case.scale)
        return self.made[id(method), parts]
