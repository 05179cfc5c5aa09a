"""Substepping: another method, with every step divided into as many equal parts as its equations need."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from .. import registry
from ..check import describe, positive_integer
from ..errors import BadInput, NotConverged
from ..features import Features
from ..grid import Grid
from ..method import Method, Role, Run
from ..method_info import MethodInfo
from ..scene import Scene
from ..trajectory import Bounds, Trajectory
from .reduced import Reduced


@dataclass(frozen=True)
class Substepped(Method):
    """A method that repeats a run with shorter steps if the equations of a step have no solution.

    All steps of the run are divided into 1, 2, 4, ... equal parts, up to `most`. Parts that change from step to step would
    destroy the long-time behaviour of a symmetric method. `Counters.steps` counts parts, and the label of the trajectory
    contains the number of parts per step.

    Parameters
    ----------
    method
        Name of the method with its settings; separate several settings by "/", as in `reduced:order=4/frame=auto`.
    most
        Largest number of parts per step.

    Raises
    ------
    BadInput
        The name or a setting is unknown, the method has no step or is itself `Substepped`, or `most` is not a positive integer.
    """

    method: str = "reduced"
    most: int = 64

    family: ClassVar[str] = "substepped"
    role: ClassVar[Role] = Role.OURS
    method_info: ClassVar[MethodInfo] = MethodInfo(
        report=(),
        structure=lambda method: method.inner.method_info.structure(method.inner),
        supports=Reduced.method_info.supports,  # of the default inner method
    )

    def __post_init__(self) -> None:
        positive_integer("most", self.most)
        allowed = "the name of a method of ours with a step, such as 'reduced:order=4'"
        if not isinstance(self.method, str) or self.method.partition(":")[0] == self.family:
            raise BadInput("method", describe(self.method), allowed)
        if self.inner.order is None or self.inner.role != Role.OURS:
            raise BadInput("method", describe(self.method), allowed)

    @property
    def inner(self) -> Method:
        """Return the method of the parts."""
        return registry.method(self.method.replace("/", ","))

    @property
    def supports(self) -> Features:
        return self.inner.supports

    @property
    def order(self) -> int | None:
        return self.inner.order

    @property
    def conserves(self) -> frozenset[str]:
        return self.inner.conserves

    def bounds(self, scene: Scene, grid: Grid) -> Bounds:
        return self.inner.bounds(scene, Grid(grid.dt / self.most, grid.n_steps * self.most))

    def unsupported(self, scene: Scene) -> str | None:
        return self.inner.unsupported(scene)

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        inner = self.inner
        runs: dict[int, Run] = {}

        def run() -> Trajectory:
            parts = 1
            while True:
                if parts not in runs:
                    runs[parts] = inner.prepare(scene, Grid(grid.dt / parts, grid.n_steps * parts, grid.every * parts))
                trajectory = runs[parts]()
                if 2 * parts > self.most or not isinstance(trajectory.failure, NotConverged):
                    label = f"{self.label}, {parts} parts a step" if parts > 1 else self.label
                    return replace(trajectory, t=grid.t[: len(trajectory)], label=label)
                parts *= 2

        return run
