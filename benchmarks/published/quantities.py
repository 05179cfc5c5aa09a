"""What is measured of a motion, to be compared with a printed figure: one function a quantity."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from conservative.attitude import Array, angle_between, to_quaternion
from conservative.check import MOST_STEPS
from conservative.method import Grid, Method, grid_for
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.references.truth import reference
from conservative.scene import Scene
from conservative.trajectory import Trajectory

FINE = 16
"""How much shorter steps are in a run that stands for the motion: what MuJoCo's test of convergence takes."""


@dataclass(frozen=True, eq=False)
class Runs:
    """What a figure is measured with: a scene, a method (None: the truth), its step, s, and a method to compare it with."""

    scene: Scene
    method: Method | None
    dt: float
    other: Method | None = None

    def run(self) -> Trajectory:
        """Return the trajectory with all of its steps."""
        return _solve(self.method, self.scene, grid_for(self.scene, self.dt))

    def end(self, dt: float | None = None, other: bool = False) -> Trajectory:
        """Return the start and the end of the trajectory, by default at the step of the figure."""
        return _solve(self.other if other else self.method, self.scene, self._ends(dt or self.dt))

    def true(self) -> Trajectory:
        """Return the motion at all steps."""
        return reference(self.scene, grid_for(self.scene, self.dt)).trajectory

    def true_end(self, dt: float | None = None) -> Trajectory:
        """Return the start and the end of the motion."""
        return reference(self.scene, self._ends(dt or self.dt)).trajectory

    def _ends(self, dt: float) -> Grid:
        return grid_for(self.scene, dt, sample_every=MOST_STEPS)


def _solve(method: Method | None, scene: Scene, grid: Grid) -> Trajectory:
    """Return a run, or the motion if there is no method; raise what ended a run that did not reach its end."""
    if method is None:
        return reference(scene, grid).trajectory
    trajectory = method.solve(scene, grid)
    if trajectory.failure is not None:
        raise trajectory.failure
    return trajectory


Quantity = Callable[[Runs], Array]


def spin(runs: Runs) -> Array:
    """Return the second world component of the angular velocity at the end, rad/s."""
    return _world_rates(runs.end())[1:2]


def quaternion(runs: Runs) -> Array:
    """Return the attitude at the end as a unit quaternion (4,), scalar first and positive."""
    q = to_quaternion(runs.end().R_WB[-1])
    return q * math.copysign(1.0, q[0])


def modified_rodrigues(runs: Runs) -> Array:
    """Return the attitude at the end as modified Rodrigues parameters (3,), of at most half a turn."""
    q = quaternion(runs)
    return q[1:] / (1 + q[0])


def displacement(runs: Runs) -> Array:
    """Return by how much the centre of mass has moved at the end (3,), m, world axes."""
    found, potential = runs.end(), runs.scene.potential
    assert isinstance(potential, UniformGravity)
    return np.asarray((found.R_WB[-1] - found.R_WB[0]) @ potential.com_B)


def energy(runs: Runs) -> Array:
    """Return the energy at the end, J."""
    return runs.end().energy[-1:]


def energy_ratio(runs: Runs) -> Array:
    """Return the energy at the end relative to that at the start."""
    found = runs.end().energy
    return found[-1:] / found[0]


def largest_energy_ratio(runs: Runs) -> Array:
    """Return the largest energy relative to that at the start."""
    found = runs.run().energy
    return np.array([found.max() / found[0]])


def energy_drift(runs: Runs) -> Array:
    """Return the largest change of the energy relative to its start."""
    return _drift(runs.run().energy)


def momentum_length_drift(runs: Runs) -> Array:
    """Return the largest change of the length of the angular momentum relative to its start."""
    return _drift(np.linalg.norm(runs.run().momentum_W, axis=1))


def vertical_momentum_drift(runs: Runs) -> Array:
    """Return the largest change of the angular momentum about the vertical relative to its start."""
    return _drift(runs.run().momentum_W[:, 2])


def momentum_change(runs: Runs) -> Array:
    """Return the length of the change of the angular momentum until the end, kg m^2/s, world axes."""
    found = runs.end().momentum_W
    return np.array([np.linalg.norm(found[-1] - found[0])])


