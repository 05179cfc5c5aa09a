"""Invariants of the exact motion, as functions of attitude and rates."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .attitude import Array
from .body import RigidBody
from .check import describe, name_text, printable_text, real_number
from .errors import BadInput
from .potentials.potential import AnyPotential, depends_on_time, energy_at
from .potentials.turning import Turning
from .potentials.uniform_gravity import UniformGravity

MOMENTUM_UNIT = "kg m^2/s"
AXIAL_MOMENTUM = "axial momentum"
JACOBI_INTEGRAL = "Jacobi integral"
"""Name of the invariant that replaces the energy in a turning field."""
MOMENTA = MOMENTUM, VERTICAL_MOMENTUM, FIELD_MOMENTUM = "momentum", "vertical momentum", "momentum along the field's axis"
"""Names of what a field conserves of the momentum in the world: all without a field, or the component along its axis."""


@dataclass(frozen=True, eq=False)
class Invariant:
    """A conserved quantity.

    `evaluate(R_WB, w_WB_B)` returns (n,) or (n, 3) for attitudes (n, 3, 3) and rates (n, 3). Drifts are relative to `scale`,
    which is positive and has the unit `unit`. In a turning field, `evaluate` receives attitudes R_OB relative to the axes O
    that turn with the field (`Scene.in_field_axes`).

    In a scene with a torque or damping, I(t) - I(0) equals what these loads supplied. `supplied` returns it, (n,) or (n, 3),
    from `Trajectory.supplied`, and the drift belongs to the balance I(t) - I(0) - supplied.

    Raises
    ------
    BadInput
        name or unit is not a string, scale is not a positive number, or evaluate is not callable.
    """

    name: str
    unit: str
    scale: float
    evaluate: Callable[..., Array]
    supplied: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        name_text(self.name)
        printable_text("unit", self.unit, "a text")
        number = real_number(self.scale)
        if number is None or not 0 < number < math.inf:
            raise BadInput("scale", describe(self.scale), "a finite number above 0")
        if not callable(self.evaluate):
            raise BadInput("evaluate", describe(self.evaluate), "a function of attitudes (n, 3, 3) and rates (n, 3)")


class InvariantInTime(Invariant):
    """A conserved quantity that needs more: `evaluate(R_WB, w_WB_B, t)` or, in free flight, `evaluate(R, w, p_WB, v_WB, t)`."""


def sizes(drift: Array) -> Array:
    """Return the magnitudes (n,) of relative values (n,) or (n, 3)."""
    return np.abs(drift) if drift.ndim == 1 else np.linalg.norm(drift, axis=-1)


def kinetic_energy(body: RigidBody, w_WB_B: Array) -> Array:
    """Return the kinetic energy (...), J, at rates (..., 3), rad/s, body axes, without the constant energy of a rotor."""
    return np.asarray(np.sum((w_WB_B @ body.inertia) * w_WB_B, axis=-1) / 2)


def energy(body: RigidBody, potential: AnyPotential | None, R_WB: Array, w_WB_B: Array, t: Array) -> Array:
    """Return kinetic plus potential energy (...), J, at attitudes (..., 3, 3), rates (..., 3), rad/s, and times (...), s."""
    kinetic = kinetic_energy(body, w_WB_B)
    return kinetic if potential is None else kinetic + energy_at(potential, R_WB, t)


def jacobi_scale(body: RigidBody, field: Turning, energy_scale: float) -> float:
    """Return the reference scale of the Jacobi integral, J: the scale of the energy plus the contribution of the turning."""
    return energy_scale + field.orbit.rate * largest_momentum(body, energy_scale)


def largest_momentum(body: RigidBody, energy: float) -> float:
    """Return the largest angular momentum, kg m^2/s, that a kinetic energy, J, allows."""
    rotor = 0.0 if body.rotor_momentum is None else float(np.linalg.norm(body.rotor_momentum))
    return math.sqrt(2 * energy * float(body.moments.max())) + rotor


def momentum_W(body: RigidBody, R_WB: Array, w_WB_B: Array, t: Array | float = 0.0) -> Array:
    """Return the angular momentum (..., 3) about the fixed point, kg m^2/s, world axes.

    Attitudes are (..., 3, 3), body to world, and rates (..., 3), rad/s, body axes; times (...), s, matter to a motor.
    """
    return (R_WB @ body.momentum(w_WB_B, t)[..., None])[..., 0]


def invariants_of(
    body: RigidBody, potential: AnyPotential | None, w_WB_B0: Array, energy_scale: float, axis: Array | None
) -> tuple[Invariant, ...]:
    """Return the invariants that follow from body and potential, with scales from the initial state.

    These are the energy, unless the field depends on time; the Jacobi integral in a turning field; the world momentum (a
    vector) of a free body, or its component along the axis of the field (the vertical in uniform gravity); and the axial
    momentum if body and field are symmetric about one axis. Momenta include a rotor's.

    The initial rates (3,) are in rad/s, the reference scale of the energy in J, above 0. `axis` is the unit vector (3,), body
    axes, about which body and field are symmetric, or None (`axial_direction`).
    """
    conserved = []
    if isinstance(potential, Turning):
        field, orbit = potential.potential, potential.orbit

        def jacobi_integral(R_OB: Array, w: Array) -> Array:
            return kinetic_energy(body, w) + field.energy(R_OB) - orbit.rate * (momentum_W(body, R_OB, w) @ orbit.normal_W)

        conserved.append(Invariant(JACOBI_INTEGRAL, "J", jacobi_scale(body, potential, energy_scale), jacobi_integral))
    elif not depends_on_time(potential):
        conserved.append(Invariant("energy", "J", energy_scale, lambda R, w: energy(body, potential, R, w, np.zeros(()))))
    # A scene that starts at rest has no momentum. The momentum that gravity can produce is the scale instead.
    scale = float(np.linalg.norm(body.momentum(w_WB_B0))) or math.sqrt(float(body.moments.max()) * energy_scale)
    if potential is None:
        conserved.append(Invariant(MOMENTUM, MOMENTUM_UNIT, scale, lambda R, w: momentum_W(body, R, w)))
    elif (line := potential.axis_W) is not None:
        name = VERTICAL_MOMENTUM if isinstance(potential, UniformGravity) else FIELD_MOMENTUM
        conserved.append(Invariant(name, MOMENTUM_UNIT, scale, lambda R, w: momentum_W(body, R, w) @ line))
    if axis is not None:
        conserved.append(Invariant(AXIAL_MOMENTUM, MOMENTUM_UNIT, scale, lambda R, w: body.momentum(w) @ axis))
    return tuple(conserved)


def balance_of(invariant: Invariant, potential: AnyPotential | None) -> Invariant:
    """Return the balance that replaces an invariant of body and potential in a scene with a torque or damping."""
    line = None if potential is None else potential.axis_W

    def supplied(sums: Array) -> Array:
        if invariant.unit == "J":
            turning = potential.orbit.rate * potential.orbit.normal_W if isinstance(potential, Turning) else np.zeros(3)
            return np.asarray(sums[:, 0] - sums[:, 1:] @ turning)
        return sums[:, 1:] if line is None else np.asarray(sums[:, 1:] @ line)

    return replace(invariant, name=f"{invariant.name} balance", supplied=supplied)


def in_time(invariant: Invariant, body: RigidBody) -> Invariant:
    """Return a component of the momentum, or all three, with the momentum of a rotor with a motor."""
    start = body.motor.at(0.0) if body.motor else np.zeros(3)

    def evaluate(R_WB: Array, w_WB_B: Array, t: Array) -> Array:
        # A change of h in body axes acts as a change of J w does.
        return invariant.evaluate(R_WB, np.linalg.solve(body.inertia, (body.momentum(w_WB_B, t) - start).T).T)

    return InvariantInTime(invariant.name, invariant.unit, invariant.scale, evaluate, invariant.supplied)


def with_balances(*names: str) -> frozenset[str]:
    """Return names of invariants, and of the balances that replace them in scenes with a torque or damping."""
    return frozenset((*names, *(f"{name} balance" for name in names)))


def find_energy(invariants: Iterable[Invariant]) -> Invariant | None:
    """Return the energy or, in a turning field, the Jacobi integral among invariants; None if neither is conserved."""
    return next((invariant for invariant in invariants if invariant.name in ("energy", JACOBI_INTEGRAL)), None)


def kept_sizes(scene: Any, kept: frozenset[str]) -> dict[Invariant, float]:
    """Return the invariants named `kept` that follow from body and field, and the scales of their round-off.

    The scale of a momentum is the largest momentum that the energy allows, which exceeds its reference scale if a body starts
    near rest.
    """
    most = largest_momentum(scene.body, scene.energy_scale)
    of_motion = (
        invariant for invariant in scene.invariants if invariant.name in kept and invariant not in scene.extra_invariants
    )
    return {
        invariant: max(invariant.scale, most) if invariant.unit == MOMENTUM_UNIT else invariant.scale for invariant in of_motion
    }


NEARLY_SPHERICAL = 0.005
"""Relative gap of moments below which `axial_direction` uses the plain tolerance."""


def axial_direction(body: RigidBody, potential: AnyPotential | None, tolerance: float = 1e-14) -> Array | None:
    """Return the unit vector (3,), body axes, about which body and field are symmetric, or None.

    In uniform gravity it points towards the centre of mass. The result is None for other kinds of field, and for a body with a
    rotor, which no method treats as symmetric.
    """
    if body.rotor_momentum is not None or not isinstance(potential, UniformGravity | None):
        return None
    moment_P = np.zeros(3) if potential is None else potential.moment_B @ body.R_BP
    size = float(np.linalg.norm(moment_P))
    if size > 0 and np.ptp(body.moments) <= tolerance * body.moments.max():
        return np.asarray(body.R_BP @ (moment_P / size))
    axis = body.symmetry_axis(tolerance)
    if axis is None:
        return None
    # The axes of a tensor are known to round-off over the relative gap of its moments, 50 times round-off at a gap of 2 %.
    # Bodies closer to a sphere keep the plain tolerance.
    gap = np.abs(np.delete(body.moments, axis) - body.moments[axis]).min() / body.moments.max()
    if np.linalg.norm(np.delete(moment_P, axis)) > tolerance * size / (gap if gap >= NEARLY_SPHERICAL else 1.0):
        return None
    return np.asarray(body.R_BP[:, axis] * (-1.0 if moment_P[axis] < 0 else 1.0))
