"""Exact motions at the times of a file, and motions by other equations, of many initial states at once. Nothing is compiled."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.errors import PotentialFailed, TorqueFailed
from conservative.features import IN_TIME
from conservative.potentials.field import FieldPotential
from conservative.potentials.load import Window
from conservative.potentials.potential import torque_W
from conservative.potentials.turning import static_part
from conservative.references.exact.method import Exact, free_body, lagrange_top
from conservative.scene import Scene

States = tuple[Array | None, Array | None]
"""Attitudes (n, 3, 3), body to world, and rates (n, 3), rad/s, body axes; None if the file has none."""
NODES, ANGLE, SWEEPS = 32, 2.0, 60
"""Chebyshev points of a stretch, the length of the first one in rad, and the largest number of Picard's iterations."""
SMALLEST, TAIL = 1e-6, 3e-15
"""Shortest stretch that is halved again, relative to the first one, and largest last coefficients of a good stretch."""
_EPS = 2.0**-52

_X = -np.cos(np.pi * np.arange(NODES) / (NODES - 1))
"""Chebyshev points from -1 to 1."""
_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(_X, NODES - 1))
"""From values at the points to coefficients of their Chebyshev series."""
_INTEGRAL = chebyshev.chebvander(_X, NODES) @ chebyshev.chebint(np.eye(NODES), lbnd=-1) @ _COEFFICIENTS
"""From values at the points to their integrals from -1 to each point."""


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

    def at(self, t: Array, window: Window = (-math.inf, math.inf)) -> Callable[[Array], Array]:
        """Return the derivative of states (7, B, n) at times (n,), s, between two break points, s."""
        body = self.scene.body
        J, inverse = body.inertia, body.inverse
        motor = None if body.motor is None else np.array([body.motor.at(time, None, window) for time in t.tolist()]).T
        turning = None if motor is None else self.reaction * (inverse @ motor)
        rotor = np.zeros(3) if body.rotor_momentum is None or motor is not None else body.rotor_momentum
        spinning, side = J if self.spinning is None else self.spinning, -1.0 if self.left else 1.0
        gyroscopic, turn = _column(self.gyroscopic), 0.5 * _column(self.turn)
        load = self._loads(t, window)

        def slope(y: Array) -> Array:
            shape = y.shape[1:]
            w = y[4:] if turning is None else y[4:] - turning.reshape(3, *(1,) * (y.ndim - 2), -1)
            (q0, q1, q2, q3), (w1, w2, w3) = y[:4], turn * w
            out = np.empty_like(y)
            out[0] = -(q1 * w1 + q2 * w2 + q3 * w3)
            out[1] = q0 * w1 + side * (q2 * w3 - q3 * w2)
            out[2] = q0 * w2 + side * (q3 * w1 - q1 * w3)
            out[3] = q0 * w3 + side * (q1 * w2 - q2 * w1)
            if self.fixed is None and not self.half_turned:
                if motor is None or (self.reaction == 1 and self.spinning is None):
                    L = _apply(spinning, y[4:]) + rotor.reshape(3, *(1,) * len(shape))
                else:
                    L = _apply(spinning, w) + motor.reshape(3, *(1,) * (len(shape) - 1), -1)
                torque = gyroscopic * cross(L, w)
                out[4:] = _apply(inverse, torque if load is None else torque + load(y, w))
            elif self.fixed is None:
                T = J @ _matrix(y)  # R' (R J) R
                L = (T @ np.moveaxis(w, 0, -1)[..., None])[..., 0] + rotor
                torque = gyroscopic * cross(np.moveaxis(L, -1, 0), w) + (0.0 if load is None else load(y, w))
                out[4:] = np.moveaxis(np.linalg.solve(T, np.moveaxis(torque, 0, -1)[..., None])[..., 0], -1, 0)
            else:
                R = _matrix(y)
                L = _turn(R, 0 * w + rotor.reshape(3, *(1,) * len(shape)))
                spin = _turn(R, w)
                torque = gyroscopic * cross(L + _apply(self.fixed, spin), spin)
                torque = torque if load is None else torque + _turn(R, load(y, w))
                out[4:] = _turn(np.swapaxes(R, -1, -2), _apply(np.linalg.inv(self.fixed).astype(float), torque))
            if np.any(self.damping):
                out[4:] -= _column(self.damping) * w
            return out

        return slope

    def _loads(self, t: Array, window: Window) -> Callable[[Array, Array], Array] | None:
        """Return the torque (3, ...) of field and loads, N m, body axes, as a function of states and rates."""
        scene, torque, damping = self.scene, self.scene.torque, self.scene.damping
        if scene.potential is None and torque is None and damping is None:
            return None
        of_time = damping and damping.of_time
        M: Array | None = None
        D: Array | None = None
        if torque is not None and not torque.of_attitude:
            M = np.array([torque.at(time, None, window) for time in t.tolist()])
        if damping is not None and not (of_time and of_time.of_attitude):
            D = np.array([damping.at(time, None, window) for time in t.tolist()])
        field = None if scene.potential is None else _field(scene.potential, t)
        turned = scene.potential is not None or (torque is not None and (torque.frame != "body" or torque.of_attitude))
        turned = turned or bool(of_time and of_time.of_attitude)

        def load(y: Array, w: Array) -> Array:
            rates, out = np.moveaxis(w, 0, -1), np.zeros((*w.shape[1:], 3))
            R = _matrix(y) if turned else np.eye(3)
            times = np.broadcast_to(t, rates.shape[:-1])
            if field is not None:
                out += _column(self.field)[..., None] * field(R)
            if torque is not None:
                value = M if M is not None else _each(torque.at, times, R, window)
                out += value if torque.frame == "body" else (np.broadcast_to(value, rates.shape)[..., None, :] @ R)[..., 0, :]
            if damping is not None:
                value = D if D is not None else _each(damping.at, times, R, window)
                out -= (value @ rates[..., None])[..., 0]
            return np.moveaxis(out, -1, 0)

        return load

    @property
    def steady(self) -> bool:
        """Whether the equations do not depend on time."""
        return not self.scene.loads and not self.scene.features & IN_TIME

    def wheel(self, t: Array) -> Array:
        """Return J^-1 h (3, n), rad/s, of a rotor with a motor; 0 without one."""
        body = self.scene.body
        if body.motor is None:
            return 0 * t
        return self.reaction * (body.inverse @ np.array([body.motor.at(time) for time in t.tolist()]).T)

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
                    Y, sweeps = _sweep(self.at(a + half * (_X + 1), (before, after)), y, half, self.tolerance)
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
                made.series.append(series)
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
    """A motion as Chebyshev series (7, B, NODES) between `ends`, s, from the states `first` (7, B) on."""

    equations: Equations
    ends: list[float]
    series: list[Array]
    first: Array

    def at(self, t: Array) -> tuple[Array, Array]:
        """Return attitudes (B, n, 3, 3) and rates (B, n, 3) at times (n,), s, in any order; nan outside of the motion."""
        out = np.full((7, self.first.shape[1], len(t)), np.nan)
        out[:, :, t == self.ends[0]] = self.first[:, :, None]
        place = np.searchsorted(self.ends, t, side="left")
        for k, (a, b, series) in enumerate(zip(self.ends[:-1], self.ends[1:], self.series, strict=True), 1):
            if (some := place == k).any():
                out[:, :, some] = chebyshev.chebval((t[some] - a) / ((b - a) / 2) - 1, np.moveaxis(series, -1, 0))
        with np.errstate(all="ignore"):
            return self.equations.states(out, t)

    def at_own_times(self, t: Array) -> tuple[Array, Array]:
        """Return the motion of each state, or of the only one, at its own times (B, n), s."""
        own = np.arange(len(t)) % self.first.shape[1]
        flows = [Flow(self.equations, self.ends, [x[:, [b]] for x in self.series], self.first[:, [b]]) for b in own.tolist()]
        made = [flow.at(np.clip(times, self.ends[0], None)) for flow, times in zip(flows, t, strict=True)]
        return np.concatenate([R for R, _ in made]), np.concatenate([w for _, w in made])


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
        before, q = q, half * (slope @ _INTEGRAL.T)
        q[0] += 1.0
        if np.abs(q - before).max() < _EPS:
            break
    joined = [np.eye(3)]
    for turn in _matrix(q[..., -1]):
        joined.append(joined[-1] @ turn)
    place = np.clip(np.searchsorted(ends, t, side="left") - 1, 0, len(half) - 1)
    series, x = np.moveaxis(q @ _COEFFICIENTS.T, -1, 0)[:, :, place], (t - ends[place]) / half[place, 0] - 1
    return np.array(joined)[place] @ _matrix(chebyshev.chebval(x, series, tensor=False))


