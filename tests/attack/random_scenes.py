"""Random scenes over all that a scene can consist of: fields, fields that depend on time, rotors, motors, loads and flight.

All bodies are in axes of no symmetry, with a full tensor and an attitude that is not the identity. Sizes are relative to the
initial motion: a torque changes it within a radian or so. A `THEME` is what a scene has for certain; the rest is drawn.

table       torques with corners, jumps and short pulses
stiff       damping that stops the body in a thousandth to a thirtieth of the run, and a torque that drives it
rotor       a rotor whose momentum is up to 300 times that of the body
motor table, motor function      a rotor that is accelerated; no motor makes a jump of its momentum
needle      moments up to 1e5 apart
units       masses of 1e-18 to 1e18 and times of 1e-6 to 1e6
turning     a field that turns
attitude    torque and damping in a magnetic field that depends on time
function    a potential of attitude, or of attitude and time
flight      a thrown body
any         nothing for certain
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ..independent import Case, matrix_of

THEMES = (
    *("table", "stiff", "rotor", "motor table", "motor function", "needle", "units", "turning", "attitude", "any"),
    *("table", "stiff", "motor table", "motor function", "needle", "any", "table", "flight", "attitude", "function"),
)
MOST_TURN = 200.0
"""Longest run, rad at the largest rate that the energy and the rotor allow."""


class Draw:
    """Random numbers of one scene."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng((36, seed))

    def between(self, low: float, high: float) -> float:
        """Return a log-uniform number."""
        return float(low * (high / low) ** self.random.random())

    def chance(self, share: float) -> bool:
        """Return True with a probability."""
        return bool(self.random.random() < share)

    def vector(self, size: float = 1.0) -> Any:
        """Return a vector of a length."""
        v = self.random.normal(size=3)
        return size * v / np.linalg.norm(v)

    def rotation(self) -> Any:
        """Return a rotation, uniform on the group."""
        return matrix_of(self.random.normal(size=4))

    def wave(self, start: Any, size: Any, rate: float) -> Any:
        """Return a function of time, about `start`."""
        phase, other = self.random.uniform(0, 6, size=2)

        def value(t: Any) -> Any:
            return start + size * np.sin(rate * t + phase) * np.cos(0.6 * rate * t + other)

        return value

    def times(self, t_end: float) -> Any:
        """Return the times of a table: corners, jumps (equal times) and pulses, to the end of the run or beyond."""
        times = [0.0, *self.random.uniform(0, t_end, size=self.random.integers(0, 5))]
        for t in [t for t in times if t and self.chance(0.6)]:
            times.append(t)
        if self.chance(0.5):  # a pulse
            start, width = self.random.uniform(0.05, 0.8) * t_end, self.between(1e-5, 0.1) * t_end
            times += [start, start, start + width, start + width]
        return np.sort([*times, t_end * (1 if self.chance(0.5) else self.random.uniform(1, 2))])

    def table(self, t_end: float, start: Any, size: float, jumps: bool = True) -> Any:
        """Return a table of vectors about `start`, and sometimes equal to it."""
        times = self.times(t_end) if jumps else np.unique(self.times(t_end))
        values = start + size * self.random.normal(size=(len(times), 3))
        values[self.random.random(size=len(times)) < 0.2] = start
        return times, values


