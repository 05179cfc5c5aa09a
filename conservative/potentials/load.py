"""Torques, damping and motors of rotors, which may depend on time: momenta obey balances with their impulse, energy with work.

The discrete work and impulse belong to the load term of the paper's (22) to (27) (DERIVATION.md, section 14).

Steps end where a load is not smooth, and a load is evaluated on one side of such a time: methods pass the `Window` between two
of them, and a table is continued beyond it by its last segment.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from ..arithmetic import add, apply, dot, halfway, in_body, scale, subtract
from ..attitude import Array, triple
from ..check import PickledByFields, choice, describe, finite_array, read_only, real_array, replace_unchecked, set_fields
from ..deferred_imports import kernels
from ..errors import BadInput, TorqueFailed
from ..features import Feature, Features
from .callback import find_address
from .pointwise import EARLIER

FRAMES = ("body", "world")
_TIMES = "two or more times (n,), s, that do not decrease; two equal ones are a jump"
_SIZED = 33
"""Times at which the size of a function is taken."""
_END = 1e-9
"""Relative tolerance of the end of a table, whose times may be rounded to ten digits."""
_STRAIGHT = 1e-12
"""A row of a table is no corner if the slope changes by less than this share of the slopes."""
_CONTINUOUS = 1e-9
"""Largest jump of a rotor's momentum, relative to its size."""
Window = tuple[float, float]
"""Break points before and after the times at which a load is evaluated, s."""


class Loaded(NamedTuple):
    """A field with loads beside it, as kernels take it (`conservative.potentials.field`), in principal axes.

    `call`, `resistance` and `motor` are () for a constant torque, damping and rotor, or functions of time; `body` and `world`
    are the torques at the time of the step or stage, N m, in body and world axes; `damping` has the rows of the matrix then, N
    m s; `over` is 2 / h, 1/s. `clock` is the time at which the kernel's times begin, and the `Window`, all in s.
    """

    field: Any
    call: Any
    body: Any
    world: Any
    damping: Any
    over: Any
    resistance: Any = ()
    motor: Any = ()
    clock: Any = (0.0, -math.inf, math.inf)

    def at_time(self, t: Any) -> Any:
        """Return the field, the torque and the damping at a time t, s. Loads of the attitude keep the time (`load`)."""
        start, *window = self.clock
        now, call, resistance, body, world, damping = t + start, self.call, self.resistance, self.body, self.world, self.damping
        if hasattr(call, "now"):
            call = call._replace(now=(now, *window))
        elif call:
            body, world = call.at(now, *window)
        if hasattr(resistance, "now"):
            resistance = resistance._replace(now=(now, *window))
        elif resistance:
            damping = resistance.at(now, *window)
        field = self.field.at_time(now) if hasattr(self.field, "at_time") else self.field
        return self._replace(field=field, call=call, body=body, world=world, damping=damping, resistance=resistance)

    def at_step(self, t: Any, h: Any) -> Any:
        """Return the field for a step of length h from t, both s. The torque is the torque of the midpoint."""
        return self.at_time(t + 0.5 * h)._replace(over=2.0 / h)

    def wheel(self, t: Any) -> Any:
        """Return the momentum of the rotor with a motor at a time t, s, kg m^2/s."""
        start, *window = self.clock
        return self.motor.at(t + start, *window)

    def energy(self, q: Any) -> Any:
        """Return V in J."""
        return self.field.energy(q)

    def body_torque(self, q: Any) -> Any:
        """Return the torque of the field alone, N m."""
        return self.field.body_torque(q)

    def load(self, q: Any, w: Any) -> Any:
        """Return the torque of the loads, N m, at rates w, rad/s."""
        body, world = self.call.at(*self.call.now, q) if hasattr(self.call, "now") else (self.body, self.world)
        damping = self.resistance.at(*self.resistance.now, q) if hasattr(self.resistance, "now") else self.damping
        return subtract(add(body, in_body(q, world)), apply(damping, w))

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


Value = Array | tuple[Array, Array] | Callable[..., ArrayLike]
Given = ArrayLike | tuple[ArrayLike, ArrayLike] | Callable[..., ArrayLike]


