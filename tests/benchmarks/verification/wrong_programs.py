"""Programs with one planted mistake each, without code of the catalogue: `python wrong_programs.py NAME` speaks PROTOCOL.md."""

from __future__ import annotations

import math
import sys

try:
    from .right_programs import ZERO, Body, Program, diagonal, dot, inverse, multiply, product, serve, transpose
except ImportError:  # as a script
    from right_programs import ZERO, Body, Program, diagonal, dot, inverse, multiply, product, serve, transpose


class WrongSide(Program):
    key = "wrong side"

    def turning(self, a, w):
        return [x / 2 for x in product([0.0, *w], a)]


class FactorForgotten(Program):
    key = "factor one half"

    def turning(self, a, w):
        return product(a, [0.0, *w])


class NoGyroscopicTerm(Program):
    key = "no gyroscopic term"

    def gyroscopic(self, M, w):
        return ZERO


class GyroscopicSign(Program):
    key = "sign of the gyroscopic term"

    def gyroscopic(self, M, w):
        return [-x for x in super().gyroscopic(M, w)]


class InertiaInverted(Program):
    key = "inverted inertia"

    def setup(self, body, R0):
        super().setup(body, R0)
        self.J, self.inverse = self.inverse, self.J


class NoProducts(Program):
    key = "no products of inertia"

    def setup(self, body, R0):
        super().setup(body, R0)
        self.J = diagonal([body.J[i][i] for i in range(3)])
        self.inverse = inverse(self.J)


class InWorldAxes(Program):
    """The body components of the inertia are used in world axes, or the world components of the start are kept."""

    def __init__(self, key, *design):
        super().__init__(*design)
        self.key = key

    def inertia(self, R):
        A = self.J
        if self.key == "inertia of the start":
            A = multiply(self.start, multiply(A, transpose(self.start)))
        J = multiply(transpose(R), multiply(A, R))
        return J, inverse(J)


class Changed(Program):
    """A program that changes the rates after each step."""

    def __init__(self, key, change, *design):
        super().__init__(*design)
        self.key, self.change_rates = key, change

    def after(self, y, h):
        y = super().after(y, h)
        return y[: self.size] + self.change_rates(y[self.size :], h)


def limited(w, h):
    speed = math.sqrt(dot(w, w))
    return [x * min(1.0, 7.0 / speed) if speed else x for x in w]


def asleep(w, h):
    return ZERO if math.sqrt(dot(w, w)) < 0.05 else w


class Sleeping(Program):
    """A program that stops a body whose speed was below a threshold for a time, rad/s and s."""

    key = "sleep"

    def __init__(self, threshold, time, *design):
        super().__init__(*design)
        self.threshold, self.time = threshold, time

    def setup(self, body, R0):
        super().setup(body, R0)
        self.below = 0.0

    def step(self, t, y, h):
        return y[: self.size] + ZERO if self.below >= self.time else super().step(t, y, h)

    def after(self, y, h):
        y = super().after(y, h)
        w = y[self.size :]
        self.below = self.below + h if math.sqrt(dot(w, w)) < self.threshold else 0.0
        return y[: self.size] + ZERO if self.below >= self.time else y


class SlowTurn(Program):
    """A program that turns the attitude by less than a limit in a step, rad, and keeps the rates."""

    key = "rate limit"

    def step(self, t, y, h):
        w = y[self.size :]
        most = math.pi / 4 / max(h * math.sqrt(dot(w, w)), 1e-300)
        after = super().step(t, y, h)
        return after if most >= 1 else self.turned(y[: self.size], [h * most * x for x in w]) + after[self.size :]


class AsInstalled(Sleeping):
    """Three habits that engines of games have at once."""

    key = "no gyroscopic term + damping"

    def gyroscopic(self, M, w):
        return ZERO

    def after(self, y, h):
        y = super().after(y, h)
        return y[: self.size] + [x * (1 - 0.05 * h) for x in y[self.size :]]


class Answering(Program):
    """A program that reports other numbers than it has."""

    def __init__(self, key, answer, *design):
        super().__init__(*design)
        self.key, self.report = key, answer

    def answer(self, q, w):
        return self.report(q, w)


def in_world(q, w):
    return product(product(q, [0.0, *w]), [q[0], -q[1], -q[2], -q[3]])[1:]


class HalfAStepLate(Program):
    key = "half a step late"

    def states(self, body, q, w, h, steps):
        self.setup(body, self.R(list(q)))
        y = self.begin(q, w)
        out, wanted = [], set(steps)
        y, t = self.after(self.step(0.0, y, -h / 2), -h / 2), -h / 2
        for n in range(max(steps) + 1):
            if n in wanted:
                out.append((y[:4], y[4:]))
            y, t = self.after(self.step(t, y, h), h), t + h
        return out


class StaleRates(Program):
    key = "stale rates"

    def step(self, t, y, h):
        return self.turned(y[:4], [h * x for x in y[4:]]) + super().step(t, y, h)[4:]


class OtherBody(Program):
    """A program that reads another body."""

    def __init__(self, key, change, *design):
        super().__init__(*design)
        self.key, self.read = key, change

    def setup(self, body, R0):
        super().setup(Body(**{**vars(body), **self.read(body)}), R0)


