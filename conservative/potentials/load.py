"""Torques and damping, which may depend on time: energy and momentum obey balances with their work and impulse.

The discrete work and impulse are those of the load term of the paper's (22) to (27) (DERIVATION.md, section 14).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from ..arithmetic import add, apply, dot, halfway, in_body, scale, subtract
from ..attitude import Array, triple
from ..check import choice, describe, finite_array, read_only, real_array, replace_unchecked, set_fields
from ..deferred_imports import kernels
from ..errors import BadInput, TorqueFailed
from .callback import find_address
from .uniform_gravity import UniformField

FRAMES = ("body", "world")
_TIMES = "two or more increasing times (n,), s"
_SIZED = 33
"""Times at which the size of a torque is taken."""
_END = 1e-9
"""Relative tolerance of the end of a table, that of the number of steps (`conservative.grid`)."""


class Loaded(NamedTuple):
    """A field with loads beside it, as kernels take it (`conservative.potentials.field`), in principal axes.

    `call` and `factor` are () for a constant torque and damping, or functions of time; `body` and `world` are the torques at
    the time of the step or stage, N m, in body and world axes; `damping` has the rows of the matrix then, N m s; `over` is
    2 / h, 1/s.
    """

    field: Any
    call: Any
    body: Any
    world: Any
    damping: Any
    over: Any
    factor: Any = ()

    def at_time(self, t: Any) -> Any:
        """Return the field, the torque and the damping at a time t, s."""
        body, world = self.call.at(t) if self.call else (self.body, self.world)
        damping = self.factor.at(t) if self.factor else self.damping
        field = self.field.at_time(t) if hasattr(self.field, "at_time") else self.field
        return self._replace(field=field, body=body, world=world, damping=damping)

    def at_step(self, t: Any, h: Any) -> Any:
        """Return the field for a step of length h from t, both s. The torque is that of the midpoint."""
        return self.at_time(t + 0.5 * h)._replace(over=2.0 / h)

    def energy(self, q: Any) -> Any:
        """Return V in J."""
        return self.field.energy(q)

    def body_torque(self, q: Any) -> Any:
        """Return the torque of the field alone, N m."""
        return self.field.body_torque(q)

    def load(self, q: Any, w: Any) -> Any:
        """Return the torque of the loads, N m, at rates w, rad/s."""
        return subtract(add(self.body, in_body(q, self.world)), apply(self.damping, w))

    def finite_torque(self, q: Any, a: Any) -> Any:
        """Return the torque of field and loads over a step, and its derivative by a."""
        (T, dT), (F, dF) = self.field.finite_torque(q, a), self.finite_load(q, a)
        return add(T, F), tuple(add(x, y) for x, y in zip(dT, dF, strict=True))

    def finite_load(self, q: Any, a: Any) -> Any:
        """Return the torque of the loads over a step, Q_n' Qbar (M - D w*) + Q_n' tau, N m, and its derivative by a."""
        torque, columns = halfway(a, subtract(self.body, scale(self.over, apply(self.damping, a))))
        damped = [halfway(a, scale(-self.over, [row[k] for row in self.damping]))[0] for k in range(3)]
        return add(torque, in_body(q, self.world)), tuple(add(x, y) for x, y in zip(columns, damped, strict=True))

    def supply(self, h: Any, q: Any, a: Any) -> Any:
        """Return work, J, and impulse, N m s, world axes, of the loads over a step."""
        torque = self.finite_load(q, a)[0]
        return 2.0 * dot(a, torque), *scale(h, _in_world(q, torque))

    def supply_rate(self, q: Any, w: Any) -> Any:
        """Return power, W, and torque, N m, world axes, of the loads at rates w, rad/s."""
        torque = self.load(q, w)
        return dot(w, torque), *_in_world(q, torque)


def _in_world(q: Any, v: Any) -> Any:
    return in_body((q[0], -q[1], -q[2], -q[3]), v)


Value = Array | tuple[Array, Array] | Callable[[float], ArrayLike]
Given = ArrayLike | tuple[ArrayLike, ArrayLike] | Callable[[float], ArrayLike]


@dataclass(frozen=True, eq=False, init=False)
class OfTime:
    """A constant, a function of time, or a table. Subclasses have the shape of its values and their allowed range."""

    value: Value
    breaks: Array
    name: ClassVar[str]
    shape: ClassVar[tuple[int, ...]]
    one: ClassVar[str]
    signed: ClassVar[bool] = True

    def __init__(self, name: str, value: Given, breaks: ArrayLike) -> None:
        columns = "".join(f", {size}" for size in self.shape)
        times = real_array(breaks)
        if times is None or times.ndim != 1 or not np.isfinite(times).all():
            raise BadInput("breaks", describe(breaks), "finite times (n,), s")
        if isinstance(value, tuple) and len(value) == 2 and np.ndim(value[1]) > 0:
            times = real_array(value[0])
            if times is None or times.ndim != 1 or len(times) < 2 or not np.isfinite(times).all():
                raise BadInput("times", describe(value[0]), _TIMES)
            if (np.diff(times) <= 0).any():
                i = int(np.argmax(np.diff(times) <= 0)) + 1
                raise BadInput("times", f"{times[i]:.17g} after {times[i - 1]:.17g}, at index {i}", _TIMES)
            allowed = f"an array ({len(times)}{columns}): {self.one} for each time"
            value = read_only(times), finite_array("values", value[1], ((len(times), *self.shape),), allowed)
            if not self.signed and (value[1] < 0).any():
                raise BadInput("values", f"{value[1].min():g}", allowed)
        elif not callable(value):
            allowed = f"{self.one}; a function of time, s, that returns it; or a table (times (n,), values (n{columns}))"
            value = finite_array(name, cast(ArrayLike, value), (self.shape,), allowed)
        set_fields(self, value=value, breaks=read_only(times))
        if callable(value):
            self.require(0.0)

    def at(self, t: float) -> Array:
        """Return the value at a time, s. Raise `TorqueFailed` if there is none."""
        if isinstance(self.value, np.ndarray):
            return self.value
        if isinstance(self.value, tuple):
            times, values = self.value
            if not times[0] <= t <= times[-1] + _END * abs(times[-1]):
                raise TorqueFailed(t, f"a table from {times[0]:g} to {times[-1]:g} s", self.name, self.one)
            return np.array([np.interp(t, times, column) for column in values.T] if self.shape else np.interp(t, times, values))
        try:
            found = self.value(t)
        except Exception as error:
            raise TorqueFailed(t, f"a function that raises {error!r}", self.name, self.one) from error
        value = real_array(found)
        if value is None or value.shape != self.shape or not np.isfinite(value).all() or (not self.signed and value.min() < 0):
            raise TorqueFailed(t, f"a function that returns {describe(found)}", self.name, self.one)
        return value

    def require(self, t_end: float) -> float:
        """Return the largest magnitude at a few times from 0 to t_end, s. Raise `BadInput` if there is no value."""
        try:
            return max(float(np.linalg.norm(self.at(t))) for t in np.linspace(0.0, t_end, _SIZED).tolist())
        except TorqueFailed as failure:
            raise BadInput(self.name, f"{failure.got} at t = {failure.time:g} s", failure.allowed) from failure.__cause__

    def in_units(self, unit: float, time: float) -> Self:
        """Return the function in units of its values and with times in units of `time`, s, powers of two."""

        def scaled(t: float) -> Array:
            return self.at(t * time) / unit

        value: Value = scaled
        if isinstance(self.value, np.ndarray):
            value = self.value / unit
        elif isinstance(self.value, tuple):
            value = self.value[0] / time, self.value[1] / unit
        return replace_unchecked(self, value=value, breaks=self.breaks / time)


@dataclass(frozen=True, eq=False, init=False)
class Torque(OfTime):
    """A torque that is constant or depends on time, beside the potential of a scene.

    Parameters
    ----------
    value
        Three numbers (3,), N m; a function of time, s, that returns them; or a table: a tuple of times (n,) and values (n, 3),
        linear in between. The times have to cover the run, including its last step. A step calls Python if it is no constant.
    frame
        "body" or "world": the axes of its components.
    breaks
        Times (n,), s, at which the function is not smooth: steps of the reference solution end there. A table has its own.

    Raises
    ------
    BadInput
        The value is of another kind or shape or not finite, times do not increase, or frame has another value.
    TorqueFailed
        During integration, the function raised an exception or did not return three finite numbers, or the table ended.
    """

    frame: str
    name: ClassVar[str] = "torque"
    shape: ClassVar[tuple[int, ...]] = (3,)
    one: ClassVar[str] = "three finite numbers (3,), N m"

    def __init__(self, value: Given, frame: str = "body", breaks: ArrayLike = ()) -> None:
        choice("frame", frame, FRAMES)
        super().__init__("value", value, breaks)
        set_fields(self, frame=frame)


class Factor(OfTime):
    """The factor of a damping."""

    name: ClassVar[str] = "factor"
    shape: ClassVar[tuple[int, ...]] = ()
    one: ClassVar[str] = "a finite number of 0 or more"
    signed: ClassVar[bool] = False


@dataclass(frozen=True, eq=False, init=False)
class Damping:
    """A torque -f D w, proportional to the angular velocity w in body axes.

    Parameters
    ----------
    matrix
        D (3, 3), N m s, body axes, with w'D w >= 0 for all w. It does not need to be symmetric.
    factor
        None for constant damping, f = 1. Otherwise f, 0 or more, such as density times airspeed: a function of time, s, or a
        table, a tuple of times (n,) and values (n,), linear in between. Its times have to cover the run, as for `Torque`.
    breaks
        Times (n,), s, at which the factor is not smooth, as for `Torque`.

    Raises
    ------
    BadInput
        The matrix is not finite, of another shape, or its symmetric part has a negative eigenvalue. The factor is negative, not
        finite or of another shape, or times do not increase.
    TorqueFailed
        During integration, the factor has no such value.
    """

    matrix: Array
    factor: Factor | None

    def __init__(self, matrix: ArrayLike, factor: Given | None = None, breaks: ArrayLike = ()) -> None:
        allowed = "a matrix (3, 3), N m s, whose symmetric part (D + D')/2 has no negative eigenvalue"
        D = finite_array("matrix", matrix, ((3, 3),), allowed)
        smallest = float(np.linalg.eigvalsh((D + D.T) / 2)[0])
        if smallest < -1e-14 * np.abs(D).max():
            raise BadInput("matrix", f"{D.tolist()}, with the eigenvalue {smallest:.3g}", allowed)
        set_fields(self, matrix=D, factor=None if factor is None else Factor("factor", factor, breaks))

    def in_units(self, energy: float, time: float) -> Damping:
        """Return the damping in units of `energy`, J, and `time`, s, powers of two."""
        factor = self.factor and self.factor.in_units(1.0, time)
        return replace_unchecked(self, matrix=self.matrix / energy / time, factor=factor)


def load_field(field: Any, torque: Torque | None, damping: Damping | None, R_BP: Array) -> Loaded:
    """Return a field, or None, with loads as kernels take them, in axes that R_BP (3, 3) takes to the body's."""
    zero, call, factor = (0.0, 0.0, 0.0), (), ()
    D = np.zeros((3, 3)) if damping is None else R_BP.T @ damping.matrix @ R_BP
    matrix = tuple(triple(row) for row in D)
    if damping is not None and damping.factor is not None:
        factor = kernels("function_field").DampingInTime(find_address(damping.factor), matrix)
    body = world = zero
    if torque is not None and isinstance(torque.value, np.ndarray):
        if torque.frame == "body":
            body = triple(torque.value @ R_BP)
        else:
            world = triple(torque.value)
    elif torque is not None:
        call = kernels("function_field").Torques(find_address(torque), tuple(triple(row) for row in R_BP))
    beside = UniformField(0.0, 0.0, 0.0) if field is None else field
    return Loaded(beside, call, body, world, matrix, 0.0, factor)