@dataclass(frozen=True, eq=False, init=False)
class OfTime(PickledByFields):
    """A constant, a table, or a function of time or of time and attitude. Subclasses have the shape and range of its values."""

    value: Value
    breaks: Array
    name: ClassVar[str]
    shape: ClassVar[tuple[int, ...]]
    one_value: ClassVar[str]
    may_jump: ClassVar[bool] = True
    origin: ClassVar[tuple[OfTime, float] | None] = None
    """The load whose function this one calls, and the time in it, s, that is 1 here; None for a function of a user."""

    def __init__(self, name: str, value: Given, breaks: ArrayLike) -> None:
        columns = "".join(f", {size}" for size in self.shape)
        times = real_array(breaks)
        if times is None or times.ndim != 1 or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
            raise BadInput("breaks", describe(breaks), "finite, increasing times (n,), s")
        if len(times) and not callable(value):
            raise BadInput("breaks", describe(breaks), "none for a constant or a table, which has its own")
        if isinstance(value, tuple) and len(value) == 2 and np.ndim(value[1]) > len(self.shape):
            times = real_array(value[0])
            if times is None or times.ndim != 1 or len(times) < 2 or not np.isfinite(times).all():
                raise BadInput("times", describe(value[0]), _TIMES)
            gaps = np.diff(times)
            if (bad := (gaps < 0) | ((gaps == 0) & (np.append(1, gaps[:-1]) == 0))).any():
                i = int(np.argmax(bad)) + 1
                raise BadInput("times", f"{times[i]:.17g} after {times[i - 1]:.17g}, at index {i}", _TIMES)
            allowed = f"an array ({len(times)}{columns}): {self.one_value} for each time"
            value = read_only(times), finite_array("values", value[1], ((len(times), *self.shape),), allowed)
            if (fault := next(filter(None, map(self.fault, value[1])), None)) is not None:
                raise BadInput("values", fault, allowed)
            times = find_corners(*value)
        elif not callable(value):
            allowed = f"{self.one_value}; a function of time, s, that returns it; or a table (times (n,), values (n{columns}))"
            value = finite_array(name, cast(ArrayLike, value), (self.shape,), allowed)
            if fault := self.fault(value):
                raise BadInput(name, fault, allowed)
        set_fields(self, value=value, breaks=read_only(times))
        if callable(value):
            self.require(0.0)

    @classmethod
    def fault(cls, value: Array) -> str | None:
        """Return the reason why an array of this shape is not allowed, or None."""
        return None

    @property
    def constant(self) -> bool:
        """True for one value at all times."""
        return isinstance(self.value, np.ndarray)

    @cached_property
    def of_attitude(self) -> bool:
        """True for a function of time and attitude: one with two arguments that have no default."""
        if not callable(self.value):
            return False
        try:
            parameters = inspect.signature(self.value).parameters.values()
        except (TypeError, ValueError):  # a function of C without a signature
            return False
        return (
            sum(
                parameter.default is parameter.empty and parameter.kind <= parameter.POSITIONAL_OR_KEYWORD
                for parameter in parameters
            )
            == 2
        )

    def at(self, t: float, R_WB: Array | None = None, window: Window = (-math.inf, math.inf)) -> Array:
        """Return the value at a time, s, and an attitude (3, 3), between two break points. Raise `TorqueFailed` without one.

        At a matrix that is not finite the value may be NaN: the run has diverged, which is no fault of the function.
        """
        if isinstance(self.value, np.ndarray):
            return self.value
        inside = t if isinstance(self.value, tuple) or self.origin else t * EARLIER
        if not window[0] < inside < window[1]:  # or at a jump, where the side matters
            inside = min(max(inside, math.nextafter(window[0], math.inf)), math.nextafter(window[1], -math.inf))
        if isinstance(self.value, tuple):
            times, values = self.value
            i = int(np.searchsorted(times, inside, side="right"))
            if not 0 < i < len(times):  # after the end of the run, for which `require_times` has been called
                return np.asarray(values[0] if i == 0 else values[-1])
            return np.asarray(values[i - 1] + (t - times[i - 1]) / (times[i] - times[i - 1]) * (values[i] - values[i - 1]))
        try:
            result = self.value(inside, np.eye(3) if R_WB is None else R_WB) if self.of_attitude else self.value(inside)
        except Exception as error:
            if self._lost(R_WB):
                return np.full(self.shape, math.nan)
            raise TorqueFailed(t, f"a function that raises {error!r}", self.name, self.one_value) from error
        value = real_array(result)
        if value is None or value.shape != self.shape or not np.isfinite(value).all() or self.fault(value):
            if self._lost(R_WB):
                return np.full(self.shape, math.nan)
            raise TorqueFailed(t, f"a function that returns {describe(result)}", self.name, self.one_value)
        return value

    def _lost(self, R_WB: Array | None) -> bool:
        """Return whether a function of the attitude was asked at a matrix that is not finite."""
        return self.of_attitude and R_WB is not None and not np.isfinite(R_WB).all()

    def require(self, t_end: float, R_WB: Array | None = None) -> float:
        """Return the largest magnitude from 0 to t_end, s: of a function at a few times. Raise `BadInput` without a value.

        Raise it also if a function returns another value in a second call.
        """
        if t_end > 0 and callable(self.value) and len(self.breaks) and not 0 <= self.breaks[0] <= self.breaks[-1] <= t_end:
            raise BadInput("breaks", self.breaks.tolist(), f"times in the run, from 0 to {t_end:g} s")
        times: Any = np.linspace(0.0, t_end, _SIZED)
        if isinstance(self.value, tuple):
            self.require_times(t_end)
            times = np.append(self.value[0][(self.value[0] > 0) & (self.value[0] < t_end)], (0.0, t_end))
        sides = [math.nextafter(time, side) for time in self.breaks if time <= t_end for side in (-math.inf, math.inf)]
        try:
            values = [self.at(t, R_WB) for t in sorted({*times.tolist(), *sides})]
            again = values[0] if self.constant else self.at(float(times.min()), R_WB)
        except TorqueFailed as failure:
            raise BadInput(self.name, f"{failure.got} at t = {failure.time:g} s", failure.allowed) from failure.__cause__
        if callable(self.value) and not sides and not np.array_equal(values[0], again):
            got = f"a function that returns {values[0].tolist()} and then {again.tolist()} at t = 0 s"
            raise BadInput(self.name, got, "a function that returns the same value each time")
        return max(float(np.linalg.norm(value)) for value in values)

    @property
    def end(self) -> float:
        """Last time, s, at which it has a value: the end of a table, otherwise infinite."""
        return float(self.value[0][-1]) if isinstance(self.value, tuple) else math.inf

    def require_times(self, t_end: float) -> None:
        """Raise `BadInput` if a table does not cover the times from 0 to t_end, s."""
        if isinstance(self.value, tuple):
            first, last = self.value[0][[0, -1]].tolist()
            if first > 0 or last < t_end * (1 - _END):
                allowed = f"one that covers the run, 0 to {t_end:g} s"
                raise BadInput(self.name, f"a table from {first:g} to {last:g} s", allowed)

    def in_units(self, unit: float, time: float) -> Self:
        """Return the function in units of its values and with times in units of `time`, s, powers of two."""
        if isinstance(self.value, tuple):
            value: Value = (self.value[0] / time, self.value[1] / unit)
        elif isinstance(self.value, np.ndarray):
            value = self.value / unit
        elif self.of_attitude:
            value = lambda t, R_WB: self.at(t * time, R_WB) / unit  # noqa: E731  # its arguments count
        else:
            value = lambda t: self.at(t * time) / unit  # noqa: E731
        return replace_unchecked(self, value=value, breaks=self.breaks / time, origin=(self, time))


