"""Samples of the studies as lines of pictures: drifts, curves on spheres, the figures of the paper."""

from functools import cache

import numpy as np
import pytest

from conservative import Reduced, RigidBody, Scene, registry, scenes
from conservative.attitude import rotation_about
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import Measurement, Samples
from conservative.benchmarks.studies import motion, studies
from conservative.benchmarks.studies.study import Study
from conservative.method import Role
from conservative.reports.rows import lines
from conservative.reports.rows.names import with_names
from conservative.reports.sections import paper

from .made_up import curves, row
from .rows import frame

T = np.linspace(0.5, 60, 120)


def test_drifts_of_motions_have_their_sign_and_the_name_without_a_tolerance():
    who = {"method": "engine:tol=1e-9", "label": "", "series": "engine", "family": "engine", "setting": "tol=1e-9"}
    common = {"study": "motion", "scene": "made_up", "role": Role.ENGINE, "dt": 0.1, **who}
    found = [Samples(quantity=f"drift of {name}", t=T, value=-T, **common) for name in ("energy", "momentum")]
    drifts = lines.signed_drifts(with_names(measurement.samples_frame([*found, Samples(quantity="x", t=T, value=T, **common)])))
    assert drifts.groupby("quantity")["drift"].min().to_dict() == {"energy": -T.max(), "momentum": -T.max()}
    assert set(drifts["name"]) == {"engine"}


@pytest.mark.parametrize("name", ["brick_flip", "lagrange_top"])
def test_curves_lie_on_the_unit_sphere(name):
    found = lines.curves(with_names(measurement.samples_frame(curves(registry.scene(name), registry.method("reduced")))))
    assert np.abs(np.linalg.norm(found[["x", "y", "z"]].to_numpy(), axis=1) - 1).max() < 1e-13  # measured 3e-16
    assert 200 < len(found) <= motion.SAMPLES


def test_polhode_is_the_same_whatever_the_body_axes():
    base = scenes.brick_flip()
    S = rotation_about((1.0, 2.0, -0.5), 0.7)
    turned = Scene("turned", RigidBody(S.T @ base.body.inertia @ S), base.R_WB0 @ S, S.T @ base.w_WB_B0, base.t_end, dt=base.dt)
    one, other = (
        np.abs(lines.curves(with_names(measurement.samples_frame(curves(scene, Reduced()))))[["x", "y", "z"]].to_numpy())
        for scene in (base, turned)
    )
    assert np.abs(one - other)[:50].max() < 1e-9  # measured 3e-13


def test_picks_one_method_of_each_family_that_has_no_preferred_one():
    names = [
        m.name
        for m in motion.select_methods(
            [registry.method(n) for n in ("gauss:stages=2", "gauss", "reduced:order=4", "reduced", "exact")]
        )
    ]
    assert names == ["reduced", "gauss:stages=2"]


@cache
def study():
    """Rows and lines of the study of the paper's figures."""
    scenes = tuple(map(registry.scene, ("brick_flip", "lagrange_top")))
    found = list(studies.findings(Study("paper_figures", scenes, (registry.method("reduced"),))))
    samples_of = [each for each in found if isinstance(each, Samples)]
    return measurement.frame(each for each in found if isinstance(each, Measurement)), measurement.samples_frame(samples_of)


def test_body_rates_reverse_twice():
    rates = lines.body_rates(study()[1])
    spin = rates[rates["component"] == "ω3"]["rate"].to_numpy()
    assert np.count_nonzero(np.diff(np.sign(spin))) == 2
    assert np.abs(spin).max() == pytest.approx(10, abs=1e-3)  # measured 10 - 4e-6


def test_conservation_within_the_papers_figures():
    errors = lines.conservation_errors(study()[1]).set_index("method")[["energy", "momentum"]].abs()
    assert errors.loc["convected"].max().max() < 1e-10  # measured 1.5e-15
    assert errors.loc["reduced"].max().max() < 1e-13  # measured 7e-16


def test_centre_of_mass_has_two_steps_and_the_analytical_line():
    positions = lines.centre_of_mass(study()[1])
    assert set(positions["run"]) == {"Δt = 0.01 s", "Δt = 0.005 s", "analytical"}
    last = positions[positions["run"] == "Δt = 0.01 s"].iloc[-1]
    # Centre of mass of the paper's scheme after 63 steps
    assert abs(last["x1"] + 0.0589061) < 1e-7  # measured 5e-9, the digits printed there
    assert abs(last["x2"] + 0.02962542) < 1e-7  # measured 3e-9


def test_position_errors_fall_by_the_papers_factor():
    table = study()[0]
    found = {measure: table[table["measure"] == measure.text]["value"].round(4).tolist() for measure in Measure}
    assert found[Measure.PERIOD_X1] == [0.06, 0.0205, 0.005]
    assert found[Measure.PERIOD_DISTANCE] == [0.0696, 0.0206, 0.0051]
    assert [row[2:] for row in paper.position_errors(table).rows] == [
        ["0.0600", "0.0696"],
        ["0.0205", "0.0206"],
        ["0.0050", "0.0051"],
    ]


def test_an_order_is_known_only_if_the_fit_tells_it_from_the_next_one():
    found = {"sure": (4.1, 0.04), "vague": (15.1, 1.56), "no fit": (np.nan, np.nan)}
    measures = ("observed order", "observed order stderr")
    rows = [
        row("convergence", name, measure, value)
        for name, pair in found.items()
        for measure, value in zip(measures, pair, strict=True)
    ]
    assert lines.orders(frame(rows)).dropna().to_dict() == {"sure": 4.1}
