"""SciPy's compiled loops: every part of a scene is right or refused by name, and runs end with a reason."""

from itertools import product

import numpy as np
import pytest

from conservative import registry
from conservative.errors import BadInput, Unsupported
from conservative.features import Feature
from conservative.grid import Grid
from conservative.references.solvers import scipy
from conservative.references.solvers.scipy import SciPy
from tests.crossing import FREE, ROWS

from ..sampling import sampled

KINDS = [SciPy(name, 1e-10, "compiled") for name in scipy._COMPILED]


ATTITUDE_LOADS = [case for case in product(ROWS, KINDS) if case[0] is Feature.ATTITUDE]
"""A load as a Python function of the attitude is compiled for each integrator."""


@pytest.mark.parametrize(
    ("feature", "method"),
    sampled(product(ROWS, KINDS), 20, keep=ATTITUDE_LOADS[:1], leave=ATTITUDE_LOADS[1:]),
    ids=lambda each: getattr(each, "integrator", str(each)),
)
def test_every_part_is_right_or_refused_by_name(feature, method):
    """With its break points: torques and motors from tables, with a jump and corners."""
    row = ROWS[feature]
    scene, grid = row.scene(), Grid(row.case.t_end / 8, 8)
    if feature is Feature.FLIGHT:
        with pytest.raises(Unsupported, match="flight"):
            method.prepare(scene, grid)
        return
    run = method.prepare(scene, grid)
    found = run()
    assert found.ok
    assert row.distance(found.t, found.R_WB) < 3e-7  # measured 3e-8, BDF
    states = np.asarray(run.own_loop() if scene.smoothness(scene.t_end).breaks.size == 0 else run.own_loop()[0])
    assert np.abs(states[:, 4:] @ scene.body.R_BP.T - found.w_WB_B).max() < 1e-12


@pytest.mark.parametrize("method", [*KINDS, SciPy("DOP853", 1e-10), SciPy("LSODA", 1e-10)], ids=lambda each: each.name)
def test_the_timed_loop_has_the_final_state_at_each_call(method):
    scene = FREE.scene("free")
    run = method.prepare(scene, Grid(scene.t_end, 1))
    before = run()
    for _ in range(2):
        (*_, last) = np.array(run.own_loop(), ndmin=2)
        np.testing.assert_allclose(last[4:] @ scene.body.R_BP.T, before.w_WB_B[-1], rtol=0, atol=1e-14)
    assert before.counters.steps > 5
    assert before.counters.evaluations > before.counters.steps


@pytest.mark.parametrize("method", KINDS, ids=lambda each: each.integrator)
def test_a_limit_of_steps_and_a_state_that_is_not_finite_end_a_run(method, monkeypatch):
    monkeypatch.setattr(scipy, "STEP_LIMIT", 5)
    cut = method.prepare(FREE.scene("free"), Grid(FREE.t_end, 1))()
    assert cut.outcome.reason == "step limit of 5 reached"
    assert len(cut) == 1
    monkeypatch.setattr(scipy, "STEP_LIMIT", 400)
    t = np.linspace(0, 2, 9)
    blown = lambda t, y: np.full(7, np.nan if t > 1.1 else 0.3)  # noqa: E731
    states, _, reason = scipy.Ode(method.integrator, 1e-9, 1e-9).march(blown, (0.0, 2.0), np.ones(7), t, np.inf)
    assert reason
    assert len(states) <= 5
    assert np.isfinite(states).all()


def test_integrators_without_a_compiled_loop_are_refused_by_name():
    for text, argument in (("Radau,loop=compiled", "Radau"), ("Adams", "Adams"), ("loop=fortran", "fortran")):
        with pytest.raises(BadInput, match=argument):
            registry.method(f"scipy:{text}")
