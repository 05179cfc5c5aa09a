"""Samples of a motion beside the exact motion: errors, what is allowed and by what, noise, and fits of initial states.

Attitude errors are in rad, errors of rates relative to the largest rate. Nothing here knows files.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, angle_between, to_quaternion
from conservative.features import IN_TIME
from conservative.scene import Scene

from .solution import ANGLE, Equations, States, has_closed_form, truth

FLOOR = 1e-9
"""Smallest allowed error: double precision makes smaller ones by round-off."""
UNITS_OF_DIGITS = 6.0
"""Allowed error over the error that the digits of a file make."""
SIGMAS = 7.0
"""Allowed error over the standard deviation of the noise."""
ROUND_OFF = 1e-13
"""Smallest noise that fits assume: round-off in double precision."""
LONGEST, NUMERICAL = 100.0, 2000.0
"""Angles, rad, of the rows that are explained, and of the rows that are compared if the motion has no closed form."""
FEWEST_FOR_NOISE = 14
"""Smallest number of rows from which noise is estimated: differences of order 9 need several."""
TINY = 1e-11
"""Noise below this is round-off, and not motion."""
SCREENS, FEWEST_SCREENED, SCREENED = (3.0, 10.0, 30.0), 12, 30.0
"""Mistakes are first tried on some rows: of the first of these angles, rad, or 12, whose error is 30 times the allowed one."""
LONGER = 30.0
"""Largest number of stretches of a trial motion, relative to the exact one: a large fitted number can make a motion stiff."""
PART_OF_ALLOWED = 0.01
"""Noise that fits assume in answers of a program, relative to the allowed error: smaller errors do not tell mistakes apart."""
HUGE = 1e60
"""Replaces a difference that is not finite, relative."""
SENSITIVE = 1e6
"""Factor by which a motion may multiply an error. Beyond it, solutions need more digits."""
HOPELESS = 30.0
"""Error, in units of the noise, from which no other first row explains it."""
LINEAR = 0.3
"""Largest difference of motions, rad, that is treated to first order."""
FEWEST_LINEAR, MOST_LEFT, HIDDEN_BY_NOISE = 8, 0.7, 3.0
"""Rows from which `may_explain` decides, the share of the difference that a possible mistake leaves, and the root of the mean
square, in units of the noise, below which it does not decide."""
ROWS_OF_EFFORT = 500
"""Number of rows whose comparison takes as long as a stretch of a motion."""
PERTURBED = 1e-8, 1e-12
"""Changes of initial states that show how the motion multiplies them. The second is used where the first becomes large."""
FEWEST_FIT = 4
"""Rows that a fit of the start begins with, if the body turns by more than a quarter from row to row."""
STRAIGHT, NARROWED = 0.03, 6
"""Largest difference of motions from which slopes are computed, and the number of trials with smaller changes."""
QUARTER = math.pi / 2
"""Turn from row to row, rad, from which differences of a motion do not become smaller with their order."""
MOST_NOISE = 0.05
"""Largest noise, rad or relative to the largest rate. Larger differences of rows are motion."""
LEAST_CURVED, MOSTLY_FLAT = 1e-3, 0.1
"""Turn of the motion from row to row, rad, from which it has a plane, and the median sine to the plane of differences in it;
0.5 for noise."""
MOSTLY_ALONG = 0.9
"""Median cosine between differences and the motion from which they are errors of times; 0.5 for noise."""
CONVERGED = 1e-3
"""Share of the sum of squares by which a step of a fit that has converged improves it."""
SMALLEST_CHANGE = 1e-14
"""Smallest change of initial states from which slopes are computed."""
EXTENDED = 40
"""Largest number of fits that take more and more rows."""
FASTER = 30.0
"""Growth of small changes over the angle of rotation, from which a motion is near a separatrix."""
Solution = Callable[[Array, Array, Array, int], tuple[Array, Array]]
"""From initial attitudes (B, 3, 3), rates (B, 3), other numbers (B, k) and n to the first rows (B, n, 3, 3), (B, n, 3)."""


@dataclass(frozen=True, eq=False)
class Allowed:
    """Errors that samples may have, of attitudes, rad, and of rates, relative to the largest rate, and what allows them.

    `errors` (2,) are the largest, and `by` says for each of the two what allows it: "digits", "noise", or another word for
    a given error. `noise` (2,) is the deviation of one axis, by which fits weigh samples. `rounded` (2,) are the errors that
    digits make; a given error alone decides, so it stands there too.
    """

    errors: Array
    by: tuple[str, str]
    noise: Array
    rounded: Array


def allow(rounded: Any = (0.0, 0.0), noise: Any = (0.0, 0.0), error: float | None = None, by: str = "error") -> Allowed:
    """Return the errors that are allowed: a given error alone, or else what the digits and the noise of samples make.

    `rounded` (2,) are the errors that digits make, and `noise` (2,) is the standard deviation of one axis, both of attitudes,
    rad, and of rates, relative to the largest. `by` says what a given error comes from.
    """
    rounded, noise = np.asarray(rounded, float), np.asarray(noise, float)
    weight = np.maximum(np.maximum(noise, rounded), ROUND_OFF)
    if error is not None:
        return Allowed(np.full(2, error), (by, by), weight, np.full(2, error))
    digits, scattered = np.maximum(FLOOR, UNITS_OF_DIGITS * rounded), SIGMAS * noise
    causes = ["noise" if a > b else "digits" for a, b in zip(scattered, digits, strict=True)]
    return Allowed(np.maximum(digits, scattered), (causes[0], causes[1]), weight, rounded)


def take_rows(data: States, rows: Any) -> States:
    """Return some rows of a motion."""
    return None if data[0] is None else data[0][rows], None if data[1] is None else data[1][rows]


def weigh(scene: Scene) -> float:
    """Return the work of a solution in a scene, relative to the work for a free body."""
    varying = None if scene.damping is None else scene.damping.of_time
    slow = (scene.torque is not None and scene.torque.of_attitude) or (varying is not None and varying.of_attitude)
    in_python = scene.potential is not None and Equations(scene).law is None
    weight = 1.0 + 0.2 * bool(scene.features & IN_TIME) + 0.7 * bool(scene.loads)
    return weight + 40.0 * (slow or in_python)  # functions of attitude are called for each state in each iteration


def take_part(motion: tuple[Array, Array], of: States) -> States:
    """Return attitudes and rates of a motion as far as data have them."""
    R, w = (x if y is not None else None for x, y in zip(motion, of, strict=True))
    return R, w


@dataclass
class Effort:
    """The work that a search may still do. It is counted, because the clock depends on how busy the machine is.

    The unit is a stretch of a solution (`Equations.flow`), 0.3 ms on an idle machine.
    """

    left: float

    def spend(self, stretches: float) -> None:
        """Count work."""
        self.left -= stretches

    @property
    def over(self) -> bool:
        """True if no work is left."""
        return self.left <= 0


@dataclass(frozen=True, eq=False)
class Compared:
    """Rows of a file and the scene whose motion they should be, from its initial state at `start`, s.

    `allowed` and `noise` (2,) are errors of attitudes, rad, and rates, relative to `scale`, rad/s. `free` says which of six
    numbers of the initial state, turn and rates, are fitted to all rows, because the first one has digits or noise. `growth` is
    the factor by which the motion multiplies an error of the first row, and every `stride`-th row is here. `effort` is
    the work that a search may still do. `rounded` are the errors that digits make; with an allowed error of the user, which
    alone decides, this one. `step` is the step of a program, s; None if it is not known. `flipped` (n,) is True in rows in
    which the quaternion of the file changes its sign; None if the file has no quaternions. `open` says for attitudes and rates
    whether the rows do not show their noise: what a motion leaves there may be noise.
    """

    scene: Scene
    t: Array
    data: States
    start: float
    scale: float
    allowed: Array
    noise: Array
    free: tuple[int, ...] = ()
    growth: float = SENSITIVE
    stride: int = 1
    effort: Effort = field(default_factory=lambda: Effort(math.inf))
    rounded: tuple[float, float] = (0.0, 0.0)
    step: float | None = None
    flipped: Any = None
    open: tuple[bool, bool] = (False, False)

    @property
    def from_row(self) -> bool:
        """Whether the initial state is the state of the first row."""
        return self.start == float(self.t[0])

    def take(self, rows: Any) -> Compared:
        """Return some of the rows."""
        flipped = None if self.flipped is None else self.flipped[rows]
        taken = replace(self, t=self.t[rows], data=take_rows(self.data, rows), flipped=flipped)
        if "exact" in vars(self):
            vars(taken)["exact"] = take_rows(self.exact, rows)
        return taken

    def change(self, **changes: Any) -> Compared:
        """Return the case with other fields than scene, start and times, whose exact motion it keeps."""
        changed = replace(self, **changes)
        if "exact" in vars(self):
            vars(changed)["exact"] = self.exact
        return changed

    def first(self, angle: float, least: int) -> Compared:
        """Return the rows in which the body turns by an angle, rad, or at least `least` rows."""
        return self.take(slice(0, max(least, int(np.searchsorted(self.t, self.t[0] + angle / self.scale)))))

    def read(self, R: Array | None, w: Array | None) -> Compared:
        """Return the case of other attitudes and rates, from the first row on."""
        changes = {name: x[0] for name, x in (("R_WB0", R), ("w_WB_B0", w)) if x is not None and self.from_row}
        return replace(self, scene=self.scene.rename(self.scene.name, **changes), data=(R, w))

    def rescale(self, scale: float) -> Compared:
        """Return the rows with rates relative to another scale, rad/s. Round-off in double precision is relative to a row."""
        factors = np.array([1.0, self.scale / scale])
        allowed = np.where(self.allowed <= FLOOR, FLOOR, self.allowed * factors)
        return replace(
            self, scale=scale, allowed=allowed, noise=np.where(self.noise <= ROUND_OFF, ROUND_OFF, self.noise * factors)
        )

    @cached_property
    def exact(self) -> tuple[Array, Array]:
        """The exact motion at the times of the rows."""
        return truth(self.scene, self.start, self.t)

    @cached_property
    def error(self) -> Array:
        """The errors (2, n) of the rows against the exact motion."""
        return self.errors(*self.exact)

    @cached_property
    def screen(self) -> Compared | None:
        """The first rows, which already tell whether a mistake explains the error; None if all rows are needed."""
        for angle in SCREENS:
            some = self.first(angle, FEWEST_SCREENED)
            if len(some.t) > 0.5 * len(self.t):
                return None
            if (np.sqrt((some.error**2).mean(axis=1)) > SCREENED * np.maximum(some.allowed, some.noise)).any():
                return some
        return None

    @cached_property
    def departure(self) -> tuple[Array, Array]:
        """The first rows minus the exact motion, (n, 6), and the matrices (n, 6, 6) that carry changes of its start there.

        Differences are of first order in these rows. With a start that is exact there are no matrices, (n, 6, 0).
        """
        R, w = (x if y is None else y for x, y in zip(self.exact, self.data, strict=True))  # no difference without data
        away = differ(*self.exact, R, w, self.scale)
        n = count_linear(away)
        flow = linearise(self.take(slice(0, n)))[2][:, :, list(self.free)] if self.free else np.zeros((n, 6, 0))
        return away[:n], flow

    def may_explain(self, motion: Solution, numbers: Array, small: Array) -> bool:
        """Return whether a motion can explain the error of the first rows to first order, with its numbers and start fitted.

        It decides in one evaluation what a fit would find after many. It cannot decide, and returns True, where the motion
        begins far from the rows or where noise hides the difference.
        """
        away, flow = self.departure
        n = len(away)
        if n < min(FEWEST_LINEAR, len(self.t)):
            return True
        some = self.take(slice(0, n))
        moved = np.vstack([numbers, numbers + np.diag(small)]) if len(numbers) else numbers[None]
        R, w = some.evaluate(motion, np.hstack([np.zeros((len(moved), 6)), moved]))
        made = differ(some.exact[0], some.exact[1], R, w, self.scale)
        n = min(n, count_linear(made[0]))
        if n < min(FEWEST_LINEAR, len(self.t)) or not np.isfinite(w[:, :n]).all():
            return True
        weights = np.repeat([float(x is not None) for x in self.data] / self.noise, 3)
        wanted = ((away[:n] - made[0, :n]) * weights).ravel()
        columns = [((flow[:n, :, k]) * weights).ravel() for k in range(flow.shape[2])]
        columns += [((x[:n] - made[0, :n]) / size * weights).ravel() for x, size in zip(made[1:], small, strict=True)]
        plain = (away[:n] * weights).ravel()
        if columns:
            matrix = np.stack(columns, axis=1)
            wanted = wanted - matrix @ np.linalg.lstsq(matrix, wanted, rcond=None)[0]
            starts = matrix[:, : flow.shape[2]]
            plain = plain - starts @ np.linalg.lstsq(starts, plain, rcond=None)[0]
        left, size = np.linalg.norm(wanted), np.linalg.norm(plain)
        return bool(left < MOST_LEFT * size or left < HIDDEN_BY_NOISE * np.sqrt(6 * n))

    @property
    def turned(self) -> float:
        """The angle, rad, by which the body may have turned."""
        return float(self.t[-1] - self.start) * self.scale

    @property
    def gap(self) -> float:
        """The angle, rad, by which the body turns from row to row."""
        return float(np.median(np.diff(self.t))) * self.scale

    @property
    def far(self) -> bool:
        """Whether the body turns by more from row to row than trial motions do in all."""
        return self.gap > NUMERICAL

    @cached_property
    def plain(self) -> Array:
        """The errors (2, n) without a mistake: from the first row, or from a start that is fitted if it has noise."""
        if not self.free or self.passes(self.error) or self.turned > NUMERICAL:
            return self.error
        return min(self.error, self.errors(*self.fit(exact(self), np.zeros(0), np.zeros(0))[2]), key=self.size)

    def differences(self, R: Array, w: Array) -> Array:
        """Return motions (..., n, 3, 3), (..., n, 3) minus the data, (..., n, 12), rad and relative; 0 where there are none."""
        out = np.zeros((*w.shape[:-1], 12))
        if self.data[0] is not None:
            out[..., :9] = (R - self.data[0]).reshape(*w.shape[:-1], 9) / np.sqrt(2)
        if self.data[1] is not None:
            out[..., 9:] = (w - self.data[1]) / self.scale
        return np.clip(np.nan_to_num(out, nan=HUGE), -HUGE, HUGE)

    def errors(self, R: Array, w: Array) -> Array:
        """Return the sizes (2, n) of differences: angles between attitudes, rad, and differences of rates."""
        d = self.differences(R, w)
        return np.stack(
            [2 * np.arcsin(np.minimum(np.linalg.norm(d[..., :9], axis=-1) / 2, 1)), np.linalg.norm(d[..., 9:], axis=-1)]
        )

    def apart(self, first: tuple[Array, Array], second: tuple[Array, Array]) -> Array:
        """Return the largest differences (2,) of two motions in the quantities of the data: rad, and relative to the scale."""
        return replace(self, data=take_part(second, self.data)).errors(*first).max(axis=1)

    def passes(self, error: Array) -> bool:
        """Return whether digits and noise explain errors (2, n): the largest ones, and the means of squares."""
        n = error.shape[1]
        mean = np.sqrt((error**2).mean(axis=1))
        noisy = (self.noise * SIGMAS > 0.5 * self.allowed) & (self.rounded < self.allowed)
        most = np.where(noisy, 1.3 * np.sqrt(3) * (1 + 3 / np.sqrt(n)) * self.noise, self.allowed)
        return bool((error.max(axis=1) <= self.allowed).all() and (mean <= most).all())

    def leaves_noise(self, R: Array, w: Array) -> Array:
        """Return for attitudes and rates (2,) whether their noise is open, and a motion leaves differences that are noise."""
        noise = [is_noise(left, along) for left, along in self._left(R, w)]
        return np.array([a and b and x is not None for a, b, x in zip(self.open, noise, self.data, strict=True)])

    def along(self, R: Array, w: Array) -> list[bool]:
        """Return for attitudes and rates whether what a motion leaves lies along it."""
        return [lies_along(left, along) for left, along in self._left(R, w)]

    def _left(self, R: Array, w: Array) -> list[tuple[Array, Array]]:
        """Return differences (n, 3) of attitudes and rates from a motion, with the directions (n, 3) of errors of times."""
        a, b = (y if x is None else x for x, y in zip(self.data, (R, w), strict=True))
        left, moved = differ(R, w, a, b, self.scale), np.gradient(w, self.t, axis=0) if len(self.t) > 1 else 0 * w
        return [(left[:, :3], w), (left[:, 3:], moved)]

    def size(self, error: Array) -> float:
        """Return the root of the mean square of errors, in units of the noise."""
        return float(np.sqrt((error**2).mean(axis=1) / self.noise**2).max())

    def work(self, bodies: int) -> float:
        """Return the work (`Effort`) of a number of motions over the rows."""
        corners = int(np.searchsorted(self.scene.breaks, self.t[-1])) if len(self.scene.breaks) else 0
        stretches = 1 + self.turned / ANGLE + corners
        return weigh(self.scene) * stretches * (1 + bodies) / 2 + bodies * len(self.t) / ROWS_OF_EFFORT

    def evaluate(self, motion: Solution, many: Array) -> tuple[Array, Array]:
        """Return motions (B, n, 3, 3), (B, n, 3) of changes of the initial state and other numbers, (B, 6 + k)."""
        turns = Rotation.from_rotvec(many[:, :3]).as_matrix()
        self.effort.spend(self.work(len(many)))
        return motion(self.scene.R_WB0 @ turns, self.scene.w_WB_B0 + many[:, 3:6] * self.scale, many[:, 6:], len(self.t))

    def equations(self, scene: Scene | None = None, gyroscopic: float = 1.0, **changes: Any) -> Equations:
        """Return the equations of the scene, or of another one, whose solutions are exact beside the noise."""
        share = 0.1 / self.growth if self.growth > SENSITIVE else 1e-5
        tolerance = float(np.clip(share * self.noise.min(), 4e-16, 1e-8))
        return Equations(scene or self.scene, gyroscopic, tolerance=tolerance, most=self.most, **changes)

    @property
    def most(self) -> float:
        """The number of stretches after which a trial motion ends."""
        return LONGER * (2 + self.turned / ANGLE + len(self.scene.breaks))

    def deviations(self, motion: Solution, numbers: Array, small: float) -> Array:
        """Return the standard deviations (6 + k,) of fitted numbers for the noise of the rows; 0 where they are not free."""
        moved = [*self.free, *range(6, len(numbers))]
        R, w = self.evaluate(motion, numbers + small * np.vstack([0 * numbers, np.eye(len(numbers))[moved]]))
        d = (self.differences(R, w) / np.repeat(self.noise, [9, 3])).reshape(1 + len(moved), -1)
        slopes, out = (d[1:] - d[0]) / small, np.zeros(len(numbers))
        out[moved] = np.sqrt(np.maximum(np.diag(np.linalg.pinv(slopes @ slopes.T)), 0.0))
        return out

    def fit(self, motion: Solution, extra: Array, changed: Array, most: int = 8) -> tuple[Array, Array, tuple[Array, Array]]:
        """Return initial numbers (6,), other numbers (k,), and the motion that fit the rows best (Levenberg and Marquardt).

        The fit starts at `extra` and at the initial state of the scene, and takes more and more of the rows. `changed` are the
        small changes of the other numbers, for slopes.
        """
        free = list(self.free)
        p = np.concatenate([np.zeros(6), extra])
        moved = [*free, *range(6, 6 + len(extra))]
        small = np.concatenate([np.full(6, 1e-6), changed])
        n = len(self.t)

        # More and more rows: a motion that multiplies small changes is not linear in its start over all rows.
        noise = np.where(self.open, HOPELESS * MOST_NOISE, 0.0)
        most_left = max(HOPELESS, float((np.maximum(self.allowed, noise) / self.noise).max()))
        first = [FEWEST_FIT] if self.gap > QUARTER and n > 2 * FEWEST_FIT else []  # noise in the start grows with each turn
        rows = [*first, *(k for k in (n // 64, n // 16, n // 4) if k >= 8), n] if free else [n]
        for k in rows if moved else ():
            if self.take(slice(0, k)).work(len(moved)) > self.effort.left:
                break
            p, cost = self._improve(motion, p, k, moved, small, most)
            if free and cost > k * most_left**2:
                break  # no start explains these rows, so none explains more
        R, w = self.evaluate(motion, p[None])
        return p[:6], p[6:], (R[0], w[0])

    def _improve(
        self, motion: Solution, p: Array, k: int, moved: list[int], small: Array, most: int, damping: float = 1e-6
    ) -> tuple[Array, float]:
        """Return numbers (6 + extra,) that fit the first rows better, and the sum of squares that they leave.

        The changes `small` of the initial state become smaller here where the motion multiplies them too much for slopes.
        """
        part, damping, weights = self.take(slice(0, k)), 1e-6, 1 / np.repeat(self.noise, [9, 3])
        evaluate = partial(part.evaluate, motion)
        R, w = evaluate(p[None])
        now = (part.differences(R, w)[0] * weights).ravel()
        for _ in range(most):
            if self.effort.over:
                break
            for _ in range(NARROWED):
                R, w = evaluate(p + np.concatenate([small * np.eye(len(p))[i][None] for i in moved]))
                change = (part.differences(R, w) * weights).reshape(len(moved), -1) - now
                largest = (np.abs(change) / np.tile(weights, k)).max(axis=1)
                wide = [j for j, i in enumerate(moved) if i < 6 and largest[j] > STRAIGHT]
                if not wide:
                    break
                at = [moved[j] for j in wide]
                small[at] = np.maximum(small[at] * 0.1 * STRAIGHT / largest[wide], SMALLEST_CHANGE)
            slopes = change / small[moved][:, None]
            better = False
            axes, triangle = np.linalg.qr(slopes.T)  # normal equations would square how much the motion multiplies
            sizes = np.diag(np.linalg.norm(slopes, axis=1) + 1e-150)
            goal = np.concatenate([-axes.T @ now, np.zeros(len(moved))])
            while damping < 1e3 and not better and not self.effort.over:  # a larger damping makes steps of no use
                step = np.linalg.lstsq(np.vstack([triangle, np.sqrt(damping) * sizes]), goal, rcond=1e-15)[0]
                q = p.copy()
                q[moved] += step
                R, w = evaluate(q[None])
                new = (part.differences(R, w)[0] * weights).ravel()
                better = bool(new @ new < now @ now)
                damping = damping / 30 if better else max(damping, 1e-6) * 30
            if not better:
                break
            gain = 1 - (new @ new) / (now @ now)
            p, now = q, new
            if gain < CONVERGED or np.sqrt(now @ now / len(now)) < 1e-3:  # converged, or far below the noise
                break
            if damping < 1e-6 and ((axes.T @ now) ** 2).sum() < CONVERGED * (now @ now):  # no step along these slopes helps
                break
        return p, float(now @ now)

    def extend(self) -> tuple[Compared, int]:
        """Return the case with the initial state that explains the most rows, found from the first ones on, and their number.

        A motion that multiplies small changes is determined by the first rows for some more rows only.
        """
        motion, small, p, good, step = exact(self), np.full(6, 1e-6), np.zeros(6), 0, max(8, len(self.t) // 64)
        for _ in range(EXTENDED):
            if good == len(self.t) or step <= len(self.t) // 256:
                break
            k = min(len(self.t), good + step)
            q, _ = self._improve(motion, p, k, list(self.free), small, 8)
            part = self.take(slice(0, k))
            R, w = part.evaluate(motion, q[None])
            if self.passes(part.errors(R[0], w[0])):
                p, good, step = q, k, 2 * step
            else:
                step = (k - good) // 2
        return self.at(p), good

    def hidden(self) -> bool:
        """Return whether the motion multiplies the digits or the noise of the first row to the size of the errors.

        Small changes of any motion grow with the angle. From where they grow much faster, an error proves
        nothing; some start has to explain the rows before.
        """
        if not self.free:
            return False
        some = np.unique(np.linspace(0, len(self.t) - 1, 400).astype(int))
        flow = np.nan_to_num(linearise(self.take(some))[2]).reshape(-1, 2, 3, 2, 3)
        growth = np.linalg.norm(flow, axis=(2, 4))
        usual = 1 + (self.t[some] - self.start) * self.scale
        reached = (growth @ self.allowed).max(axis=1)
        lost = np.flatnonzero((reached > LINEAR) & (growth.max(axis=(1, 2)) > FASTER * usual))
        if not len(lost):
            return False
        early = self.take(slice(0, max(2, int(some[lost[0]]))))
        limit = np.interp(np.arange(len(early.t)), some, reached) + self.allowed.max()
        if (early.error.max(axis=0) > limit).any():
            return False
        fitted = early.at(early.fit(exact(early), np.zeros(0), np.zeros(0))[0])
        return early.passes(early.error) or fitted.passes(fitted.error)

    def at(self, initial: Array) -> Compared:
        """Return the case whose initial state is changed by six numbers, as `fit` finds them."""
        R0, w0 = self.scene.R_WB0 @ Rotation.from_rotvec(initial[:3]).as_matrix(), self.scene.w_WB_B0 + initial[3:] * self.scale
        return replace(self, scene=self.scene.rename(self.scene.name, R_WB0=R0, w_WB_B0=w0))


def largest_difference(first: tuple[Array, Array], second: tuple[Array, Array]) -> float:
    """Return the largest angle of attitudes, rad, or difference of rates over the largest rate, of two motions; inf for nan."""
    scale = float(np.linalg.norm(first[1], axis=1).max()) or 1.0
    with np.errstate(all="ignore"):
        rates = np.linalg.norm(first[1] - second[1], axis=1).max() / scale
        apart = max(float(np.max(angle_between(first[0], second[0]))), float(rates))
    return apart if math.isfinite(apart) else math.inf


def compare_answers(scene: Scene, t: Array, data: States, allowed: Array, step: float | None = None) -> Compared:
    """Return the case of samples of a program or engine at times t, s, of the scene, whose errors (2,) may be `allowed`.

    `step` is the step of the program, s.
    """
    allowed = np.asarray(allowed, float)
    R, w = truth(scene, 0.0, t) if len(t) else (np.zeros((0, 3, 3)), np.zeros((0, 3)))
    scale = float(np.linalg.norm(np.vstack([scene.w_WB_B0, w]), axis=1).max()) or 1.0
    noise = np.maximum(allowed * PART_OF_ALLOWED, 1e-13)
    case = Compared(scene, t, data, 0.0, scale, allowed, noise, rounded=(float(allowed[0]), float(allowed[1])), step=step)
    vars(case)["exact"] = R, w  # which the property would compute again: closed forms take most of the time of a verification
    return case


def differ(R0: Array, w0: Array, R: Array, w: Array, scale: float) -> Array:
    """Return motions (..., n) minus another one (n), (..., n, 6): turns in body axes, rad, and relative rates."""
    turn = np.nan_to_num(np.swapaxes(R0, -1, -2) @ R) + 0.0
    turn[np.abs(np.linalg.det(turn)) < 0.5] = np.eye(3)
    vector = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_rotvec().reshape(*turn.shape[:-2], 3)
    with np.errstate(over="ignore"):
        return np.concatenate([vector, np.clip(np.nan_to_num(w - w0) / scale, -HUGE, HUGE)], axis=-1)


def count_linear(differences: Array) -> int:
    """Return the number of first rows whose differences (n, 6) are of first order."""
    far = np.linalg.norm(differences, axis=1) > LINEAR
    return int(np.argmax(far)) if far.any() else len(far)


def linearise(case: Compared) -> tuple[Array, Array, Array]:
    """Return the exact motion (n, 3, 3), (n, 3), and the matrices (n, 6, 6) that carry small changes of its start along."""
    flows = []
    for size in PERTURBED:
        turns, shifts = np.split(np.vstack([np.zeros(6), size * np.eye(6)]), 2, axis=1)
        R0 = case.scene.R_WB0 @ Rotation.from_rotvec(turns).as_matrix()
        R, w = exact(case.change(growth=math.inf))(R0, case.scene.w_WB_B0 + shifts * case.scale, np.zeros((7, 0)), len(case.t))
        flows.append(np.moveaxis(differ(R[0], w[0], R[1:], w[1:], case.scale), 0, -1))
        if np.abs(flows[0]).max() < STRAIGHT:
            break
    small = np.maximum.accumulate(np.abs(flows[0]).max(axis=(1, 2))) < STRAIGHT
    return R[0], w[0], np.where(small[:, None, None], flows[0] / PERTURBED[0], flows[-1] / PERTURBED[len(flows) - 1])


def exact(case: Compared) -> Solution:
    """Return the exact motion as a function of initial states."""

    def motion(R: Array, w: Array, _: Array, n: int) -> tuple[Array, Array]:
        t = case.t[:n]
        if has_closed_form(case.scene) and ((t[-1] - case.start) * case.scale > 3 * LONGEST or case.growth > SENSITIVE):
            motions = [truth(case.scene.rename("file", R_WB0=a, w_WB_B0=b), case.start, t) for a, b in zip(R, w, strict=True)]
            return np.stack([a for a, _ in motions]), np.stack([b for _, b in motions])
        return case.equations().solve(case.start, R, w, t)

    return motion


def is_noise(left: Array, along: Array) -> bool:
    """Return whether differences (n, 3) from a motion are noise: small, white, of one size at all times and in all directions.

    `along` (n, 3) is the direction in which errors of times lie.
    """
    n = len(left)
    if n < FEWEST_FOR_NOISE or not np.isfinite(left).all():
        return False
    power = float((left * left).sum())
    size = math.sqrt(power / (3 * n))
    if not 0 < size <= MOST_NOISE or np.abs(left).max() > SIGMAS * size:
        return False
    off = float(np.linalg.norm(left.mean(axis=0))) / size
    lags = [abs(float((left[k:] * left[:-k]).sum())) / power for k in range(1, min(20, n // 4) + 1)]
    halves = sorted(float((part * part).sum()) for part in (left[: n // 2], left[-(n // 2) :]))
    spread = np.linalg.eigvalsh(left.T @ left)
    return bool(
        off < 5 / math.sqrt(n)
        and max(lags) < max(0.25, 4 / math.sqrt(3 * n))
        and halves[1] < (2 + 12 / math.sqrt(n)) * halves[0]
        and spread[0] > 0.05 * spread[-1]
        and not lies_along(left, along)
    )


def lies_along(left: Array, along: Array) -> bool:
    """Return whether most differences (n, 3) lie along directions (n, 3), or in the plane in which these turn.

    Errors of times lie along the motion, and interpolated rows are off towards the inside of its curve. Noise is all around.
    """
    sizes = np.linalg.norm(left, axis=1) * np.linalg.norm(along, axis=1)
    some = sizes > 0
    if np.linalg.matrix_rank(left, tol=1e-9 * (np.abs(left).max() or 1.0)) < 2 or some.sum() < len(left) / 2:
        return False  # differences in one direction show nothing
    cosines = np.abs((left * along).sum(axis=1))[some] / sizes[some]
    across = np.cross(along, np.gradient(along, axis=0))
    turning = np.linalg.norm(across, axis=1) * np.linalg.norm(left, axis=1)
    curved = some & (np.linalg.norm(across, axis=1) > LEAST_CURVED * np.linalg.norm(along, axis=1) ** 2)
    flat = np.abs((left * across).sum(axis=1))[curved] / turning[curved]
    in_plane = curved.sum() > len(left) / 2 and np.median(flat) < MOSTLY_FLAT
    return bool(np.median(cosines) > MOSTLY_ALONG or in_plane)


def estimate_noise(t: Array, data: States, along: States = (None, None)) -> tuple[Array, Array]:
    """Return the noise (2,) of attitudes, rad, and rates, rad/s, of one axis, and whether the rows are close enough to tell.

    It is the smallest robust estimate from differences of order 3 to 9. Differences of a smooth motion fall with each order,
    and differences of noise do not. Differences along the motion are of times, and no noise: `along` are directions (n, 3) of
    the motion, by default of the data.
    """
    noise, resolved = np.zeros(2), np.zeros(2, bool)
    for i, (values, size) in enumerate(zip(data, (2.0, 1.0), strict=True)):
        if values is None or len(t) < FEWEST_FOR_NOISE:
            continue
        x = values
        if i == 0:
            x = to_quaternion(values)
            x = x * np.cumprod(np.append(1.0, np.sign(np.sum(x[1:] * x[:-1], axis=1)) + 0.0))[:, None]
        estimates = []
        for order in range(3, 10):
            near = np.stack([t[k : len(t) - order + k] for k in range(order + 1)])
            gaps = near[:, None] - near[None] + np.eye(order + 1)[:, :, None] * np.ptp(near, axis=0)
            weights = 1 / np.prod(gaps / np.ptp(near, axis=0), axis=1)
            weights = weights / np.sqrt((weights**2).sum(axis=0))
            d = sum(weights[k][:, None] * x[k : len(t) - order + k] for k in range(order + 1))
            # 1.538: the median norm of three normal numbers.
            estimates.append(size * float(np.median(np.linalg.norm(d, axis=1))) / 1.538)
        noise[i] = min(estimates)
        # Held rows and stamps that are off change the rows along the motion, and noise in all directions.
        middle, direction = slice(4, 4 + len(d)), along[i]
        forward = x[5 : 5 + len(d)] - x[3 : 3 + len(d)] if direction is None else direction[middle]
        if i == 0:
            d, forward = _turn_of(x[middle], d), _turn_of(x[middle], forward) if direction is None else forward
        resolved[i] = (estimates[-1] > 0.5 * estimates[-3] and not lies_along(d, forward)) or noise[i] < TINY
    return noise, resolved


def _turn_of(q: Array, change: Array) -> Array:
    """Return the small turns (n, 3) in body axes, up to their size, of changes (n, 4) of quaternions."""
    a, v, b, u = q[:, :1], q[:, 1:], change[:, :1], change[:, 1:]
    return a * u - b * v - np.cross(v, u)
