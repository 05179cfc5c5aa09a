import math

import pytest

from conservative import registry
from conservative.benchmarks.measures.measure import Measure
from conservative.reports.tables import claims, orders

from .made_up import convergence, row
from .rows import frame


def verdicts(rows, scene="brick_flip"):
    table = frame(rows)
    fits = orders.fits(orders.errors(table, Measure.ATTITUDE_MAX))
    return {found.claim: found.verdict for found in claims.findings(table, fits, [registry.scene(scene)])}


@pytest.mark.parametrize(("order", "verdict"), [(4, claims.HOLDS), (2, claims.FAILS)])
def test_audit_of_an_order(order, verdict):
    assert verdicts(convergence("reduced:order=4", order)) == {"reduced:order=4 is of order 4 (brick_flip)": verdict}


@pytest.mark.parametrize(("drift", "verdict"), [(4e-16, claims.HOLDS), (1e-9, claims.FAILS), (math.nan, claims.FAILS)])
def test_audit_of_a_conserved_quantity(drift, verdict):
    rows = [row("paper", "reduced", "energy drift max", value, dt) for dt, value in ((0.01, 4e-16), (0.005, drift))]
    assert verdicts(rows) == {"reduced keeps energy to round-off (brick_flip)": verdict}


@pytest.mark.parametrize(("drift", "verdict"), [(5e-6, claims.HOLDS), (7e-6, claims.FAILS)])
def test_a_bound_for_each_step_is_one_for_all_of_them_together(drift, verdict):
    """The paper's iteration stops at 1e-8 in each of the brick's 600 steps."""
    found = verdicts([row("paper", "convected", "energy drift max", drift, 0.01)])
    assert found["convected keeps energy to the tolerance of its iteration in each step (brick_flip)"] == verdict


@pytest.mark.parametrize(("error", "verdict"), [(0.1, claims.HOLDS), (0.2, claims.FAILS), (math.nan, claims.FAILS)])
def test_audit_of_one_map_in_two_programs(error, verdict):
    rows = [row("paper", "convected", "attitude error max", 0.1), row("paper", "reduced", "attitude error max", error)]
    found = verdicts(rows)
    assert found.get("reduced is the paper's map (brick_flip)", claims.FAILS) == verdict


@pytest.mark.parametrize(("coarse", "verdict"), [(1e-8, claims.HOLDS), (0.5, claims.FAILS), (math.nan, claims.FAILS)])
def test_audit_of_mujoco_by_its_own_documentation(coarse, verdict):
    rows = [
        row("paper", "mujoco", "energy drift max", coarse, 0.01, role="engine"),
        row("paper", "mujoco:integrator=Euler", "energy drift max", 0.05, 0.0025, role="engine"),
        row("paper", "mujoco:integrator=implicit", "attitude error max", 0.2, 0.01, role="engine"),
        row("paper", "mujoco:integrator=implicitfast", "attitude error max", 0.2, 0.01, role="engine"),
    ]
    found = verdicts(rows)
    assert found["RK4 is better than Euler on energy-conserving systems, even with 4 times its step (brick_flip)"] == verdict
    assert found["implicit and implicitfast coincide for a free body (brick_flip)"] == claims.HOLDS


def test_the_better_method_is_taken_at_its_coarsest_step_and_the_other_at_its_finest():
    rows = [
        *(row("paper", "mujoco", "energy drift max", value, dt, role="engine") for dt, value in ((0.01, 0.5), (0.005, 1e-9))),
        *(
            row("paper", "mujoco:integrator=Euler", "energy drift max", value, dt, role="engine")
            for dt, value in ((0.01, 0.9), (0.0025, 0.05))
        ),
    ]
    words = "RK4 is better than Euler on energy-conserving systems, even with 4 times its step (brick_flip)"
    assert verdicts(rows) == {words: claims.FAILS}
