"""Exact motions at the times of a file, and motions by other equations, of many initial states at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import chebyshev

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.errors import PotentialFailed, TorqueFailed
from conservative.features import IN_TIME
from conservative.potentials.field import FieldPotential
from conservative.potentials.load import Window
from conservative.potentials.potential import torque_W
from conservative.potentials.turning import Turning, static_part
from conservative.references.exact.method import Exact, free_body, lagrange_top
from conservative.scene import Scene

if TYPE_CHECKING:
    from conservative.kernels import picard

States = tuple[Array | None, Array | None]
"""Attitudes (n, 3, 3), body to world, and rates (n, 3), rad/s, body axes; None if the file has none."""
NODES, ANGLE, SWEEPS = 32, 2.0, 60
"""Chebyshev points of a stretch, the length of the first one in rad, and the largest number of Picard's iterations."""
SMALLEST, TAIL = 1e-6, 3e-15
"""Shortest stretch that is halved again, relative to the first one, and largest last coefficients of a good stretch."""
_EPS = 2.0**-52
CLOSE = 1e-7
"""Time between two values of a motor for its slope, relative, if it is a function."""
NOTHING = np.empty((0, 3))
"""Stands for no load."""
Torque = Callable[[Array, Array], Array]
"""From attitudes (B, n, 3, 3) and rates (B, n, 3) to torques (B, n, 3), N m, body axes."""

_X = -np.cos(np.pi * np.arange(NODES) / (NODES - 1))
"""Chebyshev points from -1 to 1."""
_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(_X, NODES - 1))
"""From values at the points to coefficients of their Chebyshev series."""
_INTEGRAL_T = np.ascontiguousarray(
    (chebyshev.chebvander(_X, NODES) @ chebyshev.chebint(np.eye(NODES), lbnd=-1) @ _COEFFICIENTS).T
)
"""From values at the points to their integrals from -1 to each point, transposed."""


def _picard() -> Any:
    """Return the kernels, which motions in closed form do without: they import numba."""
    from conservative.kernels import picard

    return picard


