"""Recordings with a planted mistake, or none, for `conservative verify`: a scene, a simulator, a layout, noise and a length.

Nothing here comes from the package: right-hand side, steps and layouts are its own. A state
is (q, w): a quaternion, scalar first, body to world, and rates, rad/s, body axes.

    q' = q (0, w) / 2        J w' = (J w + h) x w + T - h'

The generator decides before the verification. `grain` is the root mean square of noise, digits or single precision in a row, at
least 1e-9. A file is wrong if it differs from the exact motion by more than 3 grains (root mean square over the rows,
against the initial state that fits best unless the first row is exact). A planted mistake that differs by less proves nothing.
A mistake is identifiable if it differs by more than 10, also from its rivals: other mistakes of its kind with as few fitted
numbers, whose differences may be scaled, so that a method has its best step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from conservative.benchmarks.verification.recordings.table import Options

from ..independent import Case, inverse_of, is_table
from .random_scenes import Draw

FLOOR, WRONG, IDENTIFIABLE = 1e-9, 3.0, 10.0
KINDS = ("none", "gravity", "spring", "attraction", "gradient")
NOISES: dict[str, float] = {"none": 0.0, "6 digits": 0.0, "1e-3": 1e-3, "1e-2": 1e-2}


@njit(cache=True)
def _slope(t, y, J, Ji, kind, a, n, orbit, rotor, spin, torque, times, world, D, terms, K, fixed, S):  # type: ignore[no-untyped-def]
    """Return the derivative of a state. `terms` scale gyroscopic torque and field; `fixed` keeps the tensor S in the world."""
    q, w = y[:4] / np.sqrt((y[:4] * y[:4]).sum()), y[4:].copy()
    out = np.empty(7)
    out[0] = -0.5 * (y[1] * w[0] + y[2] * w[1] + y[3] * w[2])
    out[1] = 0.5 * (y[0] * w[0] + y[2] * w[2] - y[3] * w[1])
    out[2] = 0.5 * (y[0] * w[1] + y[3] * w[0] - y[1] * w[2])
    out[3] = 0.5 * (y[0] * w[2] + y[1] * w[1] - y[2] * w[0])
    v, s = q[1:], q[0]
    R = np.eye(3) * (s * s - (v * v).sum()) + 2 * np.outer(v, v)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        R[k, j] += 2 * s * v[i]
        R[j, k] -= 2 * s * v[i]
    T = -(D @ w) - spin
    k = min(max(np.searchsorted(times, t) - 1, 0), len(times) - 2)
    M = torque[k] + (t - times[k]) / (times[k + 1] - times[k]) * (torque[k + 1] - torque[k])
    T += R.T @ M if world else M
    if kind > 0:
        F = R
        if orbit[0] != 0.0:
            angle, m = orbit[0] * t, orbit[1:]
            C = np.cos(angle) * np.eye(3) + (1 - np.cos(angle)) * np.outer(m, m)
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                C[k, j] += np.sin(angle) * m[i]
                C[j, k] -= np.sin(angle) * m[i]
            F = C.T @ R
        if kind == 1:
            f = terms[1] * np.cross(a, -n[0] * F[2])
        elif kind == 4:
            u = F.T @ a
            f = terms[1] * 3 * n[0] ** 2 * np.cross(u, K @ u)
        else:
            line = F.T @ n[3:] - a
            far = np.sqrt((line * line).sum())
            f = terms[1] * np.cross(a, line) * (n[0] * (1 - n[1] / far) if kind == 2 else n[0] / far**3)
        T += f
    if fixed:
        W = R @ w
        out[4:] = R.T @ np.linalg.solve(S, terms[0] * np.cross(S @ W + R @ (rotor + spin * t), W) + R @ T)
    else:
        out[4:] = Ji @ (terms[0] * np.cross(J @ w + rotor + spin * t, w) + T)
    return out


@dataclass(frozen=True, eq=False)
class Simulator:
    """The equations of a case, and changes of them: factors of gyroscopic torque and field, a tensor fixed in the world."""

    case: Case
    terms: tuple[float, float] = (1.0, 1.0)
    fixed: Any = None
    numbers: tuple[Any, ...] = field(init=False)
    breaks: list[float] = field(init=False)

    def __post_init__(self) -> None:
        case, zero = self.case, np.zeros(3)
        kind, *of = case.field or ("none",)
        a, n = zero, np.zeros(6)
        if case.field:
            a = of[2] / np.linalg.norm(of[2]) if kind == "gradient" else np.asarray(of[1], float)
            n[0], n[1] = of[0], of[3] if kind == "spring" else 0.0
            n[3:] = of[2] if kind in ("spring", "attraction") else 0.0
        orbit = np.zeros(4)
        if case.turning:
            orbit = np.append(case.turning[0], case.turning[1] / np.linalg.norm(case.turning[1]))
        rotor, spin = (zero if case.rotor is None else case.rotor), zero
        if is_table(rotor):
            (t0, t1), (h0, h1) = rotor
            rotor, spin = h0, (h1 - h0) / (t1 - t0)
        times, M = case.torque if is_table(case.torque) else ([0.0, 1e9], [zero if case.torque is None else case.torque] * 2)
        K, S = of[1] if kind == "gradient" else case.J, case.J if self.fixed is None else self.fixed
        given = (case.J, inverse_of(case.J), KINDS.index(kind), a, n, orbit, rotor, spin, np.array(M, float), np.array(times))
        D = np.zeros((3, 3)) if case.damping is None else case.damping
        more = (case.frame == "world", D, np.array(self.terms), K, self.fixed is not None, S)
        object.__setattr__(self, "numbers", tuple(np.ascontiguousarray(x, float) if np.ndim(x) else x for x in given + more))
        object.__setattr__(self, "breaks", [t for t in times if 0 < t < 1e8] if case.torque is not None else [])

    def __call__(self, t: float, y: Any) -> Any:
        """Return the derivative of a state in its own precision."""
        return _slope(float(t), np.asarray(y, float), *self.numbers).astype(y.dtype)

    def solve(self, times: Any, y0: Any = None, start: float = 0.0) -> Any:
        """Return states (n, 7) at increasing times, s, from the state at `start`, by DOP853 from corner to corner."""
        y = self.start() if y0 is None else y0
        if times[-1] == start:
            return np.array([y for _ in times])
        rows, ends = [], [start, *[t for t in self.breaks if start < t < times[-1]], times[-1]]
        tolerance = np.append(np.full(4, 1e-14), np.full(3, 1e-14 * max(np.linalg.norm(y[4:]), 1e-3)))
        for a, b in pairwise(ends):
            at = times[(times >= a) & (times < b)]
            found = solve_ivp(self, (a, b), y, "DOP853", np.append(at, b), rtol=1e-13, atol=tolerance, max_step=(b - a) / 4)
            y = found.y[:, -1]
            rows.append(found.y.T[:-1])
        return unit(np.concatenate([*rows, y[None]]))

    def start(self) -> Any:
        """Return the initial state."""
        return np.append(Rotation.from_matrix(self.case.R0).as_quat(scalar_first=True), self.case.w0)


def unit(y: Any) -> Any:
    """Return states whose quaternions have norm 1."""
    return np.concatenate([y[..., :4] / np.linalg.norm(y[..., :4], axis=-1, keepdims=True), y[..., 4:]], axis=-1)


def multiply(p: Any, q: Any) -> Any:
    """Return the product of two quaternions, scalar first."""
    return np.array([
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3], p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1], p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ], p.dtype)  # fmt: skip


def turn(v: Any) -> Any:
    """Return the quaternion of a rotation vector."""
    angle = math.sqrt(float(v @ v))
    if not math.isfinite(angle):  # of a method that diverges
        return np.full(4, np.nan, v.dtype)
    return np.append(math.cos(angle / 2), (math.sin(angle / 2) / angle if angle else 0.5) * v).astype(v.dtype)


def matrix(q: Any) -> Any:
    """Return the matrices of quaternions, scalar first."""
    return Rotation.from_quat(q, scalar_first=True).as_matrix()


# Steps: the state after h from that at t, and earlier states, latest first


def explicit(tableau: Any, weights: Any) -> Any:
    def step(f: Any, t: float, y: Any, h: Any, past: Any) -> Any:
        k: list[Any] = []
        for row in ((), *tableau):
            k.append(f(t + float(h) * sum(row), sum((h * y.dtype.type(a) * s for a, s in zip(row, k, strict=True)), y)))
        return sum((h * y.dtype.type(b) * s for b, s in zip(weights, k, strict=True)), y)

    return step


def implicit(share: float) -> Any:
    """Return implicit Euler (1) or the implicit midpoint rule (1/2), iterated to round-off."""

    def step(f: Any, t: float, y: Any, h: Any, past: Any) -> Any:
        k = f(t, y)
        for _ in range(80):
            before, k = k, f(t + share * float(h), y + y.dtype.type(share) * h * k)
            if abs(k - before).max() <= 4 * np.finfo(y.dtype).eps * abs(k).max():
                break
        return y + h * k

    return step


def game(corrections: int, exponential: bool) -> Any:
    """Return a step of game engines: rates first, with so many corrections of their torque, then attitudes by new rates."""

    def step(f: Any, t: float, y: Any, h: Any, past: Any) -> Any:
        w = y[4:]
        for _ in range(corrections):
            w, before = y[4:] + h * f(t, np.append(y[:4], w))[4:], w
            if abs(w - before).max() <= 2 * np.finfo(y.dtype).eps * abs(w).max():
                break
        if exponential:
            return np.append(multiply(y[:4], turn(h * w)), w)
        return np.append(y[:4] + h / 2 * multiply(y[:4], np.append(y.dtype.type(0), w)), w)

    return step


def euler_map(f: Any, t: float, y: Any, h: Any, past: Any) -> Any:
    return np.append(multiply(y[:4], turn(h * y[4:])), y[4:] + h * f(t, y)[4:])


def bashforth(order: int) -> Any:
    weights = {1: (1.0,), 2: (1.5, -0.5), 3: (23 / 12, -16 / 12, 5 / 12)}

    def step(f: Any, t: float, y: Any, h: Any, past: Any) -> Any:
        known = [y, *past][:order]
        terms = zip(weights[len(known)], known, strict=True)
        return y + h * sum(y.dtype.type(b) * f(t - i * float(h), each) for i, (b, each) in enumerate(terms))

    return step


def verlet(f: Any, t: float, y: Any, h: Any, past: Any) -> Any:
    half = y[4:] + h / 2 * f(t, y)[4:]
    moved = np.append(multiply(y[:4], turn(h * half)), half)
    return np.append(moved[:4], half + h / 2 * f(t + float(h), moved)[4:])


def stormer(f: Any, t: float, y: Any, h: Any, past: Any) -> Any:
    """q'' = q (0, w') / 2 - |w|^2 q / 4, as q(n+1) = 2 q(n) - q(n-1) + h^2 q''; rates by Heun's rule with the new attitude."""
    k = f(t, y)
    second = multiply(y[:4], np.append(y.dtype.type(0), k[4:])) / 2 - (y[4:] @ y[4:]) / 4 * y[:4]
    q = 2 * y[:4] - past[0][:4] + h * h * second if past else y[:4] + h * k[:4] + h * h / 2 * second
    return np.append(q, y[4:] + h / 2 * (k + f(t + float(h), np.append(q, y[4:] + h * k[4:])))[4:])


def buss(order: int) -> Any:
    """Return Buss's augmented step (2000), world axes: h W + h^2/2 W' + h^3/12 W' x W, and h^3/6 W'' for order 3."""

    def step(f: Any, t: float, y: Any, h: Any, past: Any) -> Any:
        J, R, k = f.numbers[0], matrix(y[:4]), f(t, y)
        W, A = R @ y[4:], R @ k[4:]
        v = h * W + h * h / 2 * A + h**3 / 12 * np.cross(A, W)
        if order == 3:
            e = 1e-5 * float(h)
            ahead, behind = y + e * k, y - e * k
            v = v + h**3 / 6 * (matrix(ahead[:4]) @ f(t + e, ahead)[4:] - matrix(behind[:4]) @ f(t - e, behind)[4:]) / (2 * e)
        L = J @ y[4:] + f.numbers[6]
        L_W = R @ (L + h * (J @ k[4:] - np.cross(L, y[4:])))
        q = multiply(turn(v), y[:4])
        return np.append(q, np.linalg.solve(J, matrix(q).T @ L_W - f.numbers[6])).astype(y.dtype)

    return step


RK3 = (((1 / 2,), (-1.0, 2.0)), (1 / 6, 2 / 3, 1 / 6))
RK4 = (((1 / 2,), (0.0, 1 / 2), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6))
GAME = "semi-implicit Euler with an {} gyroscopic term"
STEPS: dict[str, tuple[int, Any]] = {
    "explicit Euler": (0, explicit((), (1.0,))),
    "explicit Euler with the exponential map": (0, euler_map),
    GAME.format("explicit"): (0, game(1, False)),
    GAME.format("explicit") + " and the exponential map": (0, game(1, True)),
    GAME.format("implicit"): (0, game(60, False)),
    GAME.format("implicit") + " and the exponential map": (0, game(60, True)),
    "implicit Euler": (0, implicit(1.0)),
    "the implicit midpoint rule": (0, implicit(0.5)),
    "the explicit midpoint rule (RK2)": (0, explicit(((0.5,),), (0.0, 1.0))),
    "Heun's method": (0, explicit(((1.0,),), (0.5, 0.5))),
    "Ralston's method": (0, explicit(((2 / 3,),), (0.25, 0.75))),
    "RK3 (Kutta)": (0, explicit(*RK3)),
    "RK3 (Heun)": (0, explicit(((1 / 3,), (0.0, 2 / 3)), (0.25, 0.0, 0.75))),
    "RK4": (0, explicit(*RK4)),
    "Adams-Bashforth 2 (first step Euler)": (1, bashforth(2)),
    "Adams-Bashforth 3": (2, bashforth(3)),
    "leapfrog (velocity Verlet)": (0, verlet),
    "Störmer's method on the quaternion": (1, stormer),
    "Buss 2 (augmented)": (0, buss(2)),
    "Buss 3 (augmented)": (0, buss(3)),
}
"""Number of earlier states, and the step."""


def march(f: Simulator, name: str, t: Any, parts: int, normalise: bool = True, number: Any = np.float64) -> Any:
    """Return states (n, 7) by a method with so many steps between two rows, which are equally far apart."""
    past, (count, step) = list[Any](), STEPS[name]
    y, h = f.start().astype(number), number((t[-1] - t[0]) / (len(t) - 1) / parts)
    rows = [y]
    with np.errstate(all="ignore"):
        for i in range((len(t) - 1) * parts):
            new = step(f, float(t[0]) + i * float(h), y, h, past)
            past, y = [y, *past][:count], new.astype(number)
            if normalise:
                y[:4] /= np.sqrt(y[:4] @ y[:4])
            if (i + 1) % parts == 0:
                rows.append(y)
    return np.array(rows).astype(float)


# Mistakes of the scene: what was simulated instead

SCENES: dict[str, Callable[[Case], Any]] = {
    "without the rotor": lambda case: case.rotor is not None and Simulator(case.without("rotor")),
    "without the torque": lambda case: case.torque is not None and Simulator(case.without("torque")),
    "without the damping": lambda case: case.damping is not None and Simulator(case.without("damping")),
    "without the field": lambda case: case.field is not None and Simulator(case.without("field", "turning")),
    "sign of the rotor": lambda case: case.rotor is not None and Simulator(replace(case, rotor=opposite(case.rotor))),
    "sign of the torque": lambda case: case.torque is not None and Simulator(replace(case, torque=opposite(case.torque))),
    "axes of the torque": lambda case: (
        case.torque is not None and Simulator(replace(case, frame={"body": "world", "world": "body"}[case.frame]))
    ),
    "sign of the field": lambda case: case.field is not None and Simulator(case, (1.0, -1.0)),
    "turning of the field": lambda case: case.turning is not None and Simulator(case.without("turning")),
    "no products of inertia": lambda case: Simulator(with_inertia(case, np.diag(np.diag(case.J)))),
    "sign of the products of inertia": lambda case: Simulator(with_inertia(case, 2 * np.diag(np.diag(case.J)) - case.J)),
    "no gyroscopic term": lambda case: Simulator(case, (0.0, 1.0)),
    "sign of the gyroscopic term": lambda case: Simulator(case, (-1.0, 1.0)),
    "inertia of the start": lambda case: Simulator(case, fixed=case.R0 @ case.J @ case.R0.T),
    "inertia in world axes": lambda case: Simulator(case, fixed=case.J),
}


def opposite(given: Any) -> Any:
    return (given[0], -given[1]) if is_table(given) else -given


def with_inertia(case: Case, J: Any) -> Case:
    """Return the case with another inertia, also in the gravity gradient."""
    gradient = case.field is not None and case.field[0] == "gradient"
    return replace(case, J=J, field=("gradient", case.field[1], J, case.field[3]) if gradient and case.field else case.field)


# Attitudes that are not the integral of the right rates: the quaternion of a step from rates at its start and end


def first(q: Any, v: Any) -> Any:
    return q + multiply(q, np.append(0.0, v)) / 2


def in_place(q: Any, v: Any) -> Any:
    (a, b, c, d), (x, y, z) = q, v / 2
    a -= b * x + c * y + d * z
    b += a * x + c * z - d * y
    c += a * y - b * z + d * x
    return np.array([a, b, c, d + a * z + b * y - c * x])


ATTITUDES: dict[str, Callable[[Any, Any, Any, float], Any]] = {
    "attitude by normalisation, old rates": lambda q, a, b, h: first(q, a * h),
    "attitude by normalisation": lambda q, a, b, h: first(q, b * h),
    "attitude by normalisation, mean rates": lambda q, a, b, h: first(q, (a + b) / 2 * h),
    "stale rates": lambda q, a, b, h: multiply(q, turn(a * h)),
    "attitude by rotation, new rates": lambda q, a, b, h: multiply(q, turn(b * h)),
    "attitude by rotation, mean rates": lambda q, a, b, h: multiply(q, turn((a + b) / 2 * h)),
    "attitude in place, old rates": lambda q, a, b, h: in_place(q, a * h),
    "stale rates on the wrong side": lambda q, a, b, h: multiply(turn(a * h), q),
    "attitude by rotation, mean rates on the wrong side": lambda q, a, b, h: multiply(turn((a + b) / 2 * h), q),
    "attitude by normalisation, old rates on the wrong side": lambda q, a, b, h: q + multiply(np.append(0.0, a * h), q) / 2,
}


def integrate(rule: Any, q: Any, w: Any, h: float, parts: int) -> Any:
    """Return attitudes (n, 4) by a rule, at every `parts`-th of the rates."""
    rows = [q]
    for i in range(len(w) - 1):
        q = rule(q, w[i], w[i + 1], h)
        q = q / np.sqrt(q @ q)
        rows += [q] * ((i + 1) % parts == 0)
    return np.array(rows)


READINGS = (
    *("transposed", "order xyzw", "order wxyz", "rates in degrees", "rates in radians", "world rates", "reversed rates"),
)
TIMES = ("time shift", "phase drift", "time in ms", "jittered times", "dropped rows", "rates at other times")
FITTED = ("damping", "another body", "body axes", "first row", "single rows")
PAIR = "two mistakes"

# Layouts: a header, its columns of q (n, 4) and w (n, 3), the factor from their rounding to angles, and how they are read


@dataclass(frozen=True)
class Layout:
    """A table: header, columns of times, quaternions and rates, what it has, and the size of a rounding as an angle."""

    header: str
    columns: Callable[[Any, Any], Any]
    has: str
    size: float = 1.0
    options: dict[str, Any] = field(default_factory=dict)
    separator: str = ","
    comma: bool = False
    second: float = 1.0
    unit: float = 1.0


def rotation(q: Any) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


SHUFFLED = [1, 2, 3, 0]
W3 = "w_x (rad/s),w_y (rad/s),w_z (rad/s)"
DEG = np.degrees(1.0)
LAYOUTS = {
    "quaternions": Layout(f"t,q_w,q_x,q_y,q_z,{W3}", lambda q, w: [q, w], "q R w", 2.0),
    "matrices": Layout(
        "t," + ",".join(f"R_WB_{i}{j}" for i in "123" for j in "123") + ",w_x (deg/s),w_y (deg/s),w_z (deg/s)",
        lambda q, w: [rotation(q).as_matrix().reshape(-1, 9), DEG * w], "R w", 0.8, unit=DEG,
    ),
    "Euler angles": Layout(
        "time,yaw (deg),pitch (deg),roll (deg),p (deg/s),q (deg/s),r (deg/s)",
        lambda q, w: [rotation(q).as_euler("ZYX", degrees=True), DEG * w], "R w", 1 / DEG, {"euler": "zyx"}, unit=DEG,
    ),
    "world rates": Layout(
        f"t,q_w,q_x,q_y,q_z,{W3}", lambda q, w: [q, rotation(q).apply(w)], "q R w", 2.0, {"world": True}
    ),
    "TUM": Layout("# timestamp tx ty tz qx qy qz qw", lambda q, w: [0 * w, q[:, SHUFFLED]], "q R", 2.0, separator=" "),
    "ROS": Layout(
        ",".join(["%time", *(f"field.orientation.{i}" for i in "xyzw"), *(f"field.angular_velocity.{i}" for i in "xyz")]),
        lambda q, w: [q[:, SHUFFLED], w], "q R w", 2.0, second=1e9,
    ),
    "phyphox": Layout(
        '"Time (s)";"Gyroscope x (rad/s)";"Gyroscope y (rad/s)";"Gyroscope z (rad/s)"', lambda q, w: [w], "w",
        separator=";", comma=True,
    ),
    "EuRoC": Layout(
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1]", lambda q, w: [w], "w", second=1e9
    ),
    "MuJoCo": Layout(
        ",".join(["time", *(f"qpos[{i}]" for i in range(7)), *(f"qvel[{i}]" for i in range(6))]),
        lambda q, w: [0 * w, q, 0 * w, w], "q R w", 2.0,
    ),
    "Basilisk": Layout(
        "t,sigma_1,sigma_2,sigma_3,omega_1,omega_2,omega_3",
        lambda q, w: [(q * np.where(q[:, :1] < 0, -1, 1))[:, 1:] / (1 + abs(q[:, :1])), w], "R w", 4.0, {"units": "rad"},
    ),
    "rotation vectors": Layout(
        "t,rx,ry,rz,w_x (rpm),w_y (rpm),w_z (rpm)", lambda q, w: [rotation(q).as_rotvec(), w * 30 / np.pi], "R w",
        unit=30 / np.pi,
    ),
}  # fmt: skip


