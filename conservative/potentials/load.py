"""Torques that depend on time, and damping: energy and momentum obey balances with their work and impulse.

The discrete work and impulse are those of the load term of the paper's (22) to (27) (DERIVATION.md, section 14).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from ..arithmetic import add, apply, dot, halfway, in_body, scale, subtract
from ..attitude import Array, triple
from ..check import choice, describe, finite_array, read_only, real_array, replace_unchecked, set_fields
from ..deferred_imports import kernels
from ..errors import BadInput, TorqueFailed
from .callback import Callback
from .uniform_gravity import UniformField

FRAMES = ("body", "world")
_ALLOWED = "three numbers (3,), N m; a function of time, s, that returns them; or a table (times (n,), values (n, 3))"
_TIMES = "two or more increasing times (n,), s"
_SIZED = 33
"""Times at which the size of a torque is taken."""
_END = 1e-9
"""Relative tolerance of the end of a table, that of the number of steps (`conservative.grid`)."""


class Loaded(NamedTuple):
    """A field with loads beside it, as kernels take it (`conservative.potentials.field`), in principal axes.

    `call` is () for a constant torque, or the function of time; `body` and `world` are the torques at the time of the step or
    stage, N m, in body and world axes; `damping` has the rows of the matrix, N m s; `over` is 2 / h, 1/s.
    """

    field: Any
    call: Any
    body: Any
    world: Any
    damping: Any
    over: Any

    def at_time(self, t: Any) -> Any:
        """Return the field and the torque at a time t, s."""
        body, world = self.call.at(t) if self.call else (self.body, self.world)
        field = self.field.at_time(t) if hasattr(self.field, "at_time") else self.field
        return self._replace(field=field, body=body, world=world)

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


@dataclass(frozen=True, eq=False, init=False)
class Torque:
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

    value: Value
    frame: str
    breaks: Array

    def __init__(
        self,
        value: ArrayLike | tuple[ArrayLike, ArrayLike] | Callable[[float], ArrayLike],
        frame: str = "body",
        breaks: ArrayLike = (),
    ) -> None:
        choice("frame", frame, FRAMES)
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
            allowed = f"finite torques ({len(times)}, 3), N m, one for each time"
            value = read_only(times), finite_array("values", value[1], ((len(times), 3),), allowed)
        elif not callable(value):
            value = finite_array("value", cast(ArrayLike, value), ((3,),), _ALLOWED)
        set_fields(self, value=value, frame=frame, breaks=read_only(times))
        if callable(value):
            self.require(0.0)

    def at(self, t: float) -> Array:
        """Return the torque (3,), N m, at a time, s. Raise `TorqueFailed` if there is none."""
        if isinstance(self.value, np.ndarray):
            return self.value
        if isinstance(self.value, tuple):
            times, values = self.value
            if not times[0] <= t <= times[-1] + _END * abs(times[-1]):
                raise TorqueFailed(t, f"a table from {times[0]:g} to {times[-1]:g} s")
            return np.array([np.interp(t, times, column) for column in values.T])
        try:
            found = self.value(t)
        except Exception as error:
            raise TorqueFailed(t, f"a function that raises {error!r}") from error
        torque = real_array(found)
        if torque is None or torque.shape != (3,) or not np.isfinite(torque).all():
            raise TorqueFailed(t, f"a function that returns {describe(found)}")
        return torque

    def require(self, t_end: float) -> float:
        """Return the largest magnitude, N m, at a few times from 0 to t_end, s. Raise `BadInput` if it fails there."""
        try:
            return max(float(np.linalg.norm(self.at(t))) for t in np.linspace(0.0, t_end, _SIZED).tolist())
        except TorqueFailed as failure:
            raise BadInput("torque", f"{failure.got} at t = {failure.time:g} s", failure.allowed) from failure.__cause__

    def in_units(self, energy: float, time: float) -> Torque:
        """Return the torque in units of `energy`, J, with times in units of `time`, s, powers of two."""
        value: Value
        if isinstance(self.value, np.ndarray):
            value = self.value / energy
        elif isinstance(self.value, tuple):
            value = self.value[0] / time, self.value[1] / energy
        else:
            value = _Scaled(self, energy, time)
        return replace_unchecked(self, value=value, breaks=self.breaks / time)


@dataclass(frozen=True)
class _Scaled:
    torque: Torque
    energy: float
    time: float

    def __call__(self, t: float) -> Array:
        return self.torque.at(t * self.time) / self.energy


@dataclass(frozen=True, eq=False, init=False)
class Damping:
    """A torque -D w, proportional to the angular velocity w in body axes.

    Parameters
    ----------
    matrix
        D (3, 3), N m s, body axes, with w'D w >= 0 for all w. It does not need to be symmetric.

    Raises
    ------
    BadInput
        The matrix is not finite, of another shape, or its symmetric part has a negative eigenvalue.
    """

    matrix: Array

    def __init__(self, matrix: ArrayLike) -> None:
        allowed = "a matrix (3, 3), N m s, whose symmetric part (D + D')/2 has no negative eigenvalue"
        D = finite_array("matrix", matrix, ((3, 3),), allowed)
        smallest = float(np.linalg.eigvalsh((D + D.T) / 2)[0])
        if smallest < -1e-14 * np.abs(D).max():
            raise BadInput("matrix", f"{D.tolist()}, with the eigenvalue {smallest:.3g}", allowed)
        set_fields(self, matrix=D)

    def in_units(self, energy: float, time: float) -> Damping:
        """Return the damping in units of `energy`, J, and `time`, s, powers of two."""
        return replace_unchecked(self, matrix=self.matrix / energy / time)


def load_field(field: Any, torque: Torque | None, damping: Damping | None, R_BP: Array) -> Loaded:
    """Return a field, or None, with loads as kernels take them, in axes that R_BP (3, 3) takes to the body's."""
    zero, call = (0.0, 0.0, 0.0), ()
    D = np.zeros((3, 3)) if damping is None else R_BP.T @ damping.matrix @ R_BP
    body = world = zero
    if torque is not None and isinstance(torque.value, np.ndarray):
        if torque.frame == "body":
            body = triple(torque.value @ R_BP)
        else:
            world = triple(torque.value)
    elif torque is not None:
        # As for potentials: atomic, and the address is valid as long as the torque lives.
        address = id(torque.__dict__.setdefault("_callback", Callback(torque)))
        call = kernels("function_field").Torques(address, tuple(triple(row) for row in R_BP))
    beside = UniformField(0.0, 0.0, 0.0) if field is None else field
    return Loaded(beside, call, body, world, tuple(triple(row) for row in D), 0.0)
