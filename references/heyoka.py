"""heyoka: Taylor integration at any tolerance, on the formulation that suits it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from conservative.attitude import Array, from_quaternion, hat
from conservative.check import choice, finite_number
from conservative.errors import BadInput
from conservative.method import Grid, Method, Run
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from . import taylor
from .engine import Axes, gravity_or_free, principal_axes, symmetric_axes, version

FRAMES = ("body", "non_spinning")

Readout = Callable[[Array, Array], tuple[Array, Array]]


@dataclass(frozen=True, eq=False)
class Formulation:
    """A scene as heyoka integrates it.

    Attributes
    ----------
    axes
        Axes F in which it is written.
    form, parameters, start
        Equations, values of their parameters, state at t = 0.
    readout
        Attitudes (n, 3, 3) and rates (n, 3) in F from times (n,) and states (n, m).
    """

    axes: Axes
    form: taylor.Form
    parameters: list[float]
    start: Array
    readout: Readout


@dataclass(frozen=True)
class Heyoka(Method):
    """heyoka's adaptive Taylor integrator in double precision; dt is only the distance of samples.

    Compiled integrators are kept per formulation and tolerance, in heyoka's fastest mode (not compact, not high-accuracy;
    `fast_math` gains nothing and is left off). Samples are Taylor polynomials of the steps, so they cost no accuracy.

    Parameters
    ----------
    tol
        Relative error of a step, above 0 and below 1. Values below 2.2e-16 are round-off with a term or two more.
    frame
        "body": quaternion and body rates in principal axes. "non_spinning", for a body symmetric about an axis, free or in a field
        along it: quaternion of the frame that turns with l/J1, and world momentum l; spin in closed form afterwards.

    Raises
    ------
    BadInput
        tol is out of range or the frame is unknown.
    MissingEngine
        heyoka is not installed.
    """

    tol: float = 1e-16
    frame: str = "body"

    family: ClassVar[str] = "heyoka"
    room: ClassVar[Literal["ours", "engine", "truth"]] = "engine"

    def __post_init__(self) -> None:
        if not 0 < finite_number("tol", self.tol, "a number above 0 and below 1") < 1:
            raise BadInput("tol", repr(self.tol), "a number above 0 and below 1")
        choice("frame", self.frame, FRAMES)
        version("heyoka", "heyoka")

    @property
    def label(self) -> str:
        return f"heyoka=={version('heyoka', 'heyoka')}/tol={self.tol:g},{self.frame}"

    @property
    def order(self) -> None:
        return None

    def unsupported(self, scene: Scene) -> str | None:
        reason = gravity_or_free(scene)
        if reason is None and self.frame == "non_spinning" and symmetric_axes(scene) is None:
            return "a non-spinning frame needs a body symmetric about an axis, free or with its centre of mass on that axis"
        return reason

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        problem = (_body if self.frame == "body" else _non_spinning)(scene)
        integrator = taylor.compiled(problem.form, self.tol)

        def run() -> Trajectory:
            # The integrator is shared by all scenes of its form, and holds what the last run left.
            integrator.time = 0.0
            integrator.state[:], integrator.pars[:] = problem.start, problem.parameters
            outcome, _, _, steps, _, states = integrator.propagate_grid(grid.t)
            R_WF, w = problem.readout(grid.t[: len(states)], states)
            return problem.axes.trajectory(grid, self.label, R_WF, w, Counters(int(steps)), f"heyoka: {outcome.name}")

        return run

    @classmethod
    def variants(cls) -> tuple[Method, ...]:
        bodies = tuple(cls(tol) for tol in (1e-6, 1e-9, 1e-12, 1e-16))
        return (*bodies, *(cls(tol, "non_spinning") for tol in (1e-6, 1e-9, 1e-12, 1e-16)))


def _body(scene: Scene) -> Formulation:
    axes = principal_axes(scene)
    J1, J2, J3 = axes.J
    gyroscopic = [(J2 - J3) / J1, (J3 - J1) / J2, (J1 - J2) / J3]
    # The torque is g x m, with g the vertical and m the moment of the weight.
    turning = -hat(axes.moment) / axes.J[:, None]
    form, parameters = taylor.form_of(taylor.body, [*gyroscopic, *turning.ravel()])

    def readout(_: Array, states: Array) -> tuple[Array, Array]:
        return from_quaternion(states[:, :4]), states[:, 4:]

    return Formulation(axes, form, parameters, np.concatenate([axes.q0, axes.w0]), readout)


def _non_spinning(scene: Scene) -> Formulation:
    axes = symmetric_axes(scene)
    assert axes is not None  # `unsupported` has seen to it
    J1, _, J3 = axes.J
    u0 = scene.R_WB0 @ scene.body.momentum(scene.w_WB_B0) / J1
    form, parameters = taylor.form_of(taylor.non_spinning, [axes.moment[2] / J1, u0[2]])
    spin = (1 - J3 / J1) * axes.w0[2]

    def readout(t: Array, states: Array) -> tuple[Array, Array]:
        R_WS = from_quaternion(states[:, :4])
        u = np.column_stack([states[:, 4:], np.full(len(t), u0[2])])
        R_SF = _about_3(spin * t)
        u_F = np.einsum("nji,nj->ni", R_WS @ R_SF, u)
        return R_WS @ R_SF, u_F * [1, 1, J1 / J3]

    return Formulation(axes, form, parameters, np.concatenate([axes.q0, u0[:2]]), readout)


def _about_3(angle: Array) -> Array:
    """Return rotations (n, 3, 3) about the third axis by angles (n,), rad."""
    out = np.zeros((len(angle), 3, 3))
    out[:, 0, 0] = out[:, 1, 1] = np.cos(angle)
    out[:, 1, 0] = np.sin(angle)
    out[:, 0, 1] = -out[:, 1, 0]
    out[:, 2, 2] = 1
    return out