def draw_case(draw: Draw) -> tuple[Case, float]:
    """Return a case, whose parts change the motion within some radians, and its rate, rad/s."""
    mass, second = (draw.between(1e-6, 1e6), draw.between(1e-3, 1e3)) if draw.chance(0.3) else (1.0, 1.0)
    moments = draw.random.uniform(0.6, 2, size=3) * mass
    moments[2] = max(min(moments[2], 0.95 * moments[:2].sum()), 1.05 * abs(moments[0] - moments[1]))
    axes = draw.rotation()
    J, rate = axes @ np.diag(moments) @ axes.T, draw.between(0.5, 5) / second
    J = (J + J.T) / 2
    w0 = axes @ draw.vector(rate)
    case, energy = Case(J, draw.rotation(), w0, 1.0), float(w0 @ J @ w0) / 2
    momentum = float(np.linalg.norm(J @ w0))
    if draw.chance(0.1):
        thrown = (draw.between(0.1, 10) * mass, draw.vector(), draw.between(0.1, 10), draw.vector(), draw.vector())
        return replace(case, flight=thrown), rate
    kind = str(draw.random.choice(["none", *KINDS]))
    size, arm = energy * draw.between(0.1, 1.5), draw.between(0.2, 1)
    point, anchor = draw.vector(arm), draw.vector(arm * (1.5 + draw.between(0.2, 2)))
    far, normal, across = arm + float(np.linalg.norm(anchor)), draw.vector(), draw.vector()
    orbit = rate * draw.between(0.1, 1)
    fields: dict[str, tuple[Any, ...]] = {
        "gravity": (size / arm, point),
        "spring": (size / far**2, point, anchor, 0.0 if draw.chance(0.5) else draw.random.uniform(0, 0.5 * far)),
        "attraction": (size * (far - 2 * arm), point, anchor),
        "gradient": (orbit, J, np.cross(normal, across) / np.linalg.norm(np.cross(normal, across))),
    }
    turning = kind != "none" and draw.chance(0.8 if kind == "gradient" else 0.15)
    case = replace(case, field=(kind, *fields[kind]) if kind != "none" else None, turning=(orbit, normal) if turning else None)
    if draw.chance(0.3):
        h = draw.vector(momentum * draw.between(0.1, 1))
        slope = draw.vector(momentum * rate * 0.02)
        case = replace(case, rotor=([0.0, 1e4 / rate], np.array([h, h + slope * 1e4 / rate])) if draw.chance(0.3) else h)
    if draw.chance(0.3):
        size = momentum * rate * draw.between(0.003, 0.1)
        times = np.append(np.arange(12.0) * draw.between(2, 20), 1e4) / rate
        M = size * draw.random.normal(size=(13, 3)) if draw.chance(0.4) else draw.vector(size)
        case = replace(case, torque=(times, M) if M.ndim > 1 else M, frame="world" if draw.chance(0.5) else "body")
    if draw.chance(0.3):
        half = draw.random.normal(size=(3, 3)) / 2
        case = replace(case, damping=moments.mean() * rate * draw.between(0.003, 0.05) * (half @ half.T + 0.3 * np.eye(3)))
    return case, rate