def find_corners(times: Array, values: Array) -> Array:
    """Return the times (m,) of a table, s, at which it jumps or its slope changes, and its ends, where it is held."""
    rows, gaps = values.reshape(len(times), -1), np.diff(times)
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.diff(rows, axis=0) / gaps[:, None]
        bend, size = np.abs(np.diff(slopes, axis=0)).max(axis=1), np.abs(slopes).max(axis=1)
        straight = (bend <= _STRAIGHT * np.maximum(size[1:], size[:-1])) & (gaps[1:] > 0) & (gaps[:-1] > 0)
    return np.unique(times[np.concatenate([[True], ~straight, [True]])])


@dataclass(frozen=True, eq=False, init=False)
class Torque(OfTime):
    """A torque that is constant or depends on time, or on time and attitude, beside the potential of a scene.

    Parameters
    ----------
    value
        Three numbers (3,), N m; a function of time, s, that returns them, or of time and the attitude R_WB (3, 3), if it has
        two arguments without a default; or a table: a tuple of times (n,), s, and values (n, 3), linear in between. Two equal
        times are a jump. A table has to cover the run; the part of the last step after its end has its last value. A function
        is asked until the end of the last step, which is t_end unless a given step does not divide t_end. A step calls Python
        if the torque is no constant.
    frame
        "body" or "world": the axes of its components.
    breaks
        Increasing times (n,), s, at which a function jumps or has a corner: steps end there. A table has its own.

    Raises
    ------
    BadInput
        The value is of another kind or shape or not finite, times decrease, frame has another value, or a function returns
        another value when it is called again.
    TorqueFailed
        During integration, the function raised an exception or did not return three finite numbers.
    """

    frame: str
    name: ClassVar[str] = "torque"
    shape: ClassVar[tuple[int, ...]] = (3,)
    one_value: ClassVar[str] = "three finite numbers (3,), N m"

    def __init__(self, value: Given, frame: str = "body", breaks: ArrayLike = ()) -> None:
        choice("frame", frame, FRAMES)
        super().__init__("value", value, breaks)
        set_fields(self, frame=frame)

    @property
    def features(self) -> Features:
        """Members of `Feature` for scenes with it."""
        return frozenset({Feature.TORQUE, Feature.ATTITUDE} if self.of_attitude else {Feature.TORQUE})


