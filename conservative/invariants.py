"""What the exact motion conserves, as functions of attitude and rates. Source: definitions of any mechanics textbook."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from .attitude import Array
from .body import RigidBody
from .check import describe, printable_text, real_number
from .errors import BadInput, nearest
from .potentials.potential import AnyPotential, depends_on_time, energy_at
from .potentials.turning import Turning
from .potentials.uniform_gravity import UniformGravity

_NAME = "a text of one character or more"
MOMENTUM_UNIT = "kg m^2/s"
JACOBI_INTEGRAL = "Jacobi integral"
"""Name of what a field that turns conserves in place of the energy."""


@dataclass(frozen=True, eq=False)
class Invariant:
    """A conserved quantity.

    `evaluate(R_WB, w_WB_B)` returns (n,) or (n, 3) for attitudes (n, 3, 3) and rates (n, 3). Drifts are relative to `scale`,
    which is positive and has the unit `unit`. In a turning field, `evaluate` receives attitudes R_OB relative to the axes O
    that turn with the field (`Scene.in_field_axes`).

    Raises
    ------
    BadInput
        name or unit is not a string, scale is not a positive number, or evaluate is not callable.
    """

    name: str
    unit: str
    scale: float
    evaluate: Callable[[Array, Array], Array]

    def __post_init__(self) -> None:
        if not printable_text("name", self.name, _NAME):
            raise BadInput("name", "''", _NAME)
        printable_text("unit", self.unit, "a text")
        number = real_number(self.scale)
        if number is None or not 0 < number < math.inf:
            raise BadInput("scale", describe(self.scale), "a finite number above 0")
        if not callable(self.evaluate):
            raise BadInput("evaluate", describe(self.evaluate), "a function of attitudes (n, 3, 3) and rates (n, 3)")


def sizes(drift: Array) -> Array:
    """Return |x| of each of n relative values (n,), and of vectors (n, 3) their lengths (n,): no unit."""
    return np.abs(drift) if drift.ndim == 1 else np.linalg.norm(drift, axis=-1)


def find_invariant(invariant: Invariant | str, known: Iterable[Invariant]) -> Invariant:
    """Return an invariant, which may be given by its name among those that are known.

    Raises
    ------
    BadInput
        None of them has this name.
    """
    if not isinstance(invariant, str):
        return invariant
    by_name = {each.name: each for each in known}
    if invariant not in by_name:
        raise BadInput("invariant", describe(invariant), nearest(invariant, by_name))
    return by_name[invariant]


def kinetic_energy(body: RigidBody, w_WB_B: Array) -> Array:
    """Return the kinetic energy (...), J, at rates (..., 3), rad/s, body axes."""
    return np.asarray(np.sum(body.momentum(w_WB_B) * w_WB_B, axis=-1) / 2)


def energy(body: RigidBody, potential: AnyPotential | None, R_WB: Array, w_WB_B: Array, t: Array) -> Array:
    """Return kinetic plus potential energy (...), J, at attitudes (..., 3, 3), rates (..., 3), rad/s, and times (...), s."""
    kinetic = kinetic_energy(body, w_WB_B)
    return kinetic if potential is None else kinetic + energy_at(potential, R_WB, t)


def conserved_part(body: RigidBody, potential: AnyPotential | None, R: Array, w_WB_B: Array) -> Array:
    """Return what makes a conserved quantity of the kinetic energy, (...), J: V, or V - rate n.l of a field that turns.

    Attitudes (..., 3, 3) are those in axes that the field is fixed in (`Scene.in_field_axes`), rates (..., 3), rad/s, those of
    the body in the world. It is 0 for a free body, and where nothing of the kind is conserved.
    """
    if isinstance(potential, Turning):
        return potential.potential.energy(R) - potential.orbit.rate * (momentum_W(body, R, w_WB_B) @ potential.orbit.normal_W)
    if potential is None or depends_on_time(potential):
        return np.zeros(R.shape[:-2])
    return energy_at(potential, R, np.zeros(()))


def jacobi_scale(body: RigidBody, field: Turning, energy_scale: float) -> float:
    """Return what errors of the Jacobi integral are relative to, J: the energy's scale and what the turning adds to it."""
    return energy_scale + field.orbit.rate * math.sqrt(2 * energy_scale * float(body.moments.max()))


def momentum_W(body: RigidBody, R_WB: Array, w_WB_B: Array) -> Array:
    """Return the angular momentum (..., 3) about the fixed point, kg m^2/s, world axes.

    Attitudes are (..., 3, 3), body to world, and rates (..., 3), rad/s, body axes.
    """
    return (R_WB @ body.momentum(w_WB_B)[..., None])[..., 0]


