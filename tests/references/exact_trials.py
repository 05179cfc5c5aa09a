"""Random free bodies and tops, also next to separatrices and poles, in closed form and by multi-precision integration.

Both sides get the same doubles and take them as exact. The error of tops is the rounding of their tensors: a body that is
symmetric in random axes is not quite symmetric in doubles.
"""

from dataclasses import dataclass, replace

import mpmath
import numpy as np

import conservative as cv
from conservative.attitude import angle_between, from_quaternion, rotation_about, to_quaternion
from conservative.references import precise
from conservative.references.exact.lagrange_top import nutation, nutation_phase, top
from conservative.references.exact.method import free_body, lagrange_top
from conservative.references.exact.start import InitialState

from ..bodies import impossible_body

FREE_BOUND, TOP_BOUND = 1e-13, 1e-12  # claimed at any time: attitudes, rad, and rates relative to the largest one
# Of the integration, and of one near a separatrix. The motions are integrable: a distance d from the separatrix costs the
# digits of 1/d^2 once, not at every reversal.
BITS, NEAR_BITS = 128, 192


def states_in_digits(inertia, q0, w0, t, moment_B=None, bits=256):
    """Return quaternions and body rates at times (n,) as multi-precision numbers.

    Numbers are floats (exact), `mpmath.mpf` or texts; moments are (3,) or (3, 3), the moment of the weight is (3,) N m.
    """
    diagonal = [[x if i == j else 0 for j in range(3)] for i, x in enumerate(inertia)]
    field = None if moment_B is None else precise.FIELDS[cv.UniformGravity]
    solve = precise._solver(
        inertia if np.ndim(inertia) == 2 else diagonal, q0, w0, field, (0.0, 0.0, 0.0, *(moment_B or ())), bits
    )
    _, _, reals = solve(precise._reals([0, *t], bits), None)
    with precise._digits(bits) as mp:
        rows = [[mpmath.mp.make_mpf(mp.mpf(str(x))._mpf_) for x in row] for row in reals[1:]]
    return [row[:4] for row in rows], [row[4:] for row in rows]


@dataclass(frozen=True, eq=False)
class Trial:
    """A body, a field or None, a start, times (n,), s, and the bits that an integration needs."""

    body: cv.RigidBody
    potential: cv.UniformGravity | None
    R_WB0: np.ndarray
    w_WB_B0: np.ndarray
    t: np.ndarray
    bits: int = BITS

    def solve(self, t):
        if self.potential is None:
            return free_body(self.body, self.R_WB0, self.w_WB_B0, t)
        return lagrange_top(self.body, self.potential, self.R_WB0, self.w_WB_B0, t)

    def integrate(self):
        moment = None if self.potential is None else self.potential.moment_B.tolist()
        q0, w0 = to_quaternion(self.R_WB0).tolist(), self.w_WB_B0.tolist()
        q, w = states_in_digits(self.body.inertia.tolist(), q0, w0, self.t.tolist(), moment, self.bits)
        return from_quaternion(np.array(q, dtype=float)), np.array(w, dtype=float)

    def errors(self):
        """Return the largest attitude error, rad, and the largest error of the rates relative to the largest rate."""
        (R, w), (R_true, w_true) = self.solve(self.t), self.integrate()
        fastest = np.abs(w_true).max() or 1.0
        return float(angle_between(R_true, R).max()), float(np.abs(w - w_true).max() / fastest)

    def pole_distance(self, t):
        """Return the angle, rad, between the line through the centre of mass and the vertical."""
        x, y, _ = self.solve([t])[0][0] @ (self.potential.moment_B / np.linalg.norm(self.potential.moment_B))
        return float(np.hypot(x, y))


def random_rotation(rng):
    q = rng.normal(size=4)
    return from_quaternion(q / np.linalg.norm(q))


