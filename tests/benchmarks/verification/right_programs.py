"""Right programs of every common design, in plain Python: `python right_programs.py NAME` speaks PROTOCOL.md.

A design is an attitude (quaternion or matrix), a variable of rotation (rates in body axes, momentum in body or in world axes),
a step, and whether the attitude is normalised after each step. `wrong_programs` overrides parts of `Program` to plant mistakes.
"""

from __future__ import annotations

import array
import json
import math
import sys
import time
from dataclasses import dataclass, field

ZERO = [0.0, 0.0, 0.0]
EXPLICIT = {  # A by rows, b
    "explicit Euler": ([[]], [1.0]),
    "midpoint": ([[], [0.5]], [0.0, 1.0]),
    "Heun": ([[], [1.0]], [0.5, 0.5]),
    "Ralston": ([[], [2 / 3]], [0.25, 0.75]),
    "RK4": ([[], [0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6]),
    "3/8": ([[], [1 / 3], [-1 / 3, 1.0], [1.0, -1.0, 1.0]], [1 / 8, 3 / 8, 3 / 8, 1 / 8]),
}
ORDERS = {"semi-implicit Euler": 1, "implicit Euler": 1, "explicit Euler": 1, "RK4": 4, "3/8": 4, "RKMK": 4}  # others have 2


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def apply(M, v):
    return [row[0] * v[0] + row[1] * v[1] + row[2] * v[2] for row in M]


def back(M, v):
    return [M[0][i] * v[0] + M[1][i] * v[1] + M[2][i] * v[2] for i in range(3)]


def multiply(A, B):
    return [back(B, row) for row in A]


def transpose(M):
    return [list(column) for column in zip(*M, strict=True)]


def diagonal(v):
    return [[v[i] if i == k else 0.0 for k in range(3)] for i in range(3)]


def inverse(M):
    columns = [cross(M[1], M[2]), cross(M[2], M[0]), cross(M[0], M[1])]
    determinant = dot(M[0], columns[0])
    return [[columns[k][i] / determinant for k in range(3)] for i in range(3)]


def add(a, b, scale=1.0):
    return [x + scale * y for x, y in zip(a, b, strict=True)]


def product(p, q):
    a, b, c, d = p
    w, x, y, z = q
    return [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w]  # fmt: skip


def exponential(turn):
    """Return the unit quaternion of a rotation vector."""
    angle = math.sqrt(dot(turn, turn))
    size = math.sin(angle / 2) / angle if angle > 1e-8 else 0.5 - angle * angle / 48
    return [math.cos(angle / 2), *(size * x for x in turn)]


def matrix(q):
    """Return the matrix of a quaternion of any norm."""
    w, x, y, z = q
    n = w * w + x * x + y * y + z * z or math.nan  # rates that overflow
    M = [[w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
         [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
         [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]]  # fmt: skip
    return [[each / n for each in row] for row in M]


def quaternion(R):
    """Return the unit quaternion of a matrix, its largest component positive."""
    trace = R[0][0] + R[1][1] + R[2][2]
    best = max(range(4), key=lambda k: trace if k == 0 else R[k - 1][k - 1])
    if best == 0:
        q = [1 + trace, R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]]
    else:
        i = best - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [R[k][j] - R[j][k], 0.0, 0.0, 0.0]
        q[1 + i], q[1 + j], q[1 + k] = 1 + R[i][i] - R[j][j] - R[k][k], R[j][i] + R[i][j], R[k][i] + R[i][k]
    return unit(q)


def unit(q):
    size = math.sqrt(sum(x * x for x in q))
    return [x / size for x in q]


def hat(w):
    return [[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]]


def principal(J):
    """Return the moments and axes (columns) of an inertia by Jacobi rotations."""
    A, V = [list(row) for row in J], diagonal([1.0, 1.0, 1.0])
    for _ in range(30):
        for i, k in ((0, 1), (0, 2), (1, 2)):
            if A[i][k] == 0:
                continue
            angle = 0.5 * math.atan2(2 * A[i][k], A[k][k] - A[i][i])
            G = diagonal([1.0, 1.0, 1.0])
            G[i][i] = G[k][k] = math.cos(angle)
            G[i][k], G[k][i] = math.sin(angle), -math.sin(angle)
            A, V = multiply(transpose(G), multiply(A, G)), multiply(V, G)
    return [A[i][i] for i in range(3)], V


@dataclass
class Body:
    """A body and its loads, body axes unless named `_W`."""

    J: list
    rotor: list = field(default_factory=lambda: ZERO)
    torque_B: list = field(default_factory=lambda: ZERO)
    torque_W: list = field(default_factory=lambda: ZERO)
    damping: list = field(default_factory=lambda: diagonal(ZERO))
    arm: list = field(default_factory=lambda: ZERO)  # weight times centre of mass, N m
    gradient: list | None = None  # V = u' gradient u / 2 of the direction u, which turns in the world
    direction: list = field(default_factory=lambda: [1.0, 0.0, 0.0])
    turn: list = field(default_factory=lambda: ZERO)


def of_motion(m):
    """Return the body of a motion of references/motions (the keys of its JSON file)."""
    orbit, J = m.get("orbit", 0.0), m["inertia_B"]
    return Body(
        J, m.get("rotor_momentum_B", ZERO), m.get("torque_B", ZERO), m.get("torque_W", ZERO), m.get("damping", diagonal(ZERO)),
        [m.get("weight", 0.0) * x for x in m.get("com_B", ZERO)],
        [[3 * orbit**2 * x for x in row] for row in J] if orbit else None, turn=[0.0, 0.0, orbit],
    )  # fmt: skip


def of_request(given):
    """Return the body of a request `prepare`."""
    arm = [given["mass"] * given["gravity"] * x for x in given["com"]]
    gradient = given["gradient"] if any(any(row) for row in given["gradient"]) else None
    return Body(diagonal(given["moments"]), given.get("rotor", ZERO), arm=arm, gradient=gradient,
                direction=given["direction"], turn=given["turn"])  # fmt: skip


class Program:
    """A program of one design; it solves one body at a time."""

    key = ""
    """Key of the planted mistake."""

    def __init__(self, step, attitude="quaternion", variable="rates", normalised=True, single=False):
        self.method, self.attitude, self.variable = step, attitude, variable
        self.normalised, self.single = normalised, single
        self.order = ORDERS.get(step, 2)
        self.size = 4 if attitude == "quaternion" else 9

    # The body and its equations

    def setup(self, body, R0):
        self.body, self.J, self.inverse, self.start = body, body.J, inverse(body.J), R0
        if self.method == "splitting":
            self.moments, self.axes = principal(body.J)

    def inertia(self, R):
        """Return the inertia and its inverse, body axes."""
        return self.J, self.inverse

    def R(self, y):
        return matrix(y[:4]) if self.size == 4 else [y[0:3], y[3:6], y[6:9]]

    def rates(self, R, v):
        """Return the rates in body axes from the variable of rotation."""
        if self.variable == "rates":
            return v
        M = back(R, v) if self.variable == "world momentum" else v
        return apply(self.inertia(R)[1], add(M, self.body.rotor, -1.0))

    def torque(self, t, R, w):
        """Return the torque in body axes."""
        b = self.body
        out = add(add(b.torque_B, back(R, b.torque_W)), apply(b.damping, w), -1.0)
        return add(out, self.field(t, R))

    def field(self, t, R):
        b = self.body
        out = cross(R[2], b.arm)
        if b.gradient is not None:
            rate = math.sqrt(dot(b.turn, b.turn))
            u = b.direction
            if rate:
                u = apply(matrix(exponential([t * x for x in b.turn])), u)
            u = back(R, u)
            out = add(out, cross(u, apply(b.gradient, u)))
        return out

    def turning(self, a, w):
        """Return the derivative of the attitude, flat."""
        if self.size == 4:
            return [x / 2 for x in product(a, [0.0, *w])]
        return [x for row in multiply([a[0:3], a[3:6], a[6:9]], hat(w)) for x in row]

    def change(self, t, R, v, w):
        """Return the derivative of the variable of rotation."""
        T, (J, inverted) = self.torque(t, R, w), self.inertia(R)
        if self.variable == "world momentum":
            return apply(R, T)
        M = add(apply(J, w), self.body.rotor) if self.variable == "rates" else v
        out = add(self.gyroscopic(M, w), T)
        return apply(inverted, out) if self.variable == "rates" else out

    def gyroscopic(self, M, w):
        return cross(M, w)

    def slope(self, t, y):
        R, v = self.R(y), y[self.size :]
        w = self.rates(R, v)
        return self.turning(y[: self.size], w) + self.change(t, R, v, w)

    # The steps

    def step(self, t, y, h):
        n = self.size
        if self.method in EXPLICIT:
            A, b = EXPLICIT[self.method]
            slopes = []
            for row in A:
                stage = y
                for a, k in zip(row, slopes, strict=True):
                    stage = add(stage, k, h * a) if a else stage
                slopes.append(self.slope(t + h * sum(row), stage))
            for a, k in zip(b, slopes, strict=True):
                y = add(y, k, h * a) if a else y
            return y
        if self.method == "semi-implicit Euler":
            y = y[:n] + add(y[n:], self.slope(t, y)[n:], h)
            return add(y[:n], self.slope(t, y)[:n], h) + y[n:]
        if self.method in ("implicit Euler", "implicit midpoint"):
            at = 1.0 if self.method == "implicit Euler" else 0.5
            stage = y
            for _ in range(60):
                before, stage = stage, add(y, self.slope(t + at * h, stage), at * h)
                if max(abs(p - q) for p, q in zip(stage, before, strict=True)) <= 1e-15 * max(map(abs, y)):
                    break
            return add(y, add(stage, y, -1.0), 1 / at)
        if self.method == "splitting":
            return self.split(t, y, h)
        return self.munthe_kaas(t, y, h)

    def turned(self, a, turn):
        """Return the attitude (flat) turned by a rotation vector in body axes."""
        q = exponential(turn)
        if self.size == 4:
            return product(a, q)
        return [x for row in multiply([a[0:3], a[3:6], a[6:9]], matrix(q)) for x in row]

    def munthe_kaas(self, t, y, h):
        n, slopes, turns = self.size, [], []
        A, b = EXPLICIT["RK4"]
        for row in [*A, b]:
            turn, v = ZERO, y[n:]
            for a, k, u in zip(row, slopes, turns, strict=True):
                turn, v = add(turn, u, h * a), add(v, k, h * a)
            stage = self.turned(y[:n], turn) + v
            if row is b:
                return stage
            R = self.R(stage)
            w = self.rates(R, v)
            slopes.append(self.change(t + h * sum(row), R, v, w))
            across = cross(turn, w)
            turns.append(add(add(w, across, 0.5), cross(turn, across), 1 / 12))

    def split(self, t, y, h):
        """Half a kick, rotations about the principal axes 1, 2, 3, 2, 1, half a kick (Dullweber et al. 1997)."""
        n = self.size
        a, R = y[:n], self.R(y)
        v = y[n:]
        M = back(R, v) if self.variable == "world momentum" else v if self.variable == "momentum" else add(
            apply(self.J, v), self.body.rotor
        )  # fmt: skip
        M = self.kick(t, R, M, h / 2)
        axes = transpose(self.axes)
        rotor = apply(axes, self.body.rotor)
        for i, share in ((0, 0.5), (1, 0.5), (2, 1.0), (1, 0.5), (0, 0.5)):
            angle = share * h * (dot(axes[i], M) - rotor[i]) / self.moments[i]
            turn = [angle * x for x in axes[i]]
            a, M = self.turned(a, turn), back(matrix(exponential(turn)), M)
        R = self.R(a)
        M = self.kick(t + h, R, M, h / 2)
        if self.variable == "world momentum":
            return a + apply(R, M)
        return a + (M if self.variable == "momentum" else apply(self.inverse, add(M, self.body.rotor, -1.0)))

    def kick(self, t, R, M, h):
        """Return the momentum after the torque at a fixed attitude, to order 2."""

        def torque(M):
            return self.torque(t, R, apply(self.inverse, add(M, self.body.rotor, -1.0)))

        return add(M, torque(add(M, torque(M), h / 2)), h)

    def after(self, y, h):
        """Return the state after a step, normalised and rounded."""
        n = self.size
        if self.normalised and n == 4:
            y = unit(y[:4]) + y[4:]
        elif self.normalised:
            x = unit(y[0:3])
            z = unit(cross(x, y[3:6]))
            y = x + cross(z, x) + z + y[9:]
        return list(array.array("f", y)) if self.single else y

    # A motion

    def begin(self, q, w):
        """Return the state of an attitude and rates; `setup` comes first."""
        R = matrix(q)
        M = add(apply(self.J, w), self.body.rotor)
        v = {"rates": w, "momentum": M, "world momentum": apply(R, M)}[self.variable]
        return (list(q) if self.size == 4 else [x for row in R for x in row]) + list(v)

    def answer(self, q, w):
        """Return the quaternion and the rates that the program reports."""
        return q, w

    def states(self, body, q, w, h, steps):
        """Return quaternions and rates after numbers of steps."""
        self.setup(body, matrix(q))
        y, out, wanted = self.begin(q, w), [], set(steps)
        for n in range(max(steps) + 1):
            if n in wanted:
                R = self.R(y)
                a = y[:4] if self.size == 4 else quaternion(R)
                out.append(self.answer(a, self.rates(R, y[self.size :])))
            y = self.after(self.step(n * h, y, h), h)
        return out

    def simulate(self, motion, h, steps, samples):
        """Return (quaternion, rates) of a motion (keys of its JSON file) after each `steps` steps, as test_rotation.py asks."""
        ends = [steps * n for n in range(1, samples + 1)]
        return self.states(of_motion(motion), motion["quaternion_wxyz0"], motion["w_WB_B0"], h, ends)

    def solve(self, motion, h, steps):
        """Return attitudes (n, 3, 3) and rates (n, 3) at the times of a motion, after each `steps` steps of h seconds."""
        import numpy as np

        found = self.simulate(motion, h, steps, len(motion["t"]))
        return np.array([matrix(q) for q, _ in found]), np.array([w for _, w in found], dtype=float)


def right_programs():
    """Return right programs by name; each has `order`, `single`, `solve(motion, h, steps)` and speaks PROTOCOL.md (`serve`)."""
    return {
        "midpoint, quaternion, world momentum": Program("midpoint", variable="world momentum"),
        "midpoint, matrix, rates": Program("midpoint", "matrix"),
        "midpoint, quaternion, momentum, never normalised": Program("midpoint", variable="momentum", normalised=False),
        "Heun, quaternion, rates": Program("Heun"),
        "Heun, matrix, world momentum": Program("Heun", "matrix", "world momentum"),
        "semi-implicit Euler, quaternion, rates": Program("semi-implicit Euler"),
        "semi-implicit Euler, quaternion, world momentum": Program("semi-implicit Euler", variable="world momentum"),
        "semi-implicit Euler, matrix, momentum": Program("semi-implicit Euler", "matrix", "momentum"),
        "implicit Euler, quaternion, rates": Program("implicit Euler"),
        "implicit midpoint, quaternion, momentum": Program("implicit midpoint", variable="momentum"),
        "splitting, quaternion, momentum": Program("splitting", variable="momentum"),
        "splitting, matrix, rates": Program("splitting", "matrix"),
        "RK4, quaternion, rates, never normalised": Program("RK4", normalised=False),
        "RK4, matrix, world momentum": Program("RK4", "matrix", "world momentum"),
        "RKMK, quaternion, rates": Program("RKMK"),
        "RKMK, matrix, world momentum, never normalised": Program("RKMK", "matrix", "world momentum", normalised=False),
        "midpoint, quaternion, world momentum, single": Program("midpoint", variable="world momentum", single=True),
        "RK4, quaternion, rates, single": Program("RK4", single=True),
    }  # fmt: skip


def serve(program, name):
    """Answer requests of PROTOCOL.md on stdin."""
    runs = []

    def integrate(given):
        found = program.states(of_request(given), given["q0"], given["w0"], given["dt"], given["steps"])
        return {"q": [list(q) for q, _ in found], "w": [list(w) for _, w in found]}

    for line in sys.stdin:
        request = json.loads(line)
        if request["do"] == "hello":
            engine = {"order": program.order, "precision": "f32" if program.single else "f64",
                      "fields": ["UniformGravity", "GravityGradient", "Turning"], "method_info": {"rotors": True}}  # fmt: skip
            answer = {"protocol": 1, "program": name, "version": "1", "framing": "lines", "engine": engine}
        elif request["do"] == "prepare":
            runs.append(request)
            answer = {"run": len(runs) - 1}
        elif request["do"] == "run":
            answer = integrate(runs[request["run"]])
        else:
            start = time.perf_counter()
            for _ in range(request["calls"]):
                integrate(runs[request["run"]])
            answer = {"seconds": time.perf_counter() - start}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    serve(right_programs()[sys.argv[1]], sys.argv[1])