@dataclass(eq=False)
class Planted:
    """A file and what it is, decided before it is verified.

    `expected` is "right" or "wrong", or "" if the file is wrong by less than noise allows. `same` are mistakes with its rows.
    """

    seed: int
    case: Case
    mistake: str
    layout: str
    noise: str
    single: bool
    turns: float
    text: str = ""
    expected: str = ""
    identifiable: bool = False
    same: set[str] = field(default_factory=set)
    size: float = 0.0
    about: dict[str, Any] = field(default_factory=dict)

    @property
    def options(self) -> Options:
        """How the file is read."""
        return Options(**LAYOUTS[self.layout].options)


def choose(draw: Draw) -> tuple[str, str]:
    """Return a kind of mistake and its name."""
    kinds = ("right", "scene", "step", "attitude", "reading", "time", "fitted", PAIR)
    kind = str(draw.random.choice(kinds, p=(0.25, 0.22, 0.25, 0.07, 0.07, 0.06, 0.06, 0.02)))
    names = {"scene": SCENES, "step": STEPS, "attitude": ATTITUDES, "reading": READINGS, "time": TIMES, "fitted": FITTED}
    return kind, str(draw.random.choice([*names[kind]])) if kind in names else kind


def plant(seed: int) -> Planted:
    """Return the file of a seed."""
    draw = Draw(10_000 + seed)
    kind, mistake = choose(draw)
    case, rate = draw_case(draw)
    while kind == "scene" and not SCENES[mistake](case):
        case, rate = draw_case(draw)
    coarse = kind == "step"  # methods whose error is above the noise
    turns, per_turn = draw.between(0.2, 50), draw.between(12, 40) if coarse else draw.between(20, 80)
    n = int(np.clip(turns * per_turn, 40, 1200 if coarse else 2000))
    gap = float(f"{2 * math.pi * turns / n / rate:.1e}")
    t, parts = gap * np.arange(n), min(int(draw.random.integers(1, 5 if coarse else 9)), max(1, 2000 // n))
    noise = str(draw.random.choice([*NOISES], p=[0.4, 0.3, 0.2, 0.1] if coarse else [0.25] * 4))
    single = noise == "none" and draw.chance(0.3)
    wanted = {"transposed": "R", "order xyzw": "q", "order wxyz": "q", "world rates": "R w", "rates at other times": "R w"}
    feature = {"attitude": "R w", "reading": "w"}.get(kind, "")
    feature = wanted.get(mistake, "R w" if mistake == "body axes" else feature)
    in_time = case.turning is not None or case.torque is not None or is_table(case.rotor) or case.damping is not None

    def fits(name: str) -> bool:
        layout = LAYOUTS[name]
        if name == "ROS" and in_time:
            return False
        unit = {"rates in degrees": layout.unit == 1, "rates in radians": layout.unit == DEG}.get(mistake, True)
        order = {
            "order xyzw": layout.header.startswith("t,q_w"),
            "order wxyz": name in ("TUM", "ROS"),
        }
        plain = name != "world rates" or kind != "reading"
        return unit and plain and order.get(mistake, True) and all(part in layout.has.split() for part in feature.split())

    layout = str(draw.random.choice([name for name in LAYOUTS if fits(name)]))
    made = Planted(seed, replace(case, t_end=float(t[-1])), mistake, layout, noise, single, turns)
    has = LAYOUTS[layout].has
    cut = int(0.3 * n) if draw.chance(0.2) and kind in ("right", "scene") and has != "w" and "w" in has else 0
    made.about |= {"gap": gap, "rows": n, "cut": cut, "parts": parts, "rate": rate}
    case = made.case
    exact = Simulator(case)
    Y, rounding = simulate(draw, made, kind, t, parts, rate)
    t = np.arange(len(Y)) * gap if mistake != "time in ms" else t
    t, Y = t[cut:], Y[cut:]
    write(draw, made, t, Y, rounding)
    decide(made, kind, exact, t, Y)
    return made


def simulate(draw: Draw, made: Planted, kind: str, t: Any, parts: int, rate: float) -> tuple[Any, float]:
    """Return the states of a file without noise, and the error that single precision makes in them."""
    case, name, gap = made.case, made.mistake, float(t[1] - t[0])
    exact, single = Simulator(case), 0.0
    if kind == "scene":
        Y = SCENES[name](case).solve(t)
    elif kind == "step":
        normalise = draw.chance(0.7) or "q" not in LAYOUTS[made.layout].has
        made.about["normalise"] = normalise
        Y = march(exact, name, t, parts, normalise)
        if made.single:
            Y, double = march(exact, name, t, parts, normalise, np.float32), Y
            d = differences(Y, double, np.linalg.norm(Y[:, 4:], axis=1).max())
            single = float(np.sqrt((d**2).sum(axis=1).mean()))
    elif kind == "attitude":
        Y = exact.solve(np.arange((len(t) - 1) * parts + 1) * (gap / parts))
        Y = np.hstack([integrate(ATTITUDES[name], Y[0, :4], Y[:, 4:], gap / parts, parts), Y[::parts, 4:]])
    elif kind == "time":
        Y = simulate_times(draw, made, exact, t, gap)
    elif name == "damping":
        D = rate * draw.between(1e-4, 0.03) * case.J + (0.0 if case.damping is None else case.damping)
        Y = Simulator(replace(case, damping=D)).solve(t)
    elif name in ("another body", PAIR):
        half = np.eye(3) + draw.between(0.003, 0.1) * draw.random.normal(size=(3, 3))
        scale = 1 + draw.between(1e-3, 0.1) if name == PAIR else 1.0
        Y = Simulator(with_inertia(case, half @ case.J @ half.T)).solve(t * scale)
    else:
        Y = exact.solve(t)
    if name == "body axes":
        c = turn(draw.vector(draw.between(0.01, 1.5)))
        Y = np.array([np.append(multiply(y[:4], c), matrix(c).T @ y[4:]) for y in Y])
    elif name == "first row":
        Y[0] = np.append(multiply(Y[0, :4], turn(draw.vector(0.1))), Y[0, 4:] + 0.1 * rate * draw.vector())
    elif name == "single rows":
        Y[draw.random.integers(len(Y) // 3, len(Y)), 4:] += rate * draw.vector(0.3)
        Y[draw.random.integers(len(Y) // 3, len(Y)), :4] = Y[0, :4]
    return Y, single


def simulate_times(draw: Draw, made: Planted, exact: Simulator, t: Any, gap: float) -> Any:
    """Return the right states at other times than the file says."""
    n, name = len(t), made.mistake
    if name == "time shift":
        at = np.append(0.0, t[1:] + gap * draw.between(0.05, 3))
    elif name == "phase drift":
        at = t * (1 + draw.between(1e-4, 0.03))
    elif name == "jittered times":
        at = np.append(0.0, t[1:] + gap * draw.between(0.02, 0.2) * np.clip(draw.random.normal(size=n - 1), -2, 2))
    elif name == "dropped rows":
        lost = np.cumsum(np.bincount(draw.random.integers(5, n, size=3), minlength=n))
        at = t + gap * lost
    elif name == "rates at other times":
        first = draw.chance(0.5)  # the first rates are exact
        both = exact.solve(np.arange(2 * n) * gap / 2)
        made.about["first rates"] = "exact" if first else "late"
        late = both[np.maximum(2 * np.arange(n) - 1, 0)] if first else both[2 * np.arange(n)]
        return np.hstack([both[2 * np.arange(n) + (not first)][:, :4], late[:, 4:]])
    else:
        at = t
    return exact.solve(at)


def differences(Y: Any, Z: Any, scale: float) -> Any:
    """Return turns (n, 3), rad, and relative rates (n, 3) between states; those of a method that diverged are large."""
    Y = np.where(
        np.isfinite(Y).all(axis=1, keepdims=True) & (abs(Y[:, 4:]).max(axis=1, keepdims=True) < 1e9),
        Y,
        [1, 0, 0, 0, 1e9, 1e9, 1e9],
    )
    return np.hstack([(rotation(Z[:, :4]).inv() * rotation(Y[:, :4])).as_rotvec(), (Y[:, 4:] - Z[:, 4:]) / scale])


def write(draw: Draw, made: Planted, t: Any, Y: Any, single: float) -> None:
    """Write the text of a file, and find the grain of attitudes, rad, and rates, relative to the largest."""
    layout, sigma = LAYOUTS[made.layout], NOISES[made.noise]
    q, w = Y[:, :4].copy(), Y[:, 4:].copy()
    scale = float(np.linalg.norm(w, axis=1).max())
    if sigma:
        q = np.array([multiply(each, turn(sigma * draw.random.normal(size=3))) for each in q])
        w = w + sigma * scale * draw.random.normal(size=w.shape)
    w = {
        "reversed rates": -w,
        "rates in degrees": w * DEG,
        "rates in radians": w / DEG,
        "world rates": rotation(q).apply(w),
    }.get(made.mistake, w)
    q = q * [1, -1, -1, -1] if made.mistake == "transposed" else q
    q = np.roll(q, {"order xyzw": -1, "order wxyz": 1}.get(made.mistake, 0), axis=1)
    digits = {"6 digits": "%.6g", "none": "%.17g"}.get(made.noise, "%.9g") if not made.single else "%.9g"
    blocks = layout.columns(q, w)
    read = [
        np.array([float(digits % x) for x in (block.astype(np.float32) if made.single else block).ravel()]) for block in blocks
    ]
    off = [np.sqrt(((a.reshape(b.shape) - b) ** 2).sum(axis=1).mean()) for a, b in zip(read, blocks, strict=True)]
    origin = 1.7e18 if made.layout == "ROS" else 0.0
    second = 1e3 if made.mistake == "time in ms" else layout.second
    ticks = np.round(t * second) + origin if layout.second > 1 else t * second
    times = [f"{x:.0f}" if layout.second > 1 else f"{x:.12g}" for x in ticks]
    late = float(np.sqrt(np.mean(((ticks - origin) / second - t) ** 2))) + (6e-8 if origin else 0.0)
    late = late * scale if second == layout.second else 0.0
    angle = layout.size * sum(off[:-1] if "w" in layout.has else off)
    rates = off[-1] / layout.unit / scale * ("w" in layout.has) / (DEG if made.mistake == "rates in degrees" else 1)
    noise = math.sqrt(3) * sigma
    made.about |= {"scale": scale, "grain": [
        math.hypot(angle, noise, single, late) + FLOOR,
        math.hypot(rates, noise * (1.5 if made.layout == "world rates" else 1.0), single, late) + FLOOR,
    ]}  # fmt: skip
    table = np.hstack([a.reshape(b.shape) for a, b in zip(read, blocks, strict=True)])
    rows = [layout.separator.join([at, *(digits % x for x in row)]) for at, row in zip(times, table, strict=True)]
    text = "\n".join(rows) + "\n"
    made.text = f"{layout.header}\n" + (text.replace(".", ",") if layout.comma else text)


@dataclass(frozen=True, eq=False)
class Rows:
    """Differences from the exact motion `E` (n, 7) that starts in the first row, in grains, of what the file has."""

    t: Any
    E: Any
    kept: list[int]
    grain: Any
    scale: float
    start: list[Any] = field(default_factory=list)

    def off(self, Y: Any) -> Any:
        """Return the differences (n k,) of states, in grains."""
        return (differences(Y, self.E, self.scale)[:, self.kept] / self.grain).ravel()

    def size(self, x: Any, *others: Any) -> float:
        """Return the size of differences that neither the initial state nor other differences explain."""
        if many := [*self.start, *others]:
            A = np.array(many).T
            x = x - A @ np.linalg.lstsq(A, x, rcond=1e-13)[0]
        square = x.reshape(len(self.t), -1, 3) ** 2
        return float(np.sqrt(square.sum(axis=2).mean(axis=0)).max())


def compare(made: Planted, exact: Simulator, t: Any, Y: Any, inexact: bool) -> Rows:
    """Return the rows of a file beside the exact motion."""
    has, scale, start = LAYOUTS[made.layout].has.split(), made.about["scale"], exact.start()
    kept = [*range(3)] * ("R" in has) + [*range(3, 6)] * ("w" in has)
    y0 = np.append(Y[0, :4] if "R" in has else start[:4], Y[0, 4:] if "w" in has else start[4:])
    rows = Rows(t, exact.solve(t, y0, t[0]), kept, np.repeat(made.about["grain"], 3)[kept], scale)
    if not inexact:
        return rows
    moved = [np.append(multiply(y0[:4], turn(1e-6 * v)), y0[4:]) for v in np.eye(3)]
    moved += [np.append(y0[:4], y0[4:] + 1e-6 * scale * v) for v in np.eye(3)]
    return replace(rows, start=[rows.off(exact.solve(t, moved[k], t[0])) for k in kept])


def decide(made: Planted, kind: str, exact: Simulator, t: Any, Y: Any) -> None:
    """Decide whether a file is right, whether its mistake is identifiable, and which others make the same rows."""
    made.expected = "right" if kind == "right" else "wrong"
    if kind in ("right", "reading") or made.mistake == "time in ms":  # what these change is as large as the motion
        made.identifiable = kind != "right" and made.turns > 0.5
        return
    rows = compare(made, exact, t, Y, made.noise != "none" or made.single or made.layout in ("ROS", "EuRoC"))
    made.size = rows.size(wanted := rows.off(Y))
    norm = abs(np.linalg.norm(Y[:, :4], axis=1) - 1).max() if "q" in LAYOUTS[made.layout].has else 0.0
    if max(made.size, norm / made.about["grain"][0]) < WRONG and made.mistake not in ("first row", "single rows"):
        made.expected = ""
    if kind == PAIR or made.size < IDENTIFIABLE:
        return
    for name, others in rivals(made, kind, exact, rows).items():
        same = rows.size(wanted - others[0]) if kind == "scene" else rows.size(wanted, *others)
        made.same |= {name} if same < IDENTIFIABLE else set()
    made.identifiable = not made.same


def rivals(made: Planted, kind: str, exact: Simulator, rows: Rows) -> dict[str, list[Any]]:
    """Return the differences that other mistakes make."""
    t, E, parts = rows.t, rows.E, made.about["parts"]
    if kind == "scene":
        others = {name: build(exact.case) for name, build in SCENES.items() if name != made.mistake}
        return {name: [rows.off(other.solve(t, E[0], t[0]))] for name, other in others.items() if other}
    velocity = np.array([exact(at, y) for at, y in zip(t, E, strict=True)])
    late = rows.off(unit(E + 1e-6 / made.about["rate"] * velocity))
    if kind == "step":
        made_by = {name: [rows.off(march(exact, name, t, parts))] for name in STEPS if name != made.mistake}
        return made_by | {"time shift": [late]}
    if kind == "attitude":
        h = (t[1] - t[0]) / parts
        w = exact.solve(np.arange((len(t) - 1) * parts + 1) * h)[:, 4:]
        turned = {name: integrate(rule, E[0, :4], w, h, parts) for name, rule in ATTITUDES.items() if name != made.mistake}
        return {name: [rows.off(np.hstack([q, E[:, 4:]]))] for name, q in turned.items()}
    if made.mistake in ("another body", "body axes"):
        return {"phase drift": [late, (np.arange(len(t))[:, None] * late.reshape(len(t), -1)).ravel()]}
    return {"time shift": [late]} if made.mistake in ("damping", "phase drift") else {}
