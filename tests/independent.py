"""An independent integration of any scene, by SciPy's DOP853, or by an extrapolation in extended precision.

It shares no law, number or break point with the package. The state is the quaternion and the momentum K = J w + h, body axes:

    q' = q (0, w) / 2        K' = K x w + T        w = J^-1 (K - h)

h' is not needed, and K is continuous where h jumps. The integration ends at the times of tables and at declared breaks.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

import conservative as cv

Given = Any
"""A constant, a table (times, values) whose equal times are a jump, or a function of t or of (t, R_WB)."""


@dataclass(frozen=True, eq=False)
class Case:
    """The numbers of a scene. Fields and loads that are None do not act.

    `field` is (kind, *numbers): gravity (weight, com), spring (stiffness, point, anchor, rest), attraction (strength, point,
    anchor), gradient (rate, inertia, direction) or quartic (size, point, direction, share, rate): V = s x^4 / 4 with
    x = direction' R point and s = size (1 + share sin(rate t)). `turning` is (rate, normal). `flight` is (mass, com, g, p, v).
    """

    J: Any
    R0: Any
    w0: Any
    t_end: float
    field: tuple[Any, ...] | None = None
    turning: tuple[float, Any] | None = None
    rotor: Given = None
    torque: Given = None
    frame: str = "body"
    damping: Given = None
    factor: Given = None
    breaks: tuple[float, ...] = ()
    flight: tuple[Any, ...] | None = None

    def scene(self, name: str = "case", **options: Any) -> cv.Scene:
        """Return the scene of the package with these numbers."""
        breaks = {True: {"breaks": self.breaks}, False: {}}
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            body: Any = cv.RigidBody(self.J)
            if self.rotor is not None:
                body = cv.RigidBody(self.J, rotor_momentum=self.rotor, **breaks[callable(self.rotor)])
        self.check_warnings(caught)
        if self.flight is not None:
            mass, com, g, p, v = self.flight
            body = cv.shapes.MassDistribution(mass, com, self.J)
            options |= {"potential": body.gravity(g), "p_WB0": p, "v_WB0": v}
        if self.field is not None:
            options["potential"] = potential_of(*self.field, turning=self.turning)
        if self.torque is not None:
            options["torque"] = cv.Torque(self.torque, self.frame, **breaks[callable(self.torque)])
        if self.damping is not None:
            changing = callable(self.damping) or callable(self.factor)
            options["damping"] = cv.Damping(self.damping, self.factor, **breaks[changing])
        return cv.Scene(name, body, self.R0, self.w0, self.t_end, **options)

    def check_warnings(self, caught: list[warnings.WarningMessage]) -> None:
        """Fail unless there is a warning of exactly those bodies that no mass distribution has. Random tensors may be any."""
        moments = np.sort(self.J) if np.ndim(self.J) == 1 else np.linalg.eigvalsh(self.J)
        excess = moments[2] / (moments[0] + moments[1]) - 1
        assert {each.category for each in caught} <= {cv.ImpossibleInertia}
        assert abs(excess) < 1e-6 or bool(caught) is bool(excess > 0), (moments, caught)

    def without(self, *parts: str) -> Case:
        """Return the case without some of its parts."""
        return replace(self, **dict.fromkeys(parts))


def potential_of(kind: str, *numbers: Any, turning: tuple[float, Any] | None = None) -> Any:
    """Return a field of the package."""
    made: Any
    if kind == "quartic":
        size, point, direction, *wave = numbers
        law = Quartic(size, np.asarray(point), np.asarray(direction), *wave)
        made = cv.FunctionPotential(law.energy, law.gradient, time_dependent=bool(law.share))
    else:
        kinds = {"gravity": cv.UniformGravity, "spring": cv.LinearSpring, "attraction": cv.PointAttraction}
        made = {**kinds, "gradient": cv.GravityGradient}[kind](*numbers)
    return made if turning is None else cv.Turning(made, cv.Orbit(*turning))


@dataclass(frozen=True, eq=False)
class Quartic:
    """Functions of a potential of the package, which can be pickled."""

    size: float
    point: Any
    direction: Any
    share: float = 0.0
    rate: float = 0.0

    @cached_property
    def outer(self) -> Any:
        """The derivative of x for R."""
        return np.outer(self.direction, self.point)

    def strength(self, *t: float) -> float:
        """Return s, J/m^4."""
        return self.size * (1.0 + self.share * float(np.sin(self.rate * t[0]))) if t else self.size

    def energy(self, R: Any, *t: float) -> Any:
        """Return V, J."""
        return self.strength(*t) * (self.direction @ R @ self.point) ** 4 / 4

    def gradient(self, R: Any, *t: float) -> Any:
        """Return dV/dR, J."""
        x = self.direction @ R @ self.point
        return self.strength(*t) * x**3 * self.outer


def cross(a: Any, b: Any) -> Any:
    """Return the vector product. NumPy's takes twenty times as long."""
    return np.array((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


def matrix_of(q: Any) -> Any:
    """Return R_WB of a quaternion of any length."""
    w, x, y, z = q / np.sqrt(q @ q)
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    )


def quaternion_of(R: Any) -> Any:
    """Return the quaternion of a rotation, from the largest column of 4 q q'."""
    (a, b, c), (d, e, f), (g, h, i) = R
    four = np.array(
        (
            (1 + a + e + i, h - f, c - g, d - b),
            (h - f, 1 + a - e - i, b + d, c + g),
            (c - g, b + d, 1 - a + e - i, f + h),
            (d - b, c + g, f + h, 1 - a - e + i),
        )
    )
    q = four[np.argmax(np.diag(four))]
    return q / np.sqrt(q @ q)


def field_torque(case: Case, t: Any, R: Any) -> Any:
    """Return the torque of the field, N m, body axes."""
    assert case.field is not None
    kind, *numbers = case.field
    if case.turning is not None:
        rate, normal = case.turning
        n = np.asarray(normal, dtype=R.dtype)
        half = R.dtype.type(rate) * t / 2
        R = matrix_of(np.array((np.cos(half), *(np.sin(half) * n / np.sqrt(n @ n))))).T @ R
    first, *vectors = (np.asarray(number, dtype=R.dtype) for number in numbers)
    if kind == "gravity":
        return cross(vectors[0], -first * R[2])
    if kind == "gradient":
        u = vectors[1] @ R / np.sqrt(vectors[1] @ vectors[1])
        return 3 * first**2 * cross(u, vectors[0] @ u if vectors[0].ndim == 2 else vectors[0] * u)
    if kind == "quartic":
        b, a, share, rate = vectors
        return -first * (1 + share * np.sin(rate * t)) * (a @ R @ b) ** 3 * cross(b, a @ R)
    b, A = vectors[0], vectors[1] @ R  # the force along the line to the anchor, body axes
    r = np.sqrt((b - A) @ (b - A))
    size = first / r**3 if kind == "attraction" else first * (1 - vectors[2] / r) if len(vectors) > 2 else first
    return cross(b, size * (A - b))


def is_table(given: Given) -> bool:
    """Return whether a part is a table (times, values)."""
    return isinstance(given, tuple) and len(given) == 2


def value_at(given: Given, t: Any, R: Any, middle: float) -> Any:
    """Return a part's value. `middle` is inside of the smooth interval, which decides on which side of a jump t is."""
    if callable(given):
        return np.asarray(given(t, R) if given.__code__.co_argcount == 2 else given(t), dtype=R.dtype)
    if not is_table(given):
        return np.asarray(given, dtype=R.dtype)
    times, values = (np.asarray(each, dtype=R.dtype) for each in given)
    k = int(np.clip(np.searchsorted(times, middle) - 1, 0, len(times) - 2))
    if middle > times[-1]:
        return values[-1]
    return values[k] + (t - times[k]) / (times[k + 1] - times[k]) * (values[k + 1] - values[k])


def load_torque(case: Case, t: Any, R: Any, w: Any, middle: float) -> Any:
    """Return the torque of loads, N m, body axes."""
    T = np.zeros(3, dtype=R.dtype)
    if case.torque is not None:
        T = value_at(case.torque, t, R, middle)
        T = T if case.frame == "body" else T @ R
    if case.damping is not None:
        D = value_at(case.damping, t, R, middle)
        T = T - (1 if case.factor is None else value_at(case.factor, t, R, middle)) * (D @ w)
    return T


def smooth_ends(case: Case, until: float) -> list[float]:
    """Return the times at which a part is not smooth; a table is held after its end."""
    given = (case.rotor, case.torque, case.factor)
    tables = [np.asarray(each[0], dtype=float) for each in given if is_table(each)]
    return sorted({float(t) for t in np.concatenate([*tables, case.breaks]) if 0 < t < until})


def inverse_of(J: Any) -> Any:
    """Return the inverse of a tensor in its own precision."""
    adjoint = np.array([cross(J[1], J[2]), cross(J[2], J[0]), cross(J[0], J[1])]).T
    return adjoint / (J[0] @ adjoint[:, 0])


Solver = Callable[[Callable[[Any, Any], Any], Any, Any, Any], Any]


def motion(case: Case, times: ArrayLike, solver: Solver | None = None) -> tuple[Any, Any]:
    """Return attitudes R_WB (n, 3, 3) and rates w_WB_B (n, 3) at increasing times, s, by default those of `dop853`."""
    solve = dop853 if solver is None else solver
    number = np.longdouble if solve is not dop853 else np.float64
    J = np.asarray(case.J, dtype=number)
    J = np.diag(J) if J.ndim == 1 else J
    inverse, R0, at = inverse_of(J), np.asarray(case.R0, dtype=number), np.asarray(times, dtype=float)
    zero = np.zeros(3, dtype=number)

    def rotor(t: Any, R: Any, middle: float) -> Any:
        return zero if case.rotor is None else value_at(case.rotor, t, R, middle)

    def slope_in(start: float, end: float) -> Callable[[Any, Any], Any]:
        middle, last = (start + end) / 2, np.nextafter(number(end), number(start))

        def slope(t: Any, y: Any) -> Any:
            t = min(max(number(t), number(start)), last)  # a function that jumps at the end has not jumped yet
            R, (a, b, c, d), K = matrix_of(y[:4]), y[:4], y[4:]
            w = inverse @ (K - rotor(t, R, middle))
            x, y_, z = w / 2
            turned = (-b * x - c * y_ - d * z, a * x + c * z - d * y_, a * y_ + d * x - b * z, a * z + b * y_ - c * x)
            T = load_torque(case, t, R, w, middle)
            T = T if case.field is None else T + field_torque(case, t, R)
            return np.concatenate([turned, cross(K, w) + T])

        return slope

    until = max(case.t_end, at[-1])
    ends = [0.0, *smooth_ends(case, until), until]
    w0 = np.asarray(case.w0, dtype=number)
    y = np.concatenate([quaternion_of(R0), J @ w0 + rotor(number(0), R0, ends[1] / 2)])
    found: list[tuple[Any, Any]] = []
    for start, end in pairwise(ends):
        inside = at[(at >= start) & (at < end)] if end < at[-1] else at[(at >= start) & (at <= end)]
        with np.errstate(over="ignore", invalid="ignore"):
            states = solve(slope_in(start, end), start, y, [*inside, end])
        for t, state in zip(inside, states, strict=False):
            R = matrix_of(state[:4])
            w = inverse @ (state[4:] - rotor(number(t), R, (start + end) / 2))
            found.append((R.astype(float), w.astype(float)))
        y = states[-1]
        if end >= at[-1]:
            break
    R_WB, w_WB_B = zip(*found, strict=True)
    return np.array(R_WB), np.array(w_WB_B)


def dop853(slope: Any, start: Any, y: Any, times: Any) -> Any:
    """Return states at increasing times by SciPy's DOP853 at its smallest tolerance."""
    if times[-1] == start:
        return [y for _ in times]
    scale = max(float(np.abs(y[4:]).max()), 1e-3 * float(np.abs(slope(start, y)[4:]).max()) * (times[-1] - start)) or 1.0
    tolerance = np.concatenate([np.full(4, 1e-15), np.full(3, 1e-15 * scale)])
    at, index = np.unique(times, return_inverse=True)
    found = solve_ivp(slope, (start, times[-1]), y, "DOP853", at, rtol=1e-13, atol=tolerance)
    assert found.success, found.message
    return list(found.y.T[index])


COLUMNS = 2 * np.arange(1, 10)
"""Substeps of the columns of the extrapolation."""


def extrapolate(slope: Any, start: Any, y: Any, times: Any, tolerance: float = 1e-17) -> Any:
    """Return states at increasing times by Gragg's midpoint rule, extrapolated to order 18, in the precision of y."""
    number = y.dtype.type
    tolerance = max(tolerance, 20 * float(np.finfo(number).eps))
    t, h, size, states = number(start), number(times[-1]) - number(start), 0.0, []
    for end in times:
        while t < end:
            left = number(end) - t
            step = left if h >= left else min(h, left / 2)
            first, row = slope(t, y), []
            size = max(size, float(np.abs(y[4:]).max()), float(np.abs(first[4:]).max() * step))
            for n in COLUMNS:
                part, before, now = step / n, y, y + step / n * first
                for k in range(1, n):
                    before, now = now, before + 2 * part * slope(t + k * part, now)
                above, row = row, [now]
                for other, m in zip(above, COLUMNS[: len(above)][::-1], strict=True):
                    row.append(row[-1] + (row[-1] - other) / ((number(n) / m) ** 2 - 1))
            change = np.abs(row[-1] - row[-2])
            error = max(float(change[:4].max()), float(change[4:].max()) / (size or 1.0), 1e-30)
            error = error if np.isfinite(change).all() else np.inf  # a step that is far too long for damping
            if error <= tolerance:
                t, y = (number(end) if step == left else t + step), row[-1]
            if error > tolerance or step < left:  # a step that only ends at a sample says nothing about longer ones
                h = step * min(3.0, max(0.1, 0.8 * (tolerance / error) ** (1 / 17)))
        states.append(y)
    return states


def place(case: Case, t: Any, R_WB: Any, w_WB_B: Any) -> tuple[Any, Any]:
    """Return position and velocity (n, 3) of the frame of a body in free flight, whose centre of mass falls on a parabola."""
    assert case.flight is not None
    _, com, g, p, v = case.flight
    start, fall = np.asarray(case.R0), np.outer(t, (0.0, 0.0, -g))
    c = p + start @ com + np.outer(t, v + start @ np.cross(case.w0, com)) + np.asarray(t)[:, None] * fall / 2
    speed = v + start @ np.cross(case.w0, com) + fall
    return c - R_WB @ com, speed - (R_WB @ np.cross(w_WB_B, com)[..., None])[..., 0]


def angle_between(R: Any, S: Any) -> Any:
    """Return the angles (n,) between attitudes, rad, to round-off for small ones, too."""
    turn = np.swapaxes(R, -1, -2) @ S
    sine = np.stack(
        [turn[..., 2, 1] - turn[..., 1, 2], turn[..., 0, 2] - turn[..., 2, 0], turn[..., 1, 0] - turn[..., 0, 1]], -1
    )
    return np.arctan2(np.linalg.norm(sine, axis=-1) / 2, (np.trace(turn, axis1=-2, axis2=-1) - 1) / 2)
