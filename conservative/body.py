"""The rigid body: its inertia about the fixed point, and the momentum of a rotor in it."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .attitude import Array, triple
from .check import PickledByFields, numbers, read_inertia, read_only, set_fields
from .errors import ImpossibleInertia
from .features import Feature, Features
from .potentials.load import Given, RotorMomentum

_EQUAL = 4e-15
"""Largest difference of two equal moments of a rotated tensor, relative to the largest: twice the 2e-15 of 3,000 tensors."""
_ROUND_OFF = 1e-6
"""Relative excess of a moment over the sum of the others that counts as rounding, as of a plate in a file with seven digits."""


def is_impossible(moments: Array) -> Any:
    """Return whether no mass distribution has these moments (..., 3): one exceeds the sum of the others, beyond round-off."""
    return 2 * moments.max(axis=-1) > moments.sum(axis=-1) * (1 + _ROUND_OFF)


@dataclass(frozen=True, eq=False, init=False)
class RigidBody(PickledByFields):
    """A rigid body that rotates about a fixed point.

    Parameters
    ----------
    inertia
        Principal moments (3,) or inertia tensor (3, 3) about the fixed point, in body axes, kg m^2. The largest component has
        to be 1e-60 to 1e60 kg m^2, beside a field or a load 1e-30 to 1e30. A rod has no third moment: (1e-9 I, I, I),
        without a rate about the first axis. Integrate it to an error, `integrate(scene, error=1e-6)`: many methods need very
        short steps for a rod (see `Reduced`).
    rotor_momentum
        Momentum h (3,) of a rotor, kg m^2/s, body axes; None or zeros without one. The angular momentum is J w + h.
        The kinetic energy is w'J w / 2, without the energy of the rotor itself. For a rotor with moment I about its
        axis n that is driven at a constant speed s relative to the body, J includes the rotor and h = I s n. For one
        without a motor torque, J includes it without I n n', and h = I (s + n.w) n. With a motor that changes it, h is a
        function of time, s, or a table (times (n,), values (n, 3)), as for `Torque`, without jumps. The motor's reaction on the
        body is included, J w' = (J w + h) x w - h' + T; do not add it as a torque. The attribute then has h at t = 0.
    breaks
        Times (n,), s, at which a function h has a corner; see `Torque`.

    Raises
    ------
    BadInput
        The inertia is not finite, not symmetric, not positive definite, or of another shape; or a tensor that is not diagonal
        has moments with a ratio above 1e13. Or the rotor momentum is not three finite numbers.
    ImpossibleInertia
        A warning: no mass distribution has the moments (J1 + J2 < J3). The equations hold for them, but engines reject them.

    Attributes
    ----------
    motor
        h as a function of time or a table; None if it is constant.
    """

    inertia: Array
    rotor_momentum: Array | None = None
    motor: RotorMomentum | None = None

    def __init__(
        self,
        inertia: ArrayLike,
        rotor_momentum: Given | None = None,
        motor: RotorMomentum | None = None,
        *,
        breaks: ArrayLike = (),
    ) -> None:
        if motor is None and rotor_momentum is not None:
            momentum = RotorMomentum(rotor_momentum, breaks)
            motor, rotor_momentum = None if momentum.constant else momentum, momentum.at(0.0)
        rotor = None if rotor_momentum is None else np.asarray(rotor_momentum, dtype=float)
        rotor = None if rotor is None or not rotor.any() else read_only(rotor)
        set_fields(self, inertia=read_inertia(inertia), rotor_momentum=rotor, motor=motor)
        if is_impossible(self.moments):
            warnings.warn(ImpossibleInertia(self.moments.tolist()), stacklevel=2)

    @property
    def features(self) -> Features:
        """Members of `Feature` for scenes with this body."""
        rotor = set() if self.rotor_momentum is None and self.motor is None else {Feature.ROTOR}
        return frozenset(rotor if self.motor is None else {Feature.MOTOR})

    @cached_property
    def _principal(self) -> tuple[Array, Array]:
        """Moments and axes. A diagonal tensor keeps its axes in their order."""
        if np.count_nonzero(self.inertia - np.diag(np.diag(self.inertia))) == 0:
            return np.diag(self.inertia).copy(), np.eye(3)
        moments, axes = np.linalg.eigh(self.inertia)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        return moments, axes

    @property
    def moments(self) -> Array:
        """Principal moments (3,), kg m^2, in the order of the columns of `R_BP`."""
        return self._principal[0]

    @property
    def R_BP(self) -> Array:
        """Rotation (3, 3) from principal to body components."""
        return self._principal[1]

    @cached_property
    def condition(self) -> float:
        """Ratio of the largest principal moment to the smallest."""
        return float(self.moments.max() / self.moments.min())

    @cached_property
    def inverse(self) -> Array:
        """Inverse inertia (3, 3), 1/(kg m^2), body axes."""
        return self.R_BP @ np.diag(1 / self.moments) @ self.R_BP.T

    def momentum(self, w_WB_B: ArrayLike, t: ArrayLike = 0.0) -> Array:
        """Return the angular momentum (..., 3), kg m^2/s, including the rotor's, for rates (..., 3), rad/s; body axes.

        Times (...), s, matter if the rotor has a motor.
        """
        of_body = numbers("w_WB_B", w_WB_B) @ self.inertia
        if self.motor is not None:
            times = numbers("t", t)
            return of_body + np.array([self.motor.at(time) for time in times.ravel().tolist()]).reshape(*times.shape, 3)
        return of_body if self.rotor_momentum is None else of_body + self.rotor_momentum

    def rotor_along(self, R_BF: Array) -> tuple[float, float, float] | None:
        """Return the momentum of the rotor in axes F, given the rotation R_BF (3, 3) from F to body axes; None without one."""
        return None if self.rotor_momentum is None else triple(self.rotor_momentum @ R_BF)

    def symmetry_axis(self, tolerance: float = 1e-14) -> int | None:
        """Return the index (0, 1, 2) of the principal axis of symmetry; None for an asymmetric body, 2 for a spherical one.

        Two moments are equal if they differ by at most `tolerance` relative to the larger one, or by the round-off of the
        tensor.
        """
        J = self.moments
        round_off = 0.0 if np.array_equal(self.R_BP, np.eye(3)) else min(tolerance, _EQUAL) * J.max()
        for axis in (2, 1, 0):
            a, b = J[(axis + 1) % 3], J[(axis + 2) % 3]
            if abs(a - b) <= max(tolerance * max(a, b), round_off):
                return axis
        return None

    def __repr__(self) -> str:
        diagonal = np.array_equal(self.inertia, np.diag(np.diag(self.inertia)))
        rotor = "" if self.rotor_momentum is None else f", rotor_momentum={self.rotor_momentum.tolist()}"
        rotor = rotor if self.motor is None else f", rotor_momentum={self.motor.value!r}"
        return f"RigidBody(inertia={(np.diag(self.inertia) if diagonal else self.inertia).tolist()}{rotor})"