@dataclass(frozen=True, eq=False)
class Equations:
    """The equations of motion of a scene, J w' = (J w + h) x w - h' + T and q' = q w / 2, and changes of them.

    A state (7, ...) is a quaternion, scalar first, body to world, and u = w, rad/s, body axes; with a motor u = w + r J^-1 h,
    where r is `reaction`. `gyroscopic`, `field`, `reaction` and `turn` scale the first term, the torque of the potential, -h',
    and q'; `damping` is an additional one, 1/s. Each but `reaction` is a number, or (B,). `spinning` (3, 3) is the inertia of
    the gyroscopic term. `fixed` (3, 3) is a tensor, kg m^2, whose components are kept in world axes, so that it does not turn
    with the body. With `half_turned` the inertia in world axes is R J instead of R J R'. With `left` q' = w q / 2. `tolerance`
    is the error of solutions in a stretch, and `most` the number of stretches after which a motion ends.
    """

    scene: Scene
    gyroscopic: float | Array = 1.0
    field: float | Array = 1.0
    damping: float | Array = 0.0
    fixed: Array | None = None
    tolerance: float = 2 * _EPS
    reaction: float = 1.0
    turn: float | Array = 1.0
    left: bool = False
    spinning: Array | None = None
    half_turned: bool = False
    most: float = math.inf

    def at(self, t: Array, window: Window = (-math.inf, math.inf)) -> Derivative:
        """Return the derivative of states (7, B, n) at times (n,), s, between two break points, s."""
        scene, torque, damping = self.scene, self.scene.torque, self.scene.damping
        body, of_time = scene.body, damping and damping.of_time
        rotor, wheel, back, resistance = NOTHING, NOTHING, np.empty((0, 4)), np.empty((0, 3, 3))
        constant, own = {"body": NOTHING, "world": NOTHING}, list[Torque]()
        if body.motor is not None:
            rotor = _each_time(body.motor, t, window)
            wheel = self.reaction * (rotor @ body.inverse.T)
        elif body.rotor_momentum is not None:
            rotor = np.repeat(body.rotor_momentum[None], len(t), axis=0)
        if torque is not None and torque.of_attitude:
            own.append(_own_torque(torque, t, window))
        elif torque is not None:
            constant[torque.frame] = _each_time(torque, t, window)
        if of_time and of_time.of_attitude:
            own.append(_own_damping(damping, t, window))
        elif damping is not None:
            resistance = _each_time(damping, t, window)
        if isinstance(scene.potential, Turning) and self.law is not None:
            half = scene.potential.orbit.rate / 2 * t[:, None]
            back = np.concatenate([np.cos(half), -np.sin(half) * scene.potential.orbit.normal_W], axis=1)
        elif scene.potential is not None and self.law is None:
            own.append(_own_field(scene.potential, t, self.field))
        loads = _picard().AtTimes(rotor, wheel, back, constant["body"], constant["world"], resistance, np.empty((0, 0, 3)))
        return Derivative(self, loads, own)

    @cached_property
    def law(self) -> Any:
        """The law of the field for kernels, in the axes in which the field is fixed; None without one."""
        fixed = static_part(self.scene.potential)
        return fixed.kernel_field(np.eye(3)) if isinstance(fixed, FieldPotential) else None

    def terms(self, bodies: int) -> picard.Terms:
        """Return the terms of the equations of a number of states."""
        J, inverse = (np.ascontiguousarray(x) for x in (self.scene.body.inertia, self.scene.body.inverse))
        picard = _picard()
        mode, tensor = picard.HALF_TURNED if self.half_turned else picard.USUAL, J
        if self.fixed is not None:
            mode, tensor = picard.FIXED, np.ascontiguousarray(self.fixed)
            inverse = np.linalg.inv(tensor).astype(float)
        spinning, side = J if self.spinning is None else np.ascontiguousarray(self.spinning), -1.0 if self.left else 1.0
        factors = np.empty((bodies, 4))
        for i, factor in enumerate((self.gyroscopic, self.field, self.damping, self.turn)):
            factors[:, i] = factor
        return picard.Terms(J, inverse, spinning, tensor, mode, side, factors)

    @property
    def steady(self) -> bool:
        """Whether the equations do not depend on time."""
        return not self.scene.loads and not self.scene.features & IN_TIME

    def wheel(self, t: Array) -> Array:
        """Return J^-1 h (3, n), rad/s, of a rotor with a motor; 0 without one."""
        body = self.scene.body
        if body.motor is None:
            return 0 * t
        return self.reaction * (body.inverse @ _each_time(body.motor, t, (-math.inf, math.inf)).T)

    def solve(self, start: float, R: Array, w: Array, t: Array) -> tuple[Array, Array]:
        """Return attitudes (B, n, 3, 3), rates (B, n, 3) at times (n,), s, of states (B, 3, 3), (B, 3) at `start`."""
        return self.flow(start, R, w, float(t.max())).at(t)

    def flow(self, start: float, R: Array, w: Array, end: float) -> Flow:
        """Return the motion from states (B, 3, 3), (B, 3) at `start` to `end`, s.

        Picard's iteration on Chebyshev points of one stretch after the other, each of which ends at the next break point
        (Clenshaw & Norton 1963; Bai & Junkins 2011). A stretch is halved until its series ends in round-off. The motion ends at
        a singularity, and where a load has no value.
        """
        y, smooth = self.pack(start, R, w), self.scene.smoothness(end)
        made = Flow(self, [start], [], y)
        breaks = [time for time in smooth.breaks.tolist() if start < time < end]
        size = max(float(np.abs(y[4:]).max()), 1e-3 / max(end - start, 1e-300))
        a, before = start, -math.inf
        with np.errstate(all="ignore"):
            size = max(size, float(np.sqrt(np.abs(self.at(np.array([start]))(y[:, :, None])[4:]).max())))
            length = first = min(ANGLE / size, max(end - start, 1e-300), smooth.step)
            left = self.most
            while a < end and left > 0:
                left -= 1
                after = breaks[0] if breaks else math.inf
                b = min(a + length, after, end)
                b = min(after, end) if min(after, end) - b < 0.01 * length else b  # no tiny stretch at the end
                half = (b - a) / 2
                try:
                    Y, sweeps = self.at(a + half * (_X + 1), (before, after)).sweep(y, half, self.tolerance)
                except (TorqueFailed, PotentialFailed):
                    break
                series = Y @ _COEFFICIENTS.T
                tail = np.abs(series[..., -3:]).max(axis=(1, 2)) / np.maximum(np.abs(Y).max(axis=(1, 2)), [1] * 4 + [size] * 3)
                if not np.isfinite(Y).all() or sweeps == SWEEPS or tail.max() > max(TAIL, self.tolerance):
                    if length > SMALLEST * first:
                        length = half
                        continue
                    if not np.isfinite(Y).all():
                        break
                made.ends.append(b)
                made.series.append(np.moveaxis(series, 0, -1))
                y, a = Y[..., -1], b
                y[:4] /= np.sqrt((y[:4] * y[:4]).sum(axis=0))
                before = breaks.pop(0) if a == after else before
                # Between 22 and 34 iterations the length stays.
                length *= 1.25 if sweeps < 22 else 0.8 if sweeps > 34 else 1.0
        return made

    def states(self, y: Array, t: Array) -> tuple[Array, Array]:
        """Return attitudes (B, n, 3, 3) and rates (B, n, 3) of states (7, B, n) at times (n,), s."""
        return _matrix(y), np.moveaxis(y[4:] - self.wheel(t).reshape(-1, 1, len(t)) if self.scene.body.motor else y[4:], 0, -1)

    def pack(self, t: float, R: Array, w: Array) -> Array:
        """Return the states (7, B) of attitudes (B, 3, 3) and rates (B, 3) at a time, s."""
        return np.concatenate([to_quaternion(R).T, w.T + self.wheel(np.array([t])).reshape(-1, 1)])