def invariants_of(
    body: RigidBody, potential: AnyPotential | None, w_WB_B0: Array, energy_scale: float
) -> tuple[Invariant, ...]:
    """Return what follows from the body and the potential alone; drifts are relative to sizes at the start.

    Energy, unless the field depends on the time; the Jacobi integral where it turns. World momentum (a vector) for a free body,
    its component along the axis of a field that has one (the vertical in uniform gravity). The axial momentum where body and
    field are symmetric about one axis.

    Parameters
    ----------
    body, potential
        What moves, and what acts on it.
    w_WB_B0
        Angular velocity at the start (3,), rad/s, body axes.
    energy_scale
        What energy errors are relative to, J, above 0.
    """
    found = list(_energies(body, potential, energy_scale))
    # A scene that starts at rest has no momentum to be relative to; what gravity can give it is the next best scale.
    scale = float(np.linalg.norm(body.momentum(w_WB_B0))) or math.sqrt(float(body.moments.max()) * energy_scale)
    if potential is None:
        found.append(Invariant("momentum", MOMENTUM_UNIT, scale, lambda R, w: momentum_W(body, R, w)))
    elif (line := potential.axis_W) is not None:
        name = "vertical momentum" if isinstance(potential, UniformGravity) else "momentum along the field's axis"
        found.append(Invariant(name, MOMENTUM_UNIT, scale, lambda R, w: momentum_W(body, R, w) @ line))
    axis = axial_direction(body, potential)
    if axis is not None:
        found.append(Invariant("axial momentum", MOMENTUM_UNIT, scale, lambda R, w: body.momentum(w) @ axis))
    return tuple(found)


def _energies(body: RigidBody, potential: AnyPotential | None, energy_scale: float) -> Iterator[Invariant]:
    """Yield the energy, or the Jacobi integral, or nothing."""

    def evaluate(R: Array, w: Array) -> Array:
        return kinetic_energy(body, w) + conserved_part(body, potential, R, w)

    if isinstance(potential, Turning):
        yield Invariant(JACOBI_INTEGRAL, "J", jacobi_scale(body, potential, energy_scale), evaluate)
    elif not depends_on_time(potential):
        yield Invariant("energy", "J", energy_scale, evaluate)


def find_energy(invariants: Iterable[Invariant]) -> Invariant | None:
    """Return the energy among invariants, in a field that turns the Jacobi integral, None where neither is conserved."""
    return next((each for each in invariants if each.name in ("energy", JACOBI_INTEGRAL)), None)


def kept_sizes(scene: Any, kept: frozenset[str]) -> dict[Invariant, float]:
    """Return those invariants of a `Scene` that follow from body and field, by names, and what rounding errors are relative to.

    Those sizes have the units of the invariants. That of a momentum is all that the energy can make of it, which is more than
    its scale where a body starts near rest.
    """
    most = math.sqrt(2 * scene.energy_scale * float(scene.body.moments.max()))
    found = (each for each in scene.invariants if each.name in kept and each not in scene.extra_invariants)
    return {each: max(each.scale, most) if each.unit == MOMENTUM_UNIT else each.scale for each in found}


def kernel_constants(scene: Any, kept: frozenset[str]) -> tuple[Array, Array]:
    """Return the inertia (3, 3), kg m^2, and constants (5, 4) of a `Scene`, as `conservative.kernels.drifts` takes them.

    Those of invariants whose names are not among `kept` are 0. This file is below that of scenes.
    """
    body, potential, rows = scene.body, scene.potential, np.zeros((5, 4))
    for invariant, size in kept_sizes(scene, kept).items():
        start = invariant.evaluate(scene.R_WB0[None], scene.w_WB_B0[None])[0]
        if invariant.unit == "J":
            rows[0] = 1 / size, 0.0, 0.0, start
        elif invariant.name == "axial momentum":
            rows[4, :3], rows[4, 3] = scene.symmetry_axis_B / size, start / size
        else:
            directions = np.eye(3) if potential is None else potential.axis_W[None]
            part = slice(1, 1 + len(directions))
            rows[part, :3], rows[part, 3] = directions / size, start / size
    return np.array(body.inertia), rows


def axial_direction(body: RigidBody, potential: AnyPotential | None, tolerance: float = 1e-14) -> Array | None:
    """Return the unit vector (3,), body axes, about which body and field are symmetric; None where they are not.

    In uniform gravity it points to the side of the centre of mass. Fields of other kinds are not looked into: None.
    """
    if potential is not None and not isinstance(potential, UniformGravity):
        return None
    moment_P = np.zeros(3) if potential is None else potential.moment_B @ body.R_BP
    size = float(np.linalg.norm(moment_P))
    if size > 0 and np.ptp(body.moments) <= tolerance * body.moments.max():
        return np.asarray(body.R_BP @ (moment_P / size))
    axis = body.symmetry_axis(tolerance)
    if axis is None or np.linalg.norm(np.delete(moment_P, axis)) > tolerance * size:
        return None
    return np.asarray(body.R_BP[:, axis] * (-1.0 if moment_P[axis] < 0 else 1.0))
