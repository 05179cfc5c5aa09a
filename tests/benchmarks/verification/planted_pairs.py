"""Pairs of back ends with planted mistakes, as functions of `cv.verification.parity`: one wrong, both wrong, and both right."""

from __future__ import annotations

from functools import partial

import numpy as np

from conservative.attitude import to_quaternion
from conservative.benchmarks.verification import BackEnd

from .right_programs import Body, matrix, right_programs
from .wrong_programs import habits, wrong_programs

LOADED = (
    "without the rotor", "sign of the rotor", "axes of the torque", "without the field", "sign of the field",
    "turning of the field",
)  # fmt: skip
"""Mistakes that no free body shows; functions get free bodies."""
RIGHT = right_programs()
WRONG = {name: program for name, program in wrong_programs().items() if name not in LOADED}
HABITS = habits()
SOME_HABITS = (
    "limit 47 rk2", "limit 100 euler", "limit of a component rk2", "turn rk2", "turn of the attitude euler", "sleep 0.001 rk2",
    "sleep 0.8 euler", "sleep 0.05 rk2", "late sleep rk2", "band 0.001 euler", "band 0.1 rk2", "smallest moments rk2",
    "smallest moments euler", "small inertia euler", "as installed rk2", "as installed euler", "limit 500 euler",
    "limit 7 euler", "turn euler",
)  # fmt: skip
"""Habits of engines that are planted as one of two."""


def simulate(program, R0, w0, inertia, dt, n):
    """Return attitudes (n + 1, 3, 3) and rates (n + 1, 3) of a program."""
    found = program.states(Body(inertia.tolist()), to_quaternion(R0).tolist(), w0.tolist(), dt, range(n + 1))
    return np.array([matrix(q) for q, _ in found]), np.array([w for _, w in found])


def back_end(program, name):
    """Return a program as a back end, with the order that it declares."""
    precision = "single" if program.single else "double"
    return BackEnd(partial(simulate, program), name, order=program.order, precision=precision)


def pairs():
    """Return the planted pairs by name: the first and the second program, and the keys of their mistakes, "" for none."""
    made, partners = {}, list(RIGHT.items())
    one_wrong = {**WRONG, **{name: HABITS[name] for name in SOME_HABITS}}
    for k, (name, program) in enumerate(one_wrong.items()):
        _, partner = partners[k % len(partners)]
        sides = (program, partner) if k % 2 else (partner, program)
        keys = (program.key, "") if k % 2 else ("", program.key)
        made[f"one: {name}"] = (*sides, *keys)
    wrong = list(WRONG.values())
    for k in range(7):
        a, b = wrong[k], wrong[(k + 5) % len(wrong)]
        made[f"both: {k} {a.key}, {b.key}"] = (a, b, a.key, b.key)
    for k in (2, 9, 13):
        made[f"same: {wrong[k].key}"] = (wrong[k], wrong[k], wrong[k].key, wrong[k].key)
    for k in range(10):
        a, b = partners[k][1], partners[(k + 7) % len(partners)][1]
        made[f"right: {partners[k][0]}, {partners[(k + 7) % len(partners)][0]}"] = (a, b, "", "")
    return made
