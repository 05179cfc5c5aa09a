"""Integrators of every common design, for many motions at once: an attitude, a variable of rotation, and a step.

They share no code with the methods of this package and with the catalogue of mistakes: the tolerances of motions are measured
with them. All numbers of a motion are in units of its step and its largest moment, so that single precision does not overflow.
The steps are compiled (`steps`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from conservative.attitude import Array

from .motion import Motion
from .steps import (
    ADAMS,
    ARM,
    AXES,
    BODY,
    COMPOSED,
    CORRECTED,
    DAMPING,
    EXTRAPOLATED,
    GAUSS,
    IMPLICIT,
    INVERSE,
    MEAN,
    MOMENTS,
    NEW,
    OLD,
    ORBIT,
    QUATERNION,
    RATES_0,
    ROTOR,
    SEMI_IMPLICIT,
    SIZE,
    SPLIT_TWICE,
    SPLITTING,
    TABLEAU,
    TRAPEZOID,
    TURNED,
    WORLD,
    J,
    Rule,
    advance,
    begin,
)

ATTITUDES, VARIABLES = ("quaternion", "matrix"), ("rates", "momentum", "world rates", "world momentum")
"""The attitude of a state, and its other part: rates or momentum in body axes, or in world axes."""


class Bodies(NamedTuple):
    """The numbers of motions (motions, `steps.SIZE`) in units of their steps and largest moments.

    `unit` are the steps (motions,), s. `ends` are the numbers of steps of 0.1 rad after which there are samples, of one motion
    after the other; those of motion i begin at first[i].
    """

    numbers: Any
    unit: Any
    ends: Any
    first: Any


def gather(motions: Sequence[Motion], single: bool = False) -> Bodies:
    """Return the bodies of motions, in single or double precision."""
    unit = np.array([motion.step for motion in motions])
    ends = [[n * motion.steps for n in range(1, motion.samples + 1)] for motion in motions]
    numbers = np.array([_numbers(motion) for motion in motions]).astype(np.float32 if single else np.float64)
    return Bodies(numbers, unit, np.concatenate(ends), np.cumsum([0, *map(len, ends)]))


def _numbers(motion: Motion) -> Array:
    """Return the numbers of a motion, in their places."""
    inertia, unit, none = np.array(motion.inertia_B), motion.step, np.zeros(3)
    moments, axes = np.linalg.eigh(inertia)
    size = moments[2]
    torque, momentum = unit**2 / size, unit / size
    loaded = bool({*motion.features} - {"rotor"})
    parts = (
        (J, inertia / size),
        (INVERSE, np.linalg.inv(inertia) * size),
        (DAMPING, np.array(np.zeros((3, 3)) if motion.damping is None else motion.damping) * momentum),
        (AXES, axes),
        (MOMENTS, moments / size),
        (ROTOR, np.array(motion.rotor_momentum_B or none) * momentum),
        (BODY, np.array(motion.torque_B or none) * torque),
        (WORLD, np.array(motion.torque_W or none) * torque),
        (ARM, np.array(motion.arm) * torque),
        (QUATERNION, motion.exact["quaternion_wxyz"][0]),
        (RATES_0, np.array(motion.rates) * unit),
        (ORBIT, np.array([(motion.orbit or 0.0) * unit, loaded, 0.5, 0.0])),
    )
    out = np.zeros(SIZE)
    for place, values in parts:
        flat = np.ravel(values)
        out[place : place + len(flat)] = flat
    return out


def _rule(
    kind: int,
    A: Sequence[Sequence[float]] = (),
    b: Sequence[float] = (),
    at: float = 0.0,
    use: int = OLD,
    exact: bool = False,
    sweeps: int = 1,
) -> Rule:
    table = np.zeros((len(b), len(b)))
    for i, row in enumerate(A):
        table[i + 1, : len(row)] = row
    return Rule(kind, table, np.array(b, dtype=float), at, use, exact, sweeps)


RK4 = (((0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6))
EIGHTHS = (((1 / 3,), (-1 / 3, 1.0), (1.0, -1.0, 1.0)), (1 / 8, 3 / 8, 3 / 8, 1 / 8))
"""Rows of A, and b, of Runge and Kutta's rules of order 4: the classical one, and the rule of three eighths."""
STEPS: dict[int, dict[str, Rule]] = {
    1: {
        "explicit Euler": _rule(TABLEAU, (), (1.0,)),
        "explicit Euler with the exponential map": _rule(SEMI_IMPLICIT, use=OLD, exact=True),
        "semi-implicit Euler": _rule(SEMI_IMPLICIT, use=NEW),
        "semi-implicit Euler with the exponential map": _rule(SEMI_IMPLICIT, use=NEW, exact=True),
        "semi-implicit Euler with an implicit torque": _rule(SEMI_IMPLICIT, use=NEW, sweeps=20),
        "mean rates": _rule(SEMI_IMPLICIT, use=MEAN, exact=True),
        "implicit Euler": _rule(IMPLICIT, at=1.0),
    },
    2: {
        "explicit midpoint": _rule(TABLEAU, ((0.5,),), (0.0, 1.0)),
        "Heun": _rule(TABLEAU, ((1.0,),), (0.5, 0.5)),
        "Ralston": _rule(TABLEAU, ((2 / 3,),), (0.25, 0.75)),
        "explicit midpoint with the exponential map": _rule(TURNED, ((0.5,),), (0.0, 1.0)),
        "Heun with the exponential map": _rule(TURNED, ((1.0,),), (0.5, 0.5)),
        "implicit midpoint": _rule(IMPLICIT, at=0.5),
        "trapezoid": _rule(TRAPEZOID),
        "Adams-Bashforth": _rule(ADAMS),
        "splitting": _rule(SPLITTING),
    },
    4: {
        "RK4": _rule(TABLEAU, *RK4),
        "3/8": _rule(TABLEAU, *EIGHTHS),
        "RK4 on rotation vectors (Munthe-Kaas)": _rule(CORRECTED, *RK4),
        "Gauss": _rule(GAUSS),
        "composed implicit midpoint": _rule(COMPOSED),
        "composed splitting": _rule(SPLIT_TWICE),
        "extrapolated implicit midpoint": _rule(EXTRAPOLATED),
    },
}
"""The steps by their order."""
GROWS = {"explicit Euler", "semi-implicit Euler", "semi-implicit Euler with an implicit torque", "implicit Euler"}
"""Steps that change the norm of an attitude in order 1: they are not right without normalisation."""
KEPT = {
    "implicit midpoint",
    "trapezoid",
    "Gauss",
    "composed implicit midpoint",
    "composed splitting",
    "extrapolated implicit midpoint",
}
"""Steps that keep the norm much better than their order says: normalisation changes nothing."""