def relative_momentum_change(runs: Runs) -> Array:
    """Return the same relative to the length at the start."""
    found = runs.end().momentum_W
    return np.array([np.linalg.norm(found[-1] - found[0]) / np.linalg.norm(found[0])])


def momentum_drift(runs: Runs) -> Array:
    """Return the largest length of the change of the angular momentum, world axes, relative to its length at the start."""
    found = runs.run().momentum_W
    return np.array([np.linalg.norm(found - found[0], axis=1).max() / np.linalg.norm(found[0])])


def element_error(runs: Runs) -> Array:
    """Return the largest error of an element of the rotation matrix at the end."""
    return np.array([np.abs(runs.end().R_WB[-1] - runs.true_end().R_WB[-1]).max()])


def world_rate_error(runs: Runs) -> Array:
    """Return the largest error of a world component of the angular velocity at the end, rad/s."""
    return np.array([np.abs(_world_rates(runs.end()) - _world_rates(runs.true_end())).max()])


def attitude_error(runs: Runs) -> Array:
    """Return the largest attitude error, rad."""
    return np.array([angle_between(runs.run().R_WB, runs.true().R_WB).max()])


def order_of_attitude(runs: Runs) -> Array:
    """Return the order of the attitude's error at the end, from a step and half of it."""
    return np.log2([_attitude_at_end(runs, runs.dt) / _attitude_at_end(runs, runs.dt / 2)])


def order_of_rates(runs: Runs) -> Array:
    """Return the order of the rates' error at the end, from a step and half of it."""
    return np.log2([_rates_at_end(runs, runs.dt) / _rates_at_end(runs, runs.dt / 2)])


def rates_against_other(runs: Runs) -> Array:
    """Return the error of the rates at the end relative to that of the other method."""
    return np.array([_rates_at_end(runs, runs.dt) / _rates_at_end(runs, runs.dt, other=True)])


def halving_ratio(runs: Runs) -> Array:
    """Return how many times nearer the quaternion at the end comes to that of far shorter steps after halving the step."""
    ends = [to_quaternion(runs.end(runs.dt / part).R_WB[-1]) for part in (1, 2, FINE)]
    coarse, fine = (min(np.linalg.norm(q - ends[2]), np.linalg.norm(q + ends[2])) for q in ends[:2])
    return np.array([coarse / fine])


def position_ratio(runs: Runs) -> Array:
    """Return how many times smaller the error of the centre of mass at the end is after halving the step."""
    errors = [np.linalg.norm(_com(runs.end(dt)) - _com(runs.true_end(dt))) for dt in (runs.dt, runs.dt / 2)]
    return np.array([errors[0] / errors[1]])


def turn_of_a_step(runs: Runs) -> Array:
    """Return the angle that the body turns in the first step, degrees."""
    found = reference(runs.scene, Grid(runs.dt, 1)).trajectory
    return np.degrees([angle_between(found.R_WB[1], found.R_WB[0])]).ravel()


def _world_rates(found: Trajectory) -> Array:
    return np.asarray(found.R_WB[-1] @ found.w_WB_B[-1])


def _drift(values: Array) -> Array:
    return np.array([np.abs(values / values[0] - 1).max()])


def _com(found: Trajectory) -> Array:
    potential = found.scene.potential
    assert isinstance(potential, UniformGravity)
    return np.asarray(found.R_WB[-1] @ potential.com_B)


def _attitude_at_end(runs: Runs, dt: float) -> float:
    return float(angle_between(runs.end(dt).R_WB[-1], runs.true_end(dt).R_WB[-1]))


def _rates_at_end(runs: Runs, dt: float, other: bool = False) -> float:
    return float(np.linalg.norm(runs.end(dt, other).w_WB_B[-1] - runs.true_end(dt).w_WB_B[-1]))


QUANTITIES: Mapping[str, Quantity] = MappingProxyType(
    {
        function.__name__: function
        for function in (
            *(spin, quaternion, modified_rodrigues, displacement, turn_of_a_step),
            *(energy, energy_ratio, largest_energy_ratio, energy_drift),
            *(momentum_length_drift, vertical_momentum_drift, momentum_change, relative_momentum_change, momentum_drift),
            *(element_error, world_rate_error, attitude_error),
            *(order_of_attitude, order_of_rates, rates_against_other, halving_ratio, position_ratio),
        )
    }
)
