"""A batch: n bodies in scenes of one kind, in arrays with a leading body axis. A single body is a batch of one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .attitude import Array
from .check import replace_unchecked
from .potentials.potential import AnyPotential
from .potentials.turning import Turning, static_part
from .potentials.varied import OneByOne, Varied
from .scene import Scene

NEARLY = 1e-11
"""Relative difference of moments below which the symmetry of a body is checked completely; larger than any tolerance."""


@dataclass(frozen=True, eq=False)
class Batch:
    """n independent bodies in scenes of one kind. The constructor does not check its arguments.

    Attributes
    ----------
    scene
        The scene that provides everything that the other attributes do not.
    R_WB0, w_WB_B0
        Initial attitudes (n, 3, 3), body to world, and angular velocities (n, 3), rad/s, body axes.
    inertia
        Tensors (n, 3, 3), kg m^2, body axes; None if all bodies have the scene's.
    parameters
        Parameters (n, ...) of the potential that differ between bodies, by name. For a turning field, parameters of the field
        in its own axes.
    """

    scene: Scene
    R_WB0: Array
    w_WB_B0: Array
    inertia: Array | None
    parameters: Mapping[str, Array]

    def __len__(self) -> int:
        return len(self.R_WB0)

    def __getitem__(self, part: slice | NDArray[Any]) -> Batch:
        inertia = None if self.inertia is None else self.inertia[part]
        parameters = {name: values[part] for name, values in self.parameters.items()}
        return Batch(self.scene, self.R_WB0[part], self.w_WB_B0[part], inertia, parameters)

    @classmethod
    def of(cls, scene: Scene) -> Batch:
        """Return the batch of one body of a scene."""
        return cls(scene, scene.R_WB0[None], scene.w_WB_B0[None], None, {})

    @cached_property
    def first(self) -> Scene:
        """The scene of body 0: `scene` itself, with its cache, if it is the only body."""
        scene = self.scene
        same = self.R_WB0.base is scene.R_WB0 and self.w_WB_B0.base is scene.w_WB_B0
        return scene if same and self.inertia is None and not self.parameters else self.take(0)

    def take(self, i: int) -> Scene:
        """Return the scene of body i."""
        body = self.scene.body if self.inertia is None else replace_unchecked(self.scene.body, inertia=self.inertia[i])
        potential = self.take_potential(i)
        return replace_unchecked(self.scene, body=body, potential=potential, R_WB0=self.R_WB0[i], w_WB_B0=self.w_WB_B0[i])

    def take_potential(self, i: int) -> AnyPotential | None:
        """Return the potential of body number i."""
        potential: Any = self.scene.potential
        if not self.parameters:
            return potential
        numbers = {name: values[i].item() if values[i].ndim == 0 else values[i] for name, values in self.parameters.items()}
        own = replace(static_part(potential), **numbers)
        return Turning(own, potential.orbit) if isinstance(potential, Turning) else own

    @cached_property
    def varied(self) -> Varied | OneByOne:
        """The fields of all bodies, with the parameters of each body. Fields that turn are in their own axes."""
        vary = getattr(static_part(self.scene.potential), "vary", None)
        if vary is not None:
            return vary(self.parameters)
        return OneByOne([static_part(self.take_potential(i)) for i in range(len(self))])

    @cached_property
    def principal(self) -> tuple[Array, Array]:
        """Principal moments (n, 3), kg m^2, and rotations R_BP (n, 3, 3), as in `RigidBody`."""
        n = len(self)
        if self.inertia is None:
            body = self.scene.body
            return np.broadcast_to(body.moments, (n, 3)), np.broadcast_to(body.R_BP, (n, 3, 3))
        return principal_axes(self.inertia)

    @cached_property
    def body_momenta(self) -> Array:
        """Initial momenta (n, 3), kg m^2/s, body axes, without the momentum of a rotor."""
        if self.inertia is None:
            return self.w_WB_B0 @ self.scene.body.inertia
        return np.asarray(np.sum(self.inertia * self.w_WB_B0[:, None], axis=2))  # ten times as fast as small products

    @property
    def momenta(self) -> Array:
        """Initial momenta (n, 3), kg m^2/s, body axes, with the momentum of a rotor."""
        h = self.scene.body.rotor_momentum
        return self.body_momenta if h is None else self.body_momenta + h

    @cached_property
    def kinetic_energies(self) -> Array:
        """Initial kinetic energies (n,), J, without the constant one of a rotor."""
        return np.asarray(np.einsum("ni,ni->n", self.body_momenta, self.w_WB_B0) / 2)

    @property
    def energies(self) -> Array:
        """Sums of all energies (n,), J, as `Scene.energies`, in a new array."""
        if self.scene.loaded:
            return np.array([self.take(i).energies for i in range(len(self))])
        if self.scene.potential is None:
            return self.kinetic_energies.copy()
        return self.kinetic_energies + (self.varied.scales() if self.parameters else self.scene.potential.scale())

    @cached_property
    def symmetry_axes_B(self) -> Array:
        """Unit vectors (n, 3), or (1, 3) for all, body axes, about which body and field are symmetric; nan without one.

        They are nan for all bodies if the scene itself has no such axis.
        """
        if self.scene.symmetry_axis_B is None:
            return np.full((1, 3), np.nan)
        if self.inertia is None and not self.parameters:
            return self.scene.symmetry_axis_B[None]
        axes_B = np.full((len(self), 3), np.nan)
        J = np.sort(self.principal[0], axis=1)
        for i in np.flatnonzero(np.diff(J, axis=1).min(axis=1) <= NEARLY * J[:, 2]).tolist():
            axis = self.take(i).symmetry_axis_B
            if axis is not None:
                axes_B[i] = axis
        return axes_B


def principal_axes(inertia: Array) -> tuple[Array, Array]:
    """Return moments (n, 3), kg m^2, and right-handed axes (n, 3, 3) of tensors; diagonal ones keep their own axes."""
    diagonal = np.diagonal(inertia, axis1=-2, axis2=-1)
    plain = np.count_nonzero(inertia - diagonal[..., None] * np.eye(3), axis=(-2, -1)) == 0
    moments, axes = np.linalg.eigh(inertia)
    axes[:, :, 2] *= np.sign(np.linalg.det(axes))[:, None]
    moments[plain], axes[plain] = diagonal[plain], np.eye(3)
    return moments, axes
