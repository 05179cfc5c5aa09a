"""Units in which a scene is of order one: powers of two, so that conversions do not round.

The equations of motion are the same in units M of moments of inertia, T of times and M/T^2 of energies. Methods integrate in
units in which the largest moment and the rate that the energy allows are of order one, so that their tolerances and thresholds
have the same meaning for bodies of any size. Exponents of the units are multiples of 16, rounded towards 0. A scene whose
largest moment is between 2^-16 and 2^16 kg m^2 and whose rate is between 2^-16 and 2^16 rad/s is therefore not converted. A
scene whose potential has no `in_units` is not converted either.

Source: dimensional analysis; see E. Buckingham, On physically similar systems (1914).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np

from ..attitude import Array
from ..check import read_only, replace_unchecked
from ..grid import Grid
from ..method import Method, Run
from ..potentials.potential import depends_on_time
from ..potentials.turning import static_part
from ..scene import Scene
from ..trajectory import Trajectory
from .run_kernel import KernelRun

AnyMethod = TypeVar("AnyMethod", bound=Method)
Prepare = Callable[[AnyMethod, Scene, Grid], Run]

COARSE = 16
"""Exponents of units are multiples of this."""
SHORTEST = -64
"""Exponent of the shortest step in units of time. For shorter steps, the step determines the unit."""


@dataclass(frozen=True)
class Units:
    """Units of moments of inertia, kg m^2, and of time, s: powers of two."""

    moment: float
    time: float

    @property
    def supply(self) -> Array:
        """Units (4,) of work, J, and impulse, N m s."""
        return self.moment / self.time / np.array([self.time, 1.0, 1.0, 1.0])

    def convert(self, scene: Scene) -> Scene:
        """Return the scene in these units. Its numbers may be outside the range that constructors allow."""
        energy, potential = self.moment / self.time / self.time, cast(Any, scene.potential)
        if potential is not None:
            potential = potential.in_units(energy, self.time) if depends_on_time(potential) else potential.in_units(energy)
        rotor, motor, flight = scene.body.rotor_momentum, scene.body.motor, scene.flight
        if flight is not None:
            mass, g, v_WB0 = flight.mass / self.moment, flight.g * self.time**2, read_only(flight.v_WB0 * self.time)
            flight = replace_unchecked(flight, mass=mass, g=g, v_WB0=v_WB0)
        if rotor is not None:
            rotor = read_only(rotor / self.moment * self.time)
        motor = motor and motor.in_units(self.moment / self.time, self.time)
        inertia = read_only(scene.body.inertia / self.moment)
        return replace_unchecked(
            scene,
            body=replace_unchecked(scene.body, inertia=inertia, rotor_momentum=rotor, motor=motor),
            w_WB_B0=read_only(scene.w_WB_B0 * self.time),
            t_end=scene.t_end / self.time,
            potential=potential,
            torque=scene.torque and scene.torque.in_units(energy, self.time),
            damping=scene.damping and scene.damping.in_units(energy, self.time),
            dt=scene.dt / self.time,
            extra_invariants=(),
            flight=flight,
        )

    def restore(self, trajectory: Trajectory, scene: Scene, grid: Grid) -> Trajectory:
        """Convert a trajectory from these units to SI units; `scene` and `grid` are in SI units."""
        failure = trajectory.failure
        if failure and "time" in vars(failure):
            values = {name: value for name, value in vars(failure).items() if name != "outcome"}
            failure = type(failure)(**values | {"time": values["time"] * self.time})
        w_WB_B = trajectory.w_WB_B / self.time
        supplied = None if trajectory.supplied is None else trajectory.supplied * self.supply
        frame = trajectory.frame and (trajectory.frame[0], trajectory.frame[1] / self.time)
        control = trajectory.control
        if control is not None and control.rough is not None:
            control = control._replace(rough=control.rough * self.time)
        changes: dict[str, Any] = {"w_WB_B": w_WB_B, "failure": failure, "supplied": supplied, "frame": frame}
        return replace(trajectory, scene=scene, t=grid.t[: len(trajectory)], control=control, **changes)


SI = Units(1.0, 1.0)


def find_units(scene: Scene, dt: float) -> Units:
    """Return the units, powers of two of kg m^2 and s, in which a scene is of order one and a step dt, s, not much smaller."""
    potential = scene.potential
    if potential is not None and not (hasattr(potential, "in_units") and hasattr(static_part(potential), "in_units")):
        return SI
    moment, rate = scene.magnitudes
    step = math.frexp(dt)[1]
    time = step if rate is None else min(-rate, step - SHORTEST)
    if abs(moment) < COARSE and abs(time) < COARSE:
        return SI
    moment, time = COARSE * int(moment / COARSE), COARSE * int(time / COARSE)
    return Units(2.0**moment, 2.0**time)


def find_units_of_bodies(moments: Array, energy: Array, dt: float) -> list[Array]:
    """Return units (n,) of moments, kg m^2, and of time, s, for a step dt, s: the rule of `find_units` for arrays.

    Bodies have moments (n, 3), kg m^2, and energies (n,), J. For one scene this would take 14 us, `find_units` takes 0.3 us.
    """
    moment, step = np.frexp(moments.max(axis=1))[1], int(np.frexp(dt)[1])
    rate = (np.frexp(energy)[1] - moment) // 2
    time = np.where(energy > 0, np.minimum(-rate, step - SHORTEST), step)
    return [np.ldexp(1.0, COARSE * np.trunc(exponent / COARSE).astype(int)) for exponent in (moment, time)]


def convert_scene(scene: Scene, units: Units) -> Scene:
    """Return the scene in other units."""
    return scene if units is SI else units.convert(scene)


def bound_rate(scene: Scene) -> float:
    """Return an upper bound of the angular speed, rad/s: all energy kinetic, about the axis of least inertia."""
    units = find_units(scene, scene.dt)
    of_order_one = scene.derive(convert_scene, units)
    return math.sqrt(2 * of_order_one.energy_scale / float(of_order_one.body.moments.min())) / units.time


def in_own_units(prepare: Prepare[AnyMethod]) -> Prepare[AnyMethod]:
    """Extend a `prepare` for scenes of order one to all scenes."""

    @wraps(prepare)
    def prepare_in_units(method: AnyMethod, scene: Scene, grid: Grid) -> Run:
        units = find_units(scene, grid.dt)
        if units is SI:
            return prepare(method, scene, grid)
        steps = Grid(grid.dt / units.time, grid.n_steps, grid.every)
        run = prepare(method, scene.derive(convert_scene, units), steps)

        def run_and_restore(R_WB0: Any = None, w_WB_B0: Any = None) -> Trajectory:
            if R_WB0 is not None or w_WB_B0 is not None:
                return restored.from_start(R_WB0, w_WB_B0)
            return units.restore(run(), scene, grid)

        restored = KernelRun(run_and_restore)
        restored.own_loop = getattr(run, "own_loop", run)
        return restored

    return prepare_in_units