def _sweep(slope: Callable[[Array], Array], y: Array, half: float, tolerance: float) -> tuple[Array, int]:
    """Return the states (7, B, NODES) of a stretch from its first ones (7, B), and the number of iterations.

    The number is `SWEEPS` if they have not converged before.
    """
    Y, last, size = np.repeat(y[:, :, None], NODES, axis=2), math.inf, np.abs(y).max() or 1.0
    for sweep in range(1, SWEEPS):
        new = y[:, :, None] + half * (slope(Y) @ _INTEGRAL.T)
        change, Y = float(np.abs(new - Y).max()) / size, new
        # Converged, or no longer converging near round-off, or diverged.
        if change < tolerance or (change < 1e-13 and change > 0.5 * last) or not change < 1e30:
            return Y, sweep
        last = change
    return Y, SWEEPS


def _field(potential: Any, t: Array) -> Callable[[Array], Array]:
    """Return the torque (..., n, 3) of a field, N m, body axes, as a function of attitudes (..., n, 3, 3) at times (n,), s.

    The derivative of a compiled field is c d', and its torque (R' c) x d in axes in which the field is fixed.
    """
    fixed = static_part(potential)
    if not isinstance(fixed, FieldPotential):
        return lambda R: (torque_W(potential, R, np.broadcast_to(t, R.shape[:-2]))[..., None, :] @ R)[..., 0, :]
    law, axes = fixed.kernel_field(np.eye(3)), None if fixed is potential else np.swapaxes(potential.orbit.R_WO(t), 1, 2)

    def torque(R: Array) -> Array:
        R = R if axes is None else axes @ R
        columns = [[R[..., i, j] for i in range(3)] for j in range(3)]
        c, d = law.finite_derivative(columns, columns)
        return np.moveaxis(cross([sum(r * x for r, x in zip(column, c, strict=True)) for column in columns], d), 0, -1)

    return torque


def _matrix(y: Array) -> Array:
    """Return attitudes (..., 3, 3) of states (7, ...), whose quaternions have any norm."""
    return from_quaternion(np.moveaxis(y[:4] / np.sqrt((y[:4] * y[:4]).sum(axis=0)), 0, -1))


def _turn(R: Array, v: Array) -> Array:
    """Return vectors (3, ...) turned by matrices (..., 3, 3)."""
    return np.moveaxis((R @ np.moveaxis(v, 0, -1)[..., None])[..., 0], -1, 0)


def _column(value: float | Array) -> Array:
    """Return a number, or numbers (B,) of each motion as (B, 1)."""
    return np.asarray(value, float).reshape(-1, 1) if np.ndim(value) else np.asarray(value, float)


def _apply(matrix: Array, v: Array) -> Array:
    return (matrix @ v.reshape(3, -1)).reshape(v.shape)


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