class FieldSign(Program):
    key = "sign of the field"

    def field(self, t, R):
        return [-x for x in super().field(t, R)]


class OfLowerOrder(Program):
    key = "explicit Euler"

    def __init__(self):
        super().__init__("explicit Euler")
        self.order = 2


def wrong_programs():
    """Return programs by name. `key` is the mistake in the catalogue; the rest is as in right_programs."""
    rk2, rk4 = ("midpoint",), ("RK4",)
    made = {
        "wrong side": WrongSide(*rk2),
        "factor 1/2": FactorForgotten(*rk4),
        "no gyroscopic term": NoGyroscopicTerm(*rk2),
        "sign of the gyroscopic term": GyroscopicSign(*rk4),
        "inertia inverted": InertiaInverted(*rk2),
        "no products of inertia": NoProducts(*rk2),
        "inertia in world axes": InWorldAxes("inertia in world axes", *rk2),
        "inertia of the start": InWorldAxes("inertia of the start", *rk2),
        "damping 0.1": Changed("damping", lambda w, h: [x * math.exp(-0.1 * h) for x in w], *rk2),
        "damping 0.02": Changed("damping", lambda w, h: [x * (1 - 0.02 * h) for x in w], *rk2),
        "limit": Changed("rate limit", limited, *rk2),
        "dead band": Changed("dead band", lambda w, h: [x if abs(x) >= 0.01 else 0.0 for x in w], *rk2),
        "sleep": Changed("sleep", asleep, *rk2),
        "transposed": Answering("transposed", lambda q, w: ([q[0], -q[1], -q[2], -q[3]], w), *rk2),
        "order xyzw": Answering("order xyzw", lambda q, w: ([*q[1:], q[0]], w), *rk4),
        "world rates": Answering("world rates", lambda q, w: (q, in_world(q, w)), *rk2),
        "reversed rates": Answering("reversed rates", lambda q, w: (q, [-x for x in w]), *rk2),
        "rates in degrees": Answering("rates in degrees", lambda q, w: (q, [math.degrees(x) for x in w]), *rk2),
        "half a step late": HalfAStepLate(*rk2),
        "stale rates": StaleRates(*rk2),
        "explicit Euler": OfLowerOrder(),
        "without the rotor": OtherBody("without the rotor", lambda body: {"rotor": ZERO}, *rk2),
        "sign of the rotor": OtherBody("sign of the rotor", lambda body: {"rotor": [-x for x in body.rotor]}, *rk2),
        "axes of the torque": OtherBody(
            "axes of the torque", lambda body: {"torque_B": body.torque_W, "torque_W": body.torque_B}, *rk2
        ),
        "without the field": OtherBody("without the field", lambda body: {"arm": ZERO, "gradient": None}, *rk2),
        "sign of the field": FieldSign(*rk2),
        "turning of the field": OtherBody("turning of the field", lambda body: {"turn": ZERO}, *rk2),
    }
    return made


def limited_to(most, of=lambda w, h: math.sqrt(dot(w, w))):
    """Return the change of rates whose size, by default rad/s, is limited."""
    return lambda w, h: [x * min(1.0, most / max(of(w, h), 1e-300)) for x in w]


def of_turn(w, h):
    return h * math.sqrt(dot(w, w))


def habits():
    """Return programs with limits, sleep, dead bands and cut-offs of small bodies, which fast, slow and small bodies show."""
    rk2, euler = ("midpoint",), ("semi-implicit Euler",)
    made = {}
    for name, design in (("rk2", rk2), ("euler", euler)):
        for most in (7, 47, 100, 500):
            made[f"limit {most} {name}"] = Changed("rate limit", limited_to(most), *design)
        made[f"limit of a component {name}"] = Changed(
            "rate limit per component", lambda w, h: [max(-100.0, min(100.0, x)) for x in w], *design
        )
        made[f"turn {name}"] = Changed("rate limit", limited_to(math.pi / 4, of_turn), *design)
        made[f"turn of the attitude {name}"] = SlowTurn(*design)
        for threshold in (0.001, 0.05, 0.8):
            made[f"sleep {threshold:g} {name}"] = Sleeping(threshold, 0.5, *design)
        made[f"late sleep {name}"] = Sleeping(0.05, 2.0, *design)
        for band in (1e-5, 1e-3, 0.1):
            made[f"band {band:g} {name}"] = Changed(
                "dead band", lambda w, h, band=band: [x if abs(x) >= band else 0.0 for x in w], *design
            )
        made[f"smallest moments {name}"] = OtherBody(
            "smallest moments", lambda body: {"J": diagonal([max(body.J[i][i], 1e-6) for i in range(3)])}, *design
        )
        made[f"small inertia {name}"] = OtherBody(
            "smallest moments",  # a ball in both cases
            lambda body: {"J": diagonal([1.0] * 3)} if math.hypot(*(body.J[i][i] for i in range(3))) < 1e-6 else {},
            *design,
        )
        made[f"as installed {name}"] = AsInstalled(0.05, 0.5, *design)
    return made


if __name__ == "__main__":
    serve((wrong_programs() | habits())[sys.argv[1]], sys.argv[1])
