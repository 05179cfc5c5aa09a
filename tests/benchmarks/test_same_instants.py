"""All methods of a study are read at the same instants of a scene: errors at different ones cannot be compared."""

import numpy as np
import pytest

from conservative import registry
from conservative.benchmarks.measures import errors
from conservative.benchmarks.studies import step_ladder, studies
from conservative.benchmarks.studies.study import Study

from .generic_study import SCENE, truth

METHODS = ("reduced", "reduced:order=8", "moser_veselov", "moser_veselov:order=6", "scipy", "mujoco:RK4")
"""Of a low and of a high order, exact steps, of an order for integrable motions, with a tolerance, and an engine with steps."""


@pytest.mark.parametrize("name", ["convergence", "work_precision", "engines_over_steps"])
def test_every_line_has_the_same_instants(name, monkeypatch):
    seen, measure = {}, errors.measure_errors

    def record(trajectory, exact):
        seen.setdefault(trajectory.label, []).append(trajectory.t)
        return measure(trajectory, exact)

    monkeypatch.setattr(errors, "measure_errors", record)
    methods = tuple(map(registry.method, METHODS))
    found = list(studies.rows(Study(name, (SCENE,), methods, quick=True, truth=truth)))
    read = {row.label for row in found if row.measure.text.startswith("attitude") and row.outcome.ok}
    assert read == set(seen)
    assert len(read) >= len(METHODS) - (2 if name == "convergence" else 0)  # what has no step shows no order
    expected = np.linspace(0.0, SCENE.t_end, step_ladder.SAMPLES + 1)
    for times in seen.values():
        assert all(t.shape == expected.shape and np.allclose(t, expected, rtol=1e-14, atol=0) for t in times)  # measured 2e-16
