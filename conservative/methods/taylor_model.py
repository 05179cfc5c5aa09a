"""The motion of one body as the model of the kernel `taylor`: rows of the attitude's matrix, or the oscillation that is left.

With equal steps a free body, and a symmetric top in gravity away from the vertical, are reduced to an oscillation and angles.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ..attitude import Array, axes_about, triple
from ..deferred_imports import kernels
from ..invariants import momentum_W
from ..potentials.turning import Turning
from ..potentials.uniform_gravity import UniformField
from ..scene import Scene
from .principal_axes import PrincipalStart, field_axis, invariant_scales, principal_start, quadruple, start_along

POLE = 0.2
"""Distance of the height of a top's axis from 1 and -1 that its reduced motion needs: its angles have poles there. At 0.05,
quadrature leaves 4e-9 rad where the series of order 18 leaves 1e-15."""


def find_model(scene: Scene, reduced: bool) -> tuple[PrincipalStart, Any]:
    """Return the start of a scene in principal axes and the kernel's model of it, `reduced` to an oscillation if possible."""
    # Where body and field share an axis of symmetry, the frame does not spin, and the third component of L must not change.
    symmetric = scene.symmetry_axis_B is not None
    start, loose = principal_start(scene, "non_spinning" if symmetric else "body"), (1.0, 1.0, 0.0 if symmetric else 1.0)
    if isinstance(scene.potential, Turning):
        start = replace(start, orbit=scene.potential.orbit)
    rotor = start.rotor or ()
    kernel, R_WD, momentum = kernels("taylor"), axes_of(scene), math.hypot(*(np.add(start.L, rotor) if rotor else start.L))
    free = not (field_axis(scene) or isinstance(scene.potential, Turning))
    if free and momentum > 0 and not start.spin and not rotor:
        # The momentum of a free body circulates about the axis of the largest or of the smallest moment: here about the third.
        J, L = np.array(start.J), np.array(start.L)
        shift = 2 - int(np.argmax(J) if L @ (L / J) * np.median(J) < L @ L else np.argmin(J))
        start = start_along(scene, np.roll(scene.body.R_BP, shift, axis=1), np.roll(scene.body.moments, shift))
    R_DP = R_WD.T @ scene.R_WB0 @ (np.eye(3) if start.R_BP is None else start.R_BP)
    reduction = None
    if reduced and free and momentum > 0 and not rotor:
        reduction = reduce_free(start, R_DP)
    elif reduced and is_reducible(start):
        reduction = reduce_top(start, R_DP)
    field, *rows = reduction or (kernel.Free(momentum) if free else start.field, triple(R_DP[2]), triple(R_DP[0]))
    body = start.J, start.J_inverse, field, loose, invariant_scales(scene)
    return start, kernel.Model(*body, quadruple(R_WD), *rows, start.q, start.L, rotor)


def is_reducible(start: PrincipalStart) -> bool:
    """Return whether the motion is that of a symmetric top in gravity, which is reduced away from the vertical."""
    return isinstance(start.field, UniformField) and start.spin is not None


def reduce_free(start: PrincipalStart, R_DP: Array) -> tuple[Any, ...]:
    """Return the kernel's field, x and angles of a free body whose momentum circulates about the third axis."""
    axial, momentum, g = kernels("axial"), math.hypot(*start.L), R_DP[2]
    axis = math.copysign(1.0, g[2])
    row, factors = axial.move_along(g, (0.0, 0.0, axis), R_DP[0]), momentum * np.array(start.J_inverse)
    slopes = np.roll(factors, 1) - np.roll(factors, -1)  # g1' = slope g2 g3 and its kin; the squares are linear in each other
    products = np.roll(slopes, 1) * np.roll(slopes, -1)
    linear = products @ g**2 - 3 * products * g**2
    numbers = triple(factors), triple(linear), triple(4 * products), float(g**2 @ factors), axis, triple(np.array(row))
    return axial.Polhode(*numbers), triple(g), ((0.0, 0.0),)


def reduce_top(start: PrincipalStart, R_DP: Array) -> tuple[Any, ...] | None:
    """Return the kernel's field, x and angles of a symmetric top in gravity; None if its axis comes near the vertical."""
    g, w, wide = R_DP[2], np.array(start.L) * start.J_inverse, math.hypot(*R_DP[2, :2])
    if abs(g[2]) >= 1.0 - POLE:
        return None
    along, spin, moment = float(g @ w), float(w[2]), 2.0 * start.field.z * start.J_inverse[0]
    turns = tuple((R_DP[:2, 2] / wide).tolist()), (-g[0] / wide, g[1] / wide)
    top = kernels("axial").Nutation(along, spin, w[0] ** 2 + w[1] ** 2 + moment * g[2], moment, turns)
    if max(top.cubic(end)[0] for end in (POLE - 1.0, 1.0 - POLE)) >= 0:  # u'^2, negative where the top does not come
        return None
    return top, (g[2], g[0] * w[1] - g[1] * w[0]), ((0.0, 0.0), (0.0, 0.0))


def axes_of(scene: Scene) -> Array:
    """Return the rotation (3, 3) to the world from axes D, of which the third is the field's and, if it turns, it turns about
    the second. Where nothing acts, the third is the direction of the momentum.
    """
    if isinstance(scene.potential, Turning):
        second, third = scene.potential.orbit.normal_W, np.asarray(scene.potential.potential.axis_W)
        return np.stack([np.cross(second, third), second, third], axis=1)
    axis, momentum = field_axis(scene), momentum_W(scene.body, scene.R_WB0, scene.w_WB_B0)
    size = float(np.linalg.norm(momentum))
    return axes_about(np.array(axis) if axis else momentum / size if size > 0 else np.array((0.0, 0.0, 1.0)))
