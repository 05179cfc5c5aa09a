"""Runs of descriptions in engines and methods: alone, again, continued, in a new process, and with other bodies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any, NamedTuple, cast

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput, IntegrationFailed
from conservative.integration.many import integrate_many
from conservative.method import Method
from conservative.references.environments.adapter import AdapterMethod
from conservative.references.environments.engine_method import EngineMethod, WorkerRun
from conservative.references.environments.environment import new_worker
from conservative.references.environments.plain_numbers import join_numbers, read_states
from conservative.references.samples import to_body_axes
from conservative.references.worker.calls import python_worker, run_within
from conservative.references.worker.client import EngineTimeout, Worker, time_limit

from ...studies.selection import bits_of
from .pairs import Description, Pair, Samples

RUN_LIMIT = 60.0
"""Time limit of a run, s, against engines that hang. A run takes 800 steps at most, and may compile. It decides no verdict."""
START_LIMIT = 600.0
"""Time limit of a run of our own methods in a new process, s, which may compile all kernels."""
HANGS = 2
"""Number of runs without an end after which an engine is not run any more: each trial of a reduction could take the limit."""
ENDLESS = f"the run had not ended after {RUN_LIMIT:g} s"
FEW = 4
"""Fewer numbers that are not 0 show no resolution."""
PROBE = 9
"""Significant digits that show whether numbers were rounded to single precision, which has seven to eight."""


class NotAvailable(Exception):
    """The engine does not have this variant of a description or of a run; the message is the reason."""


class Runner:
    """An engine or method that integrates descriptions.

    Attributes: `method`; `precision`, the relative one of its numbers, or the tolerance of its steps if that is larger;
    `digits`, the digits of its answers, None before the first answer; `adaptive`, True if it chooses its steps.
    """

    digits: Digits | None = None

    def __init__(self, method: Method) -> None:
        self.method, self.adaptive, self._tolerances = method, method.order is None, tuple[str, ...]()
        self.precision = float(np.finfo("f4" if bits_of(method) == 32 else "f8").eps)
        if self.adaptive:
            own = getattr(getattr(method, "data", None), "tolerance", "")
            self._tolerances = tuple(filter(None, (own, "rtol", "tol")))
            self.precision = max([self.precision, *(getattr(method, name, 0.0) or 0.0 for name in self._tolerances)])

    def looser(self) -> Runner | None:
        """Return the runner of the method with a hundred times its tolerance; None if it has none that is known."""
        name = next((name for name in self._tolerances if getattr(self.method, name, 0.0)), "")
        if not self.adaptive or not name:
            return None
        tolerance = {name: min(100 * getattr(self.method, name), 0.1)}
        return runner_of(replace(cast("Any", self.method), **tolerance))

    def has(self, variant: str) -> bool:
        """Return whether the engine has a variant of descriptions."""
        return variant in ("frame", "zero")

    def unsupported(self, description: Description) -> str | None:
        """Return why a description is not supported; None if it is."""
        try:
            return self.method.unsupported(description.scene)
        except BadInput as error:
            return str(error)

    def model(self, description: Description) -> Callable[[], Samples]:
        """Return a function that runs a description from its start, each time."""
        try:
            run = self.method.prepare(description.scene, description.grid)
        except BadInput as error:
            raise NotAvailable(str(error)) from None

        def samples() -> Samples:
            trajectory = run()
            if trajectory.failure:
                raise trajectory.failure
            return trajectory.R_WB.copy(), trajectory.w_WB_B.copy()

        return samples

    def many(self, bodies: Sequence[Description], number: int) -> Samples:
        """Return the samples of one of many bodies that run together. Raise `NotAvailable`."""
        starts, grid = zip(*((body.R0, body.w0, body.scene.body.inertia) for body in bodies), strict=True), bodies[0].grid
        R, w, inertia = map(np.array, starts)
        options = {"dt": grid.dt, "t_end": grid.t[-1], "sample_every": grid.every, "method": self.method}
        ensemble = integrate_many(bodies[number].scene, R, w, inertia=inertia, **options)  # its field is the one that counts
        return ensemble[number].R_WB, ensemble[number].w_WB_B

    def apart(self, description: Description) -> Samples:
        """Return the samples of a run in a new process."""
        worker, method = python_worker(show_output=False), self.method
        try:
            return run_within(START_LIMIT, lambda: runner_of(method).model(description)(), process=worker)
        except EngineTimeout as error:
            raise NotAvailable(str(error)) from None
        finally:
            worker.close()

    @contextmanager
    def closing(self) -> Iterator[Runner]:
        """Free what the runner holds at the end of the block."""
        yield self


class EngineRunner(Runner):
    """An engine with an adapter, which gets the numbers of a description as they are, in a process of its own."""

    method: AdapterMethod

    def __init__(self, method: AdapterMethod) -> None:
        super().__init__(method)
        self._worker, self._hangs = self._start(), 0

    def _start(self) -> Worker:
        if isinstance(self.method, EngineMethod):
            return new_worker(self.method.environment, self.method.precision)
        return python_worker(show_output=False)

    def has(self, variant: str) -> bool:
        # PROTOCOL.md promises moments above 0. Our adapters pass a moment of 0 on, as a user of their engine does.
        ours = getattr(self.method.adapter, "environment", None) is None
        return variant == "quaternion" or (variant == "zero" and ours) or variant in self.method.data.descriptions

    def _given(self, numbers: dict[str, Any]) -> dict[str, Any]:
        return {"adapter": str(self.method.adapter.__file__), "settings": self.method.settings, **numbers}

    def _ask(self, numbers: dict[str, Any], shape: tuple[int, ...], worker: Worker) -> Callable[[], Any]:
        run = WorkerRun(worker, self._given(numbers), lambda answer: answer)

        def samples() -> Any:
            if self._hangs == HANGS:
                raise NotAvailable(f"{ENDLESS}, {HANGS} times")
            try:
                with time_limit(RUN_LIMIT):
                    answer = run()
            except NotImplementedError as error:
                raise NotAvailable(str(error)) from None
            if isinstance(answer, EngineTimeout):  # such as of steps that become tiny, which is no other motion
                self._hangs += 1
                raise NotAvailable(ENDLESS)
            if isinstance(answer, IntegrationFailed):
                worker.close()  # it may have lost its memory, as an aborted program of WebAssembly has
                raise answer
            states = read_states(answer, shape)
            n, s, _ = states.values.shape
            if self.digits is None:
                self.digits = find_digits(states.values)
                self.precision = max(self.precision, float(np.finfo("f4" if self.digits.single else "f8").eps))
            R, w, _ = to_body_axes(np.empty(s), states, np.broadcast_to(np.eye(3), (n, 3, 3)))
            return R, w

        return samples

    def model(self, description: Description, worker: Worker | None = None) -> Callable[[], Samples]:
        run = self._ask(description.numbers, (description.grid.n_samples,), worker or self._worker)
        return lambda: tuple(samples[0] for samples in run())

    def many(self, bodies: Sequence[Description], number: int) -> Samples:
        if self.method not in self.method.settings_for("many"):
            raise NotAvailable("many bodies at once")
        R, w = self._ask(
            join_numbers([body.numbers for body in bodies]), (len(bodies), bodies[0].grid.n_samples), self._worker
        )()
        return R[number], w[number]

    def apart(self, description: Description) -> Samples:
        worker = self._start()
        try:
            return self.model(description, worker)()
        finally:
            worker.close()

    @contextmanager
    def closing(self) -> Iterator[Runner]:
        try:
            yield self
        finally:
            self._worker.close()


class Digits(NamedTuple):
    """Digits with which an engine answers.

    Attributes: `single`, True if numbers were rounded to single precision; `significant`, the number of significant digits,
    and `decimals`, the number of decimals, 0 if numbers have all digits of double precision.
    """

    single: bool = False
    significant: int = 0
    decimals: int = 0

    def resolution(self, samples: Samples) -> float:
        """Return the relative resolution of samples: rad, and relative to the largest rate."""
        largest = float(np.abs(samples[1]).max())
        decimals = 10.0**-self.decimals / min(1.0, largest) if self.decimals and largest else 0.0
        return max(10.0 ** (1 - self.significant) if self.significant else 0.0, decimals)


def find_digits(values: Array) -> Digits:
    """Return the digits of the last sample. A program need not declare that it rounds to single precision or writes few."""
    end = values[..., -1, :].reshape(-1)
    parts = [part[np.isfinite(part) & (part != 0)] for part in (end[:-3], end[-3:])]
    both = np.concatenate(parts).tolist()
    with np.errstate(all="ignore"):
        single = any(len(part) > 2 and _written(part.astype(np.float32), PROBE) == _written(part, PROBE) for part in parts)
    if len(both) < FEW or single:
        return Digits(single)
    # A double that is not rounded has 15 digits or more.
    significant = next((n for n in range(3, 15) if all(float(f"{x:.{n}g}") == x for x in both)), 0)
    decimals = next((n for n in range(3, 15) if all(round(x, n) == x for x in both)), 0)
    return Digits(False, significant, decimals)


def _written(values: Array, digits: int) -> list[str]:
    return [f"{value:.{digits}g}" for value in values.tolist()]


def runner_of(method: Method) -> Runner:
    """Return the runner of a method."""
    return EngineRunner(method) if isinstance(method, AdapterMethod) else Runner(method)


def _others(body: Description, n: int) -> list[Description]:
    """Return n bodies unlike the given one, with the same axes and steps."""
    factors = np.random.default_rng(7).uniform(0.8, 1.2, (n, 4))
    return [replace(body, w0=body.w0 * f[:3], mass=body.mass * f[3], inertia=body.inertia * f[3]) for f in factors]


def run(runner: Runner, first: Description, second: Description, pair: Pair, model: Callable[[], Samples]) -> Samples:
    """Return the samples of a second description, run as a pair asks for it (`Pair.run`); `model` is the model of the first.

    Raise `NotAvailable` if the engine cannot.
    """
    if pair.run == "again":
        return model()
    if pair.run == "process":
        return runner.apart(second)
    if pair.run == "reset":
        with suppress(IntegrationFailed):
            runner.model(_others(second, 1)[0])()
        return model()
    if pair.run == "thinned":
        (R, w), kept = runner.model(second)(), first.grid.steps.astype(int)
        return R[kept], w[kept]
    if pair.run == "continued":
        steps = second.n_steps // 2
        if not steps:
            raise NotAvailable("half a step")
        R, w = runner.model(replace(second, n_steps=steps, every=steps))()
        if not (np.isfinite(R).all() and np.isfinite(w).all()):
            return R, w
        # An engine may return attitudes that are not rotations to rounding; a request has a rotation.
        U, _, V = np.linalg.svd(R[-1])
        rest = second.n_steps - steps
        end = runner.model(replace(second, R0=U @ V, w0=w[-1], n_steps=rest, every=rest))()
        return np.stack([R[0], end[0][-1]]), np.stack([w[0], end[1][-1]])
    if pair.run == "beside":
        place, count = pair.place
        bodies = _others(second, count)
        bodies[place - 1] = second
        return runner.many(bodies, place - 1)
    return runner.model(second)()