class Factor(OfTime):
    """The factor of a damping."""

    name: ClassVar[str] = "factor"
    shape: ClassVar[tuple[int, ...]] = ()
    one_value: ClassVar[str] = "a finite number of 0 or more"

    @classmethod
    def fault(cls, value: Array) -> str | None:
        return f"{float(value):g}" if value < 0 else None


class Resistance(OfTime):
    """The matrix of a damping."""

    name: ClassVar[str] = "matrix"
    shape: ClassVar[tuple[int, ...]] = (3, 3)
    one_value: ClassVar[str] = "a matrix (3, 3), N m s, whose symmetric part (D + D')/2 has no negative eigenvalue"

    @classmethod
    def fault(cls, value: Array) -> str | None:
        smallest = float(np.linalg.eigvalsh((value + value.T) / 2)[0])
        return f"{value.tolist()}, with the eigenvalue {smallest:.3g}" if smallest < -1e-14 * np.abs(value).max() else None


class RotorMomentum(OfTime):
    """The momentum of a rotor that a motor turns, without jumps."""

    name: ClassVar[str] = "rotor_momentum"
    may_jump: ClassVar[bool] = False
    shape: ClassVar[tuple[int, ...]] = (3,)
    one_value: ClassVar[str] = "three finite numbers (3,), kg m^2/s"

    def __init__(self, value: Given, breaks: ArrayLike = ()) -> None:
        super().__init__("rotor_momentum", value, breaks)
        for t in self.breaks.tolist():
            before, after = self.at(t, None, (-math.inf, t)), self.at(t, None, (t, math.inf))
            if np.abs(after - before).max() > _CONTINUOUS * max(np.abs(before).max(), np.abs(after).max()):
                got = f"a jump from {before.tolist()} to {after.tolist()} at t = {t:g} s"
                raise BadInput("rotor_momentum", got, "a momentum without jumps, which no motor can make")


