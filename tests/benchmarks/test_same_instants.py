"""All methods of a study are read at the same instants of a scene: errors at different ones cannot be compared."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.measures import errors
from conservative.benchmarks.studies import step_ladder, studies
from conservative.benchmarks.studies.study import Study
from conservative.method import Role
from conservative.references.exact.method import Exact

from .generic_study import SCENE, truth


@dataclass(frozen=True)
class Closed(cv.Method):
    """The exact motion in the steps of a method of some order, of one with exact steps where that is None."""

    steps: int | None
    family: ClassVar[str] = "closed"
    role: ClassVar[Role] = Role.OURS
    kernel: ClassVar[str] = "known to end, so that it runs in this process"

    @property
    def order(self):
        return self.steps

    def prepare(self, scene, grid):
        return Exact().prepare(scene, grid)


@dataclass(frozen=True)
class Adaptive(Closed):
    """The same with a tolerance in place of a step."""

    steps: None = None
    tol: float = 1e-9
    family: ClassVar[str] = "adaptive"


METHODS = (Closed(1), Closed(2), Closed(8), Closed(None), Adaptive())


@pytest.mark.parametrize("name", ["convergence", "work_precision", "engines_over_steps"])
def test_every_line_has_the_same_instants(name, monkeypatch):
    seen, measure = [], errors.measure_errors

    def record(trajectory, exact):
        seen.append(trajectory.t)
        return measure(trajectory, exact)

    monkeypatch.setattr(errors, "measure_errors", record)
    found = list(studies.rows(Study(name, (SCENE,), METHODS, quick=True, truth=truth)))
    read = {row.series for row in found if row.measure.text.startswith("attitude") and row.outcome.ok}
    assert len(read) == (3 if name == "convergence" else len(METHODS))  # that one is of methods with an order alone
    expected = np.linspace(0.0, SCENE.t_end, step_ladder.SAMPLES + 1)
    assert len(seen) >= 3 * len(read) - 1
    assert all(t.shape == expected.shape and np.allclose(t, expected, rtol=1e-14, atol=0) for t in seen)  # measured 2e-16
