"""A second reference solution: Gauss collocation of order 24 in NumPy's extended precision.

It shares nothing with `Precise`: neither the integrator (implicit, equal steps), nor the arithmetic (64 bits of mantissa on
x86), nor the variables (body momentum instead of rates), nor the law of the field (the potential's own).

Source: Hairer, Lubich & Wanner, Geometric Numerical Integration, II.1.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conservative.arithmetic import in_body
from conservative.attitude import from_quaternion, to_quaternion
from conservative.features import Feature
from conservative.grid import Grid
from conservative.potentials.turning import Turning
from conservative.scene import Scene
from conservative.trajectory import Trajectory

Reals = NDArray[np.longdouble]
Slope = Callable[[Reals], Callable[[Reals], Reals]]
"""Returns the derivative of states (7, n) at times (n,), s."""
STAGES = 12
ROUND_OFF = 4 * float(np.finfo(np.longdouble).eps)
MOST_ITERATIONS = 60
AT_ONCE = 4096
"""Largest number of samples that are computed together; each takes a few kB."""


def collocate(scene: Scene, grid: Grid, parts: int, every: int = 1) -> Trajectory:
    """Return the motion of a scene at the samples of a grid.

    There are `parts` steps between successive knots, which are every `every`-th sample.
    The field is one that kernels know. A step that is too long to converge gives a wrong result, or one that is not finite.
    Steps also end where a load is not smooth (`Scene.breaks`). With a motor the momentum in the state includes the rotor's.
    Other samples are single steps from the step before them, computed all at once.
    """
    slope, ends = _slope(scene), grid.steps.astype(np.longdouble) * np.longdouble(grid.dt)
    bends = scene.smoothness(grid.last).breaks.astype(np.longdouble)
    stops = np.union1d(np.append(ends[::every], ends[-1]), bends[(bends > 0) & (bends < ends[-1])])
    q = to_quaternion(scene.R_WB0).astype(np.longdouble)
    L = scene.body.inertia.astype(np.longdouble) @ scene.w_WB_B0 + motor_momentum(scene, ends[:1])[:, 0]
    y = np.concatenate([q / np.sqrt(q @ q), L])[:, None]
    t, states = stops[:1], [y[:, 0]]
    with np.errstate(all="ignore"):
        for start, stop in pairwise(stops):
            h = np.array([(stop - start) / parts])
            for k in range(parts):
                y = _step(slope, start + h * k, y, h)
                states.append(y[:, 0])
            t = np.append(t, [*(start + h * np.arange(1, parts)), stop])
        row, solution = np.searchsorted(t, ends, side="right") - 1, np.array(states)
        samples, gaps = solution[row], ends - t[row]
        for some in np.array_split(np.flatnonzero(gaps), math.ceil(len(ends) / AT_ONCE)):
            if len(some):
                samples[some] = _step(slope, t[row[some]], samples[some].T, gaps[some]).T
        size = np.sqrt((samples[:, :4] ** 2).sum(axis=1, keepdims=True))
        R_WB = from_quaternion((samples[:, :4] / size).astype(float))
        w_WB_B = ((samples[:, 4:] - motor_momentum(scene, ends).T) @ _inverse(scene).T).astype(float)
    return Trajectory(scene, grid.t, R_WB, w_WB_B, f"collocation of order {2 * STAGES}, extended precision")


def _step(slope: Slope, start: Reals, y: Reals, h: Reals) -> Reals:
    """Return states (7, n) after a step of h (n,), s, each from its own time (n,), s."""
    c, b, A = _tableau()
    rates = slope((start[:, None] + h[:, None] * c).ravel())
    stages, change, shape = np.repeat(y[:, :, None], STAGES, axis=2), np.inf, (7, len(h), STAGES)
    for _ in range(MOST_ITERATIONS):
        before, last = stages, change
        stages = y[:, :, None] + h[:, None] * (rates(stages.reshape(7, -1)).reshape(shape) @ A.T)
        change = float(np.abs(stages - before).max() / np.abs(y).max())
        if change < ROUND_OFF or (change >= last and change < 1e3 * ROUND_OFF):  # converged, or stalled near round-off
            break
    return np.asarray(y + h * (rates(stages.reshape(7, -1)).reshape(shape) @ b))


def _slope(scene: Scene) -> Slope:
    """Return a function of times (n,) that returns the derivative of quaternion and body momentum (7, n) at these times."""
    J_inverse, potential = _inverse(scene), scene.potential
    h1, h2, h3 = (0.0, 0.0, 0.0) if scene.body.motor else scene.body.rotor_along(np.eye(3)) or (0.0, 0.0, 0.0)
    # In double precision a field's products would be rounded, which some bodies amplify by 1,000.
    fixed: Any = None if potential is None else potential.kernel_field(np.eye(3, dtype=np.longdouble))
    turns_with_body = Feature.ATTITUDE in scene.features

    def loads(t: list[float], R: Any) -> tuple[Any, Any]:
        """Return damping (n, 3, 3) and torque (3, n), or None."""
        D = None if scene.damping is None else np.array([scene.damping.at(*state) for state in zip(t, R, strict=True)])
        if scene.torque is None:
            return D, None
        return D, np.array([scene.torque.at(*state) for state in zip(t, R, strict=True)], dtype=np.longdouble).T

    def at(t: Reals) -> Callable[[Reals], Reals]:
        momentum, field, times = motor_momentum(scene, t), fixed, t.astype(float).tolist()
        if isinstance(potential, Turning):  # its own `at_time` is for single times in double precision
            half = fixed.rate / np.longdouble(2) * t
            field = fixed._replace(back=(np.cos(half), *(-np.sin(half) * n for n in fixed.normal)))
        acting = None if turns_with_body else loads(times, [None] * len(t))  # the same in each iteration

        def rates(y: Reals) -> Reals:
            (a, b, c, d, L1, L2, L3), (x, y_, z) = y, J_inverse @ (y[4:] - momentum)
            T = np.zeros_like(y[4:]) if field is None else np.array(field.body_torque((a, b, c, d)))
            turn = -b * x - c * y_ - d * z, a * x + c * z - d * y_, a * y_ + d * x - b * z, a * z + b * y_ - c * x
            D, torque = acting or loads(times, from_quaternion(np.array([a, b, c, d]).T.astype(float)))
            if D is not None:
                T = T - np.einsum("nij,jn->in", D, np.array([x, y_, z]))
            if torque is not None and scene.torque is not None:
                T = T + (torque if scene.torque.frame == "body" else np.array(in_body((a, b, c, d), tuple(torque))))
            L1, L2, L3 = L1 + h1, L2 + h2, L3 + h3  # rates follow from the body's own momentum
            momentum_rate = L2 * z - L3 * y_ + T[0], L3 * x - L1 * z + T[1], L1 * y_ - L2 * x + T[2]
            return np.array([*(rate / 2 for rate in turn), *momentum_rate])

        return rates

    return at


def motor_momentum(scene: Scene, t: Reals) -> Reals:
    """Return the momentum (3, n) of a rotor with a motor at times (n,), s; 0 without a motor."""
    motor = scene.body.motor
    if motor is None:
        return np.zeros((3, len(t)), dtype=np.longdouble)
    return np.array([motor.at(float(time)) for time in t], dtype=np.longdouble).T


def _inverse(scene: Scene) -> Reals:
    """Return the inverse of the inertia (3, 3), from its adjugate: NumPy inverts in double precision."""
    J = scene.body.inertia.astype(np.longdouble)
    adjugate = np.array([np.cross(J[1], J[2]), np.cross(J[2], J[0]), np.cross(J[0], J[1])]).T
    return np.asarray(adjugate / (J[0] @ adjugate[:, 0]))


@lru_cache
def _tableau() -> tuple[Reals, Reals, Reals]:
    """Return nodes c (s,), weights b (s,) and coefficients A (s, s) from integrals of Legendre polynomials."""
    s, x = STAGES, np.polynomial.legendre.leggauss(STAGES)[0].astype(np.longdouble)
    for _ in range(3):  # Newton's method from double precision; the last pass is for the derivative
        P: list[Any] = [np.ones_like(x), x]
        for k in range(1, s):
            P.append(((2 * k + 1) * x * P[k] - k * P[k - 1]) / (k + 1))
        derivative = s * (x * P[s] - P[s - 1]) / (x * x - 1)
        x = x - P[s] / derivative
    weights = 2 / ((1 - x * x) * derivative**2)
    integrals = np.array(P[1:]) - np.array([-P[0], *P[: s - 1]])  # (2 k + 1) times the integrals from -1 to the nodes
    return (1 + x) / 2, weights / 2, integrals.T @ np.array(P[:s]) * weights / 4
