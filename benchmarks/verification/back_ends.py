"""Back ends: Python functions, methods, engines and programs, each as a function that integrates motions."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from conservative import registry
from conservative.attitude import Array
from conservative.check import choice, describe, real_array
from conservative.errors import BadInput, IntegrationFailed, Unsupported
from conservative.features import join
from conservative.grid import Grid
from conservative.method import Method
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.environments.adapter import AdapterMethod
from conservative.references.environments.programs import find_program, program_class, read_program
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..studies.selection import bits_of, tolerance_setting
from .programs import PATIENCE, Samples, Solve, solver
from .verify import Kind, kind_of

SIMULATE = "simulate(R0, w0, inertia, dt, n)"
RETURNS = (
    "(R, w): attitudes (n + 1, 3, 3), body to world, and rates (n + 1, 3), rad/s, at the start and after each of the n steps; "
    "or one of the two"
)
ORDERS = (1, 2, 3, 4)
PRECISIONS = ("double", "single")
TOLERANCES = (1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
"""Tolerances of a method that chooses its steps, in the sweep of settings."""


@dataclass(frozen=True, eq=False)
class BackEnd:
    """A Python function that integrates the rotation of a free body: a back end of a product, such as an engine in a wrapper.

    Parameters
    ----------
    simulate
        Called as `simulate(R0, w0, inertia, dt, n)`: the attitude (3, 3), body to world, the rates (3,), rad/s, body axes, the
        inertia (3, 3), kg m^2, body axes, the step, s, and the number of steps. It returns `(R, w)`: attitudes (n + 1, 3, 3)
        and rates (n + 1, 3), rad/s, at the start and after each step. One of the two can be None, or be returned alone. Each
        call starts from the given state. The function raises `NotImplementedError` for a body that it does not support.
    name
        Name in tables and sentences. By default the name of the function.
    order
        Order of convergence, 1 to 4. By default it is measured: from differences of motions with different steps, which do not
        depend on the exact motion.
    rates
        "body" or "world": the axes of the returned rates. The given rates are in body axes.
    precision
        "double" or "single". By default single if all returned numbers are numbers of single precision.
    settings
        Values of settings for the sweep, by name, such as `{"substeps": (1, 2, 4, 8)}`. Each is passed as a keyword argument.

    Raises
    ------
    BadInput
        `simulate` cannot be called, or an option has another value.
    """

    simulate: Callable[..., Any]
    name: str = ""
    order: int | None = None
    rates: str = "body"
    precision: str | None = None
    settings: Mapping[str, Sequence[Any]] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        if not callable(self.simulate):
            raise BadInput("simulate", describe(self.simulate), f"a function {SIMULATE}")
        if not isinstance(self.name, str) or len(self.name.splitlines()) > 1:
            raise BadInput("name", describe(self.name), "a text of one line")
        if self.order is not None and (isinstance(self.order, bool) or self.order not in ORDERS):
            raise BadInput("order", describe(self.order), "1, 2, 3, 4, or None to measure it")
        choice("rates", self.rates, ("body", "world"))
        if self.precision is not None:
            choice("precision", self.precision, PRECISIONS)
        if not isinstance(self.settings, Mapping) or not all(
            isinstance(name, str) and isinstance(values, list | tuple | range) and len(values)
            for name, values in self.settings.items()
        ):
            raise BadInput(
                "settings", describe(self.settings), 'a dictionary of names and lists of values: {"substeps": [1, 2]}'
            )


@dataclass(frozen=True)
class Setting:
    """A setting of a back end that a sweep varies: its name and values, and the back end with each of them."""

    name: str
    values: tuple[Any, ...]
    solvers: tuple[Solve, ...]


@dataclass(frozen=True, eq=False)
class Runnable:
    """A back end that can be run, whatever it is.

    Attributes
    ----------
    name, kind
        Its name, and its kind: "function", "method", "engine" or "program".
    solve
        Integrates a scene on a grid.
    order
        Its order; None if it is adaptive, or not known yet.
    single
        Whether its numbers have single precision.
    principal
        Whether it gets bodies in principal axes.
    unsupported
        Returns why it does not support a scene, None if it may.
    settings
        Settings for the sweep, in addition to the step.
    measures_order, measures_precision
        Whether its order and its precision are not declared, and have to be measured.
    """

    name: str
    kind: str
    solve: Solve
    order: int | None
    single: bool
    principal: bool
    unsupported: Callable[[Scene], str | None]
    settings: tuple[Setting, ...] = ()
    measures_order: bool = False
    measures_precision: bool = False


AnyBackEnd = BackEnd | Callable[..., Any] | Method | str | os.PathLike[str]


def find(subject: Any, letter: str) -> Runnable:
    """Return a back end: a function, a `BackEnd`, a method, or the name of a method, an engine or a program.

    A name without settings is the default setting. `letter` names functions without a name, and the argument in messages.

    Raises
    ------
    BadInput
        The subject is something else, such as a recording.
    MissingEngine
        The engine is not installed.
    """
    if isinstance(subject, str | os.PathLike):
        return _named(os.fspath(subject))
    if isinstance(subject, Method):
        return of_method(subject, Kind.METHOD)
    if isinstance(subject, BackEnd) or (callable(subject) and not isinstance(subject, type)):
        return _of_function(subject if isinstance(subject, BackEnd) else BackEnd(subject), letter)
    allowed = f"a function {SIMULATE}, a cv.verification.BackEnd, a method, or the name of an engine, a method or a program"
    raise BadInput(letter, describe(subject), allowed)


def _named(text: str) -> Runnable:
    kind = kind_of(text)
    if kind not in (Kind.METHOD, Kind.ENGINE, Kind.PROGRAM):
        advice = "without --pairs, two recordings are compared with each other" if kind is Kind.RECORDING else "without --pairs"
        raise BadInput("subject", f"{text!r}, a {kind}", f"an engine, a method or a program; {advice}")
    if kind is Kind.PROGRAM and find_program(text.partition(":")[0]) is None:  # the command line of a program
        return replace(of_method(program_class(read_program(text, "program"), PATIENCE)(), kind), name=text)
    return of_method(registry.method(text), kind)


def of_method(method: Method, kind: str) -> Runnable:
    """Return a method, an engine or a program as a back end."""
    settings = list[tuple[str, tuple[Any, ...]]]()
    names = {field.name for field in fields(method)}
    if "precision" in names:
        settings.append(("precision", ("f32", "f64")))
    if (tolerance := tolerance_setting(method)) is not None:
        settings.append((tolerance, TOLERANCES))
    return Runnable(
        method.name,
        str(kind),
        solver(method),
        method.order,
        bits_of(method) == 32,
        isinstance(method, AdapterMethod),
        method.unsupported,
        tuple(
            Setting(name, values, tuple(partial(_solve_with, method, name, value) for value in values))
            for name, values in settings
        ),
    )


def _solve_with(method: Method, name: str, value: Any, scene: Scene, grid: Grid) -> Any:
    changed: Any = replace(method, **{name: value})
    return solver(changed)(scene, grid)


def _of_function(own: BackEnd, letter: str) -> Runnable:
    name = own.name or getattr(own.simulate, "__name__", type(own.simulate).__name__)
    name = letter if name == "<lambda>" else name
    solvers = [
        Setting(key, tuple(values), tuple(partial(_call, own, name, {key: value}) for value in values))
        for key, values in own.settings.items()
    ]
    return Runnable(
        name,
        "function",
        partial(_call, own, name, {}),
        own.order,
        own.precision == "single",
        False,
        _unsupported,
        tuple(solvers),
        measures_order=own.order is None,
        measures_precision=own.precision is None,
    )


def _unsupported(scene: Scene) -> str | None:
    return f"a function gets a free body, without {join(sorted(scene.features))}" if scene.features else None


class Raised(IntegrationFailed):
    """A function raised an exception."""

    def __init__(self, name: str, grid: Grid, error: Exception) -> None:
        self.error = error
        self.outcome = Outcome(OutcomeKind.CRASHED, f"{type(error).__name__}: {error}")
        super().__init__(f"{name}(R0, w0, inertia, dt={grid.dt:g}, n={grid.n_steps}) raised {type(error).__name__}: {error}")


def _call(own: BackEnd, name: str, settings: Mapping[str, Any], scene: Scene, grid: Grid) -> Samples:
    """Return the samples of a function on a grid. Raise `Unsupported`, `Raised`, or `BadInput` for another answer."""
    n = grid.n_steps
    try:
        answer = own.simulate(
            np.array(scene.R_WB0), np.array(scene.w_WB_B0), np.array(scene.body.inertia), grid.dt, n, **settings
        )
    except NotImplementedError as error:
        raise Unsupported("method", name, f"what it supports ({error})") from None
    except Exception as error:  # of a user's code
        raise Raised(name, grid, error) from error
    R, w = read(answer, n, name)
    if own.rates == "world":
        if w is not None and R is None:
            raise BadInput(name, "rates in world axes without attitudes", 'both, or rates in body axes (rates="body")')
        w = None if w is None or R is None else np.einsum("nji,nj->ni", R, w)
    R, w = (None if x is None else x[:: grid.every] for x in (R, w))
    return Samples(grid.t, R, w)


def read(answer: Any, n: int, name: str) -> tuple[Array | None, Array | None]:
    """Return attitudes (n + 1, 3, 3) and rates (n + 1, 3) of an answer, None for one that it does not have.

    Raise `BadInput` for another answer, with what it is.
    """
    if isinstance(answer, tuple) and len(answer) == 2:
        parts = [None if part is None else _array(part, name) for part in answer]
        if all(part is None for part in parts):
            raise BadInput(name, "(None, None)", RETURNS)
        for part, shape, what in zip(parts, ((n + 1, 3, 3), (n + 1, 3)), ("R", "w"), strict=True):
            if part is not None and part.shape != shape:
                raise BadInput(name, f"{what} of shape {part.shape} for n = {n}", _expected(part, shape, what))
        return parts[0], parts[1]
    if answer is None or isinstance(answer, tuple | dict | str):
        raise BadInput(name, describe(answer), RETURNS)
    only = _array(answer, name)
    if only.shape == (n + 1, 3, 3):
        return only, None
    if only.shape == (n + 1, 3):
        return None, only
    shape, what = ((n + 1, 3, 3), "R") if only.ndim == 3 or only.shape[-1:] == (4,) else ((n + 1, 3), "w")
    raise BadInput(name, f"an array of shape {only.shape} for n = {n}", _expected(only, shape, what))


def _array(value: Any, name: str) -> Array:
    array = real_array(value)
    if array is None:
        raise BadInput(name, describe(value), RETURNS)
    return array


def _expected(part: Array, shape: tuple[int, ...], what: str) -> str:
    if what == "R" and part.shape == (shape[0], 4):
        return (
            "matrices: scipy.spatial.transform.Rotation.from_quat(q, scalar_first=True).as_matrix() makes them of quaternions "
            "w, x, y, z, and from_quat(q).as_matrix() of x, y, z, w"
        )
    if part.shape[1:] == shape[1:]:
        return f"{shape[0]} of them: the start, and the state after each of the n steps"
    return f"{what} of shape {shape}; a function returns {RETURNS}"


def is_single(samples: Samples | Trajectory) -> bool:
    """Return whether all numbers of the attitudes, or of the rates, are numbers of single precision."""
    for x in (samples.R_WB, samples.w_WB_B):
        if x is not None and len(x) > 1 and np.isfinite(x).all() and np.array_equal(x[1:], x[1:].astype(np.float32)):
            return not np.array_equal(x[1:], np.round(x[1:]))  # a body that stands still shows nothing
    return False


def same(first: Any, second: Any) -> bool:
    """Return whether two back ends are one and the same."""
    if isinstance(first, BackEnd) and isinstance(second, BackEnd):
        return first is second or (first.simulate is second.simulate and first.rates == second.rates)
    if isinstance(first, Method) and isinstance(second, Method):
        return type(first) is type(second) and first.name == second.name
    return first is second
