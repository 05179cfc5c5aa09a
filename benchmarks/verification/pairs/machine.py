"""How engines and methods run a description, in each of the ways that pairs need."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any, cast

import numpy as np

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

from .pairs import Description, Samples

RUN_LIMIT = 20.0
"""Wall time in s of a run of an engine, which takes at most a twentieth of that in the usual description."""
LIMIT = 600.0
"""Wall time in s that a run in a new process may take."""


class NotAvailable(Exception):
    """The engine has no such way to describe or run a body; the message says which."""


class Machine:
    """An engine or method that integrates descriptions.

    Attributes: `method`; `precision`, the relative one of its numbers, or the tolerance of its steps if that is larger;
    `adaptive`, True if it chooses its steps.
    """

    def __init__(self, method: Method) -> None:
        self.method, self.adaptive, self._tolerances = method, method.order is None, tuple[str, ...]()
        self.precision = float(np.finfo("f4" if getattr(method, "precision", "f64") == "f32" else "f8").eps)
        if self.adaptive:
            own = getattr(getattr(method, "data", None), "tolerance", "")
            self._tolerances = tuple(filter(None, (own, "rtol", "tol")))
            self.precision = max([self.precision, *(getattr(method, name, 0.0) or 0.0 for name in self._tolerances)])

    def looser(self) -> Machine | None:
        """Return the machine of the method with a hundred times its tolerance; None if it has none that is known."""
        name = next((name for name in self._tolerances if getattr(self.method, name, 0.0)), "")
        if not self.adaptive or not name:
            return None
        tolerance = {name: min(100 * getattr(self.method, name), 0.1)}
        return machine_of(replace(cast("Any", self.method), **tolerance))

    def has(self, way: str) -> bool:
        """Return whether the engine can be told about a body in a way."""
        return way in ("frame", "zero")

    def unsupported(self, one: Description) -> str | None:
        """Return why a description is not supported; None if it is."""
        try:
            return self.method.unsupported(one.scene)
        except BadInput as error:
            return str(error)

    def model(self, one: Description) -> Callable[[], Samples]:
        """Return a function that runs a description from its start, each time."""
        try:
            run = self.method.prepare(one.scene, one.grid)
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
        starts, grid = zip(*((each.R0, each.w0, each.scene.body.inertia) for each in bodies), strict=True), bodies[0].grid
        R, w, inertia = map(np.array, starts)
        options = {"dt": grid.dt, "t_end": grid.t[-1], "sample_every": grid.every, "method": self.method}
        ensemble = integrate_many(bodies[0].scene, R, w, inertia=inertia, **options)
        return ensemble[number].R_WB, ensemble[number].w_WB_B

    def apart(self, one: Description) -> Samples:
        """Return the samples of a run in a new process."""
        worker, method = python_worker(show_output=False), self.method
        try:
            return run_within(LIMIT, lambda: machine_of(method).model(one)(), process=worker)
        finally:
            worker.close()

    @contextmanager
    def closing(self) -> Iterator[Machine]:
        """Free what the machine holds at the end of the block."""
        yield self


class EngineMachine(Machine):
    """An engine with an adapter, which gets the numbers of a description as they are, in a process of its own."""

    method: AdapterMethod

    def __init__(self, method: AdapterMethod) -> None:
        super().__init__(method)
        self._worker = self._start()

    def _start(self) -> Worker:
        if isinstance(self.method, EngineMethod):
            return new_worker(self.method.environment, self.method.precision)
        return python_worker(show_output=False)

    def has(self, way: str) -> bool:
        return way in ("quaternion", "zero") or way in self.method.data.ways

    def _given(self, numbers: dict[str, Any]) -> dict[str, Any]:
        return {"adapter": str(self.method.adapter.__file__), "settings": self.method.settings, **numbers}

    def _ask(self, numbers: dict[str, Any], shape: tuple[int, ...], worker: Worker) -> Callable[[], Any]:
        run = WorkerRun(worker, self._given(numbers), lambda answer: answer)

        def samples() -> Any:
            try:
                with time_limit(RUN_LIMIT):
                    answer = run()
            except NotImplementedError as error:
                raise NotAvailable(str(error)) from None
            if isinstance(answer, EngineTimeout):  # such as of steps that become tiny, which is no other motion
                raise NotAvailable(f"the run had not ended after {RUN_LIMIT:g} s")
            if isinstance(answer, IntegrationFailed):
                worker.close()  # it may have lost its memory, as an aborted program of WebAssembly has
                raise answer
            states = read_states(answer, shape)
            n, s, _ = states.values.shape
            R, w, _ = to_body_axes(np.empty(s), states, np.broadcast_to(np.eye(3), (n, 3, 3)))
            return R, w

        return samples

    def model(self, one: Description, worker: Worker | None = None) -> Callable[[], Samples]:
        run = self._ask(one.numbers, (one.grid.n_samples,), worker or self._worker)
        return lambda: tuple(each[0] for each in run())

    def many(self, bodies: Sequence[Description], number: int) -> Samples:
        if self.method not in self.method.settings_for("many"):
            raise NotAvailable("many bodies at once")
        R, w = self._ask(
            join_numbers([each.numbers for each in bodies]), (len(bodies), bodies[0].grid.n_samples), self._worker
        )()
        return R[number], w[number]

    def apart(self, one: Description) -> Samples:
        worker = self._start()
        try:
            return self.model(one, worker)()
        finally:
            worker.close()

    @contextmanager
    def closing(self) -> Iterator[Machine]:
        try:
            yield self
        finally:
            self._worker.close()


def machine_of(method: Method) -> Machine:
    """Return the machine of a method."""
    return EngineMachine(method) if isinstance(method, AdapterMethod) else Machine(method)


def _others(one: Description, n: int) -> list[Description]:
    """Return n bodies unlike the given one, with the same steps."""
    factors = np.random.default_rng(7).uniform(0.8, 1.2, (n, 4))
    return [replace(one, w0=one.w0 * factor[:3], inertia=one.inertia * factor[3]) for factor in factors]


def run(machine: Machine, first: Description, one: Description, how: str, model: Callable[[], Samples]) -> Samples:
    """Return the samples of a twin of a first description, run in a way of a pair; `model` is that of the first.

    Raise `NotAvailable` if the engine cannot.
    """
    if how == "again":
        return model()
    if how == "process":
        return machine.apart(one)
    if how == "reset":
        with suppress(IntegrationFailed):
            machine.model(_others(one, 1)[0])()
        return model()
    if how == "thinned":
        (R, w), kept = machine.model(one)(), first.grid.steps.astype(int)
        return R[kept], w[kept]
    if how == "continued":
        steps = one.n_steps // 2
        if not steps:
            raise NotAvailable("half a step")
        R, w = machine.model(replace(one, n_steps=steps, every=steps))()
        rest = one.n_steps - steps
        end = machine.model(replace(one, R0=R[-1], w0=w[-1], n_steps=rest, every=rest))()
        return np.stack([R[0], end[0][-1]]), np.stack([w[0], end[1][-1]])
    if how:
        place, count = (int(word) for word in how.split(" of "))
        bodies = _others(one, count)
        bodies[place - 1] = one
        return machine.many(bodies, place - 1)
    return machine.model(one)()