def random_case(seed: int) -> tuple[Case, str]:
    """Return a random case and what it consists of."""
    draw, theme = Draw(seed), THEMES[seed % len(THEMES)]
    mass, second = 1.0, 1.0
    if theme == "units" or draw.chance(0.15):
        mass, second = draw.between(1e-18, 1e18), draw.between(1e-6, 1e6)
    moments = draw.random.uniform(0.3, 3, size=3) * draw.between(0.1, 10) * mass
    if theme == "needle":
        moments = moments.max() * np.array((1.0, 1.1, 1 / draw.between(1e2, 1e5)))
    axes = draw.rotation()
    J = axes @ np.diag(moments) @ axes.T
    rate = draw.between(0.3, 3) / second
    w0 = axes @ draw.vector(rate)
    if theme == "needle":
        w0 = axes @ (np.array((0.1, 0.07, 1.0)) * draw.vector(rate))
    turn = draw.between(3, 30)
    case = Case((J + J.T) / 2, draw.rotation(), w0, turn / rate)
    energy = float(w0 @ case.J @ w0) / 2
    if theme == "flight":
        thrown = (draw.between(0.1, 10) * mass, draw.vector(), draw.between(0.1, 10), draw.vector(), draw.vector())
        return replace(case, flight=thrown), theme
    if theme in ("needle", "turning", "function") or draw.chance(0.6):
        case, energy = add_field(draw, case, energy, theme, rate)
    rotor = 0.0
    if theme in ("rotor", "motor table", "motor function") or draw.chance(0.25):
        rotor = float(np.linalg.norm(case.J @ w0)) * (draw.between(10, 300) if theme == "rotor" else draw.between(0.1, 3))
    fastest = math.sqrt(2 * energy / moments.min()) + rotor / moments.min()
    case = replace(case, t_end=min(case.t_end, MOST_TURN * (0.3 if theme == "needle" else 1.0) / fastest))
    if rotor:
        case = add_rotor(draw, case, theme, rotor, rate)
    torque = energy / turn * draw.between(0.3, 10)
    if theme in ("table", "stiff", "attitude") or draw.chance(0.25):
        case = add_torque(draw, case, theme, torque, rate)
    if theme in ("stiff", "attitude") or draw.chance(0.25):
        case = add_damping(draw, case, theme, moments, rate)
    return case, describe(case, theme)


def add_field(draw: Draw, case: Case, energy: float, theme: str, rate: float) -> tuple[Case, float]:
    """Return the case with a field, and the energy that it has then."""
    kinds = ["gravity", "spring", "attraction", "gradient"]
    kind = "quartic" if theme == "function" or draw.chance(0.05) else kinds[draw.random.integers(4)]
    size, arm, direction = energy * draw.between(0.05, 5), draw.between(0.1, 1), draw.vector()
    if theme == "needle":
        size *= 10
    point, anchor = draw.vector(arm), draw.vector(arm * (1 + draw.between(0.2, 3)))
    far = arm + float(np.linalg.norm(anchor))
    fields: dict[str, tuple[Any, ...]] = {
        "gravity": (min(size / arm, 1e30), point),  # N: the largest weight that is taken
        "spring": (size / far**2, point, anchor, 0.0 if draw.chance(0.3) else draw.random.uniform(0, far)),
        "attraction": (size * (far - 2 * arm) * (1 if draw.chance(0.7) else -1), point, anchor),
        "gradient": (math.sqrt(size / float(np.linalg.eigvalsh(case.J)[-1])), case.J, direction),
        "quartic": (size / arm**4, point, direction, 0.5 if draw.chance(0.5) else 0.0, rate * draw.between(0.2, 2)),
    }
    turning = theme == "turning" or (kind != "quartic" and draw.chance(0.15))
    orbit = (rate * draw.between(0.1, 2), draw.vector(draw.between(0.1, 10))) if turning else None
    if kind == "quartic" and fields[kind][3]:  # a field that turns does not depend on time otherwise
        orbit = None
    return replace(case, field=(kind, *fields[kind]), turning=orbit), energy + 2 * size


def add_rotor(draw: Draw, case: Case, theme: str, size: float, rate: float) -> Case:
    """Return the case with a rotor, or one that a motor drives."""
    start = draw.vector(size)
    kind = theme if theme.startswith("motor") else ("", "", "motor table", "motor function")[draw.random.integers(4)]
    if kind == "motor table":
        return replace(case, rotor=draw.table(case.t_end, start, 0.5 * size, jumps=False))
    if kind == "motor function":
        return replace(case, rotor=draw.wave(start, draw.vector(0.7 * size), rate * draw.between(0.2, 2)))
    return replace(case, rotor=start)


