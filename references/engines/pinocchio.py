"""Pinocchio: its forward dynamics and its manifold, in a loop written here because it has none of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array, from_quaternion
from conservative.batch import Batch
from conservative.card import Card, Maker
from conservative.check import choice
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.methods.many import Block, RunMany
from conservative.methods.units import in_own_units
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import EngineAxes, load, mass_model, principal_axes, unsupported_reason, version
from ..environments.plain_numbers import ManySamples, take_axes

SCHEMES = ("Euler", "RK4")

Step = Callable[[Array, Array], tuple[Array, Array]]


@dataclass(frozen=True)
class Pinocchio(Method):
    """Pinocchio's `aba` and `integrate`, stepped from Python.

    Pinocchio is a library of algorithms without a time loop, so this loop is Python's, and calling into the library is most of
    what a step costs. The body hangs on a spherical joint at its fixed point (at the centre of mass for a free body).

    Parameters
    ----------
    scheme
        "Euler": semi-implicit, v += dt aba(q, v), then q = integrate(q, dt v). "RK4": Munthe-Kaas's Runge-Kutta method of
        order 4 on the rotation group (Munthe-Kaas 1998, with the two commutators of Munthe-Kaas & Owren 1999).

    Raises
    ------
    BadInput
        The scheme is unknown.
    MissingEngine
        Pinocchio is not installed.
    """

    scheme: str = "RK4"

    family: ClassVar[str] = "pinocchio"
    role: ClassVar[Role] = Role.ENGINE
    card: ClassVar[Card] = Card(
        variants=SCHEMES, report=("",), suite=("RK4",), many=("RK4",), pictures=("Euler",), colour="purple"
    )

    def __post_init__(self) -> None:
        choice("scheme", self.scheme, SCHEMES)
        version("pin", "Pinocchio")

    @property
    def maker(self) -> Maker:
        return Maker("pin", version("pin", "Pinocchio"))

    @property
    def setting_parts(self) -> dict[str, str]:
        return {"scheme": f"aba+{self.scheme}"}

    @property
    def order(self) -> int:
        return 4 if self.scheme == "RK4" else 1

    def unsupported(self, scene: Scene) -> str | None:
        return unsupported_reason(scene)

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        pin = load("pinocchio", "pin", "Pinocchio")
        axes = principal_axes(scene)
        model = _model(pin, axes)
        step = (_rk4 if self.scheme == "RK4" else _euler)(pin, model, grid.dt)
        # Pinocchio: scalar last, body to world; velocities in the joint's own (body) axes.
        q_start, v_start = np.roll(axes.q0, -1), axes.w0

        def run() -> Trajectory:
            q, v = _march(step, q_start, v_start, grid)
            evaluations = grid.n_steps * (4 if self.scheme == "RK4" else 1)
            R_WF = from_quaternion(np.roll(q, 1, axis=1))
            return axes.trajectory(grid, self.label, R_WF, v, Counters(grid.n_steps, evaluations=evaluations))

        return run

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        """Return one loop over all bodies, each with a model of its own: Pinocchio has no function for many."""
        pin, axes = load("pinocchio", "pin", "Pinocchio"), take_axes(bodies, grid, self.unsupported)
        if axes is None:
            return None
        samples = ManySamples(axes, grid)
        make = _rk4 if self.scheme == "RK4" else _euler
        starts = [(make(pin, _model(pin, each), grid.dt), np.roll(each.q0, -1), each.w0) for each in axes]

        def run() -> Block:
            q, w = (np.stack(part) for part in zip(*(_march(*start, grid) for start in starts), strict=True))
            return samples.trajectory({"q": np.roll(q, 1, axis=-1), "w": w})

        return run


def _model(pin: Any, axes: EngineAxes) -> Any:
    mass = mass_model(axes)
    assert mass is not None  # `unsupported` has seen to it
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "body")
    # Inertia about the centre of mass, in the joint's axes.
    model.appendBodyToJoint(joint, pin.Inertia(mass.mass, mass.com, mass.body.inertia), pin.SE3.Identity())
    model.gravity.linear = np.array([0.0, 0.0, -mass.gravity])
    return model


def _march(step: Step, q: Array, v: Array, grid: Grid) -> tuple[Array, Array]:
    """Return samples of quaternions (n, 4), scalar last, and rates (n, 3); those of a run that ended early are nan."""
    qs, vs = np.full((grid.n_samples, 4), np.nan), np.full((grid.n_samples, 3), np.nan)
    qs[0], vs[0] = q, v
    with np.errstate(all="ignore"):  # a diverging run is reported by its status
        for sample, n_steps in enumerate(np.diff(grid.steps).astype(int), start=1):
            for _ in range(n_steps):
                q, v = step(q, v)
            if not np.isfinite(v).all():
                break
            qs[sample], vs[sample] = q, v
    return qs, vs


def _euler(pin: Any, model: Any, dt: float) -> Step:
    aba, integrate, data, tau = pin.aba, pin.integrate, model.createData(), np.zeros(model.nv)

    def step(q: Array, v: Array) -> tuple[Array, Array]:
        v = v + dt * aba(model, data, q, v, tau)
        return integrate(model, q, dt * v), v

    return step


def _rk4(pin: Any, model: Any, dt: float) -> Step:
    """Return the step k_i = dt (v, aba) at q exp(u_i), with u_3 and the last u corrected by a commutator.

    The signs are those of a group acting from the right, q' = q v, with v in body axes.
    """
    aba, integrate, data, tau = pin.aba, pin.integrate, model.createData(), np.zeros(model.nv)

    def step(q: Array, v: Array) -> tuple[Array, Array]:
        k1, a1 = dt * v, dt * aba(model, data, q, v, tau)
        v2 = v + a1 / 2
        k2, a2 = dt * v2, dt * aba(model, data, integrate(model, q, k1 / 2), v2, tau)
        v3 = v + a2 / 2
        k3, a3 = dt * v3, dt * aba(model, data, integrate(model, q, k2 / 2 + _cross(k1, k2) / 8), v3, tau)
        v4 = v + a3
        k4, a4 = dt * v4, dt * aba(model, data, integrate(model, q, k3), v4, tau)
        u = (k1 + 2 * (k2 + k3) + k4 + _cross(k1, k4) / 2) / 6
        return integrate(model, q, u), v + (a1 + 2 * (a2 + a3) + a4) / 6

    return step


def _cross(a: Array, b: Array) -> Array:
    """Return a x b for single vectors; `numpy.cross` costs more than `aba`."""
    a1, a2, a3 = a.tolist()
    b1, b2, b3 = b.tolist()
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])
