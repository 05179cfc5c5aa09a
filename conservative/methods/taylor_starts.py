"""Other starts of a run of `Taylor`: the constants of the body, and where the numbers of a run are, for `kernels.starts`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ..attitude import Array
from ..deferred_imports import kernels
from ..potentials.turning import Turning
from ..scene import Scene
from .principal_axes import PrincipalStart, slow_axes
from .taylor_model import POLE, axes_of, is_reducible


def count(value: Any) -> int:
    """Return the number of numbers in a tuple of tuples."""
    return sum(map(count, value)) if isinstance(value, tuple) else 1


def bind_restart(scene: Scene, start: PrincipalStart, model: Any, frame: Any, numbers: Array) -> Callable[[Array, Array], bool]:
    """Return a function that writes another start, R_WB0 (3, 3) and w_WB_B0 (3,), into the numbers of a run.

    `frame` is the `Frame` of the kernel `dense`; None for `taylor`, for which motions are reduced. The function returns False,
    and writes nothing, if that is not possible (`kernels.starts.restart`).
    """
    kernel, axial = kernels("starts"), kernels("axial")
    parts, at = {}, 0
    for name, value in zip(model._fields, model, strict=True):
        parts[name], at = at, at + count(value)
    kinds = {kernels("taylor").Free: kernel.FREE, axial.Polhode: kernel.POLHODE, axial.Nutation: kernel.TOP}
    kind, tail = kinds.get(type(model.field), kernel.FIELD), len(numbers) - kernels("samples").END
    axes_D, spin, first = -1, -1, -1
    if frame is not None:
        axes_D, first = at, tail - 12
        spin = at + count(frame[:3]) if frame.spin else -1
    places = (parts[name] for name in ("scales", "left", "g", "a", "q", "L", "field"))
    layout = np.array([kind, *places, axes_D, spin, first, tail])

    spinning = start.spin is not None
    body, rotation = np.zeros(kernel.SIZE), np.eye(3) if start.R_BP is None else start.R_BP
    body[kernel.R_BP : kernel.J] = rotation.reshape(9)
    moments = start.J
    if spinning:
        _, J1, J3 = slow_axes(scene)
        moments = J1, J1, J3
    body[kernel.J : kernel.J_INVERSE], body[kernel.J_INVERSE : kernel.R_WD] = moments, start.J_inverse
    body[kernel.R_WD : kernel.POTENTIAL] = axes_of(scene).reshape(9)
    body[kernel.POTENTIAL] = scene.potential.scale() if scene.potential else 0.0
    body[kernel.LARGEST_J] = scene.body.moments.max()
    if scene.body.rotor_momentum is not None:
        body[kernel.ROTOR_SIZE] = np.linalg.norm(scene.body.rotor_momentum)
        body[kernel.ROTOR : kernel.SPINNING] = start.rotor
    if isinstance(scene.potential, Turning):
        body[kernel.RATE] = scene.potential.orbit.rate
    body[kernel.SPINNING] = spinning
    if frame is None and is_reducible(start):
        body[kernel.REDUCIBLE], body[kernel.MOMENT] = 1.0, 2.0 * start.field.z * start.J_inverse[0]
    body[kernel.POLE] = POLE
    return partial(kernel.restart, body, layout, numbers)
