"""Checks of initial states and bodies of `integrate_many`, before any work.

Arrays are checked as a whole. The first invalid body is passed to the constructor of `Scene` or of its parts, which raises the
error.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import ROTATION_TOLERANCE, Array, orthonormality
from ..batch import Batch
from ..body import RigidBody, is_impossible
from ..check import LARGEST, SMALLEST, describe, finite_array, read_only, real_array, require_size, rotation
from ..errors import BadInput, ImpossibleInertia, nearest
from ..potentials.turning import static_part
from ..scene import Scene

RATES = "three finite rates (3,), rad/s"


def read_bodies(
    scene: Scene, R_WB0: Any, w_WB_B0: ArrayLike | None, inertia: ArrayLike | None, parameters: Mapping[str, ArrayLike] | None
) -> Batch:
    """Return n bodies from the arguments of `integrate_many`, with the values of the scene for everything that is None.

    Raise `BadInput` if an argument has the wrong shape, or `Scene` or one of its parts rejects a body.
    """
    with suppress(Exception):  # not a Rotation: the checks below report the error
        R_WB0 = R_WB0.as_matrix()
    given: dict[str, Array] = {}
    for name, value, shapes in (
        ("R_WB0", R_WB0, ((3, 3),)),
        ("w_WB_B0", w_WB_B0, ((3,),)),
        ("inertia", inertia, ((3,), (3, 3))),
    ):
        if value is not None:
            given[name] = _read(name, value, shapes, given)
    values = _read_parameters(scene, parameters, given)
    n = len(next(iter(given.values()))) if given else 1
    R = given.get("R_WB0", np.broadcast_to(scene.R_WB0, (n, 3, 3)))
    w = given.get("w_WB_B0", np.broadcast_to(scene.w_WB_B0, (n, 3)))
    if "R_WB0" in given:
        with np.errstate(all="ignore"):
            good = (orthonormality(R) <= ROTATION_TOLERANCE) & (np.linalg.det(R) > 0)
        _refuse_first("R_WB0", R, ~good, lambda value: rotation("R_WB0", value))
    if "w_WB_B0" in given:
        _refuse_first("w_WB_B0", w, ~_are_in_range(w), lambda value: finite_array("w_WB_B0", value, ((3,),), RATES))
    J = _read_inertia(given["inertia"]) if "inertia" in given else None
    if J is not None and scene.features:
        _refuse_first("inertia", J, ~_are_in_range(J), require_size)
    if J is not None and hasattr(static_part(scene.potential), "inertia") and "inertia" not in values:
        allowed = "{'inertia': ...} too, because the field has an inertia, which should equal the body's"
        raise BadInput("parameters", describe(parameters), allowed)
    if (J is not None or values) and scene.extra_invariants:
        scene = scene.rename(scene.name, extra_invariants=())  # they hold only for the scene's own body and field
    return Batch(scene, R, w, J, values)


def _read(name: str, value: Any, shapes: tuple[tuple[int, ...], ...], given: Mapping[str, Array]) -> Array:
    """Return an argument as a new array (n, ...). n has to agree with earlier arguments."""
    array = real_array(value)
    other = next(iter(given), None)
    expected_n = "n" if other is None else str(len(given[other]))  # "n" before the first argument
    allowed = "numbers of shape " + " or ".join(f"({expected_n},{','.join(f' {size}' for size in shape)})" for shape in shapes)
    allowed += "" if other is None else f": {expected_n} bodies, as {other} has"
    if array is None:
        raise BadInput(name, describe(value), allowed)
    if array.shape[1:] not in shapes or array.ndim == 0 or len(array) == 0 or expected_n not in ("n", str(len(array))):
        raise BadInput(name, f"shape {array.shape}", allowed)
    return read_only(array)


def _refuse_first(name: str, values: Array, bad: Any, check: Callable[[Any], object]) -> None:
    """Raise the error of `check` for the first row of `values` (n, ...) marked `bad` that it rejects, with its number."""
    for i in np.flatnonzero(bad).tolist():
        try:
            check(values[i])
        except BadInput as refusal:
            raise BadInput(f"{name}[{i}]", refusal.got, refusal.allowed) from None


def _are_in_range(values: Array) -> Any:
    """Return booleans (n,), true for arrays (n, ...) that are finite, and 0 or of magnitude `SMALLEST` to `LARGEST`."""
    largest = np.abs(values.reshape(len(values), -1)).max(axis=1)
    return (largest == 0) | ((largest >= SMALLEST) & (largest <= LARGEST))


def _read_inertia(value: Array) -> Array:
    """Return checked tensors (n, 3, 3) from moments (n, 3) or tensors, kg m^2."""
    tensors = value if value.ndim == 3 else value[:, :, None] * np.eye(3)
    with np.errstate(all="ignore"):
        skew = np.abs(tensors - np.swapaxes(tensors, 1, 2)).max(axis=(1, 2))
        # Limits within the limits of `RigidBody`, which decides on the other bodies.
        good = _are_in_range(tensors) & (skew <= 1e-13 * np.abs(tensors).max(axis=(1, 2)))
        moments = np.full((len(tensors), 3), -1.0)
        moments[good] = np.linalg.eigvalsh(tensors[good])
    fine = good & (moments[:, 0] > 0) & (moments[:, 2] <= 1e12 * moments[:, 0])
    with warnings.catch_warnings(action="ignore", category=ImpossibleInertia):  # one warning for all is below
        _refuse_first("inertia", value, ~fine, RigidBody)  # its checks are exact, and accept most of them
    moments[~good] = np.linalg.eigvalsh(tensors[~good])  # accepted by `RigidBody`, such as molecules
    impossible = is_impossible(moments)
    if impossible.any():
        warning = ImpossibleInertia(moments[impossible][0].tolist(), int(impossible.sum()))
        warnings.warn(warning, stacklevel=4)  # the caller of `integrate_many`
    return read_only((tensors + np.swapaxes(tensors, 1, 2)) / 2)


def _read_parameters(scene: Scene, parameters: Any, given: dict[str, Array]) -> dict[str, Array]:
    """Return checked parameters (n, ...) by name. They are added to `given`, whose first array determines n."""
    if parameters is None:
        return {}
    if not isinstance(parameters, Mapping):
        raise BadInput("parameters", describe(parameters), "a mapping of names of the potential's numbers to arrays (n, ...)")
    shapes = list_parameters(static_part(scene.potential))
    values = {}
    for name, value in parameters.items():
        if name not in shapes:
            allowed = nearest(str(name), shapes) if shapes else f"none: the scene {scene.name!r} has no potential with numbers"
            raise BadInput("parameters", describe(name), allowed)
        key = f"parameters[{name!r}]"
        values[name] = _read(key, value, (shapes[name],), given)
        given.setdefault(key, values[name])
    return _convert_parameters(scene, values) if values else {}


def list_parameters(potential: object) -> dict[str, tuple[int, ...]]:
    """Return the shapes of the numbers of a potential by the names of its fields."""
    if not is_dataclass(potential) or isinstance(potential, type):
        return {}
    values = {field.name: getattr(potential, field.name) for field in fields(potential)}
    arrays = {name: np.asarray(value) for name, value in values.items() if isinstance(value, float | np.ndarray)}
    return {name: array.shape for name, array in arrays.items() if array.dtype == np.float64}


def _convert_parameters(scene: Scene, parameters: dict[str, Array]) -> dict[str, Array]:
    """Return parameters (n, ...) as the constructor of the potential converts them. Raise `BadInput` for the first bad one."""
    n = len(next(iter(parameters.values())))
    bodies = Batch(scene, np.broadcast_to(scene.R_WB0, (n, 3, 3)), np.broadcast_to(scene.w_WB_B0, (n, 3)), None, parameters)
    # Bodies that the constructor may refuse or change (`potentials.varied`).
    suspects = getattr(static_part(scene.potential), "suspects", None)
    bad = np.ones(n, dtype=bool) if suspects is None else np.zeros(n, dtype=bool) | suspects(parameters)
    for values in parameters.values():
        bad |= ~_are_in_range(values)
    converted = {name: values.copy() for name, values in parameters.items()} if bad.any() else parameters
    for i in np.flatnonzero(bad).tolist():
        try:
            potential: Any = static_part(bodies.take_potential(i))
        except BadInput as refusal:
            raise BadInput(f"parameters[{refusal.argument!r}][{i}]", refusal.got, refusal.allowed) from None
        for name, values in converted.items():
            values[i] = getattr(potential, name)  # a direction is normalized
    return {name: read_only(values) for name, values in converted.items()}