@dataclass(frozen=True, eq=False)
class Flow:
    """A motion as Chebyshev series (B, NODES, 7) between `ends`, s, from the states `first` (7, B) on."""

    equations: Equations
    ends: list[float]
    series: list[Array]
    first: Array

    def at(self, t: Array) -> tuple[Array, Array]:
        """Return attitudes (B, n, 3, 3) and rates (B, n, 3) at times (n,), s, in any order; nan outside of the motion."""
        return self._sample(t[None], self.first.shape[1])

    def at_own_times(self, t: Array) -> tuple[Array, Array]:
        """Return the motion of each state, or of the only one, at its own times (B, n), s."""
        return self._sample(np.clip(t, self.ends[0], None), len(t))

    def _sample(self, t: Array, bodies: int) -> tuple[Array, Array]:
        R, w = np.empty((bodies, t.shape[1], 3, 3)), np.empty((bodies, t.shape[1], 3))
        series = np.array(self.series).reshape(-1, self.first.shape[1], NODES, 7)
        wheel = np.empty((0, 0, 3))
        if self.equations.scene.body.motor is not None:
            wheel = np.stack([self.equations.wheel(times).T for times in t])
        _picard().sample(np.array(self.ends), series, np.ascontiguousarray(self.first), np.ascontiguousarray(t), wheel, R, w)
        return R, w


def integrate_rates(rates: Callable[[Array], Array], ends: Array, t: Array) -> Array:
    """Return attitudes (n, 3, 3) at times (n,), s, that begin at the identity and have given rates, rad/s, body axes.

    `rates` returns rates (..., 3) at times (...). They are smooth between `ends` (m,), s, the first of which is the start.
    All stretches are integrated at once by Picard's iteration, from the identity each, and then joined.
    """
    half = np.diff(ends)[:, None] / 2
    w = np.moveaxis(rates(ends[:-1, None] + half * (_X + 1)), -1, 0) / 2
    q = np.zeros((4, *w.shape[1:]))
    q[0] = 1.0
    for _ in range(SWEEPS):
        a, v = q[0], q[1:]
        slope = np.concatenate([-(v * w).sum(axis=0)[None], a * w + cross(v, w)])
        before, q = q, half * (slope @ _INTEGRAL_T)
        q[0] += 1.0
        if np.abs(q - before).max() < _EPS:
            break
    joined = [np.eye(3)]
    for turn in _matrix(q[..., -1]):
        joined.append(joined[-1] @ turn)
    place = np.clip(np.searchsorted(ends, t, side="left") - 1, 0, len(half) - 1)
    series, x = np.moveaxis(q @ _COEFFICIENTS.T, -1, 0)[:, :, place], (t - ends[place]) / half[place, 0] - 1
    return np.array(joined)[place] @ _matrix(chebyshev.chebval(x, series, tensor=False))


@dataclass(frozen=True, eq=False)
class Derivative:
    """The derivative of states (7, B, n) at n times. `own` are torques of the state."""

    equations: Equations
    loads: picard.AtTimes
    own: list[Torque]
    terms: dict[int, picard.Terms] = field(default_factory=dict)

    def __call__(self, y: Array) -> Array:
        out, y = np.empty(y.shape), np.ascontiguousarray(y)
        if y.shape[1] not in self.terms:
            self.terms[y.shape[1]] = self.equations.terms(y.shape[1])
        _picard().slopes(self.equations.law, self.terms[y.shape[1]], self._with_own(y), y, out)
        return out

    def sweep(self, y: Array, half: float, tolerance: float) -> tuple[Array, int]:
        """Return the states (7, B, NODES) of a stretch from its first ones (7, B), and the number of iterations.

        The number is `SWEEPS` if they have not converged before.
        """
        Y, terms, y = np.repeat(y[:, :, None], NODES, axis=2), self.equations.terms(y.shape[1]), np.ascontiguousarray(y)
        if not self.own:
            return Y, _picard().sweep(self.equations.law, terms, self.loads, y, Y, half, tolerance, _INTEGRAL_T, SWEEPS)[0]
        last = math.inf
        for number in range(1, SWEEPS):  # functions of Python between two iterations
            _, change = _picard().sweep(self.equations.law, terms, self._with_own(Y), y, Y, half, 0.0, _INTEGRAL_T, 2)
            if change < tolerance or (change < 1e-13 and change > 0.5 * last) or not change < 1e30:
                return Y, number
            last = change
        return Y, SWEEPS

    def _with_own(self, y: Array) -> picard.AtTimes:
        if not self.own:
            return self.loads
        R, w = _matrix(y), np.moveaxis(y[4:], 0, -1)
        w = w - self.loads.wheel if len(self.loads.wheel) else w
        return self.loads._replace(own=np.ascontiguousarray(sum(torque(R, w) for torque in self.own)))


