"""A scene for each member of `Feature`, without it, and with another value of it; and scene files of most.

All have a body in turned axes, an attitude and rates of no symmetry. Without the part, the motion is at least `APART` rad from
the right one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

import conservative as cv
from conservative.features import Feature
from conservative.potentials.field import FieldPotential
from conservative.potentials.uniform_gravity import UniformField

from .independent import Case, Given, angle_between, cross, is_table, matrix_of, motion

APART, RIGHT = 0.3, 0.02
"""Smallest distance of a motion without the part, and largest one of a right one, rad."""
AXES = matrix_of(np.array((0.8, 0.3, -0.4, 0.5)))
J = AXES @ np.diag((0.7, 1.1, 1.6)) @ AXES.T
J = (J + J.T) / 2
FREE = Case(J, matrix_of(np.array((0.4, -0.6, 0.3, 0.7))), np.array((0.7, -0.9, 1.2)), 2.0)
POINT, ANCHOR = np.array((0.3, -0.2, 0.4)), np.array((0.7, 0.6, -0.9))
DIRECTION = np.array((0.48, -0.6, 0.64))
TIMES = np.array((0.0, 0.5, 0.8, 0.8, 1.3, 2.0))
VALUES = np.array(((0, 1, 2), (1, -1, 0.5), (0, 0, 0), (2, 1, -1), (1, 3, 0), (0.5, 1, 0)), dtype=float)
RAMP = (0.0, 0.4, 1.1, 2.0)
MOMENTA = np.array(((0.3, -0.2, 0.1), (0.5, -0.9, 0.8), (1.5, 0.3, -0.6), (0.1, 0.4, 0.9)))
STEPS = 10
_RANDOM = np.random.default_rng(50)
_CORNER_TIMES = np.sort(np.concatenate([[0.0, 2.0], np.linspace(0.2, 1.8, 9), _RANDOM.uniform(0, 2, 50)]))
CORNERS = (_CORNER_TIMES, 2 * _RANDOM.normal(size=(61, 3)))
CORNER_FACTOR = (_CORNER_TIMES, _RANDOM.uniform(0, 2, 61))
"""Tables with six corners in a step of ten, of which one is at its end."""
MASS, COM = 2.0, np.array((0.25, -0.3, 0.2))


def magnetic(t: float, R: Any) -> Any:
    """Return the torque on a dipole of the body in a field that swings, N m, body axes."""
    return cross((0.9, -0.5, 1.4), np.array((1.0, 0.5 * np.sin(2 * t), -0.7)) @ R)


def more_magnetic(t: float, R: Any) -> Any:
    """Return that of a larger dipole."""
    return 1.6 * magnetic(t, R)


class OwnField(FieldPotential):
    """A field of a user: gravity along another name."""

    NUMBERS = ("moment_B",)

    def __init__(self, moment_B: Any) -> None:
        self.moment_B = np.array(moment_B, dtype=float)

    @staticmethod
    def build_field(R_BP: Any, moment_B: Any) -> Any:
        """Return the field in axes R_BP."""
        turned = moment_B if R_BP is None else (moment_B[..., None, :] @ R_BP)[..., 0, :]
        return UniformField(*np.moveaxis(turned, -1, 0))


T = np.linspace(0, 2, 201)
_MOTIONS: dict[Case, tuple[Any, Any]] = {}


def right_motion(case: Case, times: Any) -> tuple[Any, Any]:
    """Return attitudes and rates of a case. It is integrated once for all times that are among `T`."""
    times = np.atleast_1d(times)
    at = np.rint(100 * times).astype(int)
    if at[-1] >= len(T) or np.abs(T[at] - times).max() > 1e-12:
        return motion(case, times)
    if case not in _MOTIONS:
        _MOTIONS[case] = motion(case, T)
    R_WB, w_WB_B = _MOTIONS[case]
    return R_WB[at], w_WB_B[at]


@dataclass(frozen=True, eq=False)
class Row:
    """Cases with a part, without it, and with another value of it. `words`: one of them is in a message that names the part."""

    case: Case
    without: Case
    other: Case
    words: tuple[str, ...]
    in_file: bool = True
    options: dict[str, Any] = field(default_factory=dict)

    def scene(self, case: Case | None = None, name: str = "crossed") -> cv.Scene:
        """Return the scene of one of the cases, by default the first."""
        case = case or self.case
        made = case.scene(name)
        if self.options and case.field is not None:
            made = made.rename(name, potential=OwnField(case.field[1] * np.asarray(case.field[2])))
        return made

    @cached_property
    def t(self) -> Any:
        """Times of the samples, s."""
        return np.linspace(0, self.case.t_end, 9)

    @cached_property
    def started(self) -> tuple[Case, ...]:
        """The case, and bodies that start with other rates."""
        return self.case, *(replace(self.case, w0=factor * self.case.w0) for factor in (1.1, 0.9))

    @cached_property
    def starts(self) -> Any:
        """The initial rates of these bodies."""
        return np.array([case.w0 for case in self.started])

    def distance(self, t: Any, R_WB: Any) -> float:
        """Return the largest distance from the right motion, rad, at times, s."""
        return float(angle_between(right_motion(self.case, t)[0], R_WB).max())


def row(part: str, value: Any, other: Any, words: tuple[str, ...], base: Case = FREE, **options: Any) -> Row:
    """Return the row of a part that a case without it lacks."""
    return Row(replace(base, **{part: value}), base, replace(base, **{part: other}), words, **options)


HEAVY, PULLED = ("gravity", 6.0, POINT), ("spring", 5.0, POINT, ANCHOR, 0.3)
POTENTIAL = ("potential", "field")
PIVOTED = replace(FREE, J=J + MASS * (COM @ COM * np.eye(3) - np.outer(COM, COM)), field=("gravity", MASS * 9.81, COM))
ROWS = {
    Feature.GRAVITY: row("field", HEAVY, ("gravity", 9.0, POINT), ("gravity", *POTENTIAL)),
    Feature.SPRING: row("field", PULLED, ("spring", 9.0, *PULLED[2:]), ("spring", *POTENTIAL)),
    Feature.ATTRACTION: row(
        "field", ("attraction", 4.0, POINT, ANCHOR), ("attraction", 6.0, POINT, ANCHOR), ("attraction", *POTENTIAL)
    ),
    Feature.GRADIENT: row("field", ("gradient", 1.3, J, DIRECTION), ("gradient", 1.7, J, DIRECTION), ("gradient", *POTENTIAL)),
    Feature.FIELD: row(
        "field", HEAVY, ("gravity", 9.0, POINT), ("of a user", *POTENTIAL), in_file=False, options={"potential": OwnField}
    ),
    Feature.FUNCTION: row(
        *("field", ("quartic", 60.0, POINT, DIRECTION, 0.0, 0.0), ("quartic", 90.0, POINT, DIRECTION, 0.0, 0.0)),
        ("function", *POTENTIAL),
        in_file=False,
    ),
    Feature.TURNING: row("turning", (1.5, DIRECTION), (2.5, DIRECTION), ("turn", "time"), replace(FREE, field=PULLED)),
    Feature.TIME: row(
        *("field", ("quartic", 60.0, POINT, DIRECTION, 0.9, 3.0), ("quartic", 60.0, POINT, DIRECTION, -0.9, 3.0)),
        ("time",),
        replace(FREE, field=("quartic", 60.0, POINT, DIRECTION, 0.0, 0.0)),
        in_file=False,
    ),
    Feature.ROTOR: row("rotor", np.array((0.6, -0.5, 0.9)), np.array((0.6, -0.5, 1.3)), ("rotor",)),
    Feature.MOTOR: row("rotor", (RAMP, MOMENTA), (RAMP, 1.5 * MOMENTA), ("motor", "rotor"), replace(FREE, rotor=MOMENTA[0])),
    Feature.TORQUE: row("torque", (TIMES, VALUES), (TIMES, 1.5 * VALUES), ("torque",), replace(FREE, frame="world")),
    Feature.DAMPING: row("damping", 0.6 * J + 0.2 * np.cross(np.eye(3), DIRECTION), 0.9 * J, ("damping",)),
    Feature.ATTITUDE: row("torque", magnetic, more_magnetic, ("attitude", "torque"), in_file=False),
    Feature.FLIGHT: Row(
        replace(FREE, flight=(MASS, COM, 9.81, (0.1, 0.2, 0.3), (1.0, -2.0, 3.0))),
        PIVOTED,
        replace(FREE, w0=1.1 * FREE.w0, flight=(MASS, COM, 9.81, (0.1, 0.2, 0.3), (1.0, -2.0, 4.0))),
        ("flight", "p_WB", "free"),
    ),
}


def write_file(path: Path, case: Case) -> Path:
    """Write a scene file, and return its path."""
    lines = [f"t_end = {case.t_end!r}", "[body]"]
    if case.flight is None:
        lines += [f"inertia = {as_text(case.J)}"]
    else:
        lines += [f"inertia_com = {as_text(case.J)}", f"mass = {case.flight[0]!r}", f"com_B = {as_text(case.flight[1])}"]
        lines += ["[potential]", 'kind = "uniform_gravity"', f"g = {case.flight[2]!r}"]
    if case.field is not None:
        kind, *numbers = case.field
        keys = {
            "gravity": ("uniform_gravity", "weight", "com_B"),
            "spring": ("linear_spring", "stiffness", "point_B", "anchor_W", "rest_length"),
            "attraction": ("point_attraction", "strength", "point_B", "anchor_W"),
            "gradient": ("gravity_gradient", "rate", "", "direction_W"),
        }[kind]
        lines += ["[potential]", f'kind = "{keys[0]}"']
        lines += [f"{key} = {as_text(value)}" for key, value in zip(keys[1:], numbers, strict=True) if key]
    if case.turning is not None:
        lines += ["[orbit]", f"rate = {case.turning[0]!r}", f"normal_W = {as_text(case.turning[1])}"]
    lines += table("rotor", "momentum", case.rotor)
    lines += table("torque", "value", case.torque)
    lines += [f'frame = "{case.frame}"'] * (case.torque is not None)
    lines += table("damping", "matrix", case.damping)
    lines += ["[start]", f"R_WB = {as_text(case.R0)}", f"w_WB_B = {as_text(case.w0)}"]
    if case.flight is not None:
        lines += [f"p_WB = {as_text(case.flight[3])}", f"v_WB = {as_text(case.flight[4])}"]
    path.write_text("\n".join([*lines, ""]))
    return path


def table(name: str, key: str, given: Given) -> list[str]:
    """Return the lines of a constant or of a table."""
    if given is None:
        return []
    values = {"times": given[0], "values": given[1]} if is_table(given) else {key: given}
    return [f"[{name}]", *(f"{key} = {as_text(value)}" for key, value in values.items())]


def as_text(value: Any) -> str:
    """Return numbers with every digit."""
    return repr(np.asarray(value, dtype=float).tolist())