@dataclass(frozen=True, eq=False, init=False)
class Damping(PickledByFields):
    """A torque -f D w, proportional to the angular velocity w in body axes.

    Parameters
    ----------
    matrix
        D (3, 3), N m s, body axes, with w'D w >= 0 for all w. It does not need to be symmetric. Also a function of time, s, or
        of time and the attitude R_WB (3, 3), or a table, as for `Torque`.
    factor
        None for f = 1. Otherwise f, 0 or more, such as density times airspeed: a function of time, s, or of time and attitude,
        or a table, a tuple of times (n,) and values (n,), as for `Torque`. None if the matrix is not constant.
    breaks
        Increasing times (n,), s, at which the function is not smooth, as for `Torque`.

    Raises
    ------
    BadInput
        The matrix is not finite, of another shape, or its symmetric part has a negative eigenvalue. The factor is negative, not
        finite or of another shape, or times decrease. Or both depend on time.
    TorqueFailed
        During integration, a function has no such value.
    """

    matrix: Array | Resistance
    factor: Factor | None

    def __init__(self, matrix: Given | Resistance, factor: Given | Factor | None = None, breaks: ArrayLike = ()) -> None:
        D = matrix if isinstance(matrix, Resistance) else Resistance("matrix", matrix, () if factor is not None else breaks)
        if factor is not None and not D.constant:
            raise BadInput("factor", describe(factor), "None together with a matrix that depends on time")
        if factor is not None and not isinstance(factor, Factor):
            factor = Factor("factor", factor, breaks)
        set_fields(self, matrix=D.value if D.constant else D, factor=factor)

    @property
    def of_time(self) -> Factor | Resistance | None:
        """The part that is not constant, or None."""
        return self.matrix if isinstance(self.matrix, Resistance) else self.factor

    @property
    def features(self) -> Features:
        """Members of `Feature` for scenes with it."""
        varying = self.of_time
        return frozenset({Feature.DAMPING, Feature.ATTITUDE} if varying and varying.of_attitude else {Feature.DAMPING})

    def at(self, t: float, R_WB: Array | None = None, window: Window = (-math.inf, math.inf)) -> Array:
        """Return f D (3, 3), N m s, body axes, at a time, s, and an attitude, as `OfTime.at`."""
        if isinstance(self.matrix, Resistance):
            return self.matrix.at(t, R_WB, window)
        return self.matrix if self.factor is None else self.factor.at(t, R_WB, window) * self.matrix

    def in_units(self, energy: float, time: float) -> Damping:
        """Return the damping in units of `energy`, J, and `time`, s, powers of two."""
        unit = energy * time
        matrix = self.matrix.in_units(unit, time) if isinstance(self.matrix, Resistance) else self.matrix / energy / time
        return replace_unchecked(self, matrix=matrix, factor=self.factor and self.factor.in_units(1.0, time))


def load_field(
    field: Any, torque: Torque | None, damping: Damping | None, R_BP: Array, motor: RotorMomentum | None = None
) -> Loaded:
    """Return a field, or None, with loads as kernels take them, in axes that R_BP (3, 3) takes to the body's."""
    kernel, rows, zero = kernels("function_field"), tuple(triple(row) for row in R_BP), (0.0, 0.0, 0.0)
    body = world = zero
    call: Any = ()
    matrix: Any = (zero, zero, zero)
    resistance: Any = ()
    if torque is not None and torque.constant:
        body, world = (triple(torque.at(0.0) @ R_BP), zero) if torque.frame == "body" else (zero, triple(torque.at(0.0)))
    elif torque is not None:
        call = (kernel.TorquesOfAttitude if torque.of_attitude else kernel.Torques)(find_address(torque), rows)
    if damping is not None and (varying := damping.of_time):
        resistance = (kernel.DampingOfAttitude if varying.of_attitude else kernel.DampingInTime)(find_address(damping), rows)
    elif damping is not None:
        matrix = tuple(triple(row) for row in R_BP.T @ damping.at(0.0) @ R_BP)
    wheel = () if motor is None else kernel.Wheel(find_address(motor), rows)
    return Loaded(field, call, body, world, matrix, 0.0, resistance, wheel)