def add_torque(draw: Draw, case: Case, theme: str, size: float, rate: float) -> Case:
    """Return the case with a torque: a table, a constant, or a function of time or of attitude and time."""
    case = replace(case, frame="world" if draw.chance(0.4) else "body")
    kind = draw.random.integers(4) if theme not in ("table", "attitude") else 0 if theme == "table" else 3
    if kind == 0:
        return replace(case, torque=draw.table(case.t_end, 0.0, size))
    if kind == 1:
        return replace(case, torque=draw.vector(size))
    if kind == 2 and draw.chance(0.5):  # switched on and off, with declared breaks
        on, off = np.sort(draw.random.uniform(0.05, 0.95, size=2)) * case.t_end
        value, nothing = draw.vector(size), np.zeros(3)
        return replace(case, torque=lambda t: value if on <= t < off else nothing, breaks=(*case.breaks, float(on), float(off)))
    if kind == 2:
        return replace(case, torque=draw.wave(draw.vector(size), draw.vector(size), rate * draw.between(0.2, 2)))
    field, dipole = draw.wave(draw.vector(), draw.vector(), rate * draw.between(0.2, 1)), draw.vector(size)

    def magnetic(t: Any, R: Any) -> Any:  # of a dipole that is fixed in the body
        return np.cross(dipole, field(t) @ R)

    def magnetic_world(t: Any, R: Any) -> Any:
        return np.cross(R @ dipole, field(t))

    return replace(case, torque=magnetic if case.frame == "body" else magnetic_world)


def add_damping(draw: Draw, case: Case, theme: str, moments: Any, rate: float) -> Case:
    """Return the case with damping: a matrix, with a factor, or a function of time or of attitude and time."""
    size = float(moments.min()) / case.t_end * draw.between(0.3, 10)
    if theme == "stiff":
        size = float(moments.min()) / case.t_end * draw.between(30, 1000)
        case = replace(case, torque=draw.vector(size * rate) if case.torque is None or draw.chance(0.3) else case.torque)
    half, skew = draw.random.normal(size=(3, 3)) / 2, draw.vector(0.3)
    D = size * (half @ half.T / 2 + 0.3 * np.eye(3) + np.cross(np.eye(3), skew) * draw.random.integers(2))
    kind = 4 if theme == "attitude" else draw.random.integers(4)
    if kind == 0:
        return replace(case, damping=D)
    if kind == 1:
        times = draw.times(case.t_end)
        return replace(case, damping=D, factor=(times, draw.random.uniform(0, 1.5, size=len(times))))
    wave = draw.wave(1.0, 0.9, rate * draw.between(0.2, 2))
    if kind == 2:
        return replace(case, damping=D, factor=wave)
    if kind == 3:
        return replace(case, damping=lambda t: wave(t) * D)
    field = draw.wave(draw.vector(), draw.vector(), rate * draw.between(0.2, 1))

    def magnetic(t: Any, R: Any) -> Any:  # eddy currents
        b = field(t) @ R
        return size * (b @ b * np.eye(3) - np.outer(b, b))

    return replace(case, damping=magnetic)


def describe(case: Case, theme: str) -> str:
    """Return the needs of a case."""
    parts = [
        theme,
        "" if case.field is None else case.field[0] + " in time" * (case.field[0] == "quartic" and case.field[4] > 0),
    ]
    parts += ["turning" * (case.turning is not None)]
    for name in ("rotor", "torque", "damping", "factor"):
        given = getattr(case, name)
        kind = f"f({', '.join(given.__code__.co_varnames[: given.__code__.co_argcount])})" if callable(given) else "constant"
        parts.append("" if given is None else f"{name} {'table' if isinstance(given, tuple) else kind}")
    return ", ".join(filter(None, parts))