def log_uniform(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def turn_axes(rng, moments):
    """Return a body in random axes, one time in three its principal ones, and `R_BP`."""
    R_BP = np.eye(3)[rng.permutation(3)] if rng.random() < 1 / 3 else random_rotation(rng)
    R_BP = R_BP * np.linalg.det(R_BP)
    tensor = R_BP @ np.diag(moments) @ R_BP.T
    return impossible_body((tensor + tensor.T) / 2), R_BP


def draw_free(rng, separatrix=None, physical=False):
    """Return a free body over 20 rad, or over 60 rad one that starts at a relative distance from the separatrix.

    If `physical`, the moments are those of a mass distribution: none is larger than the sum of the others.
    """
    parts = np.array([log_uniform(rng, 0.1, 10) for _ in range(3)])
    moments = np.sort(parts.sum() - parts if physical else parts) * log_uniform(rng, 1e-4, 1e4)
    body, R_BP = turn_axes(rng, moments)
    w = rng.normal(size=3)
    if separatrix is not None:
        a, b, c = moments
        # 2 T J2 = |L|^2, and then off it: towards the unstable axis as often as anywhere on the separatrix.
        w[0] *= 1 if rng.random() < 0.5 else np.sqrt(separatrix)
        w[2] = w[0] * np.sqrt(a * (b - a) / (c * (c - b))) * (1 + separatrix * rng.choice([-1, 1]))
    speed = log_uniform(rng, 1e-2, 1e2)
    w *= speed / np.linalg.norm(w)
    angle, bits = (20.0, BITS) if separatrix is None else (60.0, NEAR_BITS)
    return Trial(body, None, random_rotation(rng), R_BP @ w, np.sort(rng.uniform(0, angle / speed, size=24)), bits)


def draw_top(rng, pole=None):
    """Return a top over some four nutations, or one that passes a pole at a distance of about `pole`, rad, at its last time."""
    J1, J3 = log_uniform(rng, 0.2, 5), log_uniform(rng, 0.2, 5)
    body, R_BP = turn_axes(rng, np.array([J1, J1, J3]))
    k = log_uniform(rng, 0.1, 10)
    tilt, w_1, w_3 = rng.uniform(0.3, 2.8), rng.normal() * np.sqrt(k), rng.normal() * log_uniform(rng, 0.3, 30) * np.sqrt(k)
    w_2, b3 = rng.normal() * np.sqrt(k), J3 * w_3 / J1
    if pole is not None:
        # About the vertical the momentum of the pole itself, b_z = +-b3, and enough energy to reach it.
        side, u = rng.choice([-1, 1]), np.cos(tilt)
        w_2 = b3 * (side - u) / np.sin(tilt) + pole * np.sqrt(k)
        w_1 = np.sqrt(w_1**2 + (4 * k if side > 0 else 0) + b3**2)
    first, last = (rotation_about((0, 0, 1), angle) for angle in rng.uniform(0, 2 * np.pi, size=2))
    R_WP, w_P = first @ rotation_about((1, 0, 0), tilt) @ last, last.T @ [w_1, w_2, w_3]
    weight = float(rng.choice([-1, 1])) * log_uniform(rng, 0.1, 10)
    potential = cv.UniformGravity(weight, R_BP @ [0, 0, k * J1 / weight])
    t = np.sort(rng.uniform(0, 8 * np.pi / np.sqrt(4 * k + w_1**2 + w_2**2), size=24))
    trial = Trial(body, potential, R_WP @ R_BP.T, R_BP @ w_P, t)
    if pole is None:
        return trial
    start = top(InitialState(body, trial.R_WB0, trial.w_WB_B0), potential.moment_B, potential.moment_B)
    clock = nutation_phase(start, nutation(start))
    passages = [float(((n / 2) * clock.period - clock.start) / clock.rate) for n in range(3)]
    passage = min((time for time in passages if time > 0), key=trial.pole_distance)
    return replace(trial, t=np.append(t[t < passage], passage))