@dataclass(frozen=True)
class Design:
    """A right program."""

    order: int
    step: str
    attitude: str
    variable: str
    normalised: bool
    single: bool = False

    @property
    def name(self) -> str:
        """The design in words."""
        parts = [self.step, self.attitude, self.variable, *["never normalised"] * (not self.normalised)]
        return ", ".join([*parts, *["single"] * self.single])

    def samples(self, bodies: Bodies, parts: int, after: Callable[[Array], Array] | None = None) -> tuple[Array, Array]:
        """Return attitudes (n, 3, 3) and rates (n, 3), rad/s, of all samples, by steps of 0.1 rad over `parts`.

        `after` is a habit: it changes rates (3, motions), rad/s, after each step. The variable of rotation is then the rates.
        """
        kind, count = bodies.numbers.dtype.type, len(bodies.unit)
        rule = STEPS[self.order][self.step]
        rule = rule._replace(A=rule.A.astype(kind), b=rule.b.astype(kind), at=kind(rule.at))
        y = np.zeros((count, 7 if self.attitude == "quaternion" else 12), kind)
        before, R, w = np.zeros_like(y), np.empty((len(bodies.ends), 3, 3)), np.empty((len(bodies.ends), 3))
        variable, end = VARIABLES.index(self.variable), int(bodies.ends.max()) * parts
        with np.errstate(all="ignore"):
            begin(bodies.numbers, variable, y)
            for first, last in [(0, end + 1)] if after is None else [(n, n + 1) for n in range(end + 1)]:
                advance(bodies, variable, rule, self.normalised, parts, first, last, y, before, R, w)
                if after is not None:
                    y[:, -3:] = (after(y[:, -3:].T / bodies.unit) * bodies.unit).T
        return R, w / np.repeat(bodies.unit, np.diff(bodies.first))[:, None]

    def run(
        self, motions: Sequence[Motion], parts: int, after: Callable[[Array], Array] | None = None
    ) -> Iterator[tuple[Array, Array]]:
        """Yield attitudes (samples, 3, 3) and rates (samples, 3) of each motion; see `samples`."""
        bodies = gather(motions, self.single)
        R, w = self.samples(bodies, parts, after)
        for a, b in pairwise(bodies.first):
            yield R[a:b], w[a:b]


def designs(order: int, single: bool = False) -> list[Design]:
    """Return the right programs of an order."""
    return [
        Design(order, step, attitude, variable, normalised, single)
        for step in STEPS[order]
        for attitude in ATTITUDES
        for variable in VARIABLES
        for normalised in (True, False)
        if (normalised or step not in GROWS | KEPT) and not ("world" in variable and "splitting" in step)
    ]