def _each_time(load: Any, t: Array, window: Window) -> Array:
    """Return the values (n, ...) of a load at times (n,), s, as `OfTime.at` does for one time."""
    value = getattr(load, "value", None)
    if isinstance(value, tuple):
        times, values = value
        inside = np.clip(t, math.nextafter(window[0], math.inf), math.nextafter(window[1], -math.inf))
        i = np.searchsorted(times, inside, side="right")
        k = np.clip(i, 1, len(times) - 1)
        share = ((t - times[k - 1]) / (times[k] - times[k - 1])).reshape(-1, *(1,) * (values.ndim - 1))
        made = values[k - 1] + share * (values[k] - values[k - 1])
        made[i == 0], made[i == len(times)] = values[0], values[-1]
        return np.asarray(made)
    if value is not None and not callable(value):
        return np.repeat(load.at(float(t[0]), None, window)[None], len(t), axis=0)
    return np.array([load.at(time, None, window) for time in t.tolist()])


def slopes_of_motor(motor: Any, t: Array) -> Array:
    """Return the changes (n, 3) of a motor's momentum at times (n,), s, and just after them, N m."""
    if isinstance(motor.value, tuple):
        times, values = motor.value
        k = np.clip(np.searchsorted(times, t, side="right"), 1, len(times) - 1)
        return np.asarray((values[k] - values[k - 1]) / (times[k] - times[k - 1])[:, None])
    e = CLOSE * np.maximum(np.abs(t), 1.0)
    return np.array(
        [(motor.at(time + near) - motor.at(time)) / near for time, near in zip(t.tolist(), e.tolist(), strict=True)]
    )


def _own_torque(torque: Any, t: Array, window: Window) -> Torque:
    def own(R: Array, w: Array) -> Array:
        value = _each(torque.at, np.broadcast_to(t, w.shape[:-1]), R, window)
        return value if torque.frame == "body" else (value[..., None, :] @ R)[..., 0, :]

    return own


def _own_damping(damping: Any, t: Array, window: Window) -> Torque:
    return lambda R, w: -(_each(damping.at, np.broadcast_to(t, w.shape[:-1]), R, window) @ w[..., None])[..., 0]


def _own_field(potential: Any, t: Array, factor: float | Array) -> Torque:
    strength = np.asarray(factor, float).reshape(-1, 1, 1)
    return lambda R, w: strength * (torque_W(potential, R, np.broadcast_to(t, R.shape[:-2]))[..., None, :] @ R)[..., 0, :]


def _matrix(y: Array) -> Array:
    """Return attitudes (..., 3, 3) of states (7, ...), whose quaternions have any norm."""
    return from_quaternion(np.moveaxis(y[:4] / np.sqrt((y[:4] * y[:4]).sum(axis=0)), 0, -1))


def cross(a: Any, b: Any) -> Array:
    """Return the cross product of vectors (3, ...)."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _each(value: Callable[..., Array], t: Array, R: Array, window: Window) -> Array:
    """Return a load of time and attitude at each state."""
    flat = [value(time, turned, window) for time, turned in zip(t.ravel().tolist(), R.reshape(-1, 3, 3), strict=True)]
    return np.array(flat).reshape(*t.shape, *np.shape(flat[0]))


def has_closed_form(scene: Scene) -> bool:
    """Return whether the exact motion is known in closed form."""
    return Exact().unsupported(scene) is None and not scene.loaded and scene.body.rotor_momentum is None and (
        scene.potential is None or scene.symmetry_axis_B is not None
    )  # fmt: skip


def truth(scene: Scene, start: float, t: Array) -> tuple[Array, Array]:
    """Return the exact motion (n, 3, 3), (n, 3) at times (n,), s, of a scene whose initial state is the state at `start`."""
    if not has_closed_form(scene):
        R, w = Equations(scene).solve(start, scene.R_WB0[None], scene.w_WB_B0[None], t)
        return R[0], w[0]
    if scene.potential is None:
        return free_body(scene.body, scene.R_WB0, scene.w_WB_B0, t - start)
    return lagrange_top(scene.body, scene.potential, scene.R_WB0, scene.w_WB_B0, t - start)  # type: ignore[arg-type]
